//! The rig of thesis figure 3.3, simulated: a backbone held fast at one end, a module at the other, let go.

use std::f64::consts::TAU;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use hal_sim::body::coordinates::Coordinates;
use hal_sim::body::skeleton::{Matrix, Skeleton, product, transposed};
use hal_sim::body::{Drive, Ensemble, Plan, Precision, Settings};
use rayon::prelude::*;
use robot_file::Robot;

use super::BackboneError;

/// How the backbone stands in the room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gravity {
    /// It lies level, its z axis up.
    #[default]
    Level,
    /// It hangs from its fast end.
    Hanging,
    /// Gravity is left out: what it does to the oscillation is small against the backbone's stiffness.
    None,
}

/// Numbers of a start: shape and rate of the hinges about x (one each), y and z (two each).
pub const START: usize = 10;
/// Of a start, per axis: where its shape and its rates stand, and how many of each there are.
const SHAPES: [(usize, usize); 3] = [(0, 1), (1, 2), (3, 2)];
/// From a number of the shape to the same of the rates.
const RATES: usize = 5;
/// Between two points of a simulated oscillation, s.
pub const POINT_S: f64 = 1e-3;
/// Steps that are tried, s: the longest that carries the hinges is taken.
const STEPS_S: [f64; 4] = [1e-4, 5e-5, 2.5e-5, 1.25e-5];
/// Bodies of one ensemble.
const TOGETHER: usize = 8;
/// To find where it rests, the hinges' damping times this, and for so long, s.
const CALM: (f64, f64) = (6.0, 0.5);

/// Stiffness (N·m/rad) of a hinge about x, y, z, and damping (N·m·s/rad).
pub type Hinges = [f64; 6];

/// The rig, but for what is looked for.
#[derive(Debug)]
pub struct Rig<'a> {
    plan: Plan,
    /// Once it is true nothing can be simulated any more.
    stop: &'a AtomicBool,
    /// Oscillations that were simulated.
    simulated: AtomicUsize,
}

/// One oscillation to simulate.
#[derive(Clone, Debug)]
pub struct Release {
    /// Of the backbone.
    pub hinges: Hinges,
    /// Where its hinges stand and how they move at the first sample: angle of the end, rad, and how much more of it comes from the
    /// hinges at the end; then their rates.
    pub start: [f64; START],
    /// How long, s.
    pub seconds: f64,
}

impl<'a> Rig<'a> {
    /// From a robot file: the first backbone, with `module` (from 1) at its end. It works until `stop` is true.
    ///
    /// # Errors
    /// The file has no body or no such module.
    pub fn new(
        robot: &Robot,
        module: Option<usize>,
        gravity: Gravity,
        stop: &'a AtomicBool,
    ) -> Result<Self, BackboneError> {
        let whole = Plan::new(robot).map_err(|error| BackboneError::Robot(error.to_string()))?;
        let number = module.unwrap_or(whole.modules.len());
        let Some(end) = number.checked_sub(1).and_then(|place| whole.modules.get(place)) else {
            return Err(BackboneError::Robot(format!(
                "there is no module {number}: the robot has {}",
                whole.modules.len()
            )));
        };
        let mut backbone = whole.backbones[0];
        backbone.roll = 0.0;
        let g = hal_sim::body::plan::GRAVITY;
        let plan = Plan {
            modules: vec![*end, *end],
            backbones: vec![backbone],
            eccentric: None,
            contact: None,
            clamped: Some(0),
            gravity: match gravity {
                Gravity::Level => [0.0, 0.0, -g],
                // The free end points to −x.
                Gravity::Hanging => [-g, 0.0, 0.0],
                Gravity::None => [0.0; 3],
            },
            walls: vec![],
        };
        Ok(Self { plan, stop, simulated: AtomicUsize::new(0) })
    }

    /// What the file says.
    #[must_use]
    pub fn file(&self) -> Hinges {
        let backbone = &self.plan.backbones[0];
        let ([kx, ky, kz], [dx, dy, dz]) = (backbone.stiffness, backbone.damping);
        [kx, ky, kz, dx, dy, dz]
    }

    /// Moment of inertia that a hinge at the fast end has to move about x, y, z, kg·m²: what stiffness is known against.
    #[must_use]
    pub fn inertia(&self) -> [f64; 3] {
        let (end, backbone) = (&self.plan.modules[1], &self.plan.backbones[0]);
        let [x, y, z] = end.principal_inertia();
        let arm = backbone.length + 0.5 * end.size[0];
        [x, y + end.mass * arm * arm, z + end.mass * arm * arm]
    }

    /// Whether it was told to stop.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// How many oscillations were simulated so far.
    #[must_use]
    pub fn simulated(&self) -> usize {
        self.simulated.load(Ordering::Relaxed)
    }

    fn with(&self, [kx, ky, kz, dx, dy, dz]: Hinges) -> Plan {
        let mut plan = self.plan.clone();
        plan.backbones[0].stiffness = [kx, ky, kz];
        plan.backbones[0].damping = [dx, dy, dz];
        plan
    }

    /// Rotation vectors of the end against its pose at rest, world frame, rad, every [`POINT_S`]; `None` where no step carries
    /// the hinges, or it was told to stop.
    pub fn oscillations(&self, releases: &[Release]) -> Option<Vec<Vec<[f64; 3]>>> {
        if self.is_stopped() {
            return None;
        }
        self.simulated.fetch_add(releases.len(), Ordering::Relaxed);
        let mut different: Vec<Hinges> = Vec::new();
        let mut places = Vec::new();
        for release in releases {
            let known = different.iter().position(|hinges| *hinges == release.hinges);
            places.push(known.unwrap_or(different.len()));
            if known.is_none() {
                different.push(release.hinges);
            }
        }
        let rests = in_groups(&different, |some| self.rests(some))?;
        let rested: Vec<(&Release, &Coordinates)> =
            releases.iter().zip(places).map(|(release, place)| (release, &rests[place])).collect();
        in_groups(&rested, |some| self.some_oscillations(some))
    }

    /// Where the backbone rests under its end's weight.
    fn rests(&self, hinges: &[Hinges]) -> Option<Vec<Coordinates>> {
        let nominal = Coordinates::nominal(&self.plan);
        if self.plan.gravity == [0.0; 3] {
            return Some(vec![nominal; hinges.len()]);
        }
        let calmed = hinges
            .iter()
            .map(|&[kx, ky, kz, dx, dy, dz]| self.with([kx, ky, kz, CALM.0 * dx, CALM.0 * dy, CALM.0 * dz]));
        let mut bodies = ensemble(&calmed.collect::<Vec<_>>())?;
        bodies.advance((CALM.1 / bodies.step_s()) as usize, &vec![STILL; hinges.len()]);
        let still = |body| Coordinates { rates: nominal.rates.clone(), ..bodies.coordinates(body) };
        Some((0..hinges.len()).map(still).collect())
    }

    fn some_oscillations(&self, releases: &[(&Release, &Coordinates)]) -> Option<Vec<Vec<[f64; 3]>>> {
        let plans: Vec<Plan> = releases.iter().map(|(release, _)| self.with(release.hinges)).collect();
        let mut bodies = ensemble(&plans)?;
        let skeletons: Vec<Skeleton> = plans.iter().map(Skeleton::new).collect();
        let end = |at: &Coordinates, body: usize| at.parts(&plans[body], &skeletons[body]).modules[1].rotation;
        let mut upright = Vec::new();
        for (body, (release, rest)) in releases.iter().enumerate() {
            upright.push(transposed(end(rest, body)));
            bodies.put(body, &bent(rest, &release.start));
        }
        let still = vec![STILL; releases.len()];
        let steps = (POINT_S / bodies.step_s()).round() as usize;
        let points = |seconds: f64| (seconds / POINT_S).ceil() as usize + 2;
        let most = releases.iter().map(|(release, _)| points(release.seconds)).max().unwrap_or(0);
        let mut out = vec![Vec::new(); releases.len()];
        for point in 0..most {
            for (body, (release, _)) in releases.iter().enumerate() {
                if point < points(release.seconds) {
                    let turned = product(end(&bodies.coordinates(body), body), upright[body]);
                    out[body].push(rotation_vector(turned));
                }
            }
            bodies.advance(steps, &still);
        }
        out.iter().flatten().flatten().all(|angle| angle.is_finite()).then_some(out)
    }
}

const STILL: Drive = Drive::Phase { speed: 0.0 };

/// Works on a few at a time, side by side; `None` where any is.
fn in_groups<T: Sync, R: Send>(all: &[T], work: impl Fn(&[T]) -> Option<Vec<R>> + Send + Sync) -> Option<Vec<R>> {
    let groups: Option<Vec<Vec<R>>> = all.par_chunks(TOGETHER).map(work).collect();
    groups.map(|groups| groups.into_iter().flatten().collect())
}

/// Bodies with the longest step that carries their hinges.
fn ensemble(plans: &[Plan]) -> Option<Ensemble> {
    let settings = |step_s| Settings { step_s, precision: Precision::Double };
    STEPS_S.iter().find_map(|&step_s| Ensemble::new(plans, settings(step_s)).ok())
}

/// From rest, the hinges share the end's angle so that the bending moment is linear along the backbone, as any load at its end
/// makes it.
fn bent(rest: &Coordinates, start: &[f64; START]) -> Coordinates {
    let mut at = rest.clone();
    let joints = at.angles.len();
    for joint in 0..joints {
        let along = if joints > 1 { 2.0 * joint as f64 / (joints - 1) as f64 - 1.0 } else { 0.0 };
        for (axis, (first, count)) in SHAPES.into_iter().enumerate() {
            let share = |from: usize| {
                let more = if count > 1 { along * start[from + 1] } else { 0.0 };
                (start[from] + more) / joints as f64
            };
            at.angles[joint][axis] += share(first);
            at.rates[joint][axis] += share(first + RATES);
        }
    }
    at
}

/// How wide a number of a start may be: rad, and rad/s.
#[must_use]
pub fn widest(number: usize) -> f64 {
    if number < RATES { 1.0 } else { 10.0 * TAU }
}

/// Numbers of a start that move the end about an axis.
pub fn of_axis(axis: usize) -> impl Iterator<Item = usize> {
    let (first, count) = SHAPES[axis];
    (first..first + count).flat_map(|number| [number, number + RATES])
}

/// Axis times angle of a rotation, rad.
#[must_use]
pub fn rotation_vector(m: Matrix) -> [f64; 3] {
    let [w, x, y, z] = hal_sim::body::coordinates::quaternion(m);
    let sine = (x * x + y * y + z * z).sqrt();
    let scale = if sine < 1e-9 { 2.0 } else { 2.0 * sine.atan2(w) / sine };
    [x * scale, y * scale, z * scale]
}

/// An oscillation between its points: cubic through the four around a time (s) after the first.
#[must_use]
pub fn between(points: &[[f64; 3]], time_s: f64) -> [f64; 3] {
    let place = (time_s / POINT_S).clamp(0.0, (points.len() - 1) as f64);
    let last = points.len() - 1;
    let k = (place as usize).min(last.saturating_sub(1));
    let u = place - k as f64;
    [0, 1, 2].map(|axis| {
        let (b, c) = (points[k][axis], points[(k + 1).min(last)][axis]);
        // Beyond the ends it goes on straight.
        let a = if k > 0 { points[k - 1][axis] } else { 2.0 * b - c };
        let d = points.get(k + 2).map_or(2.0 * c - b, |point| point[axis]);
        b + 0.5 * u * (c - a + u * (2.0 * a - 5.0 * b + 4.0 * c - d + u * (3.0 * (b - c) + d - a)))
    })
}
