//! Which answers of a shaft a robot file allows.

use robot_file::robot::{Quantity, Robot};

/// A motor of the kind that a file describes has its torque constant, resistance and inertia within these factors of the file's,
/// whatever spread the file gives them.
const PART: (f64, f64) = (0.5, 1.6);
/// What the file gives as the end of a range is believed to be exact to this factor.
const BEYOND: f64 = 1.1;
/// Damping beside what the file knows, as a share of K²/R.
const DRAG: f64 = 0.3;
/// Squares of the distances of all numbers from the file's, each in units of what it may be off by, add up to at most this: not
/// all of them are at their worst at once.
const MOST_SQUARES: f64 = 2.2;
/// Values of a number that are tried within its range.
const STEPS: usize = 24;

/// A positive number with the range in which the file leaves it.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    /// At the file's values.
    pub value: f64,
    /// Least.
    pub low: f64,
    /// Greatest.
    pub high: f64,
}

impl Allowed {
    fn of(quantity: &Quantity) -> Self {
        let Quantity { value, low, high, .. } = *quantity;
        Self { value, low: (low / BEYOND).min(PART.0 * value), high: (high * BEYOND).max(PART.1 * value) }
    }

    fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Square of the distance from the file's value: 1 at either end, 0 at the value itself.
    fn square(&self, value: f64) -> f64 {
        let end = if value > self.value { self.high } else { self.low };
        if end == self.value { 0.0 } else { ((value / self.value).ln() / (end / self.value).ln()).powi(2) }
    }

    fn steps(self) -> impl Iterator<Item = f64> {
        (0..=STEPS).map(move |step| self.low * (self.high / self.low).powf(step as f64 / STEPS as f64))
    }
}

/// The numbers that make a shaft's answer, SI units.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    k: Allowed,
    r: Allowed,
    j: Allowed,
    /// Damping, N·m·s/rad: the file's value and the greatest.
    b: (f64, f64),
    /// Of the supply, over the file's.
    supply: Allowed,
}

impl Expected {
    /// Where the supply was measured, its own spread counts for nothing.
    pub fn new(robot: &Robot, supply_is_measured: bool) -> Self {
        let motor = &robot.motor;
        let slope_ohm = robot.effects.laws().bridge().slope_ohm;
        let load = &robot.load.inertia_kg_m2;
        let rotor = &motor.rotor_inertia_kg_m2;
        let sum = |a: &Quantity, value: f64, low: f64, high: f64| Quantity {
            value: a.value + value,
            low: a.low + low,
            high: a.high + high,
            source: String::new(),
        };
        let k = Allowed::of(&motor.torque_constant_nm_per_a);
        let r = Allowed::of(&sum(&motor.resistance_ohm, slope_ohm, slope_ohm, slope_ohm));
        let j = Allowed::of(&sum(rotor, load.value, load.low, load.high));
        let b = &motor.viscous_nm_s_per_rad;
        let rail = &robot.supply.rail_v;
        let (low, high) = if supply_is_measured { (1.0, 1.0) } else { (rail.low / rail.value, rail.high / rail.value) };
        Self {
            b: (b.value, PART.1 * b.high.max(b.value) + DRAG * k.value * k.value / r.value),
            supply: Allowed { value: 1.0, low: low / BEYOND, high: high * BEYOND },
            k,
            r,
            j,
        }
    }

    /// Angular acceleration a volt, K/(RJ), rad/s²/V.
    pub fn gain(&self) -> Allowed {
        let gain = |k: f64, r: f64, j: f64| k / (r * j);
        Allowed {
            value: gain(self.k.value, self.r.value, self.j.value),
            low: gain(self.k.low, self.r.high, self.j.high) * self.supply.low,
            high: gain(self.k.high, self.r.low, self.j.low) * self.supply.high,
        }
    }

    /// Share of the speed that is lost in a second, K²/(RJ) + b/J, 1/s.
    pub fn damping(&self) -> Allowed {
        let damping = |k: f64, r: f64, j: f64, b: f64| k * k / (r * j) + b / j;
        Allowed {
            value: damping(self.k.value, self.r.value, self.j.value, self.b.0),
            low: damping(self.k.low, self.r.high, self.j.high, 0.0),
            high: damping(self.k.high, self.r.low, self.j.low, self.b.1),
        }
    }

    /// Steady speed a volt, K/(K² + bR), rad/s/V.
    pub fn speed(&self) -> Allowed {
        let speed = |k: f64, r: f64, b: f64| k / (k * k + b * r);
        let slowest = |k: f64| speed(k, self.r.high, self.b.1);
        Allowed {
            value: speed(self.k.value, self.r.value, self.b.0),
            low: slowest(self.k.high).min(slowest(self.k.low)) * self.supply.low,
            high: self.supply.high / self.k.low,
        }
    }

    /// Whether numbers that the file allows have both a gain and a damping, each known to a factor.
    pub fn allows(&self, gain: (f64, f64), damping: (f64, f64)) -> bool {
        let ends = |(value, doubt): (f64, f64)| [value / doubt, value, value * doubt];
        ends(gain).into_iter().any(|gain| ends(damping).into_iter().any(|damping| self.allows_exactly(gain, damping)))
    }

    /// K/(RJ) = g and K g + b/J = a, for a supply that is v times the file's and makes the gain as much larger.
    fn allows_exactly(&self, gain: f64, damping: f64) -> bool {
        let supplies = [self.supply.low, 1.0, self.supply.high];
        supplies.into_iter().any(|supply| {
            let gain = gain / supply;
            self.k.steps().any(|k| {
                self.j.steps().any(|j| {
                    let (r, b) = (k / (gain * j), (damping - k * gain) * j);
                    let parts = [self.k.square(k), self.j.square(j), self.r.square(r), self.supply.square(supply)];
                    let drag = ((b - self.b.0).max(0.0) / (self.b.1 - self.b.0)).powi(2);
                    // What friction there is in the answer may make the damping a little less than none.
                    let possible = self.r.contains(r) && b <= self.b.1 && b >= -0.1 * damping * j;
                    possible && parts.iter().sum::<f64>() + drag <= MOST_SQUARES
                })
            })
        })
    }
}
