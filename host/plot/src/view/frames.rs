//! The motion as the page gets it: sixteen bits a number.

use hal_sim::body::snapshot::Pose;
use hal_sim::body::{Snapshot, Track};

use common::conventions::frequency_from_omega;

/// Distance of the frames, s. Slower than the contact, faster than anything that a person follows.
const INTERVAL_S: f64 = 0.005;
/// Of the longest page, 30 s at the usual distance: some 5 MB.
const MOST_FRAMES: usize = 6000;
/// Largest code.
const CODES: f64 = 65535.0;

/// Numbers in frames at even times. In each frame, SI units, world frame:
/// position x, y, z and orientation w, x, y, z of every module, then of every segment; x, y, z of the force on every foot;
/// and, with a rotor, its angle (counter-clockwise, not wrapped) and its frequency (Hz, clockwise).
pub struct Frames {
    /// Of the first frame, s.
    pub start_s: f64,
    /// Between frames, s; 0 for a single one.
    pub interval_s: f64,
    /// How many frames.
    pub count: usize,
    /// Of each channel: value of code 0, and of a step of the code.
    pub scale: Vec<[f64; 2]>,
    /// Frame after frame, a code a channel.
    pub codes: Vec<u16>,
}

impl Frames {
    pub fn of(track: &Track) -> Self {
        let all = &track.snapshots;
        let (Some(first), Some(last)) = (all.first(), all.last()) else {
            return Self { start_s: 0.0, interval_s: 0.0, count: 0, scale: vec![], codes: vec![] };
        };
        let gaps = all.len().saturating_sub(1).max(1);
        let gap_s = (last.time_s - first.time_s) / gaps as f64;
        let every = ((INTERVAL_S / gap_s).round() as usize).max(all.len().div_ceil(MOST_FRAMES)).clamp(1, gaps);
        let rows = rows(all.iter().step_by(every));
        let scale: Vec<_> = (0..rows[0].len()).map(|channel| scale(&rows, channel)).collect();
        let codes = rows.iter().flat_map(|row| row.iter().zip(&scale).map(|(value, scale)| code(*value, *scale)));
        let codes = codes.collect();
        Self { start_s: first.time_s, interval_s: gap_s * every as f64, count: rows.len(), scale, codes }
    }

    /// The codes as hexadecimal digits, low byte first.
    pub fn hex(&self) -> String {
        let bytes: Vec<u8> = self.codes.iter().flat_map(|code| code.to_le_bytes()).collect();
        base16ct::lower::encode_string(&bytes)
    }
}

fn rows<'a>(snapshots: impl Iterator<Item = &'a Snapshot>) -> Vec<Vec<f64>> {
    let mut before: Option<&Snapshot> = None;
    let mut signs: Vec<f64> = vec![];
    snapshots
        .map(|snapshot| {
            let parts = || snapshot.modules.iter().chain(&snapshot.segments);
            // q and −q are the same orientation: the one that is nearer to the frame before can be interpolated.
            signs.resize(parts().count(), 1.0);
            if let Some(before) = before {
                let earlier = before.modules.iter().chain(&before.segments);
                for ((sign, pose), earlier) in signs.iter_mut().zip(parts()).zip(earlier) {
                    *sign *= if same_side(pose, earlier) { 1.0 } else { -1.0 };
                }
            }
            before = Some(snapshot);
            row(snapshot, &signs)
        })
        .collect()
}

fn same_side(a: &Pose, b: &Pose) -> bool {
    a.orientation.iter().zip(&b.orientation).map(|(a, b)| a * b).sum::<f64>() >= 0.0
}

/// The numbers of a frame; `signs` of the orientations.
pub(super) fn row(snapshot: &Snapshot, signs: &[f64]) -> Vec<f64> {
    let mut row = Vec::new();
    for (pose, sign) in snapshot.modules.iter().chain(&snapshot.segments).zip(signs) {
        row.extend(pose.position);
        row.extend(pose.orientation.map(|part| part * sign));
    }
    row.extend(snapshot.feet.iter().flat_map(|foot| foot.force));
    if let Some(rotor) = &snapshot.rotor {
        row.extend([rotor.angle, frequency_from_omega(rotor.speed)]);
    }
    row
}

/// From the least to the greatest finite value of a channel.
fn scale(rows: &[Vec<f64>], channel: usize) -> [f64; 2] {
    let values = || rows.iter().map(|row| row[channel]).filter(|value| value.is_finite());
    let (least, greatest) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
    if least > greatest { [0.0, 0.0] } else { [least, (greatest - least) / CODES] }
}

fn code(value: f64, [least, step]: [f64; 2]) -> u16 {
    // A constant channel has no step; NaN becomes code 0.
    if step > 0.0 { ((value - least) / step).round() as u16 } else { 0 }
}
