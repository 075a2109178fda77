//! From a run to what viewers draw: the body's parts as frames with their shapes, or the shaft alone.

use hal_sim::body::plan::{Eccentric, Module};
use hal_sim::body::{Plan as BodyPlan, Pose, Snapshot, Track};
use recording::{Form, Scene, SceneFoot, SceneFrame, ScenePose, SceneState, Shape, WORLD};
use robot_file::robot::ModuleKind;

use super::{Trace, Walk};

/// States a second: a viewer needs no more, and a state of a robot of four modules takes 4 kB of a file.
pub const SCENE_RATE_HZ: f64 = 100.0;

/// How far the ground reaches beyond the robot's path, and its thickness, m.
const MARGIN_M: f64 = 0.4;
const GROUND_M: f64 = 0.002;
/// Length of the arrow of a foot's even share of the weight, m: three times it is still no longer than the robot.
const SHARE_ARROW_M: f64 = 0.012;

/// Red, green, blue, opacity, as on the page of `--view`.
const SHELL: [f64; 4] = [0.91, 0.91, 0.89, 1.0];
const COURIER: [f64; 4] = [0.18, 0.49, 0.36, 1.0];
const LEG: [f64; 4] = [0.36, 0.40, 0.45, 1.0];
const METAL: [f64; 4] = [0.55, 0.60, 0.65, 1.0];
const BOLT: [f64; 4] = [0.83, 0.28, 0.10, 1.0];
const BEAM: [f64; 4] = [0.66, 0.72, 0.80, 1.0];
const GROUND: [f64; 4] = [0.85, 0.87, 0.90, 1.0];
const ROUGH: [f64; 4] = [0.91, 0.78, 0.64, 1.0];
const SLIPPERY: [f64; 4] = [0.69, 0.82, 0.93, 1.0];

/// What viewers draw of a run, [`SCENE_RATE_HZ`] states a second of it: the body that walked, or the shaft of a bench, which
/// is the frame `shaft` alone.
#[must_use]
pub fn scene(trace: &Trace, walk: Option<&Walk>) -> Scene {
    let times = trace.ticks.iter().map(|tick| tick.sample.time_us as f64 / 1e6);
    match walk {
        Some(walk) => {
            let Walk { track, every, .. } = walk;
            let stride = stride(trace.tick_s * *every as f64);
            let kept = times.step_by(every * stride).zip(track.snapshots.iter().step_by(stride));
            Scene {
                ground: ground(track),
                frames: frames(&track.plan),
                arrow_m_per_n: scale(&track.plan),
                states: kept.map(|(t_s, snapshot)| state(t_s, snapshot, &track.plan)).collect(),
            }
        }
        None => {
            let shaft = SceneFrame { name: "shaft".into(), parent: WORLD.into(), shapes: vec![] };
            let kept = times.zip(&trace.ticks).step_by(stride(trace.tick_s));
            let states = kept.map(|(t_s, tick)| SceneState {
                t_s,
                poses: vec![ScenePose::at([0.0; 3]).turned(tick.truth.angle)],
                robot: None,
                feet: vec![],
            });
            Scene { frames: vec![shaft], states: states.collect(), ..Scene::default() }
        }
    }
}

/// Of states at an interval (s), every how many-th viewers get.
fn stride(interval_s: f64) -> usize {
    (1.0 / (SCENE_RATE_HZ * interval_s)).round().max(1.0) as usize
}

/// m/N.
fn scale(plan: &BodyPlan) -> f64 {
    let gravity = plan.gravity.iter().map(|part| part * part).sum::<f64>().sqrt();
    let share = plan.mass() * gravity / (2.0 * plan.modules.len() as f64);
    if share > 0.0 { SHARE_ARROW_M / share } else { 0.0 }
}

fn frames(plan: &BodyPlan) -> Vec<SceneFrame> {
    let frame = |name: String, shapes| SceneFrame { name, parent: WORLD.into(), shapes };
    let radius = plan.contact.as_ref().map_or(0.0, |contact| contact.foot_radius);
    let modules = plan.modules.iter().enumerate();
    let mut frames: Vec<SceneFrame> =
        modules.map(|(k, module)| frame(module_name(k), module_shapes(module, radius))).collect();
    for (b, backbone) in plan.backbones.iter().enumerate() {
        let size = [backbone.length / backbone.segments as f64, backbone.section[0], backbone.section[1]];
        let shape = Shape { form: Form::Box(size), pose: ScenePose::at([0.0; 3]), colour: BEAM };
        let name = |segment: usize| format!("backbone{}_segment{}", b + 1, segment + 1);
        frames.extend((0..backbone.segments).map(|segment| frame(name(segment), vec![shape])));
    }
    if let Some(eccentric) = &plan.eccentric {
        frames.push(SceneFrame { name: "rotor".into(), parent: module_name(0), shapes: rotor_shapes(eccentric, plan) });
    }
    frames
}

fn module_name(k: usize) -> String {
    format!("module{}", k + 1)
}

/// The box, its legs and feet.
fn module_shapes(module: &Module, foot_radius: f64) -> Vec<Shape> {
    let colour = if module.kind == ModuleKind::Courier { COURIER } else { SHELL };
    let mut shapes = vec![Shape { form: Form::Box(module.size), pose: ScenePose::at([0.0; 3]), colour }];
    let present = module.feet.iter().zip(module.has_foot).filter(|(_, has_foot)| *has_foot);
    for ([x, y, z], _) in present {
        let top = -0.5 * module.size[2];
        let leg = Form::Cylinder { radius: 0.6 * foot_radius, length: top - z };
        shapes.push(Shape { form: leg, pose: ScenePose::at([*x, *y, 0.5 * (top + z)]), colour: LEG });
        shapes.push(Shape { form: Form::Sphere(foot_radius), pose: ScenePose::at([*x, *y, *z]), colour: LEG });
    }
    shapes
}

/// Shaft, arm and bolt; the frame is at the height of the bolt's centre.
fn rotor_shapes(eccentric: &Eccentric, plan: &BodyPlan) -> Vec<Shape> {
    let [radius, length] = eccentric.bolt;
    let below = eccentric.height - 0.5 * plan.modules[0].size[2];
    let shape = |form, position, colour| Shape { form, pose: ScenePose::at(position), colour };
    let arm = Form::Box([eccentric.radius, 0.8 * radius, 0.5 * radius]);
    vec![
        shape(Form::Cylinder { radius: 0.6 * radius, length: below }, [0.0, 0.0, -0.5 * below], METAL),
        shape(arm, [0.5 * eccentric.radius, 0.0, -0.5 * length], METAL),
        shape(Form::Cylinder { radius, length }, [eccentric.radius, 0.0, 0.0], BOLT),
    ]
}

/// Boxes under the path, coloured by their friction.
fn ground(track: &Track) -> Vec<Shape> {
    let Some(contact) = &track.plan.contact else { return vec![] };
    let range = |axis: usize| {
        let values = || track.snapshots.iter().map(|snapshot| snapshot.centroid()[axis]);
        [values().fold(0.0, f64::min) - MARGIN_M, values().fold(0.0, f64::max) + MARGIN_M]
    };
    let [right, left] = range(1);
    let stretches = contact.stretches(range(0)).into_iter();
    let boxes = stretches.map(|stretch| {
        let [rear, front] = stretch.x;
        let height = stretch.height - 0.5 * GROUND_M;
        Shape {
            form: Form::Box([front - rear, left - right, GROUND_M]),
            pose: ScenePose::at([0.5 * (rear + front), 0.5 * (right + left), height]),
            colour: match stretch.friction.total_cmp(&contact.friction) {
                std::cmp::Ordering::Equal => GROUND,
                std::cmp::Ordering::Less => SLIPPERY,
                std::cmp::Ordering::Greater => ROUGH,
            },
        }
    });
    boxes.collect()
}

fn state(t_s: f64, snapshot: &Snapshot, plan: &BodyPlan) -> SceneState {
    let pose = |pose: &Pose| ScenePose { position: pose.position, orientation: pose.orientation };
    let mut poses: Vec<ScenePose> = snapshot.modules.iter().chain(&snapshot.segments).map(pose).collect();
    if let (Some(eccentric), Some(rotor)) = (&plan.eccentric, &snapshot.rotor) {
        poses.push(ScenePose::at([0.0, 0.0, eccentric.height]).turned(rotor.angle));
    }
    SceneState {
        t_s,
        poses,
        robot: Some(ScenePose::at(snapshot.centroid()).turned(snapshot.heading())),
        feet: snapshot.feet.iter().map(|foot| SceneFoot { position: foot.position, force: foot.force }).collect(),
    }
}
