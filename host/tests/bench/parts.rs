//! The boards of the bench: motor and sensor, radio, serial line.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::future::{Future, poll_fn};
use std::rc::Rc;
use std::task::Poll;

use control::protocol::dongle::{Address, Payload};
use control::protocol::radio;
use control::{Actuation, AdcCode, Command, Sample};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::pipe::Pipe;
use embassy_time::Timer;
use hal_sim::SimulatedRobot;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use scram::link::BROADCAST;
use shell::board::{Bridge, Converter, Led, Received, Receiver, Sender, Watchdog};

use super::time::now_us;

/// Runs a task as long as its board has power.
pub fn powered(power: &Rc<Cell<bool>>, task: impl Future + 'static) -> impl Future + 'static {
    let power = Rc::clone(power);
    let mut task = Box::pin(task);
    poll_fn(move |context| if power.get() { task.as_mut().poll(context) } else { Poll::Pending })
}

/// A simulated motor with bridge and sensor, in step with the clock.
pub struct Motor {
    pub robot: SimulatedRobot,
    /// What the bridge was told last.
    pub actuation: Actuation,
    /// Code and actuation of every tick.
    pub ticks: Vec<(u16, Actuation)>,
    passed: u64,
    sample: Option<Sample>,
}

impl Motor {
    pub fn new(robot: SimulatedRobot) -> Self {
        Self { robot, actuation: Actuation::OFF, ticks: Vec::new(), passed: 0, sample: None }
    }

    /// Without power the bridge is open.
    pub fn cut(&mut self) {
        self.actuation = Actuation::OFF;
    }

    fn sample(&mut self) -> Sample {
        let due = (now_us() as f64 * 1e-6 / self.robot.tick_s()).round() as u64;
        while self.passed < due {
            self.robot.advance(self.actuation);
            self.passed += 1;
        }
        *self.sample.insert(self.robot.sample())
    }
}

/// The motor as the control loop has it.
#[derive(Clone)]
pub struct Board(pub Rc<RefCell<Motor>>);

impl Converter for Board {
    fn angle(&mut self) -> AdcCode {
        self.0.borrow_mut().sample().angle
    }

    fn battery(&mut self) -> AdcCode {
        self.0.borrow().sample.unwrap_or_default().battery
    }
}

impl Bridge for Board {
    fn apply(&mut self, actuation: Actuation) {
        let mut motor = self.0.borrow_mut();
        motor.actuation = actuation;
        // At boot it is switched off before there is a sample.
        if let Some(sample) = motor.sample.take() {
            motor.ticks.push((sample.angle.0, actuation));
        }
    }
}

pub struct NoWatchdog;

impl Watchdog for NoWatchdog {
    fn feed(&mut self) {}
}

pub struct DarkLed;

impl Led for DarkLed {
    fn set(&mut self, _on: bool) {}
}

/// What the radio of ESP-NOW holds before it forgets.
const QUEUE: usize = 10;
/// A message's time on the air with its acknowledgement, µs.
const AIRTIME_US: u64 = 1500;

type Inbox = Rc<Channel<NoopRawMutex, Received, QUEUE>>;

/// Everybody on one channel.
#[derive(Clone)]
pub struct Air {
    inboxes: Rc<RefCell<BTreeMap<Address, Inbox>>>,
    random: Rc<RefCell<Pcg64Mcg>>,
    loss: f64,
}

impl Air {
    pub fn new(seed: u64, loss: f64) -> Self {
        let random = Rc::new(RefCell::new(Pcg64Mcg::seed_from_u64(seed)));
        Self { inboxes: Rc::default(), random, loss }
    }

    /// A radio at an address, in place of the one that was there.
    pub fn join(&self, address: Address) -> (Ear, Mouth) {
        let inbox = Inbox::new(Channel::new());
        self.inboxes.borrow_mut().insert(address, Rc::clone(&inbox));
        (Ear(inbox), Mouth { air: self.clone(), address })
    }

    /// A message that nobody on the bench sent.
    pub fn whisper(&self, to: Address, sequence: u16, command: Command) {
        let mut buffer = [0; radio::LONGEST];
        let bytes = radio::encode(sequence, &command, &mut buffer).expect("it fits");
        self.deliver([9; 6], to, bytes);
    }

    /// Whether anybody has it.
    fn deliver(&self, from: Address, to: Address, bytes: &[u8]) -> bool {
        let mut heard = false;
        for (address, inbox) in self.inboxes.borrow().iter() {
            if (to == *address || to == BROADCAST && from != *address)
                && !self.random.borrow_mut().random_bool(self.loss)
            {
                let payload = Payload::from_slice(bytes).expect("it fits");
                heard |= inbox.try_send(Received { from, rssi: -48, payload }).is_ok();
            }
        }
        heard
    }
}

pub struct Ear(Inbox);

impl Receiver for Ear {
    async fn receive(&mut self) -> Received {
        self.0.receive().await
    }
}

pub struct Mouth {
    air: Air,
    address: Address,
}

impl Sender for Mouth {
    async fn send(&mut self, to: &Address, payload: &[u8]) -> bool {
        Timer::after_micros(AIRTIME_US).await;
        self.air.deliver(self.address, *to, payload)
    }
}

/// Bytes that a serial line and the drivers at both ends hold.
const BUFFER: usize = 4096;

/// A serial line.
pub struct Serial {
    pub to_dongle: Pipe<NoopRawMutex, BUFFER>,
    pub to_host: Pipe<NoopRawMutex, BUFFER>,
}

impl Serial {
    pub fn new() -> Self {
        Self { to_dongle: Pipe::new(), to_host: Pipe::new() }
    }
}

/// The dongle's end of it.
pub struct Port(pub Rc<Serial>);

impl embedded_io_async::ErrorType for Port {
    type Error = Infallible;
}

impl embedded_io_async::Read for Port {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        Ok(self.0.to_dongle.read(buffer).await)
    }
}

impl embedded_io_async::Write for Port {
    async fn write(&mut self, buffer: &[u8]) -> Result<usize, Infallible> {
        Ok(self.0.to_host.write(buffer).await)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
