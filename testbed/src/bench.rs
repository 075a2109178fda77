//! A dongle and robots on a bench.

use std::cell::Cell;
use std::future::Future;
use std::rc::Rc;

use control::protocol::radio::Reset;
use hal_sim::radio::{Adversary, Air, BROADCAST};
use shell::board::Address;

use crate::air::{Driver, Ether};
use crate::dongle::Dongle;
use crate::injected_event::InjectedEvent;
use crate::parts::{ProcessorHold, SeededEntropy};
use crate::robot::Robot;
use crate::setup::Setup;
use crate::time::{World, now_us, until};

/// Longest interval at which resets are noticed and injected events applied, µs.
const STEP_US: u64 = 1000;

/// Makes the flood's draws differ from the robots'.
const FLOOD: u64 = 0xF100D;

/// Dongle, robots, the air between, and the time. A thread has one bench at a time.
pub struct Bench {
    /// Simulated robots.
    pub robots: Vec<Robot>,
    /// The dongle.
    pub dongle: Option<Dongle>,
    /// The air.
    pub ether: Ether,
    world: World,
    /// What is to happen, in the order of its times, µs.
    coming: Vec<(u64, InjectedEvent)>,
    /// The second talker's period, µs.
    attack_us: Rc<Cell<u64>>,
    /// The flood's period, µs, and the length of its frames.
    flood: Rc<Cell<(u64, usize)>>,
    seed: u64,
}

impl Bench {
    /// Everything switched on at once.
    #[must_use]
    pub fn new(setup: Setup) -> Self {
        let Setup { seed, radio, dongle, robots, detail } = setup;
        let mut world = World::new();
        let ether = Ether::new(Air::new(&radio, seed));
        let mut dongle = dongle.map(|identity| Dongle::new(identity, &mut world, &ether));
        if let Some(dongle) = &mut dongle {
            dongle.boot(&mut world, &ether);
        }
        let robots = robots.into_iter().zip(1..).map(|(member, number)| {
            let reset = member.reset;
            let mut robot = Robot::new(member, seed.wrapping_mul(31).wrapping_add(number), detail, &mut world, &ether);
            robot.boot(reset, &mut world, &ether);
            robot
        });
        let robots = robots.collect();
        Self { robots, dongle, ether, world, coming: Vec::new(), attack_us: Rc::default(), flood: Rc::default(), seed }
    }

    /// Time since the beginning, µs.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        now_us()
    }

    /// Lets something happen at a time, µs.
    pub fn at(&mut self, at_us: u64, injected_event: InjectedEvent) {
        let place = self.coming.partition_point(|(other_us, _)| *other_us <= at_us);
        self.coming.insert(place, (at_us, injected_event));
    }

    /// Adds a task with a processor of its own, such as somebody who uses the air.
    pub fn spawn(&mut self, task: impl Future + 'static) {
        let processor = self.world.processor();
        self.world.spawn(processor, task);
    }

    /// Adds a task that keeps a robot's control loop out at a time, like a critical section of the radio.
    pub fn keep_busy(&mut self, robot: usize, hold: ProcessorHold) {
        self.robots[robot].keep_busy(hold, &mut self.world);
    }

    /// Runs until a time, µs. What is due at the time itself is still done.
    pub fn run_until(&mut self, end_us: u64) {
        loop {
            while let Some((_, injected_event)) = self.coming.first().copied().filter(|(at_us, _)| *at_us <= now_us()) {
                self.coming.remove(0);
                self.apply(injected_event);
            }
            let next_us = self.coming.first().map_or(end_us, |(at_us, _)| end_us.min(*at_us));
            self.world.run_until(next_us.min(now_us() + STEP_US));
            for robot in &mut self.robots {
                robot.restart_if_wanted(&mut self.world, &self.ether);
            }
            if let Some(dongle) = &mut self.dongle {
                dongle.restart_if_wanted(&mut self.world, &self.ether);
            }
            if now_us() >= end_us && self.coming.first().is_none_or(|(at_us, _)| *at_us > end_us) {
                return;
            }
        }
    }

    /// Lets something happen now.
    pub fn apply(&mut self, injected_event: InjectedEvent) {
        let (world, ether) = (&mut self.world, &self.ether);
        match injected_event {
            InjectedEvent::Fault(robot, fault) => self.robots[robot].plant(|plant| {
                plant.advance();
                plant.robot.inject(fault);
            }),
            InjectedEvent::PowerCut(robot) => self.robots[robot].cut_power(),
            InjectedEvent::Boot(robot, reset) => self.robots[robot].boot(reset, world, ether),
            InjectedEvent::ProcessorHold(robot, for_us) => {
                self.robots[robot].plant(|plant| plant.hold(ProcessorHold { at_us: now_us(), for_us }));
            }
            InjectedEvent::Busy(robot, for_us) => {
                self.robots[robot].keep_busy(ProcessorHold { at_us: now_us(), for_us }, world)
            }
            InjectedEvent::Jitter(robot, most_us) => self.robots[robot].jitter(most_us, world),
            InjectedEvent::Leap(robot, by_us) => self.robots[robot].leap(by_us, world),
            InjectedEvent::Place(robot, position_m) => ether.place(self.robots[robot].address(), position_m),
            InjectedEvent::SlowRadio(robot, by_us) => ether.delay_callbacks(self.robots[robot].address(), by_us),
            InjectedEvent::RadioStuck(robot) => ether.break_driver(self.robots[robot].address(), Driver::Stuck),
            InjectedEvent::RadioFull(robot) => ether.break_driver(self.robots[robot].address(), Driver::Full),
            InjectedEvent::DongleSpins => self.dongle.iter().for_each(|dongle| dongle.spin(world)),
            InjectedEvent::DongleRadioStuck => self.break_dongle(Driver::Stuck),
            InjectedEvent::DongleRadioFull => self.break_dongle(Driver::Full),
            InjectedEvent::Flood { every_us, length } => self.flood(every_us, length),
            InjectedEvent::DongleHangs => self.dongle.iter().for_each(Dongle::hang),
            InjectedEvent::DongleBoots => self.dongle.iter_mut().for_each(|dongle| dongle.boot(world, ether)),
            InjectedEvent::Cable(cable) => self.dongle.iter().for_each(|dongle| dongle.line.plug(cable)),
            InjectedEvent::ReadsFail => self.dongle.iter().for_each(|dongle| dongle.line.fail_host_reads()),
            InjectedEvent::Air(trouble) => ether.trouble(trouble),
            InjectedEvent::Attack(every_us) => self.attack(every_us),
        }
    }

    /// A robot boots.
    pub fn boot(&mut self, robot: usize, reset: Reset) {
        self.apply(InjectedEvent::Boot(robot, reset));
    }

    fn break_dongle(&self, driver: Driver) {
        if let Some(dongle) = &self.dongle {
            self.ether.break_driver(dongle.identity().address, driver);
        }
    }

    fn flood(&mut self, every_us: u64, length: usize) {
        let flowing = self.flood.replace((every_us, length)).0 > 0;
        if flowing || every_us == 0 {
            return;
        }
        let mut names: Vec<Address> = self.robots.iter().map(|robot| robot.address()).collect();
        names.extend(self.dongle.iter().map(|dongle| dongle.identity().address));
        let (flood, ether, random) =
            (Rc::clone(&self.flood), self.ether.clone(), SeededEntropy::new(self.seed ^ FLOOD));
        self.spawn(async move {
            while let (every_us @ 1.., length) = flood.get() {
                // A stranger now and then.
                let stranger: Address = random.bytes();
                let from = *names.get(random.up_to(names.len() as u64) as usize).unwrap_or(&stranger);
                let payload: Vec<u8> =
                    (0..length.div_ceil(64)).flat_map(|_| random.bytes::<64>()).take(length).collect();
                ether.inject(from, BROADCAST, &payload);
                until(now_us() + every_us).await;
            }
        });
    }

    fn attack(&mut self, every_us: u64) {
        if self.attack_us.replace(every_us) == 0 && every_us > 0 {
            let (period_us, ether) = (Rc::clone(&self.attack_us), self.ether.clone());
            let mut adversary = Adversary::new(self.seed);
            self.spawn(async move {
                while period_us.get() > 0 {
                    ether.attack(&mut adversary);
                    until(now_us() + period_us.get()).await;
                }
            });
        }
    }
}
