//! The potentiometer: a track with a gap, a wiper with hysteresis, and what an insulated wiper shows.

use std::f64::consts::TAU;

use effects::{Laws, States};
use robot_file::angle_code::Track;
use robot_file::robot::InGap;

use crate::plant::dragged;
use crate::random::Stream;

/// Standard deviation of the rate at which a floating input drifts in the gap, V/s, drawn anew at every entry. Estimate:
/// 1 nA of leakage on 100 pF of input and sampling capacitance.
pub const DRIFT_V_PER_S: f64 = 10.0;

/// The potentiometer between the shaft and the converter.
#[derive(Clone, Debug)]
pub struct Potentiometer {
    /// Nominal track.
    pub track: Track,
    /// The effects between shaft and reading.
    pub laws: Laws,
    /// Half of the wiper's play, rad.
    pub half_play: f64,
    /// What it shows in the gap.
    pub in_gap: InGap,
    /// Angle at which the wiper stands, rad, not wrapped.
    wiper: f64,
    /// What is read follows the wiper with a memory.
    follows: bool,
    states: States,
    floating: bool,
    held_v: f64,
    drift_v_per_s: f64,
    gap: Stream,
}

impl Potentiometer {
    /// A potentiometer at a shaft angle (rad). The play starts in its middle. `gap` feeds what an insulated wiper shows.
    #[must_use]
    pub fn new(track: Track, laws: Laws, hysteresis: f64, in_gap: InGap, shaft_angle: f64, mut gap: Stream) -> Self {
        // A wiper that starts on insulation floats anywhere.
        let held_v = gap.uniform(0.0, track.supply_v);
        let drift_v_per_s = DRIFT_V_PER_S * gap.normal();
        let floating = track.in_gap(shaft_angle);
        let half_play = 0.5 * hysteresis;
        Self {
            track,
            laws,
            half_play,
            in_gap,
            wiper: shaft_angle,
            follows: laws.follows(),
            states: States::default(),
            floating,
            held_v,
            drift_v_per_s,
            gap,
        }
    }

    /// Moves the shaft (rad) within a step (s) and returns the angle that is read, rad: the wiper's, or what follows it. `cut`
    /// is a broken wiper lead.
    #[inline]
    pub fn step(&mut self, shaft_angle: f64, step: f64, cut: bool) -> f64 {
        let before = self.wiper;
        self.wiper = dragged(self.wiper, self.half_play, shaft_angle);
        let floating = cut || self.track.in_gap(self.wiper);
        if floating && !self.floating {
            // The line's capacitance keeps what the track last gave it.
            self.held_v = self.on_track(before);
            self.drift_v_per_s = DRIFT_V_PER_S * self.gap.normal();
        }
        if floating {
            self.held_v = (self.held_v + self.drift_v_per_s * step).clamp(0.0, self.track.supply_v);
        }
        self.floating = floating;
        if !self.follows {
            return self.wiper;
        }
        self.laws.follow(&mut self.states, self.wiper - before, step);
        self.wiper - self.laws.behind(&self.states)
    }

    /// Where the wiper stands, rad.
    #[must_use]
    pub fn wiper(&self) -> f64 {
        self.wiper
    }

    /// Voltage (V) that the track gives at an angle (rad), the effects' errors included.
    #[must_use]
    pub fn on_track(&self, angle: f64) -> f64 {
        let turn = angle.rem_euclid(TAU) - self.track.half_gap;
        ((turn + self.laws.reading_error(angle)) / self.track.angle_per_v()).clamp(0.0, self.track.supply_v)
    }

    /// Voltage (V) at the converter when the wiper stands at an angle (rad); `cut` is a broken wiper lead.
    pub fn voltage(&mut self, angle: f64, cut: bool) -> f64 {
        if !cut && !self.track.in_gap(angle) {
            return self.on_track(angle);
        }
        match self.in_gap {
            InGap::Hold => self.held_v,
            InGap::Random | InGap::Any => self.gap.uniform(0.0, self.track.supply_v),
            InGap::Zero => 0.0,
        }
    }
}
