// The picture: the robot of the robot file, moved by what comes.

import { Motion } from "live/motion";
import { Trail } from "live/trail";
import { Feet } from "view/feet";
import { Forces } from "view/forces";
import { ground } from "view/ground";
import { Robot } from "view/robot";
import { Stage } from "view/stage";
import { onTheme } from "view/theme";
import { legend } from "view/words";

const by = (id) => document.getElementById(id);
/** So many pictures in a row that took longer than this, s: the computer has no graphics card. */
const SLOW_S = 0.1;
const SLOW_PICTURES = 12;

export class LiveScene {
  /** `setup.moves`: the body's poses come; otherwise its rotor turns and the rest is as it stands. */
  constructor({ plan, rest, moves }) {
    this.moves = moves;
    this.motion = new Motion(plan, rest);
    const length = 1000 * plan.modules.reduce((sum, module, k) => sum + module.size[0] + (plan.backbones[k]?.length ?? 0), 0);
    this.stage = new Stage(by("canvas"), length, plan.gravity);
    this.robot = new Robot(this.motion);
    this.forces = new Forces(this.motion);
    this.trail = new Trail(plan.contact);
    this.slow = 0;
    this.stage.world.add(ground(this.motion), this.robot.group, this.trail.group, this.forces.group);
    this.feet = moves ? new Feet(by("feet"), this.motion) : null;
    by("forces-label").hidden = !moves;
    this.view("start");
    this.show();
    onTheme(() => (this.stage.stale = true));
  }

  view(name) {
    this.stage.view(name, this.motion.calm, this.motion.heading);
  }

  show() {
    this.forces.group.visible = this.moves && by("forces").checked;
    by("legend").innerHTML = legend(this.forces.group.visible ? this.forces.legend : null);
    this.stage.stale = true;
  }

  /** `body`: states; `points`: of the plots. */
  take(body, points) {
    if (this.moves) {
      for (const [t, values] of body) this.motion.add(t, values);
    } else if (this.motion.rotor !== null && points) {
      const hertz = points.frequency_hz.at(-1)?.[1] ?? 0;
      for (const [t, angle] of points.angle_deg) this.motion.turn(t, angle, hertz);
    }
  }

  /** Draws what is `passed` s later. */
  draw(passed) {
    const { motion } = this;
    this.slow = passed > SLOW_S ? this.slow + 1 : 0;
    if (this.slow === SLOW_PICTURES) this.stage.lighten();
    motion.advance(passed);
    this.robot.pose(motion.state);
    if (this.moves) {
      this.forces.pose(motion.state);
      this.trail.to(motion.calm);
      this.feet.show((foot) => motion.touches(foot));
    }
    this.stage.moveTo(motion.calm, by("follow").checked);
    this.stage.render();
  }
}
