//! Drives to choose an experiment from: pieces of a constant duty or of an open bridge.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// A part of a drive.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Piece {
    /// How long it lasts, s.
    pub seconds: f64,
    /// −1 … 1, positive counter-clockwise; `None` while the bridge is open.
    pub duty: Option<f64>,
}

/// A drive: its pieces, one after the other.
pub type Script = Vec<Piece>;

/// Shortest and longest piece of a random drive, s.
const HOLD_S: [f64; 2] = [0.1, 1.5];
/// Share of the pieces of a random drive in which the bridge is open.
const OPEN: f64 = 0.15;
/// Half periods of the regular drives, s.
const HALF_PERIODS_S: [f64; 3] = [0.15, 0.4, 1.0];

/// Drives that a robot can be given.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// The least duty that turns every model's shaft, and the greatest at which no supervisor intervenes.
    pub duty: [f64; 2],
    /// Length of the drive, s.
    pub seconds: f64,
}

impl Reach {
    /// A duty at a share of the way from the least to the greatest.
    fn duty(self, share: f64) -> f64 {
        let [least, most] = self.duty;
        least + share * (most - least)
    }

    /// Regular drives: reversals, pulses with an open bridge in between, and stairs, at several duties.
    pub fn regular(self) -> Vec<Script> {
        let mut scripts = Vec::new();
        for half_s in HALF_PERIODS_S {
            for share in [0.1, 0.5, 1.0] {
                let duty = self.duty(share);
                scripts.push(self.repeated(half_s, &[Some(duty), Some(-duty)]));
                scripts.push(self.repeated(half_s, &[Some(duty), None, Some(-duty), None]));
            }
            let stairs = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| self.duty(share));
            let both: Vec<Option<f64>> =
                stairs.iter().map(|d| Some(*d)).chain(stairs.iter().map(|d| Some(-d))).collect();
            scripts.push(self.repeated(half_s, &both));
        }
        scripts
    }

    fn repeated(self, seconds: f64, duties: &[Option<f64>]) -> Script {
        let count = (self.seconds / seconds).round().max(1.0) as usize;
        (0..count).map(|i| Piece { seconds: self.seconds / count as f64, duty: duties[i % duties.len()] }).collect()
    }

    /// A drive whose pieces are drawn at random.
    pub fn random(self, random: &mut Pcg64Mcg) -> Script {
        let mut script = Vec::new();
        let mut left = self.seconds;
        while left > 0.0 {
            let piece = self.piece(random);
            let seconds = if left - piece.seconds < HOLD_S[0] { left } else { piece.seconds };
            script.push(Piece { seconds, ..piece });
            left -= seconds;
        }
        script
    }

    fn piece(self, random: &mut Pcg64Mcg) -> Piece {
        let [short, long] = HOLD_S;
        let seconds = short * (long / short).powf(random.random::<f64>());
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let duty = sign * self.duty(random.random::<f64>());
        Piece { seconds, duty: (!random.random_bool(OPEN)).then_some(duty) }
    }

    /// The same drive with what one of its pieces does drawn anew.
    pub fn exchanged(self, script: &Script, random: &mut Pcg64Mcg) -> Script {
        let mut changed = script.clone();
        let place = random.random_range(0..changed.len());
        changed[place].duty = self.piece(random).duty;
        changed
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn every_drive_is_as_long_as_asked_and_within_its_duties() {
        let reach = Reach { duty: [0.3, 0.8], seconds: 5.0 };
        let mut random = Pcg64Mcg::seed_from_u64(1);
        let mut scripts = reach.regular();
        scripts.extend((0..50).map(|_| reach.random(&mut random)));
        let first = scripts[0].clone();
        scripts.push(reach.exchanged(&first, &mut random));
        for script in scripts {
            let seconds: f64 = script.iter().map(|piece| piece.seconds).sum();
            assert!((seconds - 5.0).abs() < 1e-9, "{seconds}");
            for duty in script.iter().filter_map(|piece| piece.duty) {
                assert!((0.3..=0.8).contains(&duty.abs()), "{duty}");
            }
        }
    }
}
