//! Controller and simulated robot without a shell: what `scram sim` does.

use control::protocol::radio::{Downlink, PackedTick, Request};
use control::{Actuation, Command, Controller, Telemetry};
use hal_sim::SimulatedRobot;

use super::Run;
use testbed::event_log::Event;

/// A tick of the loop without tasks.
pub struct PlainTick {
    /// Time of its sample, µs.
    pub time_us: u64,
    /// What the bridge was told.
    pub actuation: Actuation,
    /// What the controller said.
    pub telemetry: Telemetry,
    /// As telemetry over the radio has it, without the time since the row before.
    pub row: PackedTick,
}

/// A conversion's duration, µs.
const CONVERSION_US: u64 = 37;

/// What the receiving task took, and when.
pub fn heard(run: &Run) -> Vec<(u64, Downlink)> {
    let order = |payload: &[u8]| run.said.iter().find(|said| said.frame == payload).map(|said| said.order);
    let taken = run.events.iter();
    taken
        .filter_map(|(at, event)| match event {
            Event::Heard { payload, .. } => order(payload).map(|order| (*at, order)),
            _ => None,
        })
        .collect()
}

/// A command is served before the first tick that begins after its arrival; one that was served before does nothing. A
/// heartbeat is as old as what the console had heard. The middle of a tick's conversions is `middle_us` after its beginning.
pub fn plain(
    mut controller: Controller,
    mut robot: SimulatedRobot,
    middle_us: u64,
    heard: &[(u64, Downlink)],
    ticks: u64,
) -> Vec<PlainTick> {
    let mut heard = heard.iter().enumerate().peekable();
    let mut served = None;
    let tick = |index| {
        let mut sample = robot.sample();
        // Three conversions about the sample's time, and one of the cell.
        let served_us = (2 * (sample.time_us + middle_us) + 1).saturating_sub(1000 * index) + CONVERSION_US;
        sample.time_us += middle_us;
        while let Some((place, (at_us, order))) = heard.next_if(|(_, (at_us, _))| *at_us < sample.time_us) {
            if place == 0 {
                let _ = controller.command(Command::Idle, *at_us);
            }
            if let Downlink::Heartbeat { heard_ms: Some(heard_ms) } = order {
                let age_ms = index as u32 - heard_ms.min(&(index as u32));
                if *heard_ms <= index as u32 {
                    controller.heartbeat(served_us - 1000 * u64::from(age_ms));
                }
            }
            if let Downlink::Request(wanted) = order
                && served.replace(wanted.number) != Some(wanted.number)
                && let Request::Command(command) = wanted.request
            {
                let _ = controller.command(command, *at_us);
            }
        }
        let actuation = controller.tick(&sample);
        robot.advance(actuation);
        let telemetry = controller.telemetry();
        let row = PackedTick::new(sample.angle, &telemetry).with_second(sample.second);
        PlainTick { time_us: sample.time_us, actuation, telemetry, row }
    };
    (0..ticks).map(tick).collect()
}
