//! How a shaft answers its drive: gain and damping of θ″ = g·u − a·ω − c·sign ω + m + p·sin θ + q·cos θ by modulating functions
//! (M. Shinbrot, 1957). Times a smooth bump that is zero at both ends of a window, and integrated by parts, the equation holds
//! without a derivative of the reading and without the window's initial state. Nothing in it has a unit: a recording in ms
//! and degrees gives g and a of its own units, which is what the check looks for.

use nalgebra::{DMatrix, DVector};

use super::motion::Motion;

/// Lengths of windows that are tried, in samples: the one that tells most is taken.
const LENGTHS: [usize; 11] = [8, 12, 18, 27, 40, 60, 90, 135, 200, 400, 800];
/// Windows of a length that are looked at, of all runs.
const MOST_WINDOWS: usize = 6000;
/// Fewest windows that an answer is taken from, laid end to end.
const FEWEST_WINDOWS: usize = 24;
/// Blocks of the jackknife.
const BLOCKS: usize = 12;
/// Share of a window's readings that may be missing.
const MISSING: f64 = 0.25;
/// A step in time this many times the usual one ends a window.
const GAP: f64 = 3.0;
/// Share of the speed's own variance that the reading's noise may make.
const NOISE: f64 = 0.15;
/// Share of the acceleration beyond the reading's noise that the equation leaves at most where its answer is not a rough one.
const UNEXPLAINED: f64 = 0.25;
/// Share of a window's travel that each quarter of it has at least: a shaft that starts from rest has a sixteenth in the first.
const EVEN: f64 = 0.08;
/// Gain, damping, friction, a constant torque, and one that turns with the shaft.
const TERMS: usize = 6;

/// An estimate with its standard deviation.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard deviation by a jackknife over blocks of windows.
    pub deviation: f64,
}

impl Estimate {
    /// Standard deviation of its logarithm; infinite where its sign is not known.
    pub fn relative(&self) -> f64 {
        if self.value == 0.0 { f64::INFINITY } else { (self.deviation / self.value).abs() }
    }
}

/// The answer of all runs together.
#[derive(Clone, Copy, Debug)]
pub struct Response {
    /// Angular acceleration a volt, g.
    pub gain: Estimate,
    /// Share of the speed that is lost in a unit of time, a.
    pub damping: Estimate,
    /// Steady speed a volt, g/a.
    pub speed: Estimate,
    /// Share of the acceleration that the equation leaves.
    pub left_over: f64,
    /// Share of the acceleration beyond the reading's noise that it leaves.
    pub unexplained: f64,
    /// Length of the windows, in samples.
    pub length: usize,
}

impl Response {
    /// Whether the equation leaves so much that its answer is a rough one: of what it does not know (a driver's drop, say, behind
    /// which a shaft coasts) an answer takes in as much as it likes.
    pub fn is_rough(&self) -> bool {
        self.unexplained > UNEXPLAINED
    }
}

/// The answer, by the length of windows that tells most, of those that explain the motion if there are any; `None` where there are too few windows in which the driven shaft turns.
/// `turn` is a turn in the reading's unit.
pub fn response(runs: &[&Motion], turn: f64) -> Option<Response> {
    let answers = LENGTHS.iter().filter_map(|&length| of_length(runs, length, turn));
    let doubt = |one: &Response| one.gain.relative() + one.damping.relative();
    answers.min_by(|a, b| a.is_rough().cmp(&b.is_rough()).then(doubt(a).total_cmp(&doubt(b))))
}

/// The normal equations of some windows.
#[derive(Clone)]
struct Normal {
    left: DMatrix<f64>,
    right: DVector<f64>,
    /// Sum of squares of the right side.
    square: f64,
    count: f64,
}

impl Normal {
    fn new() -> Self {
        Self { left: DMatrix::zeros(TERMS, TERMS), right: DVector::zeros(TERMS), square: 0.0, count: 0.0 }
    }

    fn add(&mut self, row: &Row) {
        let terms = DVector::from_row_slice(&row.terms);
        self.left += &terms * terms.transpose();
        self.right += terms * row.acceleration;
        self.square += row.acceleration * row.acceleration;
        self.count += 1.0;
    }

    fn without(&self, other: &Self) -> Self {
        Self {
            left: &self.left - &other.left,
            right: &self.right - &other.right,
            square: self.square - other.square,
            count: self.count - other.count,
        }
    }

    /// Each term's coefficient; columns are brought to one size first, and a term that is not excited gets none.
    fn solve(&self) -> Option<DVector<f64>> {
        let (inverse, sizes) = self.inverse()?;
        let right = DVector::from_fn(TERMS, |i, _| self.right[i] / sizes[i]);
        let solved = inverse * right;
        Some(DVector::from_fn(TERMS, |i, _| solved[i] / sizes[i]))
    }

    fn inverse(&self) -> Option<(DMatrix<f64>, Vec<f64>)> {
        let sizes: Vec<f64> = (0..TERMS).map(|i| self.left[(i, i)].sqrt().max(f64::MIN_POSITIVE)).collect();
        let scaled = DMatrix::from_fn(TERMS, TERMS, |i, j| {
            self.left[(i, j)] / (sizes[i] * sizes[j]) + if i == j { 1e-9 } else { 0.0 }
        });
        scaled.cholesky().map(|factor| (factor.inverse(), sizes))
    }

    /// Mean square of what is left of the acceleration.
    fn left_over(&self) -> f64 {
        let explained = self.solve().map_or(0.0, |solved| solved.dot(&self.right));
        (self.square - explained).max(0.0) / self.count
    }

    /// Variance of the speed that the other terms do not explain.
    fn own_variance_of_speed(&self) -> f64 {
        self.inverse().map_or(0.0, |(inverse, sizes)| sizes[SPEED].powi(2) / inverse[(SPEED, SPEED)] / self.count)
    }
}

/// Places of the first two terms.
const DRIVE: usize = 0;
const SPEED: usize = 1;

/// One window.
struct Row {
    acceleration: f64,
    terms: [f64; TERMS],
    /// Variances of the acceleration and of the speed that a reading's noise of one makes.
    noise_gain: [f64; 2],
}

/// The answer by windows of one length, in samples.
pub fn of_length(runs: &[&Motion], length: usize, turn: f64) -> Option<Response> {
    let samples: usize = runs.iter().map(|run| run.t.len()).sum();
    let stride = (length / 4).max(samples / MOST_WINDOWS).max(1);
    let mut rows = Vec::new();
    let (mut noise, mut noise_gain) = (0.0, [0.0; 2]);
    for run in runs {
        for first in (0..run.t.len().saturating_sub(length)).step_by(stride) {
            let row = row(run, first, length, turn);
            if let Some(row) = row {
                noise += row.noise_gain[1] * run.noise * run.noise;
                (0..2).for_each(|i| noise_gain[i] += row.noise_gain[i]);
                rows.push(row);
            }
        }
    }
    if rows.len() * stride < FEWEST_WINDOWS * length.max(stride) {
        return None;
    }
    let mut blocks = vec![Normal::new(); BLOCKS];
    let mut all = Normal::new();
    for (place, row) in rows.iter().enumerate() {
        blocks[place * BLOCKS / rows.len()].add(row);
        all.add(row);
    }
    // Slow samples bend between each other, which looks like noise: it is not more than what the equation leaves.
    let left_over = all.left_over() * noise_gain[1] / noise_gain[0];
    if (noise / all.count).min(left_over) > NOISE * all.own_variance_of_speed() {
        return None;
    }
    let whole = answer(&all)?;
    let without: Vec<[f64; 3]> = blocks.iter().filter_map(|block| answer(&all.without(block))).collect();
    let estimate = |place: usize| {
        let mean = without.iter().map(|one| one[place]).sum::<f64>() / without.len() as f64;
        let sum: f64 = without.iter().map(|one| (one[place] - mean).powi(2)).sum();
        let deviation = (sum * (without.len() as f64 - 1.0) / without.len() as f64).sqrt();
        Estimate { value: whole[place], deviation }
    };
    let of_noise = noise * noise_gain[0] / noise_gain[1];
    let left = all.left_over() * all.count;
    (without.len() == BLOCKS).then(|| Response {
        gain: estimate(0),
        damping: estimate(1),
        speed: estimate(2),
        left_over: left / all.square,
        unexplained: (left - of_noise).max(0.0) / (all.square - of_noise).max(f64::MIN_POSITIVE),
        length,
    })
}

/// Gain, damping and steady speed a volt.
fn answer(normal: &Normal) -> Option<[f64; 3]> {
    let solved = normal.solve()?;
    let (gain, damping) = (solved[DRIVE], -solved[SPEED]);
    Some([gain, damping, gain / damping])
}

/// The bump 140 x³(1 − x)³, whose integral is one, by its first and second derivative and its integral up to x.
fn bump(x: f64) -> [f64; 4] {
    let (y, square) = (1.0 - x, x * x);
    let product = x * y;
    [
        140.0 * product.powi(3),
        420.0 * product.powi(2) * (1.0 - 2.0 * x),
        420.0 * (2.0 * product * (1.0 - 2.0 * x).powi(2) - 2.0 * product.powi(2)),
        square * square * (35.0 - 84.0 * x + 70.0 * square - 20.0 * square * x),
    ]
}

/// The equation of one window; `None` where the bridge is open, a hole in time or in the readings, or a shaft that rests or turns
/// round: what friction does there has no sign.
fn row(run: &Motion, first: usize, length: usize, turn: f64) -> Option<Row> {
    let last = first + length;
    let t = &run.t[first..=last];
    let angle = bridged(&run.angle[first..=last])?;
    let driven = run.enable[first..last].iter().all(|enable| *enable);
    let holes = t.windows(2).any(|pair| pair[1] - pair[0] > GAP * run.usual_step);
    let direction = direction(&angle)?;
    if !driven || holes {
        return None;
    }
    let duration = t[length] - t[0];
    let slope = (angle[length] - angle[0]) / duration;
    let (mut acceleration, mut speed, mut drive, mut sine, mut cosine) = (0.0, slope, 0.0, 0.0, 0.0);
    let mut noise_gain = [0.0; 2];
    let shapes: Vec<[f64; 4]> = t.iter().map(|at| bump((at - t[0]) / duration)).collect();
    for i in 0..=length {
        let (before, after) = (t[i.saturating_sub(1)], t[(i + 1).min(length)]);
        let weight = 0.5 * (after - before) / duration;
        // Without its straight part, so that the sum's own error does not see how far the shaft has turned.
        let bent = angle[i] - angle[0] - slope * (t[i] - t[0]);
        acceleration += weight * shapes[i][2] * bent / (duration * duration);
        speed -= weight * shapes[i][1] * bent / duration;
        noise_gain[0] += (weight * shapes[i][2] / (duration * duration)).powi(2);
        noise_gain[1] += (weight * shapes[i][1] / duration).powi(2);
        let (sin, cos) = (std::f64::consts::TAU * angle[i] / turn).sin_cos();
        sine += weight * shapes[i][0] * sin;
        cosine += weight * shapes[i][0] * cos;
        if i < length {
            drive += run.volts[first + i] * (shapes[i + 1][3] - shapes[i][3]);
        }
    }
    Some(Row { acceleration, terms: [drive, speed, direction, 1.0, sine, cosine], noise_gain })
}

/// Readings with what is missing on a straight line; `None` where too much is.
fn bridged(angle: &[f64]) -> Option<Vec<f64>> {
    let missing = angle.iter().filter(|angle| angle.is_nan()).count();
    if missing as f64 > MISSING * angle.len() as f64 || angle[0].is_nan() || angle[angle.len() - 1].is_nan() {
        return None;
    }
    let mut filled = angle.to_vec();
    let mut known = 0;
    for next in 1..angle.len() {
        if angle[next].is_nan() {
            continue;
        }
        let per_sample = (angle[next] - angle[known]) / (next - known) as f64;
        for (place, between) in filled[known..next].iter_mut().enumerate() {
            *between = angle[known] + per_sample * place as f64;
        }
        known = next;
    }
    Some(filled)
}

/// Which way the shaft turns, 1 or −1, all along a window; `None` where it rests or turns round.
fn direction(angle: &[f64]) -> Option<f64> {
    let last = angle.len() - 1;
    let quarters = [0, last / 4, last / 2, 3 * last / 4, last];
    let travels: Vec<f64> = quarters.windows(2).map(|ends| angle[ends[1]] - angle[ends[0]]).collect();
    let whole = angle[last] - angle[0];
    let along = travels.iter().all(|travel| travel * whole.signum() > EVEN * whole.abs());
    (along && whole != 0.0).then(|| whole.signum())
}
