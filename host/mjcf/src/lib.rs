//! The body as MJCF, MuJoCo's model format, so that the same robot runs in both.
//!
//! Carried over exactly: masses, geometry, hinges with damping and stiffness (one that grows with the angle, too), clamp,
//! gravity (on a slope it leans, the ground stays level), the eccentric with a position servo. Steps become boxes with vertical faces; patches of other
//! friction become boxes, too. Not carried over: the normal force and the grip of the feet, because MuJoCo's contact is a
//! soft constraint (`solref`, `solimp`) and not `F = k δ (1 + χ dδ/dt)`; a friction that depends on speed, direction or
//! load is refused.
//!
//! Names: bodies `m1` (module) and `b1s2` (backbone 1, segment 2), hinges `b1h2x`, sites `module1` and `foot1L`, geoms
//! `foot1L` and `bolt`, joint and actuator `rotor`. MuJoCo's rotor angle is counter-clockwise positive.
//!
//! Format: <https://mujoco.readthedocs.io/en/stable/XMLreference.html>.
//!
//! ```
//! use std::path::Path;
//!
//! use hal_sim::body::Plan;
//!
//! let robot = robot_file::Robot::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml")))?;
//! let text = mjcf::model(&robot.name, &Plan::new(&robot)?, &mjcf::Options::default())?;
//! assert!(text.contains("<mujoco model=\"scram-26\">"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It does not run MuJoCo, and needs none.
//! * It reads no MJCF.

mod chain;
mod ground;
mod words;
mod write;
mod xml;

use effects::Id;
use hal_sim::body::Plan;
use hal_sim::body::plan::Module;
pub use words::{Cone, Integrator, Solver};

/// How MuJoCo is to run the model. Defaults: the settings of the reference comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The module (from 0) that carries the free joint; module 1 or the clamped one when nothing is said. Without
    /// contact it makes no difference; with contact MuJoCo's speeds depend on it.
    pub root: Option<usize>,
    /// Whether the feet touch the ground.
    pub contact: bool,
    /// MuJoCo's time step, s.
    pub timestep_s: f64,
    /// Method of integration.
    pub integrator: Integrator,
    /// Friction cone.
    pub cone: Cone,
    /// Ratio of friction's to the normal's constraint impedance: above 1 for less slip.
    pub impratio: f64,
    /// What solves the contacts.
    pub solver: Solver,
    /// Stiffness of the rotor's position servo, N·m/rad, where the robot file has none.
    pub servo_nm_per_rad: f64,
    /// Damping of the rotor's position servo, N·m·s/rad, where the robot file has none.
    pub servo_nm_s_per_rad: f64,
    /// Time constant (s) and damping ratio of a contact.
    pub solref: [f64; 2],
    /// Impedance of a contact: least, largest, width (m), midpoint, power.
    pub solimp: [f64; 5],
}

impl Default for Options {
    fn default() -> Self {
        Self {
            root: None,
            contact: true,
            timestep_s: 1e-4,
            integrator: Integrator::ImplicitFast,
            cone: Cone::Elliptic,
            impratio: 10.0,
            solver: Solver::Newton,
            servo_nm_per_rad: 0.08,
            servo_nm_s_per_rad: 2.5e-4,
            solref: [0.004, 1.0],
            solimp: [0.9, 0.95, 0.001, 0.5, 2.0],
        }
    }
}

/// Why a body has no MuJoCo model.
#[derive(Clone, Debug, PartialEq, thiserror::Error, miette::Diagnostic)]
pub enum MjcfError {
    /// There is no such module.
    #[error("there is no module {} for the free joint: the robot has {modules}", root + 1)]
    #[diagnostic(help("modules are counted from the front, which is 1"))]
    NoModule {
        /// From 0.
        root: usize,
        /// How many there are.
        modules: usize,
    },
    /// A clamped robot has no free joint elsewhere.
    #[error("module {} is clamped and the tree of bodies begins there, not at module {}", clamped + 1, root + 1)]
    #[diagnostic(help("leave the root out"))]
    Clamped {
        /// From 0.
        clamped: usize,
        /// From 0.
        root: usize,
    },
    /// MuJoCo has no such friction.
    #[error("MuJoCo has no friction that {what}: [effects.{effect}] cannot be exported")]
    #[diagnostic(help("take [effects.{effect}] out of the robot file, or export without contact"))]
    Friction {
        /// The table of the robot file.
        effect: &'static str,
        /// What it does.
        what: &'static str,
    },
    /// MuJoCo takes a contact's friction from the foot or from the ground, not from both.
    #[error("module {} has a foot with a friction of its own, and the ground has patches: MuJoCo's contact has one of them", module + 1)]
    #[diagnostic(help(
        "take ground.patches_m and ground.steps_m, or what makes the feet unequal, out of the robot file, or export without contact"
    ))]
    FootOnPatches {
        /// From 0.
        module: usize,
    },
    /// Too many elements inside each other.
    #[error("{hinges} triples of hinges on one side of the root are more than MuJoCo's XML reader takes: {most}")]
    #[diagnostic(help("put the root into the middle of the robot, or use fewer segments"))]
    TooLong {
        /// On the longer side of the root.
        hinges: usize,
        /// What it takes.
        most: usize,
    },
    /// A setting that is no positive number.
    #[error("{what} must be a positive number, not {value}")]
    Setting {
        /// Option that is out of range.
        what: &'static str,
        /// Value that was given.
        value: f64,
    },
}

/// Bodies inside each other that TinyXML-2, MuJoCo's reader, takes: 500 elements, less `mujoco`, `worldbody`, the root
/// with its `geom`, and the rotor's body.
const MOST_TRIPLES: usize = 494;

/// The model of a body as text.
///
/// # Errors
/// MuJoCo cannot express it.
pub fn model(name: &str, plan: &Plan, options: &Options) -> Result<String, MjcfError> {
    let chain = chain::Chain::new(plan);
    let root = root(plan, options)?;
    let behind = chain.triples.iter().filter(|triple| triple.backbone >= root).count();
    let hinges = behind.max(chain.triples.len() - behind);
    if hinges > MOST_TRIPLES {
        return Err(MjcfError::TooLong { hinges, most: MOST_TRIPLES });
    }
    let positive = [
        ("the time step", options.timestep_s),
        ("impratio", options.impratio),
        ("the servo's stiffness", options.servo_nm_per_rad),
        ("the servo's damping", options.servo_nm_s_per_rad),
    ];
    if let Some((what, value)) = positive.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
        return Err(MjcfError::Setting { what, value });
    }
    if options.contact {
        friction(plan)?;
    }
    Ok(write::model(name, plan, options, &chain, root))
}

/// Where the tree of bodies begins.
fn root(plan: &Plan, options: &Options) -> Result<usize, MjcfError> {
    let modules = plan.modules.len();
    match (plan.clamped, options.root) {
        (_, Some(root)) if root >= modules => Err(MjcfError::NoModule { root, modules }),
        (Some(clamped), Some(root)) if root != clamped => Err(MjcfError::Clamped { clamped, root }),
        (Some(clamped), _) => Ok(clamped),
        (None, root) => Ok(root.unwrap_or(1)),
    }
}

/// Refuses what MuJoCo's friction cannot do.
fn friction(plan: &Plan) -> Result<(), MjcfError> {
    let Some(contact) = &plan.contact else { return Ok(()) };
    let own = |module: &Module| (0..2).any(|side| module.has_foot[side] && module.friction_shares[side] != 1.0);
    let boxes = !(contact.patches.is_empty() && contact.steps.is_empty());
    if let Some(module) = plan.modules.iter().position(own).filter(|_| boxes) {
        return Err(MjcfError::FootOnPatches { module });
    }
    let unknown = |id: Id| Some((id.name(), id.spec().not_in_mujoco?));
    match contact.laws.listed().find_map(unknown) {
        Some((effect, what)) => Err(MjcfError::Friction { effect, what }),
        None => Ok(()),
    }
}
