//! Bodies that hang: a pendulum's frequency, and shapes at rest against balances of torques solved here.

use std::f64::consts::{PI, TAU};

use crate::common::body::{G, STILL, alone, bench, damped, energy, from, in_space, maxima, rest, robot, segmented};
use hal_sim::body::Plan;
use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::skeleton::Skeleton;

/// The bench with one triple of hinges, hanging along −x from its clamped module.
fn pendulum(stiffness: f64) -> Plan {
    let mut plan = damped(segmented(bench(), 1), 0.0);
    plan.backbones[0].stiffness = [stiffness; 3];
    Plan { gravity: [-G, 0.0, 0.0], ..plan }
}

/// Inertia about the hinges for a turn about `axis` (1: y, 2: z), and mass times distance, from the boxes.
fn inertia_and_lever(plan: &Plan, axis: usize) -> (f64, f64) {
    let (module, backbone) = (plan.modules[1], plan.backbones[0]);
    let segment = [backbone.length, backbone.section[0], backbone.section[1]];
    let other = 3 - axis;
    let parts = [
        (backbone.segment_mass, 0.5 * backbone.length, segment),
        (module.mass, backbone.length + 0.5 * module.size[0], module.size),
    ];
    parts.iter().fold((0.0, 0.0), |(inertia, lever), (mass, distance, size)| {
        let own = mass * (size[0] * size[0] + size[other] * size[other]) / 12.0;
        (inertia + own + mass * distance * distance, lever + mass * distance)
    })
}

/// Frequency of a swing from rest at `amplitude` about `axis`, rad/s.
fn swing(plan: &Plan, axis: usize, amplitude: f64, step: f64) -> f64 {
    let mut start = Coordinates::nominal(plan);
    start.angles[0][axis] = amplitude;
    let mut body = from(plan, &start, step);
    let signal: Vec<_> = (0..(6.0 / step) as usize)
        .map(|_| {
            body.advance(1, &[STILL]);
            body.coordinates(0).angles[0][axis]
        })
        .collect();
    let peaks = maxima(&signal, step);
    let last = peaks.len() - 1;
    TAU * last as f64 / (peaks[last].0 - peaks[0].0)
}

#[test]
fn a_small_swing_has_the_physical_pendulums_frequency() {
    for (stiffness, name) in [(1e-9, "gravity alone"), (2e-3, "gravity and spring")] {
        for axis in [1, 2] {
            let plan = pendulum(stiffness);
            let (inertia, lever) = inertia_and_lever(&plan, axis);
            let amplitude = 0.01;
            // Of a pendulum a finite swing is slower by amplitude²/16 = 6e-6; less with a spring.
            let expected = ((G * lever + stiffness) / inertia).sqrt();
            let found = swing(&plan, axis, amplitude, 1e-4);
            let apart = found / expected - 1.0;
            println!("{name}, axis {axis}: {found:.6} rad/s, closed form {expected:.6}, {apart:.1e} apart");
            // And (ωh)²/24 = 1e-6 of the step at 25 rad/s, and the parabolas through the peaks.
            assert!(apart.abs() < 2e-5, "{name}, axis {axis}: {found} rad/s, expected {expected}");
        }
    }
}

#[test]
fn a_large_swing_is_slower_by_the_arithmetic_geometric_mean() {
    let plan = pendulum(0.0);
    for (axis, amplitude) in [(1, 0.8_f64), (2, 0.8), (2, 0.4)] {
        let (inertia, lever) = inertia_and_lever(&plan, axis);
        // Gauss: the period is 2π/ω over the arithmetic-geometric mean of 1 and cos(amplitude/2).
        let (mut a, mut b) = (1.0_f64, (0.5 * amplitude).cos());
        for _ in 0..6 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let expected = (G * lever / inertia).sqrt() * a;
        let found = swing(&plan, axis, amplitude, 1e-4);
        println!("{amplitude} rad about axis {axis}: {found:.6} rad/s, closed form {expected:.6}");
        assert!((found / expected - 1.0).abs() < 1e-5, "{amplitude} rad: {found} rad/s, expected {expected}");
    }
}

#[test]
fn a_hardening_hinge_swings_as_duffings() {
    for (axis, amplitude, hardening) in [(1, 0.3_f64, 20.0), (2, 0.3, 20.0), (2, 0.2, 5.0)] {
        let mut plan = Plan { gravity: [0.0; 3], ..pendulum(2e-3) };
        plan.backbones[0].hardening[axis] = hardening;
        let (inertia, _) = inertia_and_lever(&plan, axis);
        // Energy with q = A sin θ: a quarter period is ∫ dθ / √(k/I (1 + ½ h A² (1 + sin² θ))), by the midpoint rule, which
        // of a period is exact to rounding.
        let count = 64;
        let at = |i: i32| {
            let sin = (0.5 * PI * (f64::from(i) + 0.5) / f64::from(count)).sin();
            (2e-3 / inertia * (1.0 + 0.5 * hardening * amplitude * amplitude * (1.0 + sin * sin))).sqrt().recip()
        };
        let expected = (f64::from(count)) / (0..count).map(at).sum::<f64>();
        let found = swing(&plan, axis, amplitude, 1e-4);
        let linear = (2e-3 / inertia).sqrt();
        println!("{amplitude} rad about axis {axis}: {found:.6} rad/s, closed form {expected:.6}, linear {linear:.6}");
        assert!(expected > 1.05 * linear, "the case hardens");
        assert!((found / expected - 1.0).abs() < 2e-5, "{amplitude} rad: {found} rad/s, expected {expected}");
    }
}

/// Angles at rest of a plane chain of boxes that sags from a clamped end under gravity across it, by Newton on the
/// balance of torques: `k θ_i = Σ_{j ≥ i} g m_j (x_j − x_i)`, x along the level from the clamp.
fn sagging(stiffness: f64, links: &[(f64, f64, f64)], gravity: f64) -> Vec<f64> {
    // Each link: mass, distance of its centre from its hinge, its length to the next hinge.
    let residual = |angles: &[f64]| -> Vec<f64> {
        let (mut slope, mut hinge) = (0.0, 0.0);
        let mut places = vec![];
        for (angle, (mass, centre, length)) in angles.iter().zip(links) {
            slope += angle;
            places.push((*mass, hinge, hinge + centre * f64::cos(slope)));
            hinge += length * f64::cos(slope);
        }
        let torque = |i: usize| places[i..].iter().map(|(mass, _, x)| gravity * mass * (x - places[i].1)).sum::<f64>();
        angles.iter().enumerate().map(|(i, angle)| stiffness * angle - torque(i)).collect()
    };
    let count = links.len();
    let mut angles = vec![0.0; count];
    for _ in 0..30 {
        let here = nalgebra::DVector::from_vec(residual(&angles));
        let jacobian = nalgebra::DMatrix::from_fn(count, count, |i, j| {
            let moved = |by: f64| {
                let mut moved = angles.clone();
                moved[j] += by;
                residual(&moved)[i]
            };
            (moved(1e-6) - moved(-1e-6)) / 2e-6
        });
        let change = jacobian.lu().solve(&here).unwrap();
        angles.iter_mut().zip(change.iter()).for_each(|(angle, change)| *angle -= change);
    }
    angles
}

#[test]
fn a_chain_at_rest_balances_its_torques() {
    // Bent a little by the stiff axis, and much by a soft one.
    for (softer, least_slope) in [(1.0, 0.05), (12.0, 0.9)] {
        let mut plan = damped(bench(), 10.0);
        plan.backbones[0].stiffness = plan.backbones[0].stiffness.map(|k| k / softer);
        plan.gravity = [0.0, 0.0, -G];
        let (backbone, tip) = (plan.backbones[0], plan.modules[1]);
        let length = backbone.length / backbone.segments as f64;
        let mut links = vec![(backbone.segment_mass, 0.5 * length, length); backbone.segments];
        let last = links.last_mut().unwrap();
        let mass = backbone.segment_mass + tip.mass;
        let lever = backbone.segment_mass * 0.5 * length + tip.mass * (length + 0.5 * tip.size[0]);
        *last = (mass, lever / mass, length);
        let expected = sagging(backbone.stiffness[1], &links, G);
        let (start, body) = (alone(&plan, 1e-4).snapshot(0), rest(&plan, 1e-4));
        let found = body.coordinates(0);
        let slope: f64 = expected.iter().sum();
        assert!(slope > least_slope, "the case bends by {slope} rad only");
        let mut worst = 0.0_f64;
        for (hinge, expected) in expected.iter().enumerate() {
            // The rear, which runs along −x, goes down where the hinges turn by −θ about y.
            let off = (found.angles[hinge][1] + expected).abs() / slope;
            worst = worst.max(off);
            assert!(off < 1e-8, "hinge {hinge}: {} rad, balance of torques {expected}", found.angles[hinge][1]);
        }
        let sag = start.modules[1].position[2] - body.snapshot(0).modules[1].position[2];
        println!("k/{softer}: tip slope {slope:.4} rad, sag {:.3} mm, hinges {worst:.1e} of the slope off", 1e3 * sag);
        assert!(sag > 0.0, "the tip rises by {} m", -sag);
    }
}

/// Potential energy, J.
fn potential(plan: &Plan, skeleton: &Skeleton, at: &Coordinates) -> f64 {
    let balance = at.balance(plan, skeleton);
    energy(&balance) - balance.kinetic
}

#[test]
fn a_rolled_chain_rests_where_its_potential_is_least() {
    // In space and not in a plane: every backbone rolled, clamped at an inner module, the eccentric to the side.
    for clamped in 0..4 {
        let plan = damped(in_space(robot(4, 50.0)), 50.0);
        let plan = Plan { clamped: Some(clamped), gravity: [1.0, 2.0, -G], ..plan };
        let body = rest(&plan, 1e-4);
        let (at, skeleton) = (body.coordinates(0), Skeleton::new(&plan));
        let (mut worst, mut largest, mut widest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for joint in 0..plan.joints() {
            for axis in 0..3 {
                let moved = |by: f64| {
                    let mut moved = at.clone();
                    moved.angles[joint][axis] += by;
                    potential(&plan, &skeleton, &moved)
                };
                // The balance of torques is the gradient of the potential; 1e-3 rad because the potential has 16 digits.
                let torque = (8.0 * (moved(1e-3) - moved(-1e-3)) - (moved(2e-3) - moved(-2e-3))) / 12e-3;
                worst = worst.max(torque.abs());
                let backbone = &plan.backbones[joint / 10];
                largest = largest.max((backbone.stiffness[axis] * at.angles[joint][axis]).abs());
                widest = widest.max(at.angles[joint][axis].abs());
            }
        }
        println!(
            "clamped at module {clamped}: {worst:.1e} N·m of {largest:.1e} left over, angles up to {widest:.3} rad"
        );
        assert!(widest > 0.05 && widest < PI / 4.0, "the case bends by {widest} rad");
        assert!(worst < 1e-8 * largest.max(1e-3) + 1e-11, "{worst} N·m of {largest} N·m are out of balance");
    }
}
