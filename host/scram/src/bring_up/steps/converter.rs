//! The converter.

use std::time::Duration;

use control::protocol::radio::Status;

use super::{BARE, from_to};
use crate::bring_up::Chip;
use crate::bring_up::operator::{Act, Expected, Observation, Seen, Signal, number};
use crate::bring_up::rig::{CONSTANT_V, Halt, Rig};
use crate::bring_up::step::{Step, Wiring};
use link::Event;

/// Long traffic.
const TEN_MINUTES: Duration = Duration::from_secs(600);
const HOUR: Duration = Duration::from_secs(3600);
/// Codes are averaged over this time.
const AVERAGE: Duration = Duration::from_millis(500);
/// Farther from the mean than noise and spikes of a median are, LSB.
const JUMP_LSB: f64 = 100.0;

const CONSTANT: Step = Step { wiring: Wiring::Constant, needs: "a battery of 1.65 V, or a quiet supply", ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 14,
        title: "Codes",
        needs: "a laboratory supply and a voltmeter on the wiper's pin",
        about: "Ten voltages on the wiper's pin; telemetry says what the converter makes of them.",
        run: codes,
        ..BARE
    },
    Step {
        number: 15,
        title: "C3: upper end",
        chip: Some(Chip::Esp32c3),
        needs: "a laboratory supply and a voltmeter on the wiper's pin",
        about: "The voltage at which the code reaches 4095 is noted, for saturates_above_v of a robot file.",
        run: |rig| {
            let text = "lowest voltage with code 4095 (`scram console` shows the code)";
            let expected = Expected::Between(2.4, 3.3, "V");
            rig.observe(&Observation { key: "saturates-above", text, signal: Signal::Other, expected }).map(drop)
        },
        ..BARE
    },
    Step {
        number: 16,
        title: "Noise and outliers with the radio on",
        about: "A constant voltage on the wiper's pin during the long traffic.",
        run: noise,
        ..CONSTANT
    },
    Step {
        number: 17,
        title: "One conversion takes 37 µs",
        needs: "an oscilloscope, and the LED toggled around `Converter::angle`",
        about: "The time of a conversion is measured.",
        run: |rig| rig.observe(&from_to("us", "one conversion", Signal::Conversion, 20.0, 45.0, "us")).map(drop),
        ..BARE
    },
    Step {
        number: 18,
        title: "Battery",
        needs: "a voltmeter at the cell",
        about: "Telemetry's voltage of the cell beside the voltmeter's.",
        run: battery,
        ..BARE
    },
    Step {
        number: 19,
        title: "C3: conversions beside the radio",
        chip: Some(Chip::Esp32c3),
        about: "An hour of traffic at a constant voltage: no loss of range, no jumps.",
        run: |rig| beside_radio(rig, HOUR),
        ..CONSTANT
    },
];

/// The mean code over a while.
fn mean_code(rig: &mut Rig) -> Result<Option<f64>, Halt> {
    // What is on its way was converted before.
    rig.listen(AVERAGE / 2, |_| true)?;
    let (mut sum, mut count) = (0.0, 0.0);
    rig.listen(AVERAGE, |event| {
        if let Event::Telemetry(batch) = event {
            for row in &batch.rows {
                sum += f64::from(row.code);
                count += 1.0;
            }
        }
        true
    })?;
    Ok((count > 0.0).then(|| sum / count))
}

fn codes(rig: &mut Rig) -> Result<(), Halt> {
    let Some(curve) = rig.options.curve else {
        return Err(rig.skip("the codes", "the robot file has no potentiometer with a converter"));
    };
    let share = if rig.options.chip == Chip::Esp32c3 { 0.01 } else { 0.02 };
    let tolerance = share * curve.top_code;
    let mut before: Option<f64> = None;
    for volt in [0.0, 0.20, 0.50, 1.00, 1.65, 2.20, 2.50, 2.80, 3.00, 3.30] {
        rig.act(Act::Wiper(Some(volt)))?;
        let Some(code) = mean_code(rig)? else { return Err(rig.skip("the codes", "no telemetry came")) };
        let expected = curve.code(volt);
        let what = format!("code at {volt:.2} V");
        let range = format!("{expected:.0} ± {tolerance:.0}");
        rig.check(&what, format!("{code:.0}"), &range, (code - expected).abs() <= tolerance);
        if let Some(before) = before
            && expected < curve.top_code
        {
            rig.check(
                &format!("{what} above the one before"),
                number(code - before, "LSB"),
                "more than 0",
                code > before,
            );
        }
        before = Some(code);
    }
    rig.act(Act::Wiper(None))
}

fn noise(rig: &mut Rig) -> Result<(), Halt> {
    let traffic = rig.traffic(TEN_MINUTES)?;
    if let Some(deviation) = traffic.deviation() {
        // A converter without any noise is stuck.
        let good = deviation > 0.0 && deviation <= 15.0;
        rig.check("standard deviation of the codes", number(deviation, "LSB"), "above 0, at most 15 LSB", good);
    }
    let ticks = traffic.counted(|status: &Status| status.counters.ticks);
    let outliers = traffic.counted(|status: &Status| status.counters.adc_outliers);
    if let (Some(ticks @ 1..), Some(outliers)) = (ticks, outliers) {
        let share = 100.0 * f64::from(outliers) / f64::from(ticks);
        rig.check("outliers", number(share, "% of the ticks"), "below 1 %", share < 1.0);
    }
    Ok(())
}

fn battery(rig: &mut Rig) -> Result<(), Halt> {
    let observation = Observation {
        key: "cell",
        text: "the cell by the voltmeter",
        signal: Signal::Cell,
        expected: Expected::Number("V"),
    };
    let Seen::Value(volt) = rig.observe(&observation)? else { return Ok(()) };
    let told = rig.telemetry().map_or(0.0, |batch| f64::from(batch.battery_mv) * 1e-3);
    let range = format!("{:.2} … {:.2} V", 0.95 * volt, 1.05 * volt);
    rig.check("the cell by telemetry", number(told, "V"), &range, (told - volt).abs() <= 0.05 * volt);
    Ok(())
}

/// Also the ESP32's, whose radio switches the converter's power.
pub fn beside_radio(rig: &mut Rig, length: Duration) -> Result<(), Halt> {
    let traffic = rig.traffic(length)?;
    if let Some(weaker) = traffic.weaker() {
        rig.check("signal, weaker than at the beginning by", number(weaker, "dB"), "at most 3 dB", weaker <= 3.0);
    }
    if let Some(farthest) = traffic.farthest() {
        let what = format!("farthest code from the mean at {CONSTANT_V} V");
        rig.check(&what, number(farthest, "LSB"), "at most 100 LSB", farthest <= JUMP_LSB);
    }
    Ok(())
}
