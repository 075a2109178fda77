//! Whether a run is one, or its numbers have left what the model is for.

use hal_sim::body::{Snapshot, Track};

/// A joint of a soft backbone that bends more than this has left what the model is for, rad: ten in a row would make
/// more than a whole turn.
const JOINT_LIMIT: f64 = std::f64::consts::FRAC_PI_4;

/// Why a run is none.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BlowUp {
    /// A coordinate is NaN or infinite.
    #[error("blew up: at {time_s:.2} s the pose is no number")]
    NotFinite {
        /// Since the start, s.
        time_s: f64,
    },
    /// A joint beyond what the model is for.
    #[error("blew up: at {time_s:.2} s the pose has a joint at {angle_deg:.0}°")]
    Bent {
        /// Since the start, s.
        time_s: f64,
        /// Of the joint, degrees.
        angle_deg: f64,
    },
}

/// Where a run blows up first, if it does.
#[must_use]
pub fn blow_up(track: &Track) -> Option<BlowUp> {
    track.snapshots.iter().find_map(|snapshot| {
        let time_s = snapshot.time_s;
        let mut parts = snapshot.modules.iter().chain(&snapshot.segments);
        if !parts.all(|part| part.position.iter().chain(&part.orientation).all(|value| value.is_finite())) {
            return Some(BlowUp::NotFinite { time_s });
        }
        let bend = largest_bend(track, snapshot);
        (bend > JOINT_LIMIT).then(|| BlowUp::Bent { time_s, angle_deg: bend.to_degrees() })
    })
}

/// Largest angle between neighbouring parts, rad.
fn largest_bend(track: &Track, snapshot: &Snapshot) -> f64 {
    let mut largest = 0.0_f64;
    let mut segment = 0;
    for (b, backbone) in track.plan.backbones.iter().enumerate() {
        let Some(module) = snapshot.modules.get(b) else { return largest };
        let roll = [(0.5 * backbone.roll).cos(), (0.5 * backbone.roll).sin(), 0.0, 0.0];
        let mut before = product(module.orientation, roll);
        for _ in 0..backbone.segments {
            let Some(pose) = snapshot.segments.get(segment) else { return largest };
            let same: f64 = before.iter().zip(&pose.orientation).map(|(a, b)| a * b).sum();
            largest = largest.max(2.0 * same.abs().min(1.0).acos());
            before = pose.orientation;
            segment += 1;
        }
    }
    largest
}

/// Of quaternions (w, x, y, z).
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use hal_sim::body::{Ensemble, Plan, Settings};

    use super::*;

    /// The default robot at rest.
    fn resting() -> Track {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let plan = Plan::new(&robot_file::Robot::load(&file).unwrap()).unwrap();
        let bodies = Ensemble::new(std::slice::from_ref(&plan), Settings::default()).unwrap();
        let mut later = bodies.snapshot(0);
        later.time_s = 0.5;
        Track { plan, snapshots: vec![bodies.snapshot(0), later], energy_j: vec![] }
    }

    #[test]
    fn a_robot_at_rest_has_not_blown_up_and_a_broken_one_has() {
        assert_eq!(blow_up(&resting()), None, "rolled backbones are not bent");
        let mut lost = resting();
        lost.snapshots[1].modules[2].position[1] = f64::NAN;
        assert_eq!(blow_up(&lost).unwrap().to_string(), "blew up: at 0.50 s the pose is no number");
        for (degrees, broken) in [(40.0_f64, false), (50.0, true)] {
            let mut bent = resting();
            let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
            let turned = |pose: &mut [f64; 4]| *pose = product([cos, 0.0, 0.0, sin], *pose);
            // From the fifth joint of the second backbone on.
            for pose in &mut bent.snapshots[1].segments[14..] {
                turned(&mut pose.orientation);
            }
            for pose in &mut bent.snapshots[1].modules[2..] {
                turned(&mut pose.orientation);
            }
            let found = blow_up(&bent);
            assert_eq!(found.is_some(), broken, "{found:?}");
            assert!(!broken || found.unwrap().to_string().ends_with("a joint at 50°"));
        }
    }
}
