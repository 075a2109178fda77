//! Findings in words, for people.

use std::f64::consts::TAU;

use robot_file::robot::Robot;

use super::explain::{Answer, Cause, Circumstances, Explanation};
use super::{Finding, Mend};

/// Another supply than the file's was measured.
pub fn supply(problem: String, robot: &Robot, mean_v: f64) -> Finding {
    let rail = &robot.supply.rail_v;
    let millivolts = (0.5 * rail.low..2.0 * rail.high).contains(&(mean_v / 1000.0));
    let value = if millivolts { mean_v / 1000.0 } else { mean_v };
    Finding {
        problem: "the measured supply is not the file's".to_owned(),
        evidence: problem,
        mends: vec![Mend {
            causes: vec![Cause::Supply(value)],
            words: format!("the rig has {value:.2} V"),
            change: match millivolts {
                true => "import it with --map supply=COLUMN:mV".to_owned(),
                false => line(robot, "supply.rail_v", value),
            },
            field: (!millivolts).then(|| "supply.rail_v".to_owned()),
        }],
        tell_apart: None,
    }
}

/// The angle counts against the drive.
pub fn reversed(evidence: String) -> Finding {
    Finding {
        problem: "the shaft turns against its drive: the sensor is the other way round, or the motor's leads are".to_owned(),
        evidence,
        mends: vec![Mend {
            causes: vec![Cause::ReversedSign],
            words: "angle and drive have opposite signs".to_owned(),
            change: "put - in front of the angle's column: scram import --map angle=-COLUMN:UNIT (column = \"-COLUMN\" in a \
                     mapping file), or negate angle_rad; where it is the motor's leads, of the drive's column: --map \
                     duty=-COLUMN:FULL_SCALE"
                .to_owned(),
            field: None,
        }],
        tell_apart: Some(
            "recordings count angle and drive positive counter-clockwise: whichever column does not is the one to negate"
                .to_owned(),
        ),
    }
}

/// What the runs do not show.
pub fn unchecked(answer: &Answer) -> Vec<String> {
    let mut words = Vec::new();
    if answer.speed.is_none() && answer.gain.is_none() {
        words.push("units, time base and motor: the drive hardly changes, or the shaft hardly turns; a run of duty steps would show them");
    } else if answer.damping.is_none() {
        words.push("the time base: the runs do not show how fast the shaft takes up its speed");
    }
    words.into_iter().map(str::to_owned).collect()
}

/// What stays unchecked where the answer is a rough one.
pub fn rough() -> String {
    "the time base: more than drive, damping and friction turns and brakes the shaft (a driver that takes some volts, say)".to_owned()
}

/// The answer is not the file's.
pub fn scales(answer: &Answer, at: &Circumstances, explanations: &[Explanation]) -> Finding {
    let mut mends: Vec<Mend> = explanations.iter().map(|one| mend(&one.causes, at.robot)).collect();
    if mends.is_empty() {
        mends.push(Mend {
            causes: vec![Cause::Recording],
            words: "no single mistake in units explains it".to_owned(),
            change: "name the robot file of this rig with --robot, or describe it with scram new-rig".to_owned(),
            field: None,
        });
    }
    let problem = match mends.as_slice() {
        [only] => only.words.clone(),
        _ => "the recording does not fit the robot file".to_owned(),
    };
    Finding { problem, evidence: evidence(answer, at), tell_apart: tell_apart(&mends), mends }
}

fn evidence(answer: &Answer, at: &Circumstances) -> String {
    let mut parts = Vec::new();
    let expected = &at.expected;
    if at.drive.is_beyond_duty {
        parts.push(format!("duty goes up to {:.4}, beyond 1", at.drive.largest));
    }
    // Of a drive in another unit the speed a volt says nothing to people.
    if let (Some(speed), false) = (answer.speed, at.drive.is_beyond_duty) {
        parts.push(format!(
            "a volt turns the shaft at {} rad/s, by the robot file at {} ({} … {})",
            figure(speed.value),
            figure(expected.speed().value),
            figure(expected.speed().low),
            figure(expected.speed().high)
        ));
    }
    if let Some(damping) = answer.damping {
        parts.push(format!(
            "it takes up its speed in {} s, by the robot file in {} s ({} … {})",
            figure(1.0 / damping.value),
            figure(1.0 / expected.damping().value),
            figure(1.0 / expected.damping().high),
            figure(1.0 / expected.damping().low)
        ));
    } else if let (Some(gain), None) = (answer.gain, answer.speed) {
        parts.push(format!(
            "a volt changes the speed by {} rad/s², by the robot file by {} ({} … {})",
            figure(gain.value),
            figure(expected.gain().value),
            figure(expected.gain().low),
            figure(expected.gain().high)
        ));
    }
    if at.rows_are_slow() {
        parts.push(format!("rows are {} s apart", figure(at.step)));
    }
    if let Some(turn) = at.turn.filter(|turn| (turn / TAU - 1.0).abs() > 0.01) {
        parts.push(format!("the angle is wrapped at {}", figure(turn)));
    }
    parts.join("; ")
}

/// Explanations and what to change, of which all of a set must be changed.
fn mend(causes: &[Cause], robot: &Robot) -> Mend {
    let said: Vec<(String, String, Option<String>)> = causes.iter().map(|cause| one(cause, robot)).collect();
    let join = |parts: Vec<String>| parts.join(", and ");
    Mend {
        causes: causes.to_vec(),
        words: join(said.iter().map(|one| one.0.clone()).collect()),
        change: join(said.iter().map(|one| one.1.clone()).collect()),
        field: said.into_iter().find_map(|one| one.2),
    }
}

/// A mistake in words, what to change, and the line of the robot file that changes.
fn one(cause: &Cause, robot: &Robot) -> (String, String, Option<String>) {
    let import = |words: String, change: String| (words, change, None);
    let file = |words: String, field: &str, value: f64| (words, line(robot, field, value), Some(field.to_owned()));
    match cause {
        Cause::AngleUnit(unit) => import(
            format!("the angle is in {}, not in radians", unit_words(unit)),
            format!("scram import --map angle=COLUMN:{unit}, or multiply angle_rad by {}", figure(unit_factor(unit))),
        ),
        Cause::AngleTwice(factor) => import(
            format!("the angle is in another unit than it was imported as: it reads {} times too large", figure(*factor)),
            format!("give its true unit: scram import --map angle=COLUMN:{}", unit_of_twice(*factor)),
        ),
        Cause::MotorSide => import(
            format!("the sensor is on the motor's shaft, before the gears of {}", figure(robot.motor.gear_ratio.value)),
            "divide the angle by motor.gear_ratio (of counts: --map angle=COLUMN:counts/N with N counts of a turn of the output \
             shaft)"
                .to_owned(),
        ),
        Cause::CountsPerTurn(factor) => import(
            format!("the sensor has {} times as many counts a turn as was said (all four edges count, or one)", figure(*factor)),
            format!("scram import --map angle=COLUMN:counts/N with {} times the N", figure(*factor)),
        ),
        Cause::SpeedInRpm => import(
            "the angle is the integral of a speed in rpm".to_owned(),
            "scram import --map speed=COLUMN:rpm".to_owned(),
        ),
        Cause::DutyFullScale(scale) if *scale == 100.0 => {
            import("the duty is in percent".to_owned(), "scram import --map duty=COLUMN:percent, or divide duty by 100".to_owned())
        }
        Cause::DutyFullScale(scale) => import(
            format!("the duty's full scale is {}, not 1", figure(*scale)),
            format!("scram import --map duty=COLUMN:FULL_SCALE, so that duty is divided by {}", figure(*scale)),
        ),
        Cause::DutyInVolts => import(
            "the drive is a voltage, not a duty".to_owned(),
            format!(
                "scram import --map voltage=COLUMN:V --supply {}, or call the column voltage_v if it was measured at the motor",
                figure(robot.supply.rail_v.value)
            ),
        ),
        Cause::VoltageIsDuty => import(
            "the drive is a duty, not a voltage".to_owned(),
            "scram import --map duty=COLUMN:1, or call the column duty".to_owned(),
        ),
        Cause::VoltageInMillivolts => import(
            "the voltage is in mV".to_owned(),
            "scram import --map voltage=COLUMN:mV, or divide voltage_v by 1000".to_owned(),
        ),
        Cause::TimeUnit(unit) => import(
            format!("the time is in {unit}, not in seconds"),
            format!("scram import --map time=COLUMN:{unit} (t_s is in seconds)"),
        ),
        Cause::ClockRate(factor) => import(
            format!("the times read {} times too long", figure(*factor)),
            format!(
                "scram import --rate with {} times the rows a second, or the time's true unit: --map time=COLUMN:UNIT",
                figure(*factor)
            ),
        ),
        Cause::Supply(volts) => file(format!("the supply has about {volts:.1} V"), "supply.rail_v", *volts),
        Cause::TorqueConstant(k) => {
            file(format!("it is another motor: K is about {} N·m/A", figure(*k)), "motor.torque_constant_nm_per_a", *k)
        }
        Cause::TimeConstant(seconds) => time_constant(robot, *seconds),
        Cause::ReversedSign | Cause::Recording => import("another rig".to_owned(), "name its robot file".to_owned()),
    }
}

/// The inertia that gives a mechanical time constant: of the load, or where that cannot be, of the rotor.
fn time_constant(robot: &Robot, seconds: f64) -> (String, String, Option<String>) {
    let motor = &robot.motor;
    let (rotor, load) = (motor.rotor_inertia_kg_m2.value, robot.load.inertia_kg_m2.value);
    let damping =
        motor.torque_constant_nm_per_a.value.powi(2) / motor.resistance_ohm.value + motor.viscous_nm_s_per_rad.value;
    let total = damping * seconds;
    let words = format!(
        "it takes up its speed in {} s: with the file's K and R rotor and load have about {} kg·m² together",
        figure(seconds),
        figure(total)
    );
    let (field, value) =
        if total > rotor { ("load.inertia_kg_m2", total - rotor) } else { ("motor.rotor_inertia_kg_m2", 0.5 * total) };
    let also = format!(
        " (or motor.resistance_ohm about {}; the file's inertia is {} kg·m²)",
        figure(seconds * motor.torque_constant_nm_per_a.value.powi(2) / (rotor + load)),
        figure(rotor + load)
    );
    (words, line(robot, field, value) + &also, Some(field.to_owned()))
}

/// A line of the robot file with another value.
fn line(robot: &Robot, field: &str, value: f64) -> String {
    format!("{field} = {{ value = {}, … }} in the robot file of `{}`", figure(value), robot.name)
}

fn tell_apart(mends: &[Mend]) -> Option<String> {
    if mends.len() < 2 {
        return None;
    }
    let has = |wanted: &dyn Fn(&Cause) -> bool| mends.iter().flat_map(|mend| &mend.causes).any(wanted);
    let angle = has(&|cause| {
        matches!(
            cause,
            Cause::AngleUnit(_) | Cause::AngleTwice(_) | Cause::MotorSide | Cause::CountsPerTurn(_) | Cause::SpeedInRpm
        )
    });
    let time = has(&|cause| matches!(cause, Cause::TimeUnit(_) | Cause::ClockRate(_)));
    let drive = has(&|cause| matches!(cause, Cause::DutyFullScale(_) | Cause::DutyInVolts | Cause::VoltageIsDuty));
    let mut ways = Vec::new();
    if angle {
        ways.push("turn the shaft by hand once round: angle_rad must change by 6.283");
    }
    if has(&|cause| matches!(cause, Cause::Supply(_))) {
        ways.push("measure the supply at the bridge");
    }
    if has(&|cause| matches!(cause, Cause::TorqueConstant(_))) {
        ways.push("count turns at full drive without load: K is about the voltage over that speed in rad/s");
    }
    if time {
        ways.push("compare the recording's length with a clock");
    }
    if drive {
        ways.push("look what the column says at full drive: duty must be 1 there");
    }
    Some(ways.join("; "))
}

/// A unit of `scram import` for people.
fn unit_words(unit: &str) -> String {
    match unit {
        "deg" => "degrees".to_owned(),
        "turns" => "turns".to_owned(),
        counts => format!("{} a turn", counts.replace('/', " of ").replace("counts of", "counts,")),
    }
}

/// Radians in a unit of `scram import`.
fn unit_factor(unit: &str) -> f64 {
    match unit {
        "deg" => TAU / 360.0,
        "turns" => TAU,
        counts => counts.split_once('/').and_then(|(_, n)| n.parse::<f64>().ok()).map_or(1.0, |n| TAU / n),
    }
}

/// The unit that an angle has which reads this many times too large by another one.
fn unit_of_twice(factor: f64) -> &'static str {
    if (factor - 360.0).abs() < 1e-9 {
        "deg (not turns)"
    } else if (factor - 1.0 / 360.0).abs() < 1e-9 {
        "turns (not deg)"
    } else {
        "rad"
    }
}

/// A number in three digits.
pub fn figure(value: f64) -> String {
    robot_file::unit::number(format!("{value:.2e}").parse().unwrap_or(value))
}
