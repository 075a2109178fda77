//! Tasks and their rewards.

use common::angle::wrap;

use super::maze::Maze;

/// Where a robot stands on the plane: the mean of its modules' centres, and the direction from its last module to its first.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pose {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// Counter-clockwise from +x, rad, in −π … π.
    pub heading: f64,
}

impl Pose {
    /// Whether it is a pose at all: a robot that blew up has none.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.heading.is_finite()
    }

    /// The same in the frame of a robot that stands at `start`: x ahead of it, y to its left.
    #[must_use]
    pub fn seen_from(&self, start: Self) -> Self {
        let (sin, cos) = start.heading.sin_cos();
        let (x, y) = (self.x - start.x, self.y - start.y);
        Self { x: cos * x + sin * y, y: cos * y - sin * x, heading: wrap(self.heading - start.heading) }
    }
}

/// A step of an episode, as a reward sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Moved {
    pub start: Pose,
    pub before: Pose,
    pub after: Pose,
    /// Δt, s.
    pub interval_s: f64,
}

/// What is to be learned.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Turning in place.
    Turn(Turn),
    /// Walking along +x.
    Straight(Straight),
    /// Getting through a maze.
    Maze(MazeRun),
}

/// Turning in place, by the thesis's equation (5.5):
/// `R = −(Δθ/Δt − ω_desired)²·k_rot − ((x − x_i)² + (y − y_i)²)·k_pos`.
///
/// The thesis gives none of the three numbers; the defaults are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// ω_desired, rad/s. Counter-clockwise positive, as θ; the thesis counts it clockwise.
    pub desired_rad_per_s: f64,
    /// Weight k_rot of the angular velocity, s².
    pub k_rot: f64,
    /// Weight k_pos of the distance from the start, 1/m².
    pub k_pos: f64,
}

impl Default for Turn {
    /// To the left, beyond what any robot reaches: one that turns also shakes about its heading, and with an ω within its reach the square
    /// makes standing still the best. 40 mm off the start for a step count as much as turning by 5°/s earns.
    fn default() -> Self {
        Self { desired_rad_per_s: 573_f64.to_radians(), k_rot: 0.01, k_pos: 10.0 }
    }
}

/// Walking along +x: `R = Δx/Δt·k_ahead − (y − y_i)²·k_side − θ²·k_heading`. No source: the thesis alternates ±F by hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Straight {
    /// Weight of the speed along +x, s/m.
    pub k_ahead: f64,
    /// Weight of the distance from the line, 1/m².
    pub k_side: f64,
    /// Weight of the heading against the line, 1/rad².
    pub k_heading: f64,
}

impl Default for Straight {
    /// 10 mm/s ahead count as much as 30 mm off the line or 0.45 rad.
    fn default() -> Self {
        Self { k_ahead: 100.0, k_side: 1000.0, k_heading: 5.0 }
    }
}

/// Getting through a maze: `R = −Δd·k_progress − k_step`, d being the distance to the exit along the corridors, and once
/// `k_exit` where the exit's cell is reached, which ends the episode. No source: the thesis steers by hand.
#[derive(Clone, Debug, PartialEq)]
pub struct MazeRun {
    /// The maze.
    pub maze: Maze,
    /// Weight of the way gained, 1/m.
    pub k_progress: f64,
    /// Cost of a step, 1.
    pub k_step: f64,
    /// For the exit, 1.
    pub k_exit: f64,
}

impl MazeRun {
    /// Of a maze, with the chosen weights: a corridor's cell is worth 10 or so, a second costs 0.25.
    #[must_use]
    pub fn new(maze: Maze) -> Self {
        Self { maze, k_progress: 50.0, k_step: 0.01, k_exit: 20.0 }
    }
}

impl Task {
    /// The reward of a step, and whether it reached what ends the episode.
    pub(crate) fn reward(&self, moved: &Moved) -> (f64, bool) {
        match self {
            Self::Turn(turn) => (turn.reward(moved), false),
            Self::Straight(straight) => (straight.reward(moved), false),
            Self::Maze(run) => run.reward(moved),
        }
    }

    /// The maze, where there is one.
    #[must_use]
    pub fn maze(&self) -> Option<&Maze> {
        match self {
            Self::Maze(run) => Some(&run.maze),
            Self::Turn(_) | Self::Straight(_) => None,
        }
    }

    /// Its numbers, with the names under which they are given.
    #[must_use]
    pub fn weights(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Turn(Turn { desired_rad_per_s, k_rot, k_pos }) => {
                vec![("yaw_rate_rad_per_s", *desired_rad_per_s), ("k_rot", *k_rot), ("k_pos", *k_pos)]
            }
            Self::Straight(Straight { k_ahead, k_side, k_heading }) => {
                vec![("k_ahead", *k_ahead), ("k_side", *k_side), ("k_heading", *k_heading)]
            }
            Self::Maze(MazeRun { k_progress, k_step, k_exit, .. }) => {
                vec![("k_progress", *k_progress), ("k_step", *k_step), ("k_exit", *k_exit)]
            }
        }
    }
}

impl Turn {
    fn reward(&self, moved: &Moved) -> f64 {
        let Moved { start, before, after, interval_s } = moved;
        let turned = common::angle::wrap(after.heading - before.heading) / interval_s;
        let (dx, dy) = (after.x - start.x, after.y - start.y);
        -(turned - self.desired_rad_per_s).powi(2) * self.k_rot - (dx * dx + dy * dy) * self.k_pos
    }
}

impl Straight {
    fn reward(&self, moved: &Moved) -> f64 {
        let Moved { start, before, after, interval_s } = moved;
        let ahead = (after.x - before.x) / interval_s;
        ahead * self.k_ahead - (after.y - start.y).powi(2) * self.k_side - after.heading.powi(2) * self.k_heading
    }
}

impl MazeRun {
    fn reward(&self, moved: &Moved) -> (f64, bool) {
        let left = |pose: &Pose| self.maze.distance_to_exit([pose.x, pose.y]);
        let reached = self.maze.at_exit([moved.after.x, moved.after.y]);
        let gained = (left(&moved.before) - left(&moved.after)) * self.k_progress - self.k_step;
        (if reached { gained + self.k_exit } else { gained }, reached)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(before: [f64; 3], after: [f64; 3]) -> Moved {
        let pose = |[x, y, heading]: [f64; 3]| Pose { x, y, heading };
        Moved { start: pose([0.1, 0.2, 0.0]), before: pose(before), after: pose(after), interval_s: 0.04 }
    }

    #[test]
    fn turning_is_rewarded_by_equation_5_5() {
        let turn = Turn { desired_rad_per_s: 0.5, k_rot: 2.0, k_pos: 1000.0 };
        // 0.01 rad in 0.04 s is 0.25 rad/s: 2·0.25² = 0.125; 3 mm and 4 mm off: 1000·25e-6 = 0.025.
        let reward = turn.reward(&moved([0.1, 0.2, 0.30], [0.103, 0.204, 0.31]));
        assert!((reward + 0.15).abs() < 1e-12, "{reward}");
        // Over ±π it turns on.
        let reward = turn.reward(&moved([0.1, 0.2, 3.13], [0.1, 0.2, 3.15 - std::f64::consts::TAU]));
        assert!(reward.abs() < 1e-12, "{reward}");
        // The other way: −0.25 rad/s is 0.75 off.
        let reward = turn.reward(&moved([0.1, 0.2, 0.31], [0.1, 0.2, 0.30]));
        assert!((reward + 2.0 * 0.75 * 0.75).abs() < 1e-12, "{reward}");
    }

    #[test]
    fn walking_straight_is_speed_less_offset_and_heading() {
        let straight = Straight { k_ahead: 100.0, k_side: 1000.0, k_heading: 5.0 };
        // 0.4 mm in 0.04 s is 10 mm/s: 1; 10 mm off: 0.1; 0.2 rad: 0.2.
        let reward = straight.reward(&moved([0.15, 0.21, 0.0], [0.1504, 0.21, -0.2]));
        assert!((reward - 0.7).abs() < 1e-12, "{reward}");
    }

    #[test]
    fn a_maze_is_the_way_gained_and_once_its_exit() {
        let maze = Maze::figure_5_5(0.18);
        let (start, exit) = (maze.start(), maze.exit_centre());
        let run = MazeRun { k_progress: 50.0, k_step: 0.01, k_exit: 20.0, ..MazeRun::new(maze) };
        let at = |p: [f64; 2]| [p[0], p[1], 0.0];
        // 10 mm ahead from the start, where the corridor runs along +x.
        let (reward, done) = run.reward(&moved(at(start), at([start[0] + 0.01, start[1]])));
        assert!((reward - 0.49).abs() < 1e-9 && !done, "{reward}");
        let before = [exit[0] - 0.095, exit[1]];
        let (reward, done) = run.reward(&moved(at(before), at([exit[0] - 0.085, exit[1]])));
        // The way ends where the exit's cell begins, 5 mm on.
        assert!((reward - (0.25 - 0.01 + 20.0)).abs() < 1e-9 && done, "{reward}");
    }
}
