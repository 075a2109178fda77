//! Two controllers bit for bit.

use control::{Actuation, Command, Refusal, Sample, Telemetry};
use serde::Serialize;

/// The first thing that differed.
#[derive(Clone, Debug)]
pub enum Difference {
    /// A tick.
    Tick {
        /// Its number in the run.
        tick: usize,
        /// What both were given.
        sample: Sample,
        /// What the host made of it.
        ours: (Actuation, Telemetry),
        /// What the chip made of it.
        theirs: (Actuation, Telemetry),
    },
    /// The answer to a command.
    Answer {
        /// Number of the tick before which it was given.
        tick: usize,
        /// The command.
        command: Command,
        /// What the host answered.
        ours: Result<(), Refusal>,
        /// What the chip answered.
        theirs: Result<(), Refusal>,
    },
}

/// What was compared.
#[derive(Clone, Debug, Default)]
pub struct Compared {
    /// Ticks: every field of actuation and telemetry.
    pub ticks: u64,
    /// Answers to commands, and how many of them were refusals.
    pub answers: u64,
    /// Refusals among them.
    pub refusals: u64,
    /// How many ticks and answers differed.
    pub different: u64,
    /// The first of them.
    pub first: Option<Difference>,
}

impl Compared {
    /// Compares a tick.
    pub fn tick(
        &mut self,
        ours: &(Actuation, Telemetry),
        theirs: &(Actuation, Telemetry),
        difference: impl FnOnce() -> Difference,
    ) {
        self.ticks += 1;
        if bytes(ours) != bytes(theirs) {
            self.different += 1;
            self.first.get_or_insert_with(difference);
        }
    }

    /// Compares the answers to a command.
    pub fn answer(&mut self, tick: usize, command: &Command, ours: &Result<(), Refusal>, theirs: &Result<(), Refusal>) {
        self.answers += 1;
        self.refusals += u64::from(ours.is_err());
        if bytes(ours) != bytes(theirs) {
            self.different += 1;
            let difference = || Difference::Answer { tick, command: *command, ours: *ours, theirs: *theirs };
            self.first.get_or_insert_with(difference);
        }
    }

    /// Adds another run's.
    pub fn add(&mut self, other: Self) {
        self.ticks += other.ticks;
        self.answers += other.answers;
        self.refusals += other.refusals;
        self.different += other.different;
        self.first = self.first.take().or(other.first);
    }
}

/// Every bit of a value: a NaN with its payload, a zero with its sign.
fn bytes(value: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; 512];
    postcard::to_slice(value, &mut buffer).expect("a tick's telemetry is far shorter").to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_counts() {
        let with = |duty: u32| (Actuation { duty: f32::from_bits(duty), enable: true }, Telemetry::default());
        for (one, other, same) in [
            (0x7fc0_0000, 0x7fc0_0000, true),
            (0x7fc0_0000, 0x7fc0_0001, false),
            (0x0000_0000, 0x8000_0000, false),
            (0x3f80_0000, 0x3f80_0001, false),
        ] {
            let mut compared = Compared::default();
            let difference =
                || Difference::Tick { tick: 0, sample: Sample::default(), ours: with(one), theirs: with(other) };
            compared.tick(&with(one), &with(other), difference);
            assert_eq!(compared.different == 0, same, "{one:x} {other:x}");
        }
    }
}
