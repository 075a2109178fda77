//! The catalogue of effects: what a robot can have beyond the linear motor on a bench and Coulomb's friction on the ground.
//!
//! An effect is one file in `src/catalogue/`: its law with the source, its parameters with their ranges, how a fit moves
//! them, the state that it carries, where it shows, what it is mistaken for, and its sentences for people. From that file
//! follow its table `[effects.NAME]` in the robot file with checks and documentation, its part in the simulation, its place
//! among the candidates of a diagnosis, and the report's words. A new one is one file and one line in [`catalogue`];
//! `docs/adding-an-effect.md` walks through it.
//!
//! ```
//! use effects::{CoulombFriction, Id, Laws};
//!
//! // A law in SI units and radians, at work:
//! let friction = CoulombFriction { torque_nm: 2e-3, presliding_rad: 3e-3 };
//! let laws = Laws { coulomb_friction: Some(friction), ..Laws::NONE };
//! assert_eq!(laws.friction_level(0.0, 10.0, 0.0), 2e-3);
//!
//! // What is known about it, by its name in the robot file:
//! let id = Id::of("coulomb_friction").unwrap();
//! assert_eq!(id.spec().parameters[0].key, "torque_nm");
//! ```
//!
//! Not here: reading robot files (`robot_file`), the mechanics that the laws act in (`hal-sim`), fitting (`diagnose`).

pub mod catalogue;
mod effect;
mod fit;
mod reference;
mod relaxation;
mod spec;

pub use catalogue::*;
pub use effect::{BridgeDrop, Coupling, Drag, Effect};
pub use fit::{FitNumber, Scale, Sizes};
pub use reference::markdown;
pub use spec::{Acts, Confusion, Coordinate, Parameter, Spec};
