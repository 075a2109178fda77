//! What is known about an effect besides its law.

/// An effect as people and tools read about it.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// Name of its table `[effects.NAME]`, in JSON and in reports.
    pub name: &'static str,
    /// What the table means, for the robot file's reference.
    pub summary: &'static str,
    /// Name for people, lower case, as within a sentence.
    pub title: &'static str,
    /// What it does, in one clause after the title.
    pub clause: &'static str,
    /// The law in formulas.
    pub law: &'static str,
    /// Paper or data sheet that the law is from.
    pub source: &'static str,
    /// Keys of its table, in the order of the law's values.
    pub parameters: &'static [Parameter],
    /// Where in the chain from the command to the reading it acts.
    pub acts: Acts,
    /// The coordinate in which its misfit shows most.
    pub shows_in: Coordinate,
    /// Whether a diagnosis (of a shaft; of a walk, where it acts on the ground) tries it where the file lacks it, without being asked
    /// to. One that is in the file is part of its model either way.
    pub candidate: bool,
    /// Effects that it contains as a special case: they are not listed beside it, and it takes their place.
    pub contains: &'static [&'static str],
    /// Effects that recordings may not tell from it, and the experiment that does.
    pub mistaken_for: &'static [Confusion],
    /// The experiment that shows it best, where no pair of [`Self::mistaken_for`] decides.
    pub experiment: Option<&'static str>,
    /// What MuJoCo has no friction for, after "friction that"; `None` where the export has nothing to refuse.
    pub not_in_mujoco: Option<&'static str>,
}

/// A key of an effect's table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The key; its end is the unit.
    pub key: &'static str,
    /// What it means, for the robot file's reference.
    pub meaning: &'static str,
    /// Least allowed value, in the key's unit.
    pub low: f64,
    /// Greatest allowed value, in the key's unit.
    pub high: f64,
    /// Scaled by the factor by which a specimen's drag differs from the file's.
    pub drag: bool,
    /// What is believed of it, in the key's unit, where a robot may have the effect and nothing more is known: value and the ends of a
    /// 90 % interval. With the value at the lower end and 0, the effect is absent there, and how much of it there may be is one half of
    /// a normal distribution; with both ends at the value it is held.
    pub belief: Option<[f64; 3]>,
}

impl Parameter {
    /// A key with its meaning and allowed range, in the key's unit.
    #[must_use]
    pub const fn new(key: &'static str, meaning: &'static str, low: f64, high: f64) -> Self {
        Self { key, meaning, low, high, drag: false, belief: None }
    }

    /// The same for a friction, which scales with a specimen's drag.
    #[must_use]
    pub const fn drag(key: &'static str, meaning: &'static str, low: f64, high: f64) -> Self {
        Self { key, meaning, low, high, drag: true, belief: None }
    }

    /// The same with what is believed of it before anything is measured: value, and the ends of a 90 % interval.
    #[must_use]
    pub const fn believed(self, value: f64, low: f64, high: f64) -> Self {
        Self { belief: Some([value, low, high]), ..self }
    }

    /// Whether the key is in degrees; the law's value is in radians then, and else in the key's own unit.
    #[must_use]
    pub fn in_degrees(&self) -> bool {
        self.key.ends_with("_deg")
    }

    /// A value in the key's unit as the law takes it.
    #[must_use]
    pub fn to_si(&self, value: f64) -> f64 {
        if self.in_degrees() { value.to_radians() } else { value }
    }

    /// A value of the law in the key's unit.
    #[must_use]
    pub fn from_si(&self, value: f64) -> f64 {
        if self.in_degrees() { value * 1f64.to_degrees() } else { value }
    }
}

/// Where in the chain from the command to the reading an effect acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acts {
    /// Between the commanded duty and the bridge's switches. Not seen where the terminals' voltage is measured.
    Command,
    /// In the bridge's transistors. Not seen where the terminals' voltage is measured.
    Bridge,
    /// In what feeds the bridge. Not seen where the supply or the terminals' voltage is measured.
    Supply,
    /// On the shaft.
    Shaft,
    /// Between the shaft and the reading.
    Sensor,
    /// At the feet of a robot on the ground.
    Foot,
    /// In the ground, or in the body that walks on it.
    Ground,
}

impl Acts {
    /// Whether it concerns a robot with a body on the ground, and not a shaft on a bench.
    #[must_use]
    pub fn on_the_ground(self) -> bool {
        matches!(self, Self::Foot | Self::Ground)
    }

    /// For people.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Command => "between the commanded duty and the bridge",
            Self::Bridge => "in the bridge",
            Self::Supply => "in the bridge's supply",
            Self::Shaft => "on the shaft",
            Self::Sensor => "between the shaft and the reading",
            Self::Foot => "at the feet",
            Self::Ground => "in the body or in the ground under it",
        }
    }
}

/// A coordinate in which a misfit lives, as JSON and reports name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinate {
    /// Shaft angle, rad.
    Angle,
    /// Shaft speed, rad/s.
    Speed,
    /// Commanded voltage, V.
    Voltage,
    /// Time in the run, s.
    Time,
    /// Speed of a foot on the ground, m/s; its load, N; the robot's heading, rad: what a recording of the shaft has not.
    Ground,
}

impl Coordinate {
    /// The name in JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle => "angle_rad",
            Self::Speed => "speed_rad_per_s",
            Self::Voltage => "voltage_v",
            Self::Time => "time_s",
            Self::Ground => "condition",
        }
    }
}

/// Two effects that some recordings cannot tell apart.
#[derive(Clone, Copy, Debug)]
pub struct Confusion {
    /// Name of the other.
    pub with: &'static str,
    /// When recordings cannot tell them apart.
    pub when: &'static str,
    /// The experiment that does.
    pub experiment: &'static str,
}
