//! One tick in every driving state, on the host: `cargo bench -p control`. The budget in speed mode is 1 µs.

use control::{AdcCode, Command, Controller, Sample, Stroke};

fn main() {
    divan::main();
}

/// The robot's default design, as `scram design` fills it in.
#[path = "../tests/suite/common/mod.rs"]
mod common;

fn ticking(bencher: divan::Bencher<'_, '_>, command: Command) {
    let mut world = common::World::new();
    world.run(command, 600);
    assert!(world.controller.telemetry().state.is_driving() && world.controller.telemetry().tracking);
    let controller: Controller = world.controller;
    let sample = Sample { time_us: world.time_us, angle: AdcCode(world.code()), second: None, battery: AdcCode(2400) };
    bencher
        .with_inputs(|| (controller, sample))
        .bench_refs(|(controller, sample)| controller.tick(divan::black_box(sample)));
}

#[divan::bench]
fn speed(bencher: divan::Bencher<'_, '_>) {
    ticking(bencher, Command::Speed { omega: 44.0 });
}

#[divan::bench]
fn oscillate(bencher: divan::Bencher<'_, '_>) {
    ticking(bencher, Command::Oscillate { from: -1.745, to: 1.745, style: Stroke::BangBang });
}

#[divan::bench]
fn position(bencher: divan::Bencher<'_, '_>) {
    ticking(bencher, Command::Position { angle: 2.0 });
}
