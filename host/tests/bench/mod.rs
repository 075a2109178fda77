//! A dongle and robots on a bench: the tasks of their firmware (`shell`) in virtual time, motor and sensor by `hal-sim`,
//! and between them a radio that loses messages and a serial line that breaks.

#![allow(dead_code, reason = "every test binary uses its own part of this")]

mod parts;
#[path = "../../../shell/tests/common/time.rs"]
mod time;

use std::cell::{Cell, RefCell};
use std::io::{self, ErrorKind, Read, Write};
use std::path::PathBuf;
use std::rc::Rc;
use std::time::Duration;

use control::protocol::dongle::{Address, ToDongle};
use control::protocol::frame::Deframer;
use control::protocol::radio::{Reset, Source, decode};
use control::{Actuation, Command, Controller, Fault, Parameters, State};
use description::Robot;
use hal_sim::SimulatedRobot;
use scram::link::Line;
use scram::recording::{AngleReading, Drive, Recording};
use shell::robot::{About, Parts, Settings, Shared, Shown, control_loop, led, receive, send};

use parts::{Air, Board, DarkLed, Motor, NoWatchdog, Port, Serial, powered};
use time::{World, now_us};

pub const DONGLE: Address = [0x24, 0x6f, 0x28, 0, 0, 1];
pub const ROBOT: Address = [0x7c, 0xdf, 0xa1, 0, 0x11, 0x22];
pub const OTHER: Address = [0x7c, 0xdf, 0xa1, 0, 0x11, 0x33];

/// The robot file of the project.
pub fn robot_file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../robot.toml")
}

/// What goes wrong. Times in ms since the start.
#[derive(Clone, Copy, Debug, Default)]
pub struct Trouble {
    /// Share of radio messages that are lost, either way.
    pub loss: f64,
    /// The robot's battery falls out.
    pub robot_dies: Option<u64>,
    /// The robot boots again, after a brown-out.
    pub robot_restarts: Option<u64>,
    /// The dongle's processor stands still.
    pub dongle_hangs: Option<u64>,
    /// Reading the line fails, writing does not.
    pub reading_breaks: Option<u64>,
    /// The dongle is pulled out.
    pub unplugged: Option<u64>,
    /// There is a second robot.
    pub second: bool,
}

/// Dongle, robots, and the time.
pub struct Bench {
    /// Every command as the host wrote it, with its time in ms.
    pub commands: Vec<(u64, Command)>,
    /// What goes wrong.
    pub trouble: Trouble,
    world: World<'static>,
    ms: u64,
    air: Air,
    serial: Rc<Serial>,
    motor: Rc<RefCell<Motor>>,
    shared: Rc<Shared>,
    robot_power: Rc<Cell<bool>>,
    dongle_power: Rc<Cell<bool>>,
    parameters: Parameters,
    name: String,
    deframer: Deframer,
    whispered: u16,
}

impl Bench {
    /// Everything switched on at once.
    pub fn new(robot: &Robot, seed: u64, trouble: Trouble) -> Self {
        let parameters = description::design::design(robot).expect("robot.toml has a controller").parameters;
        let mut world = World::new();
        let air = Air::new(seed, trouble.loss);
        let serial = Rc::new(Serial::new());
        let dongle_power = Rc::new(Cell::new(true));
        let (radio, port) = (air.join(DONGLE), Rc::clone(&serial));
        world.spawn(powered(&dongle_power, async move {
            let identity = shell::dongle::Identity { address: DONGLE, channel: 1 };
            let (receiver, sender) = radio;
            let shared = shell::dongle::Shared::new();
            shell::dongle::run(Port(Rc::clone(&port)), Port(port), receiver, sender, identity, &shared).await
        }));
        let motor = Rc::new(RefCell::new(Motor::new(SimulatedRobot::new(robot, seed))));
        let mut bench = Self {
            commands: Vec::new(),
            trouble,
            world,
            ms: 0,
            air,
            serial,
            motor: Rc::clone(&motor),
            shared: Rc::new(Shared::new()),
            robot_power: Rc::new(Cell::new(true)),
            dongle_power,
            parameters,
            name: robot.name.clone(),
            deframer: Deframer::default(),
            whispered: 0,
        };
        if trouble.second {
            let second = Rc::new(RefCell::new(Motor::new(SimulatedRobot::new(robot, seed + 1))));
            bench.switch_on(OTHER, &second, Reset::PowerOn);
        }
        (bench.robot_power, bench.shared) = bench.switch_on(ROBOT, &motor, Reset::PowerOn);
        bench
    }

    /// Boots a robot: its power switch and what its tasks share.
    fn switch_on(
        &mut self,
        address: Address,
        motor: &Rc<RefCell<Motor>>,
        reset: Reset,
    ) -> (Rc<Cell<bool>>, Rc<Shared>) {
        let power = Rc::new(Cell::new(true));
        let shared = Rc::new(Shared::new());
        let name = self.name.as_str().try_into().expect("a short name");
        let about = About { name, reset, parameters: Source::Factory };
        let name = about.name.clone();
        let settings = Settings { name, parameters: self.parameters, conversions: 1, outlier_lsb: 100 };
        let controller = Controller::restarted(&self.parameters).expect("the design is sound");
        let board = Board(Rc::clone(motor));
        let parts = Parts { converter: board.clone(), bridge: board, watchdog: NoWatchdog };
        let (receiver, sender) = self.air.join(address);
        let its = Rc::clone(&shared);
        self.world.spawn(powered(&power, async move { control_loop(parts, controller, &settings, &its).await }));
        let its = Rc::clone(&shared);
        self.world.spawn(powered(&power, async move { receive(receiver, &its).await }));
        let its = Rc::clone(&shared);
        self.world.spawn(powered(&power, async move { send(sender, &about, &its).await }));
        let its = Rc::clone(&shared);
        self.world.spawn(powered(&power, async move { led(DarkLed, &its).await }));
        (power, shared)
    }

    /// Lets a ms pass.
    pub fn advance(&mut self) {
        self.ms += 1;
        if self.trouble.robot_dies == Some(self.ms) || self.trouble.robot_restarts == Some(self.ms) {
            self.robot_power.set(false);
            self.motor.borrow_mut().cut();
        }
        if self.trouble.robot_restarts == Some(self.ms) {
            let motor = Rc::clone(&self.motor);
            (self.robot_power, self.shared) = self.switch_on(ROBOT, &motor, Reset::BrownOut);
        }
        if self.past(self.trouble.dongle_hangs) {
            self.dongle_power.set(false);
        }
        self.world.run_until(self.ms * 1000);
    }

    /// ms since the start.
    pub fn ms(&self) -> u64 {
        self.ms
    }

    fn past(&self, moment: Option<u64>) -> bool {
        moment.is_some_and(|moment| self.ms >= moment)
    }

    /// Breaks something of the robot.
    pub fn inject(&mut self, fault: hal_sim::Fault) {
        self.motor.borrow_mut().robot.inject(fault);
    }

    /// A command to the robot from somebody else's dongle.
    pub fn tell(&mut self, command: Command) {
        self.whispered += 1;
        self.air.whisper(ROBOT, self.whispered, command);
    }

    /// What the robot's LED shows.
    pub fn state(&self) -> (State, Option<Fault>) {
        match self.shared.shown() {
            Shown::State(state, fault) => (state, fault),
            Shown::NotStarted => (State::Idle, None),
        }
    }

    /// What the bridge is told at present.
    pub fn actuation(&self) -> Actuation {
        self.motor.borrow().actuation
    }

    /// Every tick as the robot had it: the radio's losses are not missing here.
    pub fn ticks(&self) -> Vec<(u16, Actuation)> {
        self.motor.borrow().ticks.clone()
    }

    /// Ticks with the bridge on.
    pub fn driven(&self) -> usize {
        self.motor.borrow().ticks.iter().filter(|(_, actuation)| actuation.enable).count()
    }

    /// Index of the first of them.
    pub fn first_driven(&self) -> u64 {
        self.motor.borrow().ticks.iter().position(|(_, actuation)| actuation.enable).expect("it was driven") as u64
    }

    /// A recording without any loss from a tick on.
    pub fn whole(&self, from: usize) -> Recording {
        let motor = self.motor.borrow();
        let ticks = &motor.ticks[from..];
        let time_s = |tick: usize| (tick as f64 * motor.robot.tick_s() * 1e6).round() / 1e6;
        Recording {
            t_s: (0..ticks.len()).map(time_s).collect(),
            enable: ticks.iter().map(|(_, actuation)| actuation.enable).collect(),
            drive: Drive::Duty(ticks.iter().map(|(_, actuation)| f64::from(actuation.duty)).collect()),
            angle: AngleReading::Adc(ticks.iter().map(|(code, _)| Some(*code)).collect()),
            ..Recording::default()
        }
    }

    /// Bytes of the host, as many as there is room for.
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        let count = self.serial.to_dongle.try_write(bytes).unwrap_or(0);
        for byte in &bytes[..count] {
            match self.deframer.push::<ToDongle>(*byte) {
                Some(Ok(ToDongle::Send { payload, .. })) => {
                    let (_, command) = decode(&payload).expect("the host's version");
                    self.commands.push((self.ms, command));
                }
                Some(Ok(ToDongle::Hello | ToDongle::Count)) | None => {}
                Some(Err(error)) => panic!("the host sent what is no frame: {error:?}"),
            }
        }
        count
    }

    /// Bytes for the host.
    pub fn drain(&mut self, buffer: &mut [u8]) -> usize {
        self.serial.to_host.try_read(buffer).unwrap_or(0)
    }

    /// The last command that the host wrote.
    pub fn last_command(&self) -> Command {
        self.commands.last().expect("commands were sent").1
    }
}

/// The host's end of the line in virtual time, which passes while the host waits.
impl Read for &mut Bench {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        for _ in 0..10 {
            if self.past(self.trouble.reading_breaks) || self.past(self.trouble.unplugged) {
                return Err(io::Error::from(ErrorKind::BrokenPipe));
            }
            match self.drain(buffer) {
                0 => self.advance(),
                count => return Ok(count),
            }
        }
        Err(io::Error::from(ErrorKind::TimedOut))
    }
}

impl Write for &mut Bench {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        if self.past(self.trouble.unplugged) {
            return Err(io::Error::from(ErrorKind::BrokenPipe));
        }
        match self.feed(buffer) {
            0 => Err(io::Error::from(ErrorKind::TimedOut)),
            count => Ok(count),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Line for &mut Bench {
    fn now(&self) -> Duration {
        Duration::from_micros(now_us())
    }
}
