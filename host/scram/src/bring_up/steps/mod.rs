//! The steps, one file for each section of `firmware/UNVERIFIED.md`.

mod bridge;
mod broken_radio;
mod converter;
mod dongle;
mod esp32;
mod flash;
mod injected;
mod motor;
mod pairing;
mod pwm;
mod radio;
mod robot;
mod start;
mod time;

use super::operator::{Expected, Observation, Signal};
use super::rig::{Halt, Rig};
use super::step::{Step, Wiring};

/// Every step, in the order of their numbers.
pub fn all() -> impl Iterator<Item = &'static Step> {
    let mut steps: Vec<&Step> = [
        start::STEPS,
        bridge::STEPS,
        injected::STEPS,
        robot::STEPS,
        motor::STEPS,
        broken_radio::STEPS,
        converter::STEPS,
        pwm::STEPS,
        time::STEPS,
        radio::STEPS,
        pairing::STEPS,
        flash::STEPS,
        dongle::STEPS,
        esp32::STEPS,
    ]
    .into_iter()
    .flatten()
    .collect();
    steps.sort_by_key(|step| step.number);
    steps.into_iter()
}

/// A step on any chip, motor unplugged.
const BARE: Step =
    Step { number: 0, title: "", chip: None, wiring: Wiring::Bare, needs: "", about: "", run: |_| Ok(()) };

/// A question to be answered with yes.
const fn is(key: &'static str, text: &'static str, signal: Signal) -> Observation {
    Observation { key, text, signal, expected: Expected::Yes }
}

/// A question to be answered with a number.
const fn from_to(
    key: &'static str,
    text: &'static str,
    signal: Signal,
    low: f64,
    high: f64,
    unit: &'static str,
) -> Observation {
    Observation { key, text, signal, expected: Expected::Between(low, high, unit) }
}

/// Only questions.
fn ask(rig: &mut Rig, observations: &[Observation]) -> Result<(), Halt> {
    observations.iter().try_for_each(|observation| rig.observe(observation).map(drop))
}

const EN_FALLS: &str = "from the LED's falling edge to EN's last falling edge";
const EN_LOW: &str = "EN low all the time, no pulse above 0.8 V";
