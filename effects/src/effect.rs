//! What the file of an effect implements: its law, at the places of the chain where it acts.

use std::fmt::Debug;

use crate::fit::{FitNumber, Sizes};
use crate::spec::Spec;

/// Voltage that a bridge takes against the current.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct BridgeDrop {
    /// Drop beside its rise with the current, V.
    pub drop_v: f64,
    /// Current from which on that drop is there in full, and below in proportion to it, A.
    pub knee_a: f64,
    /// Rise of the drop with current, Ω.
    pub slope_ohm: f64,
    /// More while it switches, in proportion to its supply, V/V.
    pub of_supply: f64,
    /// Current from which on `of_supply` is lost in full, and below in proportion to it, A.
    pub switching_knee_a: f64,
    /// So near to full duty `of_supply` falls to nothing, in proportion to what is left, 1.
    pub fades_within: f64,
    /// Taken from what the command asks for, as far as it goes, whichever way the current flows, V.
    pub of_command_v: f64,
}

impl BridgeDrop {
    /// Voltage of a command at a duty and a supply (V), less what the bridge takes of it whichever way the current flows.
    #[inline]
    #[must_use]
    pub fn commanded(&self, duty: f64, supply_v: f64) -> f64 {
        (duty.abs() * supply_v - self.of_command_v).max(0.0).copysign(duty)
    }

    /// Share of the supply that is lost against the current at a duty: nothing at none and at full duty, where nothing switches.
    #[inline]
    #[must_use]
    pub fn of_switched(&self, duty: f64) -> f64 {
        let left = 1.0 - duty.abs();
        if duty == 0.0 || left <= 0.0 {
            0.0
        } else if left < self.fades_within {
            self.of_supply * left / self.fades_within
        } else {
            self.of_supply
        }
    }

    /// The current (A) that a voltage (V, not negative) drives through a conductance (A/V, that of `slope_ohm` within) where
    /// switching takes `switching_v` of a current beyond its knee; and how much more it is for a volt more, A/V.
    #[inline]
    #[must_use]
    pub fn current(&self, voltage: f64, switching_v: f64, conductance: f64) -> (f64, f64) {
        let current = (voltage - (self.drop_v + switching_v)) * conductance;
        let knee_a = self.knee_a.max(self.switching_knee_a);
        if current > knee_a {
            (current, conductance)
        } else if knee_a > 0.0 {
            self.below_a_knee(voltage, switching_v, 1.0 / conductance)
        } else {
            (0.0, 0.0)
        }
    }

    /// As [`Self::current`], of a current below at least one knee: what is lost in proportion is one more resistance.
    fn below_a_knee(&self, voltage: f64, switching_v: f64, resistance: f64) -> (f64, f64) {
        let (own, switching) = ((self.knee_a, self.drop_v), (self.switching_knee_a, switching_v));
        let [(lower_a, lower_v), (upper_a, upper_v)] =
            if self.knee_a < self.switching_knee_a { [own, switching] } else { [switching, own] };
        let below_upper = resistance + upper_v / upper_a;
        let current = (voltage - lower_v) / below_upper;
        if current > lower_a {
            (current, 1.0 / below_upper)
        } else if lower_a > 0.0 {
            let below_both = below_upper + lower_v / lower_a;
            (voltage / below_both, 1.0 / below_both)
        } else {
            (0.0, 0.0)
        }
    }
}

/// Torque against the motion that grows faster than the speed.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Drag {
    /// Of ω·|ω|, N·m·s²/rad².
    pub quadratic: f64,
    /// Of ω³, N·m·s³/rad³.
    pub cubic: f64,
}

impl Drag {
    /// Torque against the motion at a speed (rad/s), N·m, and its slope, N·m·s/rad.
    #[inline]
    #[must_use]
    pub fn torque(&self, speed: f64) -> (f64, f64) {
        let (linear, square) = (self.quadratic * speed.abs(), self.cubic * speed * speed);
        ((linear + square) * speed, 2.0 * linear + 3.0 * square)
    }
}

/// A load that turns on a spring behind the motor, with or without play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Half of the free play, rad.
    pub half_gap: f64,
    /// Of the spring beyond the play, N·m/rad.
    pub stiffness: f64,
    /// How much more the spring bears at a twist φ, as a share of the linear one's torque over φ², 1/rad².
    pub hardening: f64,
    /// Of the spring's damping to the critical one, 1.
    pub damping_ratio: f64,
    /// Share of the whole inertia that lies behind the spring, 0 … 1.
    pub load_share: f64,
    /// Share of the viscous damping that acts on the load, 0 … 1.
    pub load_drag_share: f64,
}

impl Coupling {
    /// Two in a row: plays add up, springs give way one after the other, to the third order of the twist; the load is behind the first.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        let stiffness = 1.0 / (1.0 / self.stiffness + 1.0 / other.stiffness);
        let share = |one: &Self| one.hardening * (stiffness / one.stiffness).powi(3);
        Self {
            half_gap: self.half_gap + other.half_gap,
            stiffness,
            hardening: share(&self) + share(&other),
            damping_ratio: self.damping_ratio.max(other.damping_ratio),
            load_share: self.load_share,
            load_drag_share: self.load_drag_share,
        }
    }
}

/// An effect: its parameters, SI units and radians, as a value.
///
/// Every place of the chain where a law may act is a method with a neutral default; an effect implements those where it
/// acts. Where several effects act in one place they add up, or follow one another in the order of the catalogue. An
/// effect is asked only in the part of the chain that its [`Spec::acts`] names, so that it costs nothing elsewhere.
pub trait Effect: Copy + Debug + PartialEq + Sized + 'static {
    /// What it carries from step to step; `()` for nothing.
    type State: Copy + Debug + PartialEq + Default + 'static;

    /// What is known about it.
    const SPEC: Spec;

    /// From values in the order of [`Spec::parameters`], SI units and radians.
    fn from_values(values: &[f64]) -> Self;

    // How a fit moves it.

    /// The numbers that a fit moves; each sets the parameter of the same place unless [`Self::values_of_fit`] says otherwise.
    /// None by default: recordings of the shaft do not show what acts at the feet or in the ground. Every other effect
    /// has some.
    #[must_use]
    fn fit(_sizes: &Sizes) -> Vec<FitNumber> {
        Vec::new()
    }

    /// Puts the fit's numbers into the values, in the order of [`Spec::parameters`]. Values that no number sets stay.
    fn values_of_fit(numbers: &[f64], values: &mut [f64]) {
        values[..numbers.len()].copy_from_slice(numbers);
    }

    /// The fit's numbers of values.
    fn fit_of_values(values: &[f64], numbers: &mut [f64]) {
        let count = numbers.len();
        numbers.copy_from_slice(&values[..count]);
    }

    /// Half the plausible range of each of the fit's numbers, from that of the values.
    fn fit_ranges(_values: &[f64], half_ranges: &[f64], numbers: &mut [f64]) {
        let count = numbers.len();
        numbers.copy_from_slice(&half_ranges[..count]);
    }

    /// The largest torque that it puts on the shaft by itself, N·m, where that may exceed the motor's.
    #[must_use]
    fn largest_torque(&self) -> f64 {
        0.0
    }

    /// Whether what it carries is still there after a hole in a recording; else it is as at the start of a run.
    #[must_use]
    fn lasts(&self) -> bool {
        false
    }

    // On the way from the command to the shaft.

    /// The duty that arrives, −1 … 1, of one that is commanded.
    #[inline]
    #[must_use]
    fn duty(&self, duty: f64) -> f64 {
        duty
    }

    /// By how much the command arrives late, s.
    #[inline]
    #[must_use]
    fn command_age(&self) -> f64 {
        0.0
    }

    /// Voltage that the bridge takes.
    #[inline]
    #[must_use]
    fn bridge(&self) -> BridgeDrop {
        BridgeDrop::default()
    }

    /// Resistance of the bridge's supply that acts at once, Ω.
    #[inline]
    #[must_use]
    fn supply_resistance(&self) -> f64 {
        0.0
    }

    /// By how much the supply has fallen slowly, V.
    #[inline]
    #[must_use]
    fn supply_fallen(&self, _state: &Self::State) -> f64 {
        0.0
    }

    /// Advances what the supply remembers, by a mean bridge current (A) over a time (s).
    #[inline]
    fn draw(&self, _state: &mut Self::State, _bridge_a: f64, _time: f64) {}

    // On the shaft.

    /// Level at which friction slides, N·m, at an angle (rad) and a speed (rad/s) with a torque (N·m) through the teeth.
    #[inline]
    #[must_use]
    fn friction_level(&self, _angle: f64, _speed: f64, _transmitted_nm: f64) -> f64 {
        0.0
    }

    /// By how much friction slides higher counter-clockwise than its level, and lower clockwise, N·m.
    #[inline]
    #[must_use]
    fn friction_lean(&self) -> f64 {
        0.0
    }

    /// Torque against the motion that grows faster than the speed.
    #[inline]
    #[must_use]
    fn drag(&self) -> Drag {
        Drag::default()
    }

    /// The spring behind which the load turns; `None` for a rigid shaft.
    #[must_use]
    fn coupling(&self) -> Option<Coupling> {
        None
    }

    /// Whether what turns into heat changes it: [`Self::warm`] does something.
    #[must_use]
    fn warms(&self) -> bool {
        false
    }

    /// Advances its warmth, by mean losses (W) in the winding and by friction over a time (s).
    #[inline]
    fn warm(&self, _state: &mut Self::State, _winding_w: f64, _friction_w: f64, _time: f64) {}

    /// Factor on the winding's resistance.
    #[inline]
    #[must_use]
    fn resistance_factor(&self, _state: &Self::State) -> f64 {
        1.0
    }

    /// Factor on the viscous damping.
    #[inline]
    #[must_use]
    fn viscous_factor(&self, _state: &Self::State) -> f64 {
        1.0
    }

    /// Presliding length of the bristle that carries its friction, rad; `None` for an effect without friction.
    #[inline]
    #[must_use]
    fn presliding(&self) -> Option<f64> {
        None
    }

    /// Torque on the shaft at an angle (rad), N·m, counter-clockwise positive.
    #[inline]
    #[must_use]
    fn torque(&self, _angle: f64) -> f64 {
        0.0
    }

    // Between the shaft and the reading.

    /// Error of the reading at a shaft angle (rad), rad.
    #[inline]
    #[must_use]
    fn reading_error(&self, _angle: f64) -> f64 {
        0.0
    }

    /// Age of the reading, s.
    #[inline]
    #[must_use]
    fn reading_age(&self) -> f64 {
        0.0
    }

    /// By how much the age of the reading grows in a second of the run, s/s.
    #[inline]
    #[must_use]
    fn ageing(&self) -> f64 {
        0.0
    }

    /// Chance that a reading repeats the one before it, 0 … 1.
    #[inline]
    #[must_use]
    fn held(&self) -> f64 {
        0.0
    }

    /// Whether the reading follows the shaft with a memory: [`Self::follow`] does something.
    #[must_use]
    fn follows(&self) -> bool {
        false
    }

    /// How far what is read moves on (rad) where what it follows has moved by `moved` (rad) within a step (s), evenly.
    #[inline]
    #[must_use]
    fn follow(&self, _state: &mut Self::State, moved: f64, _step: f64) -> f64 {
        moved
    }

    /// How far it is behind, rad.
    #[inline]
    #[must_use]
    fn behind(&self, _state: &Self::State) -> f64 {
        0.0
    }

    /// Puts it to where it ends up behind a shaft that turns at a speed (rad/s), `dragging` (−1 … 1) of which say how
    /// surely it has turned that way.
    fn settle(&self, _state: &mut Self::State, _speed: f64, _dragging: f64) {}

    // At the feet and in the ground.

    /// Factor on the coefficient of friction of a foot that slides at `speed` (m/s) under `load` (N).
    #[inline]
    #[must_use]
    fn friction_factor(&self, _speed: f64, _load: f64) -> f64 {
        1.0
    }

    /// Whether [`Self::friction_factor`] is anything but one.
    #[must_use]
    fn varies_foot_friction(&self) -> bool {
        false
    }

    /// A foot's friction across its module as a share of that along it.
    #[inline]
    #[must_use]
    fn lateral_share(&self) -> f64 {
        1.0
    }

    /// Factor on the coefficient of friction of one foot: its module and its side, both from 0, left before right.
    #[must_use]
    fn foot_share(&self, _module: usize, _side: usize) -> f64 {
        1.0
    }

    /// Share of a foot's load that is carried as by a sphere (0 … 1), and the load (N) at which it sinks as deep as a linear spring.
    #[must_use]
    fn sphere(&self) -> [f64; 2] {
        [0.0, 1.0]
    }

    /// Direction of gravity, a unit vector in the ground's frame, of one on level ground.
    #[inline]
    #[must_use]
    fn down(&self, down: [f64; 3]) -> [f64; 3] {
        down
    }

    // In the body.

    /// Where a courier's mass is centred, from the middle of its box in its own frame (x ahead, y to the left, z up), m.
    #[must_use]
    fn payload(&self) -> [f64; 3] {
        [0.0; 3]
    }

    /// Factors on the stiffness and on the damping of a backbone, counted from 0 at the front.
    #[must_use]
    fn backbone_shares(&self, _backbone: usize) -> [f64; 2] {
        [1.0; 2]
    }

    /// By how much stiffer a backbone is, as a share, where its ends are turned by 1 rad against each other: torsion,
    /// stiff and soft bending. It grows with the square of the turn.
    #[must_use]
    fn hardening(&self) -> [f64; 3] {
        [0.0; 3]
    }
}
