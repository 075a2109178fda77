//! A run is a value: a copy, another company or another order changes no bit.

use std::f64::consts::TAU;

use crate::common::body::{difference, in_space, norm, robot, settings, uneven};
use effects::{FootAnisotropy, FootLoadFriction, FootStribeck};
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings, Snapshot};

const ALPHAS: [f64; 8] = [0.0, 60.0, 90.0, 120.0, 30.0, 75.0, 45.0, 100.0];
const HERTZ: [f64; 8] = [8.0, -7.0, 6.0, 7.0, -8.0, -6.0, 5.0, 7.5];

fn single() -> Settings {
    Settings { step_s: 1e-4, precision: Precision::Single }
}

fn drive(i: usize) -> Drive {
    let speed = TAU * HERTZ[i];
    if i.is_multiple_of(2) { Drive::Servo { speed, stiffness: 0.08, damping: 2.5e-4 } } else { Drive::Phase { speed } }
}

fn plan(i: usize) -> Plan {
    let mut plan = robot(4, ALPHAS[i]);
    // All laws beside each other: plain, and with each thing that a robot file may switch on.
    if i.is_multiple_of(4) {
        plan = uneven(plan);
    }
    let contact = plan.contact.as_mut().unwrap();
    match i {
        1 => contact.laws.foot_stribeck = Some(FootStribeck { excess_share: 0.3, speed_m_per_s: 0.05 }),
        2 => contact.laws.foot_anisotropy = Some(FootAnisotropy { lateral_share: 0.7 }),
        3 => contact.laws.foot_load_friction = Some(FootLoadFriction { exponent: 0.1, load_n: 0.05 }),
        4 => contact.steps = vec![[0.05, 0.001]],
        5 => contact.patches = vec![[-0.06, 0.5]],
        6 => plan.gravity = [0.5, 0.2, -9.79],
        _ => (),
    }
    plan
}

/// The bodies of these numbers after so many steps.
fn walk(order: &[usize], steps: usize, settings: Settings) -> Vec<Snapshot> {
    let plans: Vec<_> = order.iter().map(|i| plan(*i)).collect();
    let drives: Vec<_> = order.iter().map(|i| drive(*i)).collect();
    let mut bodies = Ensemble::new(&plans, settings).unwrap();
    bodies.advance(steps, &drives);
    (0..order.len()).map(|i| bodies.snapshot(i)).collect()
}

#[test]
fn a_copy_goes_on_bit_for_bit() {
    for settings in [settings(1e-4), single()] {
        let plans: Vec<_> = (0..5).map(plan).collect();
        let drives: Vec<_> = (0..5).map(drive).collect();
        let mut bodies = Ensemble::new(&plans, settings).unwrap();
        bodies.advance(1234, &drives);
        let mut copy = bodies.clone();
        // In other portions.
        bodies.advance(1000, &drives);
        (0..10).for_each(|_| copy.advance(100, &drives));
        for i in 0..5 {
            assert_eq!(bodies.snapshot(i), copy.snapshot(i), "body {i}, {:?}", settings.precision);
            assert_eq!(bodies.coordinates(i), copy.coordinates(i), "body {i}, {:?}", settings.precision);
        }
    }
}

#[test]
fn company_and_order_change_no_bit() {
    for settings in [settings(1e-4), single()] {
        let alone: Vec<_> = (0..8).map(|i| walk(&[i], 2000, settings).remove(0)).collect();
        let moved = norm(difference(alone[0].centroid(), alone[1].centroid()));
        assert!(moved > 1e-5, "the cases do not differ: {moved} m");
        for order in
            [&[0, 1][..], &[2, 1, 0], &[4, 3, 2, 1, 0], &[0, 1, 2, 3, 4, 5, 6, 7], &[7, 2, 5, 0, 3, 6, 1, 4, 2]]
        {
            for (found, body) in walk(order, 2000, settings).iter().zip(order) {
                assert_eq!(*found, alone[*body], "body {body} in {order:?}, {:?}", settings.precision);
            }
        }
    }
}

#[test]
fn another_thread_changes_no_bit() {
    let here = walk(&[0, 1, 2], 1000, settings(1e-4));
    let there = std::thread::spawn(|| walk(&[0, 1, 2], 1000, settings(1e-4))).join().unwrap();
    assert_eq!(here, there);
}

#[test]
fn single_precision_stays_near_double_in_flight() {
    // 24 bits are 6e-8; a robot of 0.15 m that 5000 steps have turned is known to some micrometres.
    let plans: Vec<_> = ALPHAS.iter().map(|alpha| in_space(robot(4, *alpha))).collect();
    let drives: Vec<_> = (0..8).map(drive).collect();
    let [double, single] = [settings(1e-4), single()].map(|settings| {
        let mut bodies = Ensemble::new(&plans, settings).unwrap();
        bodies.advance(5000, &drives);
        (0..8).map(|i| bodies.snapshot(i)).collect::<Vec<_>>()
    });
    let mut worst = 0.0_f64;
    for (a, b) in double.iter().zip(&single) {
        let off = a.modules.iter().zip(&b.modules).map(|(a, b)| norm(difference(a.position, b.position)));
        worst = off.fold(worst, f64::max);
    }
    println!("single against double after 0.5 s in flight: {worst:.1e} m");
    assert!(worst > 0.0, "single precision is double");
    assert!(worst < 2e-5, "{worst} m apart");
}

#[test]
fn a_body_made_another_goes_on_like_it_bit_for_bit() {
    for settings in [settings(1e-4), single()] {
        // More than stand side by side in one group.
        let mut bodies = Ensemble::new(&vec![plan(0); 9], settings).unwrap();
        let mut drives: Vec<Drive> = (0..9).map(|i| Drive::Phase { speed: TAU * (6.0 + 0.2 * i as f64) }).collect();
        bodies.advance(1234, &drives);
        let (one, kept) = (bodies.snapshot(8), bodies.snapshot(2));
        bodies.copy(1, 8);
        assert_eq!((bodies.snapshot(1), bodies.snapshot(2)), (one, kept));
        drives[1] = drives[8];
        bodies.advance(500, &drives);
        assert_eq!(bodies.snapshot(1), bodies.snapshot(8));
        assert_eq!(bodies.load_torque(1).to_bits(), bodies.load_torque(8).to_bits());
        assert_ne!(bodies.snapshot(2), bodies.snapshot(8));
    }
}
