//! Any downlinks, parameters and samples at the controller.
//!
//! The bytes are operations: downlinks as the radio decodes them, values of any bits for any parameter, samples of any codes at
//! any time, and stretches of a shaft that turns, so that the controller comes to drive by its angle.

use std::path::Path;
use std::sync::LazyLock;

use control::parameters::table::TABLE;
use control::protocol::radio::{Downlink, Request};
use control::{AdcCode, Command, Controller, Gait, Parameters, Refusal, Sample, State};
use robot_file::Robot;
use robot_file::design::design;
use serde::Serialize;

use crate::bytes::Bytes;

/// Ticks of one input at most.
const MOST_TICKS: u32 = 4000;
const TICK_US: u64 = 1000;
/// Codes of the ADC (12 bits).
const CODES: u32 = 4096;

/// Factory parameters, designed from `robot.toml`.
pub static FACTORY: LazyLock<Parameters> = LazyLock::new(|| {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
    let robot = Robot::load(&file).expect("robot.toml is sound");
    design(&robot).expect("a controller for robot.toml").parameters
});

/// Runs the commands.
pub fn robot_commands(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let mut harness = ControllerHarness::new(&mut bytes);
    while harness.ticks < MOST_TICKS
        && let Some(command) = bytes.next()
    {
        harness.step(command, &mut bytes);
        assert_eq!(harness.controller.parameters().check(), Ok(()));
    }
}

/// A set, or anything no longer, with some of its bytes changed.
pub fn damaged(set: &impl Serialize, bytes: &mut Bytes) -> Vec<u8> {
    let mut buffer = [0; 2 * size_of::<Parameters>()];
    let mut set = postcard::to_slice(set, &mut buffer).expect("short").to_vec();
    for _ in 0..bytes.u8() % 8 {
        let index = bytes.below(set.len());
        set[index] = bytes.u8();
    }
    set
}

struct ControllerHarness {
    controller: Controller,
    time_us: u64,
    ticks: u32,
    code: u16,
}

impl ControllerHarness {
    fn new(bytes: &mut Bytes) -> Self {
        let selector = bytes.u8();
        let mut parameters = *FACTORY;
        if selector & 1 != 0
            && let Ok(read) = postcard::from_bytes::<Parameters>(&damaged(&*FACTORY, bytes))
        {
            assert_eq!(Controller::new(&read).err(), read.check().err());
            if read.check().is_ok() {
                parameters = read;
            }
        }
        let made =
            if selector & 2 == 0 { Controller::new(&parameters) } else { Controller::restarted(&parameters, &FACTORY) };
        Self { controller: made.expect("sound parameters"), time_us: 0, ticks: 0, code: 2000 }
    }

    fn step(&mut self, command: u8, bytes: &mut Bytes) {
        match command % 8 {
            0 | 1 => {
                if let Some(downlink) = bytes.message() {
                    self.obey(downlink);
                }
            }
            2 => {
                let value = bytes.f32();
                self.set(u16::from(bytes.u8()), value);
            }
            3 => {
                // Near its range, where the interesting values are.
                let index = bytes.u8();
                let Some(entry) = TABLE.get(usize::from(index)) else { return };
                let share = f32::from(bytes.u8()) / 255.0;
                self.set(u16::from(index), entry.low + share * (entry.high - entry.low));
            }
            4 => {
                self.time_us = self.time_us.wrapping_add(u64::from(bytes.u16()));
                self.tick(bytes.u16(), bytes.u16());
            }
            5 => {
                self.time_us = bytes.u64();
                self.tick(bytes.u16(), bytes.u16());
            }
            _ => self.turn(bytes),
        }
    }

    /// A shaft that turns evenly, and a good cell.
    fn turn(&mut self, bytes: &mut Bytes) {
        let (codes_a_tick, ticks) = (u32::from(bytes.u8()), bytes.u8());
        for _ in 0..ticks {
            let code = (u32::from(self.code) + codes_a_tick) % CODES;
            self.time_us = self.time_us.wrapping_add(TICK_US);
            self.tick(u16::try_from(code).expect("a code"), 2200);
            self.controller.heartbeat(self.time_us);
        }
    }

    fn obey(&mut self, downlink: Downlink) {
        match downlink {
            Downlink::Heartbeat { heard_ms } => {
                if let Some(heard_ms) = heard_ms {
                    self.controller.heartbeat(u64::from(heard_ms));
                }
            }
            Downlink::Stop => {
                let refused = self.controller.command(Command::Idle, self.time_us).is_err();
                let state = self.controller.state();
                assert!(!state.is_driving() && (!refused || state == State::Fault), "stopped, and yet {state:?}");
            }
            Downlink::Request(wanted) => match wanted.request {
                Request::Command(command) => drop(self.controller.command(command, u64::from(wanted.deadline_ms))),
                Request::Set { index, value } => self.set(index, value),
                Request::Get(index) => {
                    let value = control::parameters::table::get(self.controller.parameters(), index);
                    assert_eq!(value.is_some(), usize::from(index) < TABLE.len());
                }
                Request::KeepGait(gait) => self.keep_gait(&gait),
                // The first is the flash's business, the other no ordinary image's.
                Request::Save | Request::Inject(_) => {}
                Request::Factory => assert_eq!(self.controller.retune(&FACTORY, &FACTORY), Ok(())),
            },
        }
    }

    /// Whatever is in it: what is kept can be played, and what cannot be played is not kept.
    fn keep_gait(&mut self, gait: &Gait) {
        let (before, driving) = (self.controller.gait(), self.controller.state().is_driving());
        let parameters = self.controller.parameters();
        let can = gait.check(&parameters.limits, parameters.tick).is_ok() && !driving;
        assert_eq!(self.controller.keep_gait(gait).is_ok(), can);
        assert_eq!(self.controller.gait(), if can { Some(gait.label()) } else { before });
        if can {
            let told = self.controller.command(Command::Gait { id: gait.id() }, self.time_us);
            assert!(matches!(told, Ok(()) | Err(Refusal::Faulted(_) | Refusal::NotReady(_))), "{told:?}");
            assert_eq!(self.controller.state() == State::Gait, told.is_ok());
        }
    }

    fn set(&mut self, index: u16, value: f32) {
        let before = *self.controller.parameters();
        if let Ok(changed) = before.with(index, value) {
            let entry = &TABLE[usize::from(index)];
            assert!((entry.low..=entry.high).contains(&value), "{} was set to {value}", entry.name);
            assert_eq!(self.controller.retune(&changed, &FACTORY), Ok(()), "{} to {value}", entry.name);
        }
    }

    fn tick(&mut self, code: u16, battery: u16) {
        self.ticks += 1;
        self.code = code;
        let sample = Sample { time_us: self.time_us, angle: AdcCode(code), second: None, battery: AdcCode(battery) };
        let actuation = self.controller.tick(&sample);
        let state = self.controller.state();
        assert!(actuation.duty.is_finite() && actuation.duty.abs() <= 1.0, "{actuation:?} in {state:?}");
        assert!(state.is_driving() || !actuation.enable, "the bridge is on in {state:?}");
        let telemetry = self.controller.telemetry();
        assert_eq!((telemetry.state, telemetry.actuation), (state, actuation));
        assert_eq!(telemetry.fault.is_some(), state == State::Fault);
    }
}
