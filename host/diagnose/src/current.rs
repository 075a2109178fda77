//! The measured current, where a rig has it: what of it can be compared with the model.

use common::median;

use super::rollout::Rolled;
use super::track::{Segment, Track};

/// The drive is steady from one sample to the next while it changes by less than this share.
const STEADY: f64 = 0.05;

/// Place in the rollouts' arrays and measured minus simulated current, A, of every sample where the two are comparable.
pub fn current_residuals<'a>(track: &'a Track, rolled: &'a Rolled) -> impl Iterator<Item = (usize, f64)> + 'a {
    let mut end = 0;
    track.segments.iter().flat_map(move |segment| {
        let begin = end;
        end += segment.last - segment.first;
        (begin + 1..end).filter_map(move |place| {
            let k = segment.first + place - begin;
            let simulated = current_at(track, k, &rolled.currents, place)?;
            Some((place, track.current[k] - simulated))
        })
    })
}

/// How many samples of a track's segments have a current that can be compared.
pub fn count_of_currents(track: &Track) -> usize {
    let of = |segment: &Segment| (segment.first + 1..segment.last).filter(|&k| is_steady(track, k)).count();
    track.segments.iter().map(of).sum()
}

/// The current at a sample is between the means of the intervals on either side of it; `None` where the drive jumps, for
/// a rig may sample before or after.
#[inline]
pub fn current_at(track: &Track, k: usize, currents: &[f64], place: usize) -> Option<f64> {
    is_steady(track, k).then(|| 0.5 * (currents[place - 1] + currents[place]))
}

/// Whether a current was read and the drive had not jumped.
fn is_steady(track: &Track, k: usize) -> bool {
    let jump = (track.drive[k] - track.drive[k - 1]).abs();
    let driven = track.enable[k] && track.enable[k - 1];
    driven && jump <= STEADY * track.drive[k].abs().max(track.drive_scale) && track.current[k].is_finite()
}

/// Noise of the current column from its second differences; `None` without one.
#[must_use]
pub fn current_noise(tracks: &[Track]) -> Option<f64> {
    let mut differences: Vec<f64> = tracks
        .iter()
        .flat_map(|track| track.current.windows(3).map(|three| (three[0] - 2.0 * three[1] + three[2]).abs()))
        .filter(|difference| difference.is_finite())
        .collect();
    if differences.len() < 100 {
        return None;
    }
    let typical = {
        let mut sizes: Vec<f64> = tracks
            .iter()
            .flat_map(|track| track.current.iter().map(|current| current.abs()))
            .filter(|size| size.is_finite())
            .collect();
        median(&mut sizes).unwrap_or(0.0)
    };
    // A current sensor has errors that no difference shows: never trusted better than to 3 % of the usual current.
    Some((1.4826 * median(&mut differences).unwrap_or(0.0) / 6f64.sqrt()).max(0.03 * typical).max(1e-6))
}
