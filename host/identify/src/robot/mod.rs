//! The numbers that decide a walk, from mean speeds over conditions: thesis section 3.3, with its loss (3.2) reported beside what is minimised.
//!
//! What nobody can measure one by one (the hinges, the feet's law and each foot's friction, the eccentric's weight and height, where the
//! courier's weight lies) is looked for by its effect on three speeds under every condition. There are more numbers than such a table
//! tells apart, so each has a belief: the robot file's value with its spread. The result is the most probable set given both
//! (maximum a posteriori), and for each number how much narrower the table makes the belief ([`Parameter::told`]).
//!
//! In order:
//!
//! 1. `table`: means over the repeats with their scatter, which is pooled over the conditions; a part of the conditions is held out;
//! 2. `numbers`: which numbers, and what is believed of them;
//! 3. `fit`: sets drawn from the belief are tried; the most probable are followed down by Levenberg and Marquardt, with speeds that count
//!    little at first and fewer sets from stage to stage, for a table has several valleys;
//! 4. `ensemble`: from the lowest of them to where the speeds count in full;
//! 5. `outcome`: intervals from the curvature, widened where the model leaves more than the repeats scatter by, and no narrower than
//!    other valleys and the ensembles' members lie apart.
//!
//! The eccentric turns at exactly the condition's frequency, as in `scram sweep --drive ideal --phase-noise 0`.

mod cache;
mod captured;
mod ensemble;
mod error;
mod fit;
mod numbers;
mod outcome;
mod posterior;
mod table;
mod walk;

pub use captured::{Placement, speeds};
pub use error::RobotError;
pub use fit::{Options, Progress, Search, Stage, best_of, identify, in_pool, rough_minima};
pub use numbers::{Number, Numbers};
pub use outcome::{ComponentError, ConditionFit, Parameter, RobotFit, freedom};
pub use posterior::Posterior;
pub use table::{Held, Table};
pub use walk::{Run, rolled, speeds as simulate};

#[cfg(test)]
mod tests;
