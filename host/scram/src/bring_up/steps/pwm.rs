//! The bridge's PWM.

use std::time::Duration;

use control::Command;

use super::{BARE, from_to, is};
use crate::bring_up::operator::{Input, Observation, Signal};
use crate::bring_up::rig::{Halt, Rig};
use crate::bring_up::step::{Step, Wiring};
use link::Event;

const SCOPE: &str = "an oscilloscope on IN1, IN2 and EN";

pub const STEPS: &[Step] = &[
    Step {
        number: 20,
        title: "20 kHz, 11 bit",
        needs: SCOPE,
        about: "Duty 0.5, then duty -0.25.",
        run: |rig| {
            at(rig, 0.5, &[HZ, share("half-in1", Input::In1, 50.0, 0.1), share("half-in2", Input::In2, 0.0, 0.0)])?;
            at(rig, -0.25, &[share("back-in1", Input::In1, 0.0, 0.0), share("back-in2", Input::In2, 25.0, 0.1)])
        },
        ..BARE
    },
    Step {
        number: 21,
        title: "Full and zero duty are constant",
        needs: SCOPE,
        about: "Duty 1 (a motor that is not there is a blocked one: it lasts for a fault's persistence), then duty 0.",
        run: |rig| {
            at(rig, 1.0, &[share("full-in1", Input::In1, 100.0, 0.0)])?;
            at(rig, 0.0, &[share("zero-in1", Input::In1, 0.0, 0.0), share("zero-in2", Input::In2, 0.0, 0.0)])
        },
        ..BARE
    },
    Step {
        number: 22,
        title: "No glitch when the duty changes",
        needs: "an oscilloscope on IN1, pulse-width trigger below 24 ns and above 50 us",
        about: "The motor swings for ten seconds.",
        run: swing,
        wiring: Wiring::Motor,
        ..BARE
    },
    Step {
        number: 23,
        title: "Direction",
        needs: "eyes on the shaft, from above",
        about: "Duty 1: the shaft turns counter-clockwise; otherwise swap the motor's wires.",
        run: direction,
        wiring: Wiring::Motor,
        ..BARE
    },
];

const HZ: Observation = from_to("hz", "frequency of IN1", Signal::Other, 19.99e3, 20.01e3, "Hz");

const fn share(key: &'static str, input: Input, percent: f64, tolerance: f64) -> Observation {
    let text = match input {
        Input::In1 => "share of the period that IN1 is high",
        Input::In2 => "share of the period that IN2 is high",
    };
    from_to(key, text, Signal::Share(input), percent - tolerance, percent + tolerance, "%")
}

fn at(rig: &mut Rig, duty: f32, observations: &[Observation]) -> Result<(), Halt> {
    rig.drive(Command::Duty { duty })?;
    super::ask(rig, observations)?;
    rig.stop()
}

fn swing(rig: &mut Rig) -> Result<(), Halt> {
    let stroke = Command::Oscillate { from: -1.5, to: 1.5, style: control::Stroke::BangBang };
    rig.drive(stroke)?;
    rig.listen(Duration::from_secs(10), |_| true)?;
    let fault = rig.fault();
    rig.check("the swinging", format!("{fault:?}"), "no fault", fault.is_none());
    rig.stop()?;
    rig.observe(&is("no-glitch", "no trigger but at a change of direction", Signal::Other)).map(drop)
}

fn direction(rig: &mut Rig) -> Result<(), Halt> {
    rig.drive(Command::Duty { duty: 1.0 })?;
    let mut speed = 0.0;
    rig.listen(Duration::from_secs(2), |event| {
        if let Event::Telemetry(batch) = event {
            speed = batch.rows.last().map_or(speed, |row| row.speed());
        }
        true
    })?;
    let fault = rig.fault();
    rig.check("the drive", format!("{fault:?}"), "no fault", fault.is_none());
    rig.check("speed by telemetry", format!("{speed:.1} rad/s"), "above 1 rad/s", speed > 1.0);
    rig.observe(&is("counter-clockwise", "it turns counter-clockwise from above", Signal::CounterClockwise)).map(drop)
}
