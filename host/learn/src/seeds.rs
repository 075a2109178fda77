//! Which episodes are which: those of a training, and those on which gaits are chosen and judged, which took no part in it.

/// Below this are the seeds of trainings; from here on, up to [`LATE_TRAININGS`], those below.
const EARLIEST: u64 = 1 << 40;
/// Seeds of trainings that would reach the others have this bit.
const LATE_TRAININGS: u64 = 1 << 63;

/// Turning: the episode on which gaits without a policy are chosen. Of the file's robot it draws the shaft's angle at the start.
pub const TURNING_CHOSEN: u64 = EARLIEST;
/// Turning: the first of the episodes on which all are judged.
pub const TURNING_JUDGED: u64 = 1 << 41;
/// Straight: the first of the episodes in which holding times are tried.
pub const STRAIGHT_TRIED: u64 = 1 << 42;
/// Straight: the first of the robots that steer by their pose.
pub const STRAIGHT_JUDGED: u64 = 1 << 43;
/// Maze: the first of the robots by which a way to go through it is judged.
pub const MAZE_JUDGED: u64 = 1 << 44;
/// The file's robot alone: where it finds out which of +F and −F turns it to the left, and where it goes through the maze first.
pub const FILES_ROBOT: u64 = 1 << 45;
/// Terrain: the first of the robots.
pub const TERRAIN_JUDGED: u64 = 1 << 46;

/// The seed of an episode of a training, by its number. No two of a training are the same, nor are those of trainings with seeds below 2³¹,
/// nor is one any of those above.
pub fn of_training(seed: u64, number: u64) -> u64 {
    let seed = (seed << 32).wrapping_add(number);
    if seed < EARLIEST { seed } else { seed | LATE_TRAININGS }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_training_meets_no_episode_on_which_gaits_are_judged() {
        let judged = TURNING_CHOSEN..TERRAIN_JUDGED + (1 << 32);
        for seed in [0, 1, 255, 256, 512, 1024, 16384, 1 << 30] {
            for number in [0, 100, 1 << 20] {
                assert!(!judged.contains(&of_training(seed, number)), "episode {number} of seed {seed}");
            }
        }
        assert_eq!(of_training(3, 5), (3 << 32) + 5);
    }
}
