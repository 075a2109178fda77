//! Sequences of commands: one, two in turn, or whatever comes, every 1 ms to 1 s.

use std::f32::consts::TAU;

use control::{Command, Stroke};
use rand::RngExt;
use rand_pcg::Pcg64;

/// What is commanded when.
#[derive(Clone, Debug, PartialEq)]
pub enum Sequence {
    /// One order.
    Steady(Command),
    /// Two in turn, each for so many ticks.
    InTurn([Command; 2], u64),
    /// Anything, each for so many ticks to so many.
    Anything(u64, u64),
}

/// Any command, with the weight on those that drive.
pub fn any_order(random: &mut Pcg64) -> Command {
    let sign = if random.random() { 1.0 } else { -1.0 };
    match random.random_range(0..10) {
        0..=2 => Command::Speed { omega: sign * TAU * random.random_range(1.1..11.0) },
        3 | 4 => {
            let from = random.random_range(-3.1..2.0);
            let style = if random.random() { Stroke::BangBang } else { Stroke::Proportional };
            Command::Oscillate { from, to: from + random.random_range(0.5..3.5), style }
        }
        5 => Command::Position { angle: random.random_range(-3.1..3.1) },
        6 | 7 => Command::Duty { duty: sign },
        8 => Command::Duty { duty: sign * random.random_range(0.2..1.0) },
        _ => {
            if random.random() {
                Command::Idle
            } else {
                Command::Coast
            }
        }
    }
}

/// A time in ticks, as likely between 1 and 10 ms as between 0.1 and 1 s.
fn any_period(random: &mut Pcg64) -> u64 {
    10f64.powf(random.random_range(0.0..3.0)).round() as u64
}

impl Sequence {
    /// A sequence whose commands stand for `shortest` ticks at least.
    pub fn drawn(random: &mut Pcg64, shortest: u64) -> Self {
        let period = |random: &mut Pcg64| any_period(random).max(shortest);
        match random.random_range(0..8) {
            0 => Self::Steady(driving(random)),
            1..=4 => Self::InTurn([driving(random), any_order(random)], period(random)),
            _ => Self::Anything(shortest, period(random)),
        }
    }
}

/// A command that drives.
fn driving(random: &mut Pcg64) -> Command {
    loop {
        let order = any_order(random);
        if order.event().drives() {
            return order;
        }
    }
}

/// Gives the orders of a sequence.
pub struct Orders {
    sequence: Sequence,
    random: Pcg64,
    count: u64,
    left: u64,
}

impl Orders {
    /// From the beginning.
    #[must_use]
    pub fn new(sequence: Sequence, random: Pcg64) -> Self {
        Self { sequence, random, count: 0, left: 0 }
    }

    /// The order of this tick, if there is a new one.
    pub fn due(&mut self) -> Option<Command> {
        if self.left > 0 {
            self.left -= 1;
            return None;
        }
        self.count += 1;
        match &self.sequence {
            Sequence::Steady(order) => {
                self.left = u64::MAX;
                Some(*order)
            }
            Sequence::InTurn(orders, ticks) => {
                self.left = ticks - 1;
                Some(orders[(self.count % 2) as usize])
            }
            Sequence::Anything(least, most) => {
                self.left = self.random.random_range(least - 1..*most);
                Some(any_order(&mut self.random))
            }
        }
    }
}
