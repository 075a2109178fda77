//! The second potentiometer on the shaft, with its converter. Every draw is its own: the first one's bits are those of a
//! robot without it.

use effects::Laws;
use robot_file::angle_code::Track;
use robot_file::robot::{Effects, InGap, Potentiometer as File};

use crate::adc::Adc;
use crate::faults::{Line, LineFault};
use crate::history::History;
use crate::linearity;
use crate::potentiometer::Potentiometer;
use crate::random::{Seeds, Source, Stream};
use crate::robot::Holding;

/// Potentiometer and converter with what they remember.
#[derive(Clone, Debug)]
pub(crate) struct SecondSensor {
    potentiometer: Potentiometer,
    adc: Adc,
    /// Middle of its gap on the shaft, rad.
    mounting: f64,
    /// The middle of its conversions comes this much after that of the first one's, s.
    after_s: f64,
    history: History,
    bad_contact: Stream,
    last_code: u16,
    holding: Option<Holding>,
}

/// The end of a robot's sampling that it needs: the sensors' delay and the step, s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Timing {
    pub delay_s: f64,
    pub step_s: f64,
}

impl SecondSensor {
    /// The second sensor of a file at a shaft angle (rad): mounted somewhere within the range of its offset, its linearity
    /// error drawn from the ranges (what an identification has found is the first one's).
    pub fn new(
        first: &File,
        effects: &Effects,
        seeds: Seeds,
        shaft_angle: f64,
        timing: Timing,
        holding: Option<Holding>,
    ) -> Option<Self> {
        let file = first.second_resolved()?;
        let offset = &first.second.as_ref()?.offset_deg;
        let mounting =
            Stream::new(seeds.specimen, Source::SecondMounting).uniform(offset.low, offset.high).to_radians();
        let behaviours = [InGap::Hold, InGap::Random, InGap::Zero];
        let drawn = behaviours[Stream::new(seeds.specimen, Source::SecondGapBehaviour).below(3) as usize];
        let in_gap = if file.in_gap == InGap::Any { drawn } else { file.in_gap };
        let sensor_nonlinearity =
            linearity::draw_unknown(effects, &mut Stream::new(seeds.specimen, Source::SecondLinearity));
        let laws = Laws { sensor_nonlinearity, ..effects.laws() };
        let potentiometer = Potentiometer::new(
            Track::new(&file),
            laws,
            file.hysteresis_deg.value.to_radians(),
            in_gap,
            shaft_angle - mounting,
            Stream::new(seeds.run, Source::SecondGap),
        );
        let adc = Adc::second(&file.adc, seeds);
        let after_s = 0.5 * (first.adc.duration_s() + file.adc.duration_s());
        let reach = (timing.delay_s + adc.reach_s()) / timing.step_s;
        let history = History::new(shaft_angle - mounting, reach.ceil() as usize + 1);
        let bad_contact = Stream::new(seeds.run, Source::SecondBadContact);
        let mut sensor = Self { potentiometer, adc, mounting, after_s, history, bad_contact, last_code: 0, holding };
        // What a sensor frozen from the start repeats.
        sensor.last_code = sensor.convert(&LineFault::default(), 0.0, timing);
        Some(sensor)
    }

    /// Moves the shaft (rad) within a step (s).
    pub fn step(&mut self, shaft_angle: f64, step: f64, fault: &LineFault) {
        let seen = self.potentiometer.step(shaft_angle - self.mounting, step, fault.is_cut());
        self.history.push(seen);
    }

    /// The code of a tick whose first sensor was converted about `middle` (s against the tick).
    pub fn code(&mut self, fault: &LineFault, middle: f64, timing: Timing) -> u16 {
        let code = self.convert(fault, middle, timing);
        let held = self.holding.as_mut().is_some_and(Holding::holds);
        if fault.line != Some(Line::Frozen) && !held {
            self.last_code = code;
        }
        self.last_code
    }

    fn convert(&mut self, fault: &LineFault, middle: f64, timing: Timing) -> u16 {
        let disturbance = fault.disturbance(&mut self.bad_contact);
        let (potentiometer, history) = (&mut self.potentiometer, &self.history);
        self.adc.sample_about(middle + self.after_s, |instant| {
            let angle = history.angle((timing.delay_s - instant) / timing.step_s);
            voltage(potentiometer, fault, disturbance, angle)
        })
    }

    /// Middle of its gap on the shaft, rad.
    pub fn mounting(&self) -> f64 {
        self.mounting
    }
}

/// Voltage (V) at the converter behind a wiper at an angle (rad), its line being as it is.
pub(crate) fn voltage(
    potentiometer: &mut Potentiometer,
    fault: &LineFault,
    (factor, offset): (f64, f64),
    angle: f64,
) -> f64 {
    let supply_v = potentiometer.track.supply_v;
    match fault.line {
        Some(Line::Low) => 0.0,
        Some(Line::High) => supply_v,
        _ => factor * potentiometer.voltage(angle, fault.is_cut()) + offset * supply_v,
    }
}
