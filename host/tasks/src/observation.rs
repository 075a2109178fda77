//! What a policy is shown.

use hal_sim::body::Wall;

use super::task::Pose;

/// How many rays of [`Part::Walls`] there are, evenly around the robot, the first one ahead, counter-clockwise.
pub const RAYS: usize = 8;

/// A part of an observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// x, y against the start's, in length units, and θ in rad, −π … π: the thesis's observation.
    Pose,
    /// Mean velocity over the last step in the robot's axes, in length units a second, and mean angular velocity, rad/s.
    Velocity,
    /// Cosine and sine of the shaft's angle.
    Shaft,
    /// Distance from the centre to the walls along [`RAYS`] rays, in length units, at most that of [`Part::most_range`].
    Walls,
}

impl Part {
    /// The parts by their names.
    pub const ALL: [(&'static str, Self); 4] =
        [("pose", Self::Pose), ("velocity", Self::Velocity), ("shaft", Self::Shaft), ("walls", Self::Walls)];

    /// How many numbers it has.
    #[must_use]
    pub fn size(self) -> usize {
        match self {
            Self::Pose | Self::Velocity => 3,
            Self::Shaft => 2,
            Self::Walls => RAYS,
        }
    }

    /// The least and the greatest value of each number, of lengths measured in `length_unit_m`.
    #[must_use]
    pub fn bounds(self, length_unit_m: f64) -> Vec<[f64; 2]> {
        let within = |most: f64| [-most, most];
        match self {
            Self::Pose => {
                vec![within(FARTHEST_M / length_unit_m), within(FARTHEST_M / length_unit_m), within(ANGLE_RAD)]
            }
            Self::Velocity => {
                let speed = within(FASTEST_M_PER_S / length_unit_m);
                vec![speed, speed, within(FASTEST_RAD_PER_S)]
            }
            Self::Shaft => vec![[-1.0, 1.0]; 2],
            Self::Walls => vec![[0.0, Self::most_range() / length_unit_m]; RAYS],
        }
    }

    /// A wall farther than this (m) is not seen.
    #[must_use]
    pub fn most_range() -> f64 {
        1.0
    }
}

/// Bounds of what has none by nature, well beyond what the robot reaches: learners want numbers.
const FARTHEST_M: f64 = 100.0;
const FASTEST_M_PER_S: f64 = 10.0;
const FASTEST_RAD_PER_S: f64 = 1000.0;
/// π as a single-precision number may be rounded, rad.
const ANGLE_RAD: f64 = std::f32::consts::PI as f64;

/// [`Part::Pose`] of a robot whose x and y are against the start's.
#[must_use]
pub fn observed_pose(against_start: Pose, length_unit_m: f64) -> [f32; 3] {
    [against_start.x / length_unit_m, against_start.y / length_unit_m, against_start.heading]
        .map(|number| number as f32)
}

/// What is to be seen of a robot after a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a> {
    pub start: Pose,
    pub pose: Pose,
    /// Mean velocity over the last step: m/s along world axes, and rad/s.
    pub velocity: [f64; 3],
    pub shaft_angle: f64,
    pub walls: &'a [Wall],
}

impl Seen<'_> {
    /// Writes the parts one after the other.
    pub fn write(&self, parts: &[Part], length_unit_m: f64, to: &mut [f32]) {
        let mut to = to.iter_mut();
        let mut put = |value: f64| {
            if let Some(to) = to.next() {
                *to = value as f32;
            }
        };
        for part in parts {
            match part {
                Part::Pose => {
                    let (x, y) = (self.pose.x - self.start.x, self.pose.y - self.start.y);
                    let against_start = Pose { x, y, heading: self.pose.heading };
                    observed_pose(against_start, length_unit_m).into_iter().for_each(|number| put(number.into()));
                }
                Part::Velocity => {
                    let ([vx, vy, turning], (sin, cos)) = (self.velocity, self.pose.heading.sin_cos());
                    put((cos * vx + sin * vy) / length_unit_m);
                    put((cos * vy - sin * vx) / length_unit_m);
                    put(turning);
                }
                Part::Shaft => {
                    let (sin, cos) = self.shaft_angle.sin_cos();
                    put(cos);
                    put(sin);
                }
                Part::Walls => {
                    for ray in 0..RAYS {
                        let direction = self.pose.heading + std::f64::consts::TAU * ray as f64 / RAYS as f64;
                        put(range(self.walls, [self.pose.x, self.pose.y], direction) / length_unit_m);
                    }
                }
            }
        }
    }
}

/// From a point to the nearest wall in a direction (rad), m.
fn range(walls: &[Wall], [x, y]: [f64; 2], direction: f64) -> f64 {
    let (sin, cos) = direction.sin_cos();
    let mut nearest = Part::most_range();
    for wall in walls {
        // The point + r·(cos, sin) = from + s·(to − from).
        let (ex, ey) = (wall.to[0] - wall.from[0], wall.to[1] - wall.from[1]);
        let (fx, fy) = (wall.from[0] - x, wall.from[1] - y);
        let denominator = cos * ey - sin * ex;
        if denominator.abs() < 1e-12 {
            continue;
        }
        let along = (fx * ey - fy * ex) / denominator;
        let share = (fx * sin - fy * cos) / denominator;
        if along >= 0.0 && (0.0..=1.0).contains(&share) {
            nearest = nearest.min(along);
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

    use super::*;

    #[test]
    fn the_parts_are_what_they_say() {
        let walls = [
            Wall { from: [0.5, -1.0], to: [0.5, 1.0] },
            Wall { from: [-1.0, 0.3], to: [1.0, 0.3] },
            // Too short to be met.
            Wall { from: [0.2, 0.01], to: [0.2, 0.02] },
        ];
        let seen = Seen {
            start: Pose { x: 0.1, y: 0.0, heading: 0.0 },
            pose: Pose { x: 0.12, y: -0.03, heading: FRAC_PI_2 },
            velocity: [0.01, 0.02, 0.3],
            shaft_angle: 2.0,
            walls: &walls,
        };
        let parts = [Part::Pose, Part::Velocity, Part::Shaft, Part::Walls];
        let size: usize = parts.iter().map(|part| part.size()).sum();
        let mut found = vec![0.0; size];
        seen.write(&parts, 0.01, &mut found);
        // Facing +y: ahead the wall at y = 0.3, 0.33 m off; ahead to the right at 45° the nearer of 0.33·√2 and 0.38·√2; to the right
        // the wall at x = 0.5; behind and to the left nothing but, ahead to the left, y = 0.3 again.
        let diagonal = 0.33 / FRAC_1_SQRT_2;
        let rays = [0.33, diagonal, 1.0, 1.0, 1.0, 0.38 / FRAC_1_SQRT_2, 0.38, diagonal];
        let mut expected = vec![2.0, -3.0, FRAC_PI_2, 2.0, -1.0, 0.3, 2.0_f64.cos(), 2.0_f64.sin()];
        expected.extend(rays.map(|m| m / 0.01));
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((f64::from(*found) - expected).abs() < 1e-4, "number {k}: {found}, not {expected}");
        }
        let bounds: Vec<_> = parts.iter().flat_map(|part| part.bounds(0.01)).collect();
        assert_eq!(bounds.len(), size);
        assert!(found.iter().zip(bounds).all(|(x, [low, high])| (low..=high).contains(&f64::from(*x))));
    }
}
