//! Whether what a model leaves depends on how the shaft moves. Noise that remembers (a filter's, a converter's) makes the error of
//! a rollout larger than the floor, which only the fast part of it shows; but it does so alike in every rollout. What a model
//! lacks grows with speed, acceleration or voltage. A rank correlation per coordinate (C. Spearman, 1904), the chance of the
//! largest by permuting blocks of rollouts.

use rand::SeedableRng;
use rand::seq::SliceRandom;

use super::floor;
use super::rollout::{Rolled, residual};
use super::track::Track;

/// Permutations.
const RESAMPLES: usize = 2000;
/// Rollouts that stay together.
const BLOCK: usize = 5;
/// Fewest rollouts that a correlation is taken over.
const FEWEST: usize = 4 * BLOCK;

/// Chance that noise which does not know of the motion looks as dependent on it as what the rollouts leave.
#[must_use]
pub fn chance(tracks: &[Track], rolled: &[Rolled], seed: u64) -> f64 {
    let rollouts: Vec<Rollout> =
        tracks.iter().zip(rolled).flat_map(|(track, rolled)| of_track(track, rolled)).collect();
    if rollouts.len() < FEWEST {
        return 1.0;
    }
    let errors = ranks(&rollouts.iter().map(|one| one.error).collect::<Vec<_>>());
    let coordinates: Vec<Vec<f64>> =
        (0..3).map(|axis| ranks(&rollouts.iter().map(|one| one.motion[axis]).collect::<Vec<_>>())).collect();
    let largest = |order: &[usize]| {
        let correlation =
            |ranks: &Vec<f64>| order.iter().zip(ranks).map(|(&place, rank)| errors[place] * rank).sum::<f64>().abs();
        coordinates.iter().map(correlation).fold(0.0, f64::max)
    };
    let mut order: Vec<usize> = (0..errors.len()).collect();
    let found = largest(&order);
    let mut blocks: Vec<Vec<usize>> = order.chunks(BLOCK).map(<[usize]>::to_vec).collect();
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed ^ 0x0006_0710);
    let as_large = (0..RESAMPLES).filter(|_| {
        blocks.shuffle(&mut random);
        order.clear();
        order.extend(blocks.iter().flatten());
        largest(&order) >= found
    });
    (1.0 + as_large.count() as f64) / (RESAMPLES as f64 + 1.0)
}

/// One rollout.
struct Rollout {
    /// Logarithm of its mean square error over its own floor's.
    error: f64,
    /// Mean size of the speed, of its change, of the drive.
    motion: [f64; 3],
}

fn of_track(track: &Track, rolled: &Rolled) -> Vec<Rollout> {
    let mut offset = 0;
    let mut rollouts = Vec::with_capacity(track.segments.len());
    for segment in &track.segments {
        let length = segment.last - segment.first;
        let readings = &rolled.readings[offset..offset + length];
        offset += length;
        let scatter = floor::of_segment(track, segment, readings).unwrap_or(0.0);
        let left: f64 = (0..length).map(|i| residual(track, segment, segment.first + i, readings[i]).powi(2)).sum();
        let count: f64 = track.weight[segment.first..segment.last].iter().sum();
        if scatter > 0.0 && count > 2.0 {
            let speeds: Vec<f64> = (1..length)
                .map(|i| {
                    (readings[i] - readings[i - 1]) / (track.t[segment.first + i] - track.t[segment.first + i - 1])
                })
                .collect();
            let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / length as f64;
            rollouts.push(Rollout {
                error: (left / (count - 2.0) / scatter).max(1e-12).ln(),
                motion: [
                    mean(&mut speeds.iter().map(|speed| speed.abs())),
                    mean(&mut speeds.windows(2).map(|pair| (pair[1] - pair[0]).abs())),
                    mean(&mut (segment.first..segment.last).map(|k| track.drive[k].abs())),
                ],
            });
        }
    }
    rollouts
}

/// Ranks about their middle, scaled to a sum of squares of one; equal values share their mean rank.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let equal = order[first..].iter().take_while(|&&i| values[i] == values[order[first]]).count();
        for &i in &order[first..first + equal] {
            ranks[i] = first as f64 + 0.5 * (equal - 1) as f64 - 0.5 * (values.len() - 1) as f64;
        }
        first += equal;
    }
    let size = ranks.iter().map(|rank| rank * rank).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    ranks.iter().map(|rank| rank / size).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_share_ties_and_do_not_see_a_scale() {
        let ranked = ranks(&[3.0, 1.0, 3.0, 100.0]);
        assert_eq!(ranked, ranks(&[0.3, 0.2, 0.3, 0.4]));
        assert!((ranked[0] - ranked[2]).abs() < 1e-12 && ranked[1] < ranked[0] && ranked[0] < ranked[3]);
        assert!((ranked.iter().map(|rank| rank * rank).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(ranks(&[2.0; 5]).iter().all(|rank| *rank == 0.0));
    }
}
