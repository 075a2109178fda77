//! `[sensor]`: what measures the angle.

use serde::Serialize;

use super::Quantity;
use crate::parts::read_word;
use crate::schema::{Part, Place, Reader, Shape, TomlTable, table};

/// `[sensor]` with `kind = "ideal" | "encoder" | "potentiometer"`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum Sensor {
    /// The angle itself, whenever asked.
    Ideal,
    /// A digital absolute encoder.
    Encoder(Encoder),
    /// A potentiometer read by an ADC.
    Potentiometer(Box<Potentiometer>),
}

table! {
    /// `kind = "encoder"`
    pub struct Encoder {
        /// Counts per turn.
        counts_per_turn: Quantity = 4.0..=65536.0,
        /// Noise, standard deviation.
        noise_deg: Quantity = 0.0..=30.0,
    }
}

table! {
    /// `kind = "potentiometer"`
    pub struct Potentiometer {
        /// Electrical angle; what is missing from 360° is the gap, whose middle is shaft angle 0.
        electrical_angle_deg: Quantity = 180.0..=359.0,
        /// Voltage across the element (its supply).
        supply_v: Quantity = 0.5..=24.0,
        /// Full width of the hysteresis of the wiper.
        hysteresis_deg: Quantity = 0.0..=30.0,
        /// What the wiper shows in the gap.
        in_gap: InGap,
        /// The converter behind it.
        adc: Adc,
        /// What `scram identify potentiometer` found; missing for an uncalibrated sensor.
        correction: Option<Correction>,
        /// A second potentiometer on the same shaft, whose gap lies where this one sees.
        second: Option<SecondPotentiometer>,
    }
}

table! {
    /// `[sensor.second]`: what is left out is as in `[sensor]`, but for the correction, which is every part's own.
    pub struct SecondPotentiometer {
        /// Middle of its gap on the shaft, from the middle of the first one's, counter-clockwise. The range is how exactly the
        /// two are mounted.
        offset_deg: Quantity = 90.0..=270.0,
        /// Electrical angle.
        electrical_angle_deg: Option<Quantity> = 180.0..=359.0,
        /// Voltage across the element (its supply).
        supply_v: Option<Quantity> = 0.5..=24.0,
        /// Full width of the hysteresis of the wiper.
        hysteresis_deg: Option<Quantity> = 0.0..=30.0,
        /// What the wiper shows in the gap.
        in_gap: Option<InGap>,
        /// The converter behind it.
        adc: Option<Adc>,
        /// What `scram identify potentiometer --sensor second` found, in angles from the middle of its own gap.
        correction: Option<Correction>,
    }
}

impl Potentiometer {
    /// The second potentiometer with everything that it takes from this one, in angles from the middle of its own gap.
    #[must_use]
    pub fn second_resolved(&self) -> Option<Self> {
        let second = self.second.as_ref()?;
        let or = |own: &Option<Quantity>, first: &Quantity| own.as_ref().unwrap_or(first).clone();
        Some(Self {
            electrical_angle_deg: or(&second.electrical_angle_deg, &self.electrical_angle_deg),
            supply_v: or(&second.supply_v, &self.supply_v),
            hysteresis_deg: or(&second.hysteresis_deg, &self.hysteresis_deg),
            in_gap: second.in_gap.unwrap_or(self.in_gap),
            adc: second.adc.as_ref().unwrap_or(&self.adc).clone(),
            correction: second.correction.clone(),
            second: None,
        })
    }
}

impl Adc {
    /// All conversions of a tick, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.conversions.value.round().max(1.0) * self.conversion_s.value
    }
}

/// What the reading does while the wiper is on insulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum InGap {
    /// Holds the last voltage and drifts.
    Hold,
    /// Uncorrelated codes over the full scale: the input floats.
    Random,
    /// Code 0: a resistor pulls the input to ground.
    Zero,
    /// Not known: one of the three, another one in every simulated robot.
    Any,
}

table! {
    /// `[sensor.adc]`
    pub struct Adc {
        /// Resolution.
        bits: Quantity = 4.0..=16.0,
        /// Voltage of the full scale of the ideal straight line.
        full_scale_v: Quantity = 0.1..=24.0,
        /// Reads zero below.
        zero_below_v: Quantity = 0.0..=5.0,
        /// Reads full scale above.
        saturates_above_v: Quantity = 0.1..=24.0,
        /// How much too low it reads in the straight part.
        low_reading_v: Quantity = -1.0..=1.0,
        /// Where the upper bend begins.
        bend_above_v: Quantity = 0.1..=24.0,
        /// Noise, standard deviation.
        noise_lsb: Quantity = 0.0..=500.0,
        /// Share of conversions that are spikes, 0 … 1.
        spike_share: Quantity = 0.0..=0.5,
        /// Size of a spike, standard deviation.
        spike_lsb: Quantity = 0.0..=4096.0,
        /// Integral nonlinearity, peak.
        inl_lsb: Quantity = 0.0..=200.0,
        /// Conversions per tick, of which the median is taken.
        conversions: Quantity = 1.0..=64.0,
        /// One conversion.
        conversion_s: Quantity = 1e-7..=1e-2,
        /// Standard deviation of the sampling instant.
        jitter_s: Quantity = 0.0..=1e-3,
    }
}

table! {
    /// `[sensor.correction]`: shaft angle from code, fitted on one constant-speed run.
    /// `φ = zero_deg + deg_per_code·c`, `θ = φ + Σ_k (cos_k cos kφ + sin_k sin kφ)`, where `c` is the code with the
    /// converter's nominal bends taken out ([`crate::angle_code::AdcCurve::straightened`]; in the straight part the code
    /// itself). [`crate::angle_code::corrected_angle`] evaluates it. At most 6 harmonics.
    pub struct Correction {
        /// φ at straightened code 0.
        zero_deg: f64 = -720.0..=720.0,
        /// Slope of the straight line, degrees per straightened code.
        deg_per_code: f64 = -90.0..=90.0,
        /// Cosine amplitudes of harmonics 1, 2, ….
        cos_deg: Vec<f64> = -30.0..=30.0,
        /// Sine amplitudes of harmonics 1, 2, ….
        sin_deg: Vec<f64> = -30.0..=30.0,
        /// The blind arc begins here (shaft angle, turning counter-clockwise into it; negative).
        blind_from_deg: f64 = -180.0..=0.0,
        /// The blind arc ends here (positive).
        blind_to_deg: f64 = 0.0..=180.0,
        /// RMS of what is left outside the arc.
        residual_deg: f64 = 0.0..=30.0,
        /// How it was made.
        source: String,
    }
}

impl Part for InGap {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Word(&["hold", "random", "zero", "any"])
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        let words = [("hold", Self::Hold), ("random", Self::Random), ("zero", Self::Zero), ("any", Self::Any)];
        read_word(reader, place, &words)
    }
}

impl Part for Sensor {
    type Spec = ();

    fn shape((): &()) -> Shape {
        Shape::Kinds(vec![
            ("ideal", Vec::new()),
            ("encoder", Encoder::fields()),
            ("potentiometer", Potentiometer::fields()),
        ])
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        #[derive(Clone, Copy)]
        enum Kind {
            Ideal,
            Encoder,
            Potentiometer,
        }
        const KINDS: [(&str, Kind); 3] =
            [("ideal", Kind::Ideal), ("encoder", Kind::Encoder), ("potentiometer", Kind::Potentiometer)];
        let path = place.field();
        let table = reader.need_table(place)?;
        let kind = Place { table, path: &path, key: "kind", meaning: "which kind of sensor" };
        match read_word(reader, &kind, &KINDS)? {
            Kind::Ideal => {
                reader.refuse_unknown(table, &path, &["kind"]);
                Some(Self::Ideal)
            }
            Kind::Encoder => Encoder::read_kind(reader, table, &path).map(Self::Encoder),
            Kind::Potentiometer => {
                Potentiometer::read_kind(reader, table, &path).map(|sensor| Self::Potentiometer(Box::new(sensor)))
            }
        }
    }
}
