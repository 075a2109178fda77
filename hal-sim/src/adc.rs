//! The converter behind the wiper: the ESP32's curve, its integral nonlinearity, noise, spikes, and when it converts.

use std::f64::consts::TAU;

use robot_file::angle_code::AdcCurve;
use robot_file::robot;

use crate::random::{Seeds, Source, Stream};

/// Most conversions in a tick.
pub const MAX_CONVERSIONS: usize = 32;

/// A converter with the streams of its nuisances.
#[derive(Clone, Debug)]
pub struct Adc {
    /// Nominal curve.
    pub curve: AdcCurve,
    /// Standard deviation of the noise, LSB.
    pub noise_lsb: f64,
    /// Share of conversions that are spikes, 0 … 1.
    pub spike_share: f64,
    /// Standard deviation of a spike, LSB.
    pub spike_lsb: f64,
    /// Conversions per tick of which the median is taken.
    pub conversions: usize,
    /// Duration of one conversion, s.
    pub conversion_s: f64,
    /// Standard deviation of the tick's sampling instant, s.
    pub jitter_s: f64,
    inl: Inl,
    noise: Stream,
    spikes: Stream,
    jitter: Stream,
}

/// Integral nonlinearity: a smooth error of a given peak over the scale, its phase differing from part to part.
#[derive(Clone, Copy, Debug)]
struct Inl {
    peak_lsb: f64,
    waves: f64,
    phase: f64,
}

impl Inl {
    /// Two to five waves over the scale, as the ESP32's published plots show (estimate).
    fn draw(peak_lsb: f64, stream: &mut Stream) -> Self {
        Self { peak_lsb, waves: stream.uniform(2.0, 5.0), phase: stream.uniform(0.0, TAU) }
    }

    fn error(&self, share: f64) -> f64 {
        if self.peak_lsb == 0.0 { 0.0 } else { self.peak_lsb * (TAU * self.waves * share + self.phase).sin() }
    }
}

impl Adc {
    /// From the file: nominal values, the noise level drawn from its range.
    #[must_use]
    pub fn new(adc: &robot::Adc, seed: u64) -> Self {
        Self::of(adc, Seeds { specimen: seed, run: seed })
    }

    /// The same, level and nonlinearity being a specimen's.
    #[must_use]
    pub fn of(adc: &robot::Adc, seeds: Seeds) -> Self {
        let Seeds { specimen, run } = seeds;
        let level = Stream::new(specimen, Source::NoiseLevel).uniform(adc.noise_lsb.low, adc.noise_lsb.high);
        Self {
            curve: AdcCurve::new(adc),
            noise_lsb: level,
            spike_share: adc.spike_share.value,
            spike_lsb: adc.spike_lsb.value,
            conversions: (adc.conversions.value.round() as usize).clamp(1, MAX_CONVERSIONS),
            conversion_s: adc.conversion_s.value,
            jitter_s: adc.jitter_s.value,
            inl: Inl::draw(adc.inl_lsb.value, &mut Stream::new(specimen, Source::Inl)),
            noise: Stream::new(run, Source::Noise),
            spikes: Stream::new(run, Source::Spikes),
            jitter: Stream::new(run, Source::Jitter),
        }
    }

    /// The same for a second input: other nuisances, as if under a seed of its own.
    #[must_use]
    pub fn second(adc: &robot::Adc, seeds: Seeds) -> Self {
        let other = |seed| Stream::new(seed, Source::SecondConverter).seed();
        Self::of(adc, Seeds { specimen: other(seeds.specimen), run: other(seeds.run) })
    }

    /// One conversion of a voltage (V).
    ///
    /// The noise is at the input: where the curve is flat (below the dead zone, in saturation) it does not show. A spike
    /// is in the code.
    pub fn convert(&mut self, voltage: f64) -> u16 {
        let noise = self.noise_lsb * self.noise.normal();
        let spike =
            if self.spikes.uniform(0.0, 1.0) < self.spike_share { self.spike_lsb * self.spikes.normal() } else { 0.0 };
        let mut code = self.curve.code(voltage + noise / self.curve.codes_per_v);
        if code > 0.0 && code < self.curve.top_code {
            code += self.inl.error(code / self.curve.top_code);
        }
        (code + spike).round().clamp(0.0, self.curve.top_code) as u16
    }

    /// The middle of this tick's conversions against the tick, s: one draw of the jitter (the timer's latency is common to
    /// them).
    pub fn middle(&mut self) -> f64 {
        self.jitter_s * self.jitter.normal()
    }

    /// The instants of conversions about their `middle`, s, earliest first and evenly spaced.
    pub fn instants(&self, middle: f64) -> impl Iterator<Item = f64> + use<> {
        let first = middle - 0.5 * (self.conversions - 1) as f64 * self.conversion_s;
        let spacing = self.conversion_s;
        (0..self.conversions).map(move |index| first + index as f64 * spacing)
    }

    /// The tick's code: the median of conversions at the voltages (V) that `wiper` gives at each instant (s against
    /// the tick). Of an even number the lower middle one. Every conversion has noise of its own and is a spike or not by
    /// itself: a burst longer than a conversion would pass a median, and is not modelled. Beside the code the middle of
    /// the conversions, s against the tick.
    pub fn sample(&mut self, wiper: impl FnMut(f64) -> f64) -> (u16, f64) {
        let middle = self.middle();
        (self.sample_about(middle, wiper), middle)
    }

    /// The same about a middle (s against the tick) that is given.
    pub fn sample_about(&mut self, middle: f64, mut wiper: impl FnMut(f64) -> f64) -> u16 {
        let mut codes = [0u16; MAX_CONVERSIONS];
        for (instant, code) in self.instants(middle).zip(&mut codes) {
            *code = self.convert(wiper(instant));
        }
        let codes = &mut codes[..self.conversions];
        codes.sort_unstable();
        codes[(codes.len() - 1) / 2]
    }

    /// How far before the tick a conversion can lie, s (six standard deviations of jitter).
    #[must_use]
    pub fn reach_s(&self) -> f64 {
        0.5 * self.conversions as f64 * self.conversion_s + 6.0 * self.jitter_s
    }
}
