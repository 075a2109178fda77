//! A running motor.

use std::f32::consts::FRAC_PI_2;
use std::time::Duration;

use control::protocol::radio::Reset;
use control::{Command, Stroke};

use super::{BARE, from_to};
use crate::bring_up::operator::{Act, Expected, Observation, Signal, number};
use crate::bring_up::rig::{Back, Halt, Rig};
use crate::bring_up::step::{Step, Wiring};
use link::Event;

const MINUTE: Duration = Duration::from_secs(60);
/// 7 Hz clockwise, rad/s.
const SEVEN_HZ: Command = Command::Speed { omega: -44.0 };
/// From standstill until it turns.
const STARTS: Duration = Duration::from_secs(2);
/// Times that the thesis's cell is asked for, and the stalled bridge in each direction.
const STARTS_ON_CELL: u32 = 20;
const STALLS: u32 = 10;

const MOTOR: Step = Step { wiring: Wiring::Motor, ..BARE };

pub const STEPS: &[Step] = &[
    Step {
        number: 52,
        title: "Brush noise",
        needs: "a hand at the shaft, and the console's recordings",
        about: "A minute at 7 Hz; then the shaft is turned by hand at duty 0.",
        run: brush_noise,
        ..MOTOR
    },
    Step {
        number: 53,
        title: "Reversal dips",
        needs: "an oscilloscope on 3.3 V and on EN",
        about: "A minute of swinging by a quarter turn.",
        run: reversals,
        ..MOTOR
    },
    Step {
        number: 54,
        title: "The radio beside a stalled bridge",
        needs: "a clamp for the mass",
        about: "The mass is held, and duty 1 is driven until the robot stops itself, in each direction.",
        run: beside_stall,
        ..MOTOR
    },
    Step {
        number: 55,
        title: "Start-up on a real cell",
        needs: "cells of the thesis's kind, charged and at 3.5 V, at 5 and at 25 °C; an oscilloscope on 3.3 V",
        about: "The robot is switched on and driven at 7 Hz from standstill, again and again.",
        run: starts,
        ..MOTOR
    },
];

fn no_fault(rig: &mut Rig, what: &str) {
    let fault = rig.fault();
    rig.check(what, format!("{fault:?}"), "no fault", fault.is_none());
}

fn brush_noise(rig: &mut Rig) -> Result<(), Halt> {
    rig.drive(SEVEN_HZ)?;
    let before = rig.next_status()?.counters;
    rig.run_for(MINUTE)?;
    let after = rig.next_status()?.counters;
    no_fault(rig, "a minute at 7 Hz");
    let (ticks, outliers) = (after.ticks - before.ticks, after.adc_outliers - before.adc_outliers);
    let share = 100.0 * f64::from(outliers) / f64::from(ticks.max(1));
    rig.check("outliers", number(share, "% of the ticks"), "below 1 %", share < 1.0);
    rig.stop()?;
    let text = "deviation of the codes around the estimate, driven less turned by hand";
    rig.observe(&from_to("noise", text, Signal::Other, -100.0, 5.0, "LSB")).map(drop)
}

fn reversals(rig: &mut Rig) -> Result<(), Halt> {
    // Beside the blind arc.
    let swing = Command::Oscillate { from: 1.0, to: 1.0 + FRAC_PI_2, style: Stroke::BangBang };
    let rest_mv = rig.telemetry().map_or(0, |batch| batch.battery_mv);
    rig.drive(swing)?;
    let mut least_mv = rest_mv;
    let length = MINUTE.min(rig.options.length);
    rig.shortened_to(length, MINUTE);
    rig.listen(length, |event| {
        if let Event::Telemetry(batch) = event {
            least_mv = least_mv.min(batch.battery_mv);
        }
        true
    })?;
    no_fault(rig, "a minute of swinging");
    let dip_mv = rest_mv - least_mv;
    rig.check("the cell's dip by telemetry", format!("{dip_mv} mV"), "below 300 mV", dip_mv < 300);
    rig.observe(&from_to("rail", "least voltage of the 3.3 V", Signal::Other, 3.0, 3.4, "V")).map(drop)
}

fn beside_stall(rig: &mut Rig) -> Result<(), Halt> {
    let bound_s = rig.bound("controller.supervisor.stall_bound_s")?;
    rig.act(Act::HoldShaft(true))?;
    let sent = rig.next_status()?.counters.sent;
    let missing = rig.session.robot(rig.robot).missing();
    let times = STALLS.min(rig.options.repeats);
    let (mut not_found, mut slowest_s) = (0, 0.0_f64);
    for _ in 0..times {
        for duty in [1.0, -1.0] {
            rig.drive(Command::Duty { duty })?;
            match rig.await_fault(STARTS)? {
                Some((_, after)) => slowest_s = slowest_s.max(after.as_secs_f64()),
                None => not_found += 1,
            }
        }
    }
    rig.check("stalls that were not found", not_found.to_string(), "0", not_found == 0);
    let expected = format!("at most {bound_s:.2} s, and its telling");
    rig.check("the slowest", number(slowest_s, "s"), &expected, slowest_s <= bound_s + 0.1);
    let lost = rig.session.robot(rig.robot).missing() - missing;
    let sent = rig.next_status()?.counters.sent.wrapping_sub(sent);
    let found = format!("{lost} of {sent}");
    let good = lost as f64 <= 0.05 * f64::from(sent);
    rig.check("the robot's messages that were lost meanwhile", found, "below 5 %", good);
    rig.act(Act::HoldShaft(false))
}

fn starts(rig: &mut Rig) -> Result<(), Halt> {
    let times = STARTS_ON_CELL.min(rig.options.repeats);
    for turn in 1..=times {
        let since = rig.session.now();
        rig.act(Act::PowerCycle)?;
        let back = rig.back(since, STARTS)?;
        if back != Back::Booted(Reset::PowerOn) {
            rig.must_boot(back, Reset::PowerOn, "it did not start anew");
            return Err(Halt::Noted);
        }
        rig.drive(SEVEN_HZ)?;
        rig.listen(STARTS, |_| true)?;
        no_fault(rig, &format!("start {turn} of {times}"));
    }
    let expected = Expected::Number("V");
    rig.observe(&Observation { key: "dip", text: "deepest dip of the 3.3 V", signal: Signal::Other, expected })
        .map(drop)
}
