//! A track that no physics made: the robot of a plan gliding forward and to the left while its backbones wave.

use std::f64::consts::TAU;

use hal_sim::body::snapshot::{Foot, Pose, Rotor};
use hal_sim::body::{Plan, Snapshot, Track};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Hz, counter-clockwise.
const FREQUENCY_HZ: f64 = -7.0;
const SPEED_M_PER_S: [f64; 2] = [0.06, 0.02];
/// Of each hinge of the soft axis, rad.
const BEND: f64 = 0.012;

/// Snapshots at `interval_s`.
pub fn track(plan: &Plan, seconds: f64, interval_s: f64) -> Track {
    let count = (seconds / interval_s).round() as usize + 1;
    let snapshots = (0..count).map(|i| snapshot(plan, i as f64 * interval_s)).collect();
    Track { plan: plan.clone(), snapshots, energy_j: vec![] }
}

fn snapshot(plan: &Plan, time_s: f64) -> Snapshot {
    let phase = TAU * FREQUENCY_HZ * time_s;
    let [vx, vy] = SPEED_M_PER_S.map(|speed| speed * time_s);
    let height = plan.modules[0].centre_height + 2e-4 * (1.0 + phase.sin());
    let mut frame = Isometry3::from_parts(
        Translation3::new(vx + 5e-4 * phase.cos(), vy + 5e-4 * phase.sin(), height),
        UnitQuaternion::from_euler_angles(0.0, 0.01 * phase.sin(), 0.4 * time_s),
    );
    let (mut modules, mut segments) = (vec![pose(&frame)], vec![]);
    let mut feet: Vec<Foot> = feet(plan, 0, &frame, phase).collect();
    for (b, backbone) in plan.backbones.iter().enumerate() {
        frame *= shift(-0.5 * plan.modules[b].size[0]);
        let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), backbone.roll);
        let soft = nalgebra::Unit::new_normalize(roll * Vector3::z());
        let step = backbone.length / backbone.segments as f64;
        for i in 0..backbone.segments {
            let bend = BEND * (phase + 0.4 * i as f64 + b as f64).sin();
            frame *= UnitQuaternion::from_axis_angle(&soft, bend);
            segments.push(pose(&(frame * shift(-0.5 * step) * roll)));
            frame *= shift(-step);
        }
        frame *= shift(-0.5 * plan.modules[b + 1].size[0]);
        modules.push(pose(&frame));
        feet.extend(self::feet(plan, b + 1, &frame, phase));
    }
    let rotor = plan.eccentric.map(|eccentric| Rotor {
        angle: phase,
        speed: TAU * FREQUENCY_HZ,
        bolt: [vx + eccentric.radius * phase.cos(), vy + eccentric.radius * phase.sin(), height + eccentric.height],
        torque: 1e-4,
    });
    Snapshot { time_s, modules, segments, feet, rotor }
}

/// A foot carries during part of each turn, the next one later.
fn feet(plan: &Plan, k: usize, module: &Isometry3<f64>, phase: f64) -> impl Iterator<Item = Foot> {
    let share = plan.mass() * 9.81 / (2.0 * plan.modules.len() as f64);
    let module = *module;
    plan.modules[k].feet.into_iter().enumerate().map(move |(side, place)| {
        let position = (module * nalgebra::Point3::from(place)).coords.into();
        let load = (1.2 * share * (0.6 + (phase + 2.1 * k as f64 + 2.6 * side as f64).sin())).max(0.0);
        Foot { position, velocity: [0.0; 3], force: [0.3 * load * phase.cos(), 0.3 * load * phase.sin(), load] }
    })
}

fn shift(x: f64) -> Translation3<f64> {
    Translation3::new(x, 0.0, 0.0)
}

fn pose(frame: &Isometry3<f64>) -> Pose {
    let q = frame.rotation.quaternion();
    Pose { position: frame.translation.vector.into(), orientation: [q.w, q.i, q.j, q.k] }
}
