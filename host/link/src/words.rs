//! What the robot says, in words for a person at a bench.

use std::time::Duration;

use control::protocol::dongle::Address;
use control::protocol::radio::{Reset, Source};
use control::{Field, Refusal, State};

use super::{Outcome, Robot};
use common::conventions;
use recording::fault;

/// `7c:df:a1:00:11:22`
#[must_use]
pub fn address(address: &Address) -> String {
    address.map(|byte| format!("{byte:02x}")).join(":")
}

/// Reads an address: six bytes in hexadecimal, with `:` or `-` between.
///
/// # Errors
/// What was expected.
pub fn parse_address(text: &str) -> Result<Address, String> {
    let byte = |part: &str| {
        let plain = part.len() == 2 && part.bytes().all(|digit| digit.is_ascii_hexdigit());
        if plain { u8::from_str_radix(part, 16).ok() } else { None }
    };
    let bytes: Option<Vec<u8>> = text.split([':', '-']).map(byte).collect();
    bytes
        .and_then(|bytes| Address::try_from(bytes).ok())
        .ok_or_else(|| format!("`{text}` is no address; expected are six bytes, e.g. 7c:df:a1:00:11:22"))
}

/// Why it started.
#[must_use]
pub fn reset(reset: Reset) -> &'static str {
    match reset {
        Reset::PowerOn => "power-on or reset button",
        Reset::External => "reset by a computer on its USB",
        Reset::Software => "restart by its firmware",
        Reset::Radio => "restart by its firmware (its radio sent nothing any more)",
        Reset::Panic => "panic in its firmware",
        Reset::Watchdog => "watchdog (its control loop hung)",
        Reset::BrownOut => "brown-out (its supply broke down)",
        Reset::Other => "a start for another reason",
    }
}

/// Where its parameters come from.
#[must_use]
pub fn source(source: Source) -> &'static str {
    match source {
        Source::Factory => "built in",
        Source::Stored => "stored in its flash",
        Source::FactoryOtherVersion => "built in (those in flash are of another firmware or robot file)",
        Source::FactoryDamaged => "built in (those in flash are damaged)",
    }
}

/// What a robot does.
#[must_use]
pub fn state(state: State) -> &'static str {
    match state {
        State::Idle => "idle",
        State::Speed => "speed",
        State::Oscillate => "oscillate",
        State::Position => "position",
        State::Duty => "duty",
        State::Coast => "coast",
        State::Gait => "gait",
        State::Fault => "FAULT",
    }
}

/// Why it says no.
#[must_use]
pub fn refusal(refusal: Refusal) -> String {
    match refusal {
        Refusal::Faulted(cause) => format!("it has stopped itself: {}; `clear` first", fault(cause).0),
        Refusal::CausePersists(cause) => format!("the cause of its fault is still there: {}", fault(cause).0),
        Refusal::OutOfRange { name, value, low, high } => {
            let (what, unit, scale) = as_typed(name);
            // The thesis's sign turns the order of the ends round.
            let ends = [f64::from(low) * scale, f64::from(high) * scale];
            let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            let value = f64::from(value) * scale;
            format!("{what} must be from {low:.4} to {high:.4}{unit}, not {value:.4}")
        }
        other => other.to_string(),
    }
}

/// A field of a command as a person types it: its name, its unit, and the factor from SI.
fn as_typed(field: Field) -> (&'static str, &'static str, f64) {
    let degrees = 1_f64.to_degrees();
    match field {
        Field::Omega => ("the frequency", " Hz", conventions::frequency_from_omega(1.0)),
        Field::OmegaMagnitude => ("the frequency's magnitude", " Hz", conventions::frequency_from_omega(1.0).abs()),
        Field::From => ("the lower angle", " deg", degrees),
        Field::To => ("the upper angle", " deg", degrees),
        Field::Span => ("the stroke", " deg", degrees),
        Field::Angle => ("the angle", " deg", degrees),
        Field::Duty => ("the duty", "", 1.0),
        Field::GaitSpeed => ("the gait's frequencies", " Hz", conventions::frequency_from_omega(1.0).abs()),
        Field::GaitTable => {
            ("the gait's different frequencies, and its different oscillations counted twice,", "", 1.0)
        }
        Field::GaitStep => ("the gait's step, an index into its frequencies and oscillations,", "", 1.0),
        Field::GaitSteps => ("the number of the gait's steps", "", 1.0),
        Field::GaitInterval => ("the gait's interval", " s", 1.0),
    }
}

/// How a command ended.
#[must_use]
pub fn outcome(outcome: Outcome) -> String {
    match outcome {
        Outcome::Done(_) => "done".into(),
        Outcome::Refused(why) => format!("refused: {}", refusal(why)),
        Outcome::TooLate => "refused: it came too late".into(),
        Outcome::Unanswered => "no answer: the robot is told to stop".into(),
        Outcome::Absent => "not sent: the robot does not answer".into(),
        Outcome::Overtaken => "given up for the stop".into(),
    }
}

/// A robot in two lines: who and where, and how it started and what it has stored.
#[must_use]
pub fn robot(robot: &Robot, now: Duration) -> [String; 2] {
    let mut who = format!("{} at {}", robot.name(), address(&robot.address()));
    if let Some(rssi) = robot.quality(now).rssi_dbm {
        who += &format!(", {rssi} dBm");
    }
    if let Some(batch) = robot.telemetry()
        && batch.battery_mv > 0
    {
        who += &format!(", battery {:.2} V", f64::from(batch.battery_mv) / 1e3);
    }
    let how = robot.status().map_or_else(
        || "it has not told its status yet".to_owned(),
        |status| {
            let up = robot.uptime().unwrap_or_default().as_secs();
            let injectable = if status.injectable { "; FAULT INJECTION BUILT IN" } else { "" };
            let gait = status.gait.map_or_else(String::new, |label| format!("; gait {} stored", label.name));
            let (reset, source) = (reset(status.reset), source(status.parameters));
            format!("up {up} s since {reset}; parameters {source}{gait}{injectable}")
        },
    );
    [who, how]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refused_frequency_is_told_in_hertz_with_the_sign_of_who_typed_it() {
        let omega = |hz: f64| conventions::omega_from_frequency(hz) as f32;
        let said = refusal(Refusal::OutOfRange {
            name: Field::Omega,
            value: omega(99.0),
            low: omega(12.0),
            high: omega(-12.0),
        });
        assert_eq!(said, "the frequency must be from -12.0000 to 12.0000 Hz, not 99.0000");
    }

    #[test]
    fn addresses_are_read_as_they_are_written() {
        let one = [0x7c, 0xdf, 0xa1, 0x00, 0x11, 0xff];
        assert_eq!(address(&one), "7c:df:a1:00:11:ff");
        assert_eq!(parse_address("7c:df:a1:00:11:ff"), Ok(one));
        assert_eq!(parse_address("7C-DF-A1-00-11-FF"), Ok(one));
        for wrong in ["", "7c:df:a1:00:11", "7c:df:a1:00:11:ff:00", "7c:df:a1:00:11:+f", "7c:df:a1:00:11:fff", "é:1"] {
            assert!(parse_address(wrong).is_err(), "{wrong}");
        }
    }
}
