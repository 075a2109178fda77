//! What is broken while commands change: alone, two things at once, now and then, and a loop that gets no time.

use control::Fault as Cause;
use hal_sim::Fault;
use rand::RngExt;
use rand_pcg::Pcg64;

/// What the sensor's converter does besides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Converter {
    /// It works.
    Works,
    /// Age of its code, ticks.
    Late(usize),
    /// It fails for so many ticks of so many: its code is anything.
    Loose(u64, u64),
    /// It hangs for so many ticks of so many: it repeats its code.
    Sticks(u64, u64),
}

/// The control loop: so many ms hung, and so many good ticks after that, over and over.
pub type Starved = (u64, u64);

/// What must come of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Broken {
    /// The bridge goes off within the bound of what the supervisor calls it, or of what it is, which is one of these.
    Found(&'static [Cause]),
    /// The robot may go on, but not heat up.
    Borne,
}

/// A kind of trouble, with what is drawn for a run.
pub struct Kind {
    /// Its name, for the table and for `--only`.
    pub name: &'static str,
    /// What must come of it.
    pub broken: Broken,
    /// The faults of the robot.
    pub faults: fn(&mut Pcg64) -> Vec<Fault>,
    /// What the converter does.
    pub converter: fn(&mut Pcg64) -> Converter,
    /// How the loop is starved, if it is.
    pub starved: fn(&mut Pcg64) -> Option<Starved>,
    /// A command stands for so many ticks at least.
    pub shortest: u64,
}

/// Nothing tells these from each other where the wiper rests on insulation, or the shaft turns as nobody expects.
const STILL: &[Cause] = &[Cause::SensorOpen, Cause::Stall, Cause::SensorFrozen, Cause::SensorShorted, Cause::Runaway];
const SHORTED: &[Cause] = &[Cause::SensorShorted, Cause::Stall, Cause::SensorOpen];
const LOW: &[Cause] = &[Cause::SupplyLow];

const fn kind(name: &'static str, broken: Broken, faults: fn(&mut Pcg64) -> Vec<Fault>) -> Kind {
    Kind { name, broken, faults, converter: |_| Converter::Works, starved: |_| None, shortest: 1 }
}

const fn starved(kind: Kind) -> Kind {
    Kind { starved: |random| Some(pattern(random)), ..kind }
}

/// What must be found alone, however short the commands.
fn found_alone(random: &mut Pcg64) -> Fault {
    let faults = [
        Fault::Stalled,
        Fault::SensorOpen,
        Fault::SensorShortLow,
        Fault::SensorShortHigh,
        Fault::SensorFrozen,
        Fault::MotorOpen,
        low_cell(random),
    ];
    faults[random.random_range(0..faults.len())]
}

/// Below the weakest limit that is ever taken, 3.0 V.
fn low_cell(random: &mut Pcg64) -> Fault {
    Fault::BatteryLow { open_circuit_v: random.random_range(2.5..2.95) }
}

/// Up to what the watchdog allows.
fn pattern(random: &mut Pcg64) -> Starved {
    (random.random_range(2..100), random.random_range(1..40))
}

fn share(random: &mut Pcg64) -> (u64, u64) {
    let whole = random.random_range(2..400);
    (random.random_range(1..whole), whole)
}

/// A drive that is turned round faster moves the shaft so little that nothing tells in which direction.
const REVERSAL: u64 = 40;

/// Every kind.
pub const KINDS: [Kind; 19] = [
    kind("nothing broken", Broken::Borne, |_| Vec::new()),
    kind("shaft blocked", Broken::Found(STILL), |_| vec![Fault::Stalled]),
    kind("motor lead open", Broken::Found(STILL), |_| vec![Fault::MotorOpen]),
    Kind {
        shortest: REVERSAL,
        ..kind("motor leads swapped, orders of 40 ms or more", Broken::Found(STILL), |_| vec![Fault::MotorReversed])
    },
    kind("motor leads swapped, any orders", Broken::Borne, |_| vec![Fault::MotorReversed]),
    kind("bridge's supply sags to 2 V", Broken::Found(STILL), |_| vec![Fault::RailLow { rail_v: 2.0 }]),
    kind("sensor open", Broken::Found(STILL), |_| vec![Fault::SensorOpen]),
    kind("sensor shorted to ground", Broken::Found(SHORTED), |_| vec![Fault::SensorShortLow]),
    kind("sensor shorted to its supply", Broken::Found(SHORTED), |_| vec![Fault::SensorShortHigh]),
    kind("sensor frozen", Broken::Found(STILL), |_| vec![Fault::SensorFrozen]),
    kind("cell low", Broken::Found(LOW), |random| vec![low_cell(random)]),
    kind("sensor noisy, drifting, or fed too high", Broken::Borne, |random| {
        vec![match random.random_range(0..3) {
            0 => Fault::SensorNoisy { share: random.random_range(0.005..0.05) },
            1 => Fault::SensorDrifting { share_per_s: random.random_range(-0.2..0.2) },
            _ => Fault::AdcSaturated { factor: random.random_range(1.2..2.0) },
        }]
    }),
    kind("two of these at once", Broken::Found(STILL), |random| vec![found_alone(random), found_alone(random)]),
    Kind {
        converter: |random| Converter::Late(random.random_range(1..40)),
        ..kind("converter late by 1 to 40 ms", Broken::Borne, |_| Vec::new())
    },
    Kind {
        converter: |random| {
            let (bad, whole) = share(random);
            if random.random() { Converter::Loose(bad, whole) } else { Converter::Sticks(bad, whole) }
        },
        ..kind("converter fails or hangs now and then", Broken::Borne, |_| Vec::new())
    },
    Kind {
        converter: |random| Converter::Late(random.random_range(1..40)),
        ..kind("converter late, and the shaft blocked", Broken::Found(STILL), |_| vec![Fault::Stalled])
    },
    starved(kind("loop starved, nothing broken", Broken::Borne, |_| Vec::new())),
    starved(kind("loop starved, and the shaft blocked", Broken::Found(STILL), |_| vec![Fault::Stalled])),
    starved(kind("loop starved, and the cell low", Broken::Found(LOW), |random| vec![low_cell(random)])),
];
