// Camera, light and renderer. Scene units: millimetres, z up.

import {
  DirectionalLight, Fog, Group, HemisphereLight, PCFShadowMap, PerspectiveCamera, Scene, Vector3, WebGLRenderer, OrbitControls,
} from "three";
import { colour, onTheme } from "view/theme";

const FIELD_OF_VIEW_DEG = 32;
/** Where the camera stands, seen from the robot: ahead, left, up. */
const VIEWS = {
  start: [-0.45, -0.85, 0.62],
  above: [0, -0.001, 1],
  side: [0, -1, 0.12],
  behind: [-1, 0, 0.32],
};

export class Stage {
  /** `length`: of what is to be seen, mm. `gravity`: in the ground's frame. */
  constructor(canvas, length, gravity) {
    this.canvas = canvas;
    this.length = length;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "low-power" });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.sharpness = 2;
    this.scene = new Scene();
    this.scene.fog = new Fog(0, 1, 2);
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 5, 20000);
    this.camera.up.set(0, 0, 1);
    // The ground's frame: on a slope it leans, so that down is down on the screen.
    this.world = new Group();
    const down = new Vector3(...gravity);
    if (down.length() > 0) this.world.quaternion.setFromUnitVectors(down.normalize().negate(), new Vector3(0, 0, 1));
    this.world.updateMatrixWorld();
    this.scene.add(this.world);
    this.focus = new Vector3();
    this.#light();
    this.controls = new OrbitControls(this.camera, canvas);
    Object.assign(this.controls, { enableDamping: false, minDistance: 0.1 * length, maxDistance: 30 * length });
    this.controls.addEventListener("change", () => (this.stale = true));
    this.stale = true;
    onTheme(() => this.#recolour());
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
  }

  #light() {
    this.sky = new HemisphereLight(0xffffff, 0xd8d4cf, 1.9);
    this.sun = new DirectionalLight(0xffffff, 2.1);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    const reach = 0.8 * this.length;
    Object.assign(this.sun.shadow.camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: 1, far: 8 * this.length });
    Object.assign(this.sun.shadow, { bias: -0.0004, normalBias: 0.3, radius: 3 });
    this.scene.add(this.sky, this.sun, this.sun.target);
  }

  #recolour() {
    const paper = colour("paper");
    this.scene.background = paper;
    this.scene.fog.color.copy(paper);
    this.stale = true;
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, this.sharpness));
    this.renderer.setSize(width, height, false);
    const before = this.#distance();
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    // What was seen stays seen, however the window is turned.
    this.camera.position.sub(this.controls.target).multiplyScalar(this.#distance() / before).add(this.controls.target);
    this.stale = true;
  }

  /** From where the whole robot is seen. */
  #distance() {
    const half = (FIELD_OF_VIEW_DEG * Math.PI) / 360;
    const narrow = Math.min(half, Math.atan(Math.tan(half) * this.camera.aspect));
    return (0.54 * this.length) / Math.sin(narrow);
  }

  /** Puts the camera to a named view of what is at `point` (ground's frame), heading so (rad). */
  view(name, point, heading) {
    const [ahead, left, up] = VIEWS[name];
    // From above, north stays up.
    const turn = name === "above" ? 0 : heading;
    const away = new Vector3(ahead * Math.cos(turn) - left * Math.sin(turn), ahead * Math.sin(turn) + left * Math.cos(turn), up);
    this.focus.set(...point);
    this.world.localToWorld(this.focus);
    this.controls.target.copy(this.focus);
    this.camera.position.copy(this.focus).addScaledVector(away.normalize(), this.#distance());
    this.controls.update();
    this.stale = true;
  }

  /** Moves light, and with `follow` the camera, to where the robot is now. */
  moveTo(point, follow) {
    const now = this.world.localToWorld(new Vector3(...point));
    if (follow) {
      const step = now.clone().sub(this.focus);
      this.camera.position.add(step);
      this.controls.target.add(step);
    }
    this.focus.copy(now);
    this.sun.target.position.copy(now);
    this.sun.position.copy(now).add(new Vector3(-0.9, -1.3, 3).multiplyScalar(this.length));
  }

  /** For a computer that draws slowly: coarser, and without shadows. */
  lighten() {
    this.sharpness = 0.7;
    this.renderer.shadowMap.enabled = this.sun.castShadow = false;
    this.#resize();
  }

  render() {
    const distance = this.camera.position.distanceTo(this.controls.target);
    this.scene.fog.near = 1.6 * distance;
    this.scene.fog.far = 6 * distance;
    this.renderer.render(this.scene, this.camera);
    this.stale = false;
  }
}
