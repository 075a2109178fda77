//! A simulated board and a simulated person beside it: the same shell code, injection included, and pins that can be read.

use std::time::Duration;

use control::protocol::radio::Reset;
use control::protocol::secure::Nonce;
use hal_sim::Fault;
use hal_sim::adc::Adc;
use miette::{Report as Trouble, miette};
use robot_file::Robot;
use robot_file::robot::Sensor;
use shell::pwm::{Wires, slow_decay};
use testbed::bench::Bench;
use testbed::event_log::{Detail, Event, actuations, driven};
use testbed::host_end::HostEnd;
use testbed::injected_event::InjectedEvent;
use testbed::setup::{DONGLE, Setup, address, pairing};

use super::operator::{Act, Input, Keep, Observation, Operator, Seen, Signal};
use super::report::Report;
use super::step::{Checked, Step};
use super::{Options, walk};
use link::{Keys, KnownRobot, Line, LinkError, Session};

/// A dongle and a robot on the bench answer within this time.
const PATIENCE: Duration = Duration::from_secs(3);
/// Two of the LED's longest patterns.
const PATTERNS: Duration = Duration::from_secs(14);
/// Flashes are 0.4 s apart, patterns 1.2 s and more.
const PAUSE_US: u64 = 800_000;
/// Steps of a PWM period.
const STEPS: u16 = 2048;

/// Brings a simulated board up. `prepare` changes it first, `ended` hears of every step.
///
/// # Errors
/// The robot file makes no bench.
pub fn simulate(
    robot: &Robot,
    options: &Options,
    seed: u64,
    prepare: impl FnOnce(&mut Setup),
    ended: &mut dyn FnMut(&Checked),
) -> Result<Report, Trouble> {
    let mut setup = Setup::new(robot, 1, seed).map_err(|error| miette!("{error}"))?;
    setup.detail = Detail::Pins;
    setup.robots[0].injectable = true;
    prepare(&mut setup);
    let known = KnownRobot { name: robot.name.clone(), address: address(0), pairing: pairing(DONGLE, seed, 0) };
    let keys = Keys::of(known.pairing.primary, vec![known]);
    let line = HostEnd::new(Bench::new(setup));
    let adc = match &robot.sensor {
        Sensor::Potentiometer(sensor) => Some(Adc::new(&sensor.adc, seed)),
        Sensor::Ideal | Sensor::Encoder(_) => None,
    };
    let mut operator = Simulated { line: line.clone(), adc, ended };
    let mut next = seed;
    let nonces = Box::new(move || {
        next = next.wrapping_add(1);
        Nonce(next.to_le_bytes())
    });
    let line: Box<dyn Line> = Box::new(line);
    let mut session = Session::open(line, &keys, nonces, PATIENCE)?;
    let found = session.find(None, PATIENCE)?;
    Ok(walk(session, found, &mut operator, options))
}

/// The person.
struct Simulated<'e> {
    line: HostEnd,
    adc: Option<Adc>,
    ended: &'e mut dyn FnMut(&Checked),
}

impl Simulated<'_> {
    fn apply(&self, injected_event: InjectedEvent) {
        self.line.bench().apply(injected_event);
    }

    fn off_and_on(&self, off: Duration, reset: Reset) {
        self.apply(InjectedEvent::PowerCut(0));
        self.line.wait(off);
        self.apply(InjectedEvent::Boot(0, reset));
    }

    /// Breaks something of the robot, or mends it.
    fn fault(&self, fault: Option<Fault>) {
        self.line.bench().robots[0].plant(|plant| {
            plant.advance();
            match fault {
                Some(fault) => plant.robot.inject(fault),
                None => plant.robot.mend(),
            }
        });
    }

    fn signal(&self, signal: Signal) -> Seen {
        let bench = self.line.bench();
        let robot = &bench.robots[0];
        let events = robot.event_log.events();
        match signal {
            Signal::EnableAfterMark => after_mark(&events),
            Signal::EnableLow => Seen::Is(driven(&events).is_empty()),
            Signal::InputsLow => Seen::Is(actuations(&events).all(|(_, told)| {
                let Wires { in1, in2, .. } = slow_decay(told, STEPS);
                in1 == 0 && in2 == 0
            })),
            Signal::EnablePulse => {
                let now_us = bench.now_us();
                let lengths = driven(&events).into_iter().map(|(on, off)| off.unwrap_or(now_us) - on);
                Seen::Value(lengths.max().unwrap_or_default() as f64 * 1e-6)
            }
            Signal::Share(input) => {
                let Wires { in1, in2, .. } = slow_decay(robot.actuation(), STEPS);
                let high = if input == Input::In1 { in1 } else { in2 };
                Seen::Value(100.0 * f64::from(high) / f64::from(STEPS))
            }
            Signal::CounterClockwise => Seen::Is(robot.truth().speed > 1.0),
            Signal::Cell => Seen::Value(robot.truth().battery_v),
            Signal::Conversion => Seen::Value(robot.plant(|plant| plant.conversion_us) as f64),
            Signal::Flashes => flashes(&events),
            Signal::Other => Seen::Nothing("the simulated board has nothing of this".into()),
        }
    }
}

/// From the mark to the bridge's last opening; none where it is still on.
fn after_mark(events: &[(u64, Event)]) -> Seen {
    let mark = events.iter().find(|(_, event)| *event == Event::Injected).map(|(at_us, _)| *at_us);
    match (mark, driven(events).last()) {
        (None, _) => Seen::Nothing("no fault began".into()),
        (Some(_), None) => Seen::Nothing("the bridge was not on".into()),
        (Some(_), Some((_, None))) => Seen::Value(f64::INFINITY),
        (Some(mark), Some((_, Some(off)))) => Seen::Value((*off as f64 - mark as f64) * 1e-3),
    }
}

/// Flashes between two pauses.
fn flashes(events: &[(u64, Event)]) -> Seen {
    let lit: Vec<u64> =
        events.iter().filter(|(_, event)| *event == Event::Lit(true)).map(|(at_us, _)| *at_us).collect();
    let ends: Vec<usize> = (1..lit.len()).filter(|index| lit[*index] - lit[index - 1] > PAUSE_US).collect();
    match ends.as_slice() {
        [first, second, ..] => Seen::Value((second - first) as f64),
        _ => Seen::Value(0.0),
    }
}

impl Operator for Simulated<'_> {
    fn begin(&mut self, _: &Step, _: &mut Keep) -> Result<bool, LinkError> {
        Ok(true)
    }

    fn act(&mut self, act: Act, _: bool, _: &mut Keep) -> Result<bool, LinkError> {
        let second = Duration::from_secs(1);
        match act {
            Act::PowerCycle | Act::HoldReset => self.off_and_on(second, Reset::PowerOn),
            Act::ResetButton => self.apply(InjectedEvent::Boot(0, Reset::PowerOn)),
            Act::UsbReset => self.apply(InjectedEvent::Boot(0, Reset::External)),
            Act::Halt => self.apply(InjectedEvent::Busy(0, 2_000_000)),
            Act::BrownOut => self.off_and_on(second / 10, Reset::BrownOut),
            Act::Motor(plugged) => self.fault((!plugged).then_some(Fault::MotorOpen)),
            Act::HoldShaft(held) => self.fault(held.then_some(Fault::Stalled)),
            Act::WiperLead(on) => self.fault((!on).then_some(Fault::SensorOpen)),
            Act::Cell(volt) => self.fault(volt.map(|open_circuit_v| Fault::BatteryLow { open_circuit_v })),
            Act::Wiper(volt) => {
                let Some(adc) = &self.adc else { return Ok(false) };
                let supply = volt.map(|volt| (volt, adc.clone()));
                self.line.bench().robots[0].plant(|plant| plant.supply(supply));
            }
        }
        Ok(true)
    }

    fn arm(&mut self) {
        drop(self.line.bench().robots[0].event_log.take());
    }

    fn observe(&mut self, _: u16, observation: &Observation, keep: &mut Keep) -> Result<Seen, LinkError> {
        if observation.signal == Signal::Flashes {
            let end = self.line.now() + PATTERNS;
            while self.line.now() < end {
                keep()?;
            }
        }
        Ok(self.signal(observation.signal))
    }

    fn silence(&mut self, time: Duration) {
        self.line.wait(time);
    }

    fn ended(&mut self, step: &Checked) {
        (self.ended)(step);
    }
}
