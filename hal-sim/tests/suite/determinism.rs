//! A seed is a robot: the same bits everywhere, other bits for other seeds, one stream for every nuisance.

use crate::common::{default_robot, drive, potentiometer};
use control::Sample;
use hal_sim::variation::{Spreads, draw};
use hal_sim::{Settings, SimulatedRobot, Truth};
use robot_file::robot::{InGap, Robot};

/// Half a second of driving back and forth; every sample and the last truth.
fn run(mut robot: SimulatedRobot) -> (Vec<Sample>, Truth) {
    let samples = (0..500)
        .map(|tick| {
            let sample = robot.sample();
            robot.advance(drive(if (tick / 100) % 2 == 0 { 1.0 } else { -0.8 }));
            sample
        })
        .collect();
    (samples, robot.truth())
}

#[test]
fn the_same_seed_is_the_same_bits_in_every_thread_and_clone() {
    let robot = default_robot();
    let here = run(SimulatedRobot::new(&robot, 42));
    let clone = SimulatedRobot::new(&robot, 42);
    let others: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|n| {
                let (robot, clone) = (&robot, clone.clone());
                scope.spawn(move || run(if n % 2 == 0 { clone } else { SimulatedRobot::new(robot, 42) }))
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for other in others {
        assert_eq!(here.0, other.0);
        assert_eq!(format!("{:?}", here.1), format!("{:?}", other.1));
    }
}

#[test]
fn a_clone_goes_its_own_way_from_the_same_state() {
    let robot = default_robot();
    let mut one = SimulatedRobot::new(&robot, 4);
    for _ in 0..300 {
        one.sample();
        one.advance(drive(0.7));
    }
    let other = one.clone();
    assert_eq!(run(one).0, run(other).0);
}

#[test]
fn other_seeds_are_other_robots() {
    let robot = default_robot();
    let runs: Vec<_> = (0..20).map(|seed| run(SimulatedRobot::new(&robot, seed)).0).collect();
    for (n, one) in runs.iter().enumerate() {
        assert!(runs[..n].iter().all(|other| one != other));
    }
}

#[test]
fn what_a_seed_draws_covers_its_range() {
    let robot = default_robot();
    let robots: Vec<SimulatedRobot> = (0..400).map(|seed| SimulatedRobot::new(&robot, seed)).collect();
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / 400.0;
    let angle = mean(robots.iter().map(|robot| robot.truth().angle).collect());
    assert!(angle.abs() < 0.36, "start angles' mean {angle} rad: four standard errors are 0.36");
    let charges: Vec<f64> = robots.iter().map(|robot| robot.charge().unwrap()).collect();
    assert!(charges.iter().all(|charge| (0.5..=1.0).contains(charge)));
    assert!((mean(charges) - 0.75).abs() < 0.03);
    for behaviour in [InGap::Hold, InGap::Random, InGap::Zero] {
        let count = robots.iter().filter(|robot| robot.in_gap() == Some(behaviour)).count();
        assert!((95..175).contains(&count), "{behaviour:?}: {count} of 400");
    }
}

#[test]
fn one_nuisance_off_leaves_the_others_alone() {
    // Where no conversion is a spike the codes with and without spikes are the same bits.
    let mut spiky = default_robot();
    potentiometer(&mut spiky).adc.spike_share.value = 0.05;
    let mut calm = spiky.clone();
    potentiometer(&mut calm).adc.spike_share.value = 0.0;
    let settings = Settings { in_gap: Some(InGap::Hold), ..Settings::default() };
    let codes = |robot: &Robot| run(SimulatedRobot::with(robot, 8, &settings)).0;
    let different = codes(&spiky).iter().zip(codes(&calm)).filter(|(a, b)| a.angle != b.angle).count();
    assert!((8..50).contains(&different), "{different} of 500 differ at 5 % of spikes");
}

#[test]
fn specimens_lie_within_their_spreads_and_are_seeded() {
    let robot = default_robot();
    assert_eq!(draw(&robot, 3, &Spreads::NONE), robot);
    assert_eq!(draw(&robot, 3, &Spreads::MISMATCHED), draw(&robot, 3, &Spreads::MISMATCHED));
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    for seed in 0..300 {
        let specimen = draw(&robot, seed, &Spreads::MISMATCHED);
        let ratio = |ours: &robot_file::robot::Quantity, file: &robot_file::robot::Quantity| ours.value / file.value;
        let r = ratio(&specimen.motor.resistance_ohm, &robot.motor.resistance_ohm);
        let j = ratio(&specimen.motor.rotor_inertia_kg_m2, &robot.motor.rotor_inertia_kg_m2);
        let load = ratio(&specimen.load.inertia_kg_m2, &robot.load.inertia_kg_m2);
        assert!((0.85..=1.15).contains(&r) && (0.7..=1.3).contains(&j) && (j - load).abs() < 1e-12);
        (low, high) = (low.min(r), high.max(r));
    }
    assert!(low < 0.86 && high > 1.14, "{low} to {high}");
}
