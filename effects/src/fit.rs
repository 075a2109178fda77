//! How a fit moves the numbers of an effect.

/// How the fit moves a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Positive: by ratios.
    Log,
    /// In units of this much.
    Linear(f64),
}

/// A number of an effect that a fit moves, SI units and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct FitNumber {
    /// Effects that share a number (one bristle carries all friction) give it the same name, and a fit moves it once.
    pub name: &'static str,
    /// For people, with its article: "the sliding friction".
    pub words: &'static str,
    /// How it is moved.
    pub scale: Scale,
    /// Where fits begin that do not know it, one after the other.
    pub starts: Vec<f64>,
    /// Least value that a fit tries. Of a linear number that may be 0, the effect is absent at 0; of any other it is a shape.
    pub low: f64,
    /// Greatest value that a fit tries.
    pub high: f64,
    /// Standard deviation of a weak prior about the start, in the fit's coordinate; infinite for none.
    pub prior: f64,
    /// Step of the finite difference, in the fit's coordinate; `None` for the usual one of its scale.
    pub step: Option<f64>,
}

impl FitNumber {
    /// A number moved in units of `unit` between bounds, from one start.
    #[must_use]
    pub fn linear(name: &'static str, words: &'static str, unit: f64, start: f64, [low, high]: [f64; 2]) -> Self {
        let (scale, starts) = (Scale::Linear(unit), vec![start]);
        Self { name, words, scale, starts, low, high, prior: f64::INFINITY, step: None }
    }

    /// A positive number moved by ratios between bounds, from two starts, with a prior of so many factors e about each.
    #[must_use]
    pub fn log(name: &'static str, words: &'static str, starts: [f64; 2], [low, high]: [f64; 2], prior: f64) -> Self {
        Self { name, words, scale: Scale::Log, starts: starts.to_vec(), low, high, prior, step: None }
    }

    /// How many starts are worth a fit of their own.
    #[must_use]
    pub fn count_of_starts(&self) -> usize {
        if self.starts.iter().all(|start| *start == self.starts[0]) { 1 } else { self.starts.len() }
    }
}

/// The sizes of a rig, from which units and bounds of a fit's numbers follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sizes {
    /// Stall torque, or the largest torque that the file's own effects have, N·m.
    pub torque_nm: f64,
    /// Bridge supply, V.
    pub rail_v: f64,
    /// Winding resistance, Ω.
    pub resistance_ohm: f64,
    /// Inertia of rotor and load, kg·m².
    pub inertia_kg_m2: f64,
    /// Speed without load, rad/s.
    pub free_speed: f64,
    /// Turns of the rotor a turn of the shaft.
    pub gear_ratio: f64,
    /// Share of the readings that repeat the one before, at most.
    pub repeats: f64,
}
