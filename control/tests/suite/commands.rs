//! No command keeps the bridge on: whatever is commanded while something is broken, and however often, in every pair of modes.

use std::f64::consts::PI;

use control::{AdcCode, Command, Fault, Sample, State, Stroke};

use crate::common::{self, World};

/// What is commanded in turn with something else, in every direction.
fn orders() -> [Command; 12] {
    [
        Command::Speed { omega: 44.0 },
        Command::Speed { omega: -44.0 },
        Command::Speed { omega: 7.0 },
        Command::Oscillate { from: -1.7, to: 1.7, style: Stroke::BangBang },
        Command::Oscillate { from: 1.4, to: 4.9, style: Stroke::Proportional },
        Command::Position { angle: 1.7 },
        Command::Position { angle: -1.7 },
        Command::Duty { duty: 1.0 },
        Command::Duty { duty: -1.0 },
        Command::Duty { duty: 0.59 },
        Command::Gait { id: common::gait().id() },
        Command::Idle,
    ]
}

/// Every pair of commands, each command for so long, ms.
const PERIODS_MS: [u64; 10] = [1, 3, 10, 20, 30, 40, 80, 190, 240, 1000];

/// How many ms the bridge is on within `most` ms of two commands in turn, and the fault that ends it.
fn driven(
    world: &mut World,
    orders: [Command; 2],
    period_ms: u64,
    most: u64,
    change: impl Fn(Sample) -> Sample,
) -> (u64, Option<Fault>) {
    let mut on = 0;
    for tick in 0..most {
        // The console repeats what it wants.
        let _ = world.controller.command(orders[(tick / period_ms % 2) as usize], world.time_us);
        on += u64::from(world.tick_with(&change).enable);
        if world.controller.state() == State::Fault {
            break;
        }
    }
    (on, world.controller.telemetry().fault)
}

/// The bridge is on for no longer than the bound, in whatever pair of commands, and the robot says so unless it was hardly ever on.
fn all_pairs_end(bound_ms: u64, start: impl Fn(&mut World), change: impl Fn(Sample) -> Sample) {
    for first in orders() {
        for second in orders() {
            for period_ms in PERIODS_MS {
                let mut world = World::new();
                start(&mut world);
                let (on, fault) = driven(&mut world, [first, second], period_ms, 5000, &change);
                assert!(on <= bound_ms, "{first:?} and {second:?} every {period_ms} ms: driven for {on} ms, {fault:?}");
            }
        }
    }
}

#[test]
fn a_blocked_shaft_ends_every_sequence_of_orders() {
    for angle in [2.0, -2.0, 0.5, PI] {
        all_pairs_end(500, |world| (world.angle, world.blocked) = (angle, true), |sample| sample);
    }
}

#[test]
fn a_shaft_that_is_blocked_in_motion_ends_every_sequence_of_orders() {
    let start = |world: &mut World| {
        world.run(Command::Speed { omega: 44.0 }, 700);
        (world.angle, world.blocked) = (2.0, true);
    };
    all_pairs_end(500, start, |sample| sample);
}

#[test]
fn a_broken_sensor_ends_every_sequence_of_orders() {
    // Codes of a wiper that floats, stands, and lies on one end.
    all_pairs_end(1200, |_| {}, |s| Sample { angle: AdcCode(100 + (s.time_us / 1000 * 1237 % 3900) as u16), ..s });
    all_pairs_end(300, |_| {}, |s| Sample { angle: AdcCode(2000), ..s });
    all_pairs_end(600, |_| {}, |s| Sample { angle: AdcCode(0), ..s });
}

#[test]
fn a_low_cell_ends_every_sequence_of_orders() {
    all_pairs_end(100, |_| {}, |sample| Sample { battery: AdcCode(1500), ..sample });
}

/// A shaft that is blocked under a drive too weak to be called hard.
#[test]
fn a_blocked_shaft_is_found_at_every_duty_that_drives_a_current() {
    for percent in -100..=100i16 {
        let duty = f32::from(percent) / 100.0;
        // The bridge's drop takes 2.07 of 5 V; 10 mA through 15.9 ohm take 0.16 V.
        if duty.abs() < 0.45 {
            continue;
        }
        let mut world = World::new();
        world.blocked = true;
        let (on, fault) = driven(&mut world, [Command::Duty { duty }; 2], 1000, 60_000, |sample| sample);
        assert!(on <= 500 && fault == Some(Fault::Stall), "duty {duty}: driven for {on} ms, {fault:?}");
    }
}

/// Periods that are missed in some pattern: what was hung, and how many good ticks follow, ms.
const STARVED: [(u64, u64); 7] = [(99, 5), (90, 5), (60, 20), (45, 3), (30, 10), (15, 5), (2, 0)];

/// The time from the beginning until the bridge is off for good, ms, with a loop that is starved.
fn driven_while_starved(world: &mut World, (hung, good): (u64, u64), change: impl Fn(Sample) -> Sample) -> u64 {
    let start = world.time_us;
    let mut last_on = start;
    for tick in 0..2000 {
        let _ = world.controller.command(Command::Speed { omega: 44.0 }, world.time_us);
        if world.tick_with(&change).enable {
            last_on = world.time_us;
        }
        if tick % (good + 1) == good {
            world.pass(hung - 1);
            if world.controller.telemetry().actuation.enable {
                last_on = world.time_us;
            }
        }
    }
    (last_on - start) / 1000
}

#[test]
fn a_starved_loop_is_a_fault_of_its_own_or_keeps_every_bound() {
    for pattern in STARVED {
        let healthy = |sample| sample;
        let mut world = World::new();
        world.run(Command::Speed { omega: 44.0 }, 600);
        let on = driven_while_starved(&mut world, pattern, healthy);
        let fault = world.controller.telemetry().fault;
        assert!(on <= 200, "{pattern:?}: driven for {on} ms, {fault:?}");
        assert!(matches!(fault, Some(Fault::LoopStarved | Fault::ClockFault)), "{pattern:?}: {fault:?}");
        for (name, bound, change) in [
            ("a low cell", 200, (|sample| Sample { battery: AdcCode(1500), ..sample }) as fn(Sample) -> Sample),
            ("a stall", 200, |sample| sample),
        ] {
            let mut world = World::new();
            world.run(Command::Speed { omega: 44.0 }, 600);
            world.blocked = name == "a stall";
            let on = driven_while_starved(&mut world, pattern, change);
            assert!(on <= bound, "{name}, {pattern:?}: driven for {on} ms");
        }
    }
}

/// Full voltage to and fro: a healthy shaft that swings so wide that nothing but the winding suffers.
const TO_AND_FRO: [Command; 2] = [Command::Duty { duty: 1.0 }, Command::Duty { duty: -1.0 }];

#[test]
fn heat_ends_what_no_other_trigger_sees_and_is_not_cleared_while_it_lasts() {
    let mut world = World::new();
    let (_, fault) = driven(&mut world, TO_AND_FRO, 40, 60_000, |sample| sample);
    assert_eq!(fault, Some(Fault::Overheated));
    let mut waited = 0;
    while world.controller.command(Command::ClearFault, world.time_us).is_err() {
        world.tick();
        waited += 1;
    }
    assert!((1000..5000).contains(&waited), "cleared after {waited} ms");
}

#[test]
fn no_sequence_of_orders_overheats_the_winding() {
    for blocked in [false, true] {
        for first in orders() {
            for second in orders() {
                for period_ms in [3, 10, 25, 40, 60, 120, 240] {
                    let mut world = World::new();
                    world.blocked = blocked;
                    let (mut hottest, mut cleared) = (0.0f64, 0);
                    for tick in 0..8000u64 {
                        let order = [first, second][(tick / period_ms % 2) as usize];
                        // Somebody clears every fault at once.
                        if world.controller.state() == State::Fault {
                            cleared += u32::from(world.controller.command(Command::ClearFault, world.time_us).is_ok());
                        }
                        let _ = world.controller.command(order, world.time_us);
                        world.tick();
                        hottest = hottest.max(world.heat);
                    }
                    // The limit is 2.7; the model knows resistance and drop as they are here, and the speed nearly.
                    let what = format!("{first:?} and {second:?} every {period_ms} ms, blocked {blocked}");
                    assert!(hottest < 2.8, "{what}: heat {hottest:.2}, cleared {cleared} times");
                }
            }
        }
    }
}
