//! What the tests of the body share: plans made from the default robot's, and small ways to run and judge them.

use hal_sim::body::coordinates::{Balance, Coordinates};
use hal_sim::body::plan::Backbone;
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings};
use robot_file::robot::ModuleKind;

use super::default_robot;

pub const G: f64 = 9.81;
/// The eccentric stands still against its module.
pub const STILL: Drive = Drive::Phase { speed: 0.0 };

/// The default robot with so many modules, its backbones rolled by α, 2α, …
pub fn robot(modules: usize, alpha_deg: f64) -> Plan {
    let mut robot = default_robot();
    let kind = |k| [ModuleKind::Actuator, ModuleKind::Courier].get(k).copied().unwrap_or(ModuleKind::Passive);
    robot.body.as_mut().unwrap().modules = (0..modules).map(kind).collect();
    robot.backbone.as_mut().unwrap().alpha_deg.value = alpha_deg;
    Plan::new(&robot).unwrap()
}

/// Without ground and weight.
pub fn in_space(plan: Plan) -> Plan {
    Plan { contact: None, gravity: [0.0; 3], ..plan }
}

/// Module 1 held fast, a passive module of 6 g behind one backbone, no eccentric, no ground, no weight.
pub fn bench() -> Plan {
    let mut plan = in_space(robot(3, 0.0));
    plan.modules.remove(1);
    plan.backbones.truncate(1);
    Plan { eccentric: None, clamped: Some(0), ..plan }
}

/// The same robot with everything that a robot may have unevenly: an off-centre mass, a module heavier and with another
/// inertia than its kind's, a missing foot, a short leg, feet and backbones unlike each other, hardening.
pub fn uneven(mut plan: Plan) -> Plan {
    plan.modules[1].mass_centre = [0.002, -0.006, 0.001];
    plan.modules[1].inertia = Some([8e-6, 1e-6, 8.5e-6]);
    plan.modules[2].mass *= 1.5;
    plan.modules[2].has_foot[0] = false;
    plan.modules[3].feet[1][2] += 5e-4;
    for (k, module) in plan.modules.iter_mut().enumerate() {
        module.friction_shares = [1.0 - 0.1 * k as f64, 0.8 + 0.15 * k as f64];
    }
    for (b, backbone) in plan.backbones.iter_mut().enumerate() {
        let (share, squared) = (0.8 + 0.3 * b as f64, (backbone.segments * backbone.segments) as f64);
        backbone.stiffness = backbone.stiffness.map(|k| share * k);
        backbone.damping = backbone.damping.map(|d| d / share);
        backbone.hardening = [0.5, 1.0 + 0.5 * b as f64, 3.0].map(|share| share * squared);
    }
    plan
}

/// What the mirror in the plane of x and z shows of a robot whose backbones roll by α, as a robot whose backbones roll by
/// `180° − α`.
pub fn mirrored(plan: &Plan, alpha_deg: f64) -> Plan {
    let mut image = Plan { modules: plan.modules.clone(), ..robot(plan.modules.len(), 180.0 - alpha_deg) };
    for module in &mut image.modules {
        module.mass_centre[1] *= -1.0;
        module.feet = [1, 0].map(|side| [module.feet[side][0], -module.feet[side][1], module.feet[side][2]]);
        module.has_foot.swap(0, 1);
        module.friction_shares.swap(0, 1);
    }
    for (image, backbone) in image.backbones.iter_mut().zip(&plan.backbones) {
        *image = Backbone { roll: image.roll, ..*backbone };
    }
    image
}

/// The same backbones as chains of so many segments: the compliance, mass and damping times of a whole backbone stay.
pub fn segmented(mut plan: Plan, segments: usize) -> Plan {
    for backbone in &mut plan.backbones {
        let share = segments as f64 / backbone.segments as f64;
        backbone.segment_mass /= share;
        backbone.stiffness = backbone.stiffness.map(|k| k * share);
        backbone.damping = backbone.damping.map(|d| d * share);
        backbone.hardening = backbone.hardening.map(|h| h * share * share);
        backbone.segments = segments;
    }
    plan
}

/// Every hinge's damping times a factor.
pub fn damped(mut plan: Plan, factor: f64) -> Plan {
    for backbone in &mut plan.backbones {
        backbone.damping = backbone.damping.map(|d| factor * d);
    }
    plan
}

/// Two passive modules that a hundred N·m/rad keep in line, next to a rigid block, with their centres at this height (m)
/// over the feet's lowest points. A low one pitches little while it brakes.
pub fn block(centre_height: f64) -> Plan {
    let mut plan = segmented(robot(4, 0.0), 1);
    let contact = plan.contact.as_ref().unwrap();
    let down = contact.foot_radius - centre_height;
    plan.modules.drain(..2);
    plan.backbones.truncate(1);
    plan.eccentric = None;
    for module in &mut plan.modules {
        module.centre_height = centre_height;
        module.feet = module.feet.map(|[x, y, _]| [x, y, down]);
    }
    // Next to no mass, or the block would not be symmetric.
    plan.backbones[0].segment_mass = 1e-7;
    plan.backbones[0].stiffness = [100.0; 3];
    plan.backbones[0].damping = [0.02; 3];
    plan
}

pub fn settings(step_s: f64) -> Settings {
    Settings { step_s, precision: Precision::Double }
}

/// One body.
pub fn alone(plan: &Plan, step_s: f64) -> Ensemble {
    Ensemble::new(std::slice::from_ref(plan), settings(step_s)).unwrap()
}

/// One body that starts from these coordinates.
pub fn from(plan: &Plan, start: &Coordinates, step_s: f64) -> Ensemble {
    let mut body = alone(plan, step_s);
    body.put(0, start);
    body
}

/// Advances for a time, s.
pub fn run(body: &mut Ensemble, time_s: f64, drive: Drive) {
    let drives = vec![drive; body.len()];
    body.advance((time_s / body.step_s()).round() as usize, &drives);
}

/// Runs until nothing moves.
pub fn rest(plan: &Plan, step_s: f64) -> Ensemble {
    let mut body = alone(plan, step_s);
    for _ in 0..40 {
        run(&mut body, 0.5, STILL);
        if body.balance(0).kinetic < 1e-24 {
            return body;
        }
    }
    panic!("still moves after 20 s: {:e} J", body.balance(0).kinetic);
}

pub fn energy(balance: &Balance) -> f64 {
    balance.kinetic + balance.elastic + balance.gravity
}

pub fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| a[i] - b[i])
}

/// Mean velocity of the modules' centres, m/s.
pub fn velocity(body: &Ensemble, i: usize) -> [f64; 3] {
    let plan = &body.plans()[i];
    let parts = body.coordinates(i).parts(plan, &hal_sim::body::skeleton::Skeleton::new(plan));
    let count = parts.modules.len() as f64;
    [0, 1, 2].map(|axis| parts.modules.iter().map(|module| module.velocity[axis]).sum::<f64>() / count)
}

/// Orders of convergence between errors at steps that halve.
pub fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

/// Times (s) and heights of the maxima of a signal sampled at even times, by parabolas through three samples.
pub fn maxima(signal: &[f64], step_s: f64) -> Vec<(f64, f64)> {
    let windows = signal.windows(3).enumerate().filter(|(_, w)| w[1] > w[0] && w[1] >= w[2]);
    windows
        .map(|(index, w)| {
            let (curvature, slope) = (0.5 * (w[0] - 2.0 * w[1] + w[2]), 0.5 * (w[2] - w[0]));
            ((index as f64 + 1.0 - 0.5 * slope / curvature) * step_s, w[1] - 0.25 * slope * slope / curvature)
        })
        .collect()
}

/// Frequency (Hz) and logarithmic decrement from the first `count` maxima.
pub fn frequency_and_decrement(signal: &[f64], step_s: f64, count: usize) -> (f64, f64) {
    let peaks = maxima(signal, step_s);
    let (first, last) = (peaks[0], peaks[count - 1]);
    let periods = (count - 1) as f64;
    (periods / (last.0 - first.0), (first.1 / last.1).ln() / periods)
}

/// How far `a` is above `b`, %.
pub fn apart_percent(a: f64, b: f64) -> f64 {
    100.0 * (a / b - 1.0)
}

/// Numbers with two digits.
pub fn brief(numbers: &[f64]) -> String {
    numbers.iter().map(|number| format!("{number:.1e}")).collect::<Vec<_>>().join(", ")
}
