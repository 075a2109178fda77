//! robot.toml, the one description: reading it with good errors ([`Robot`]), changing it by program ([`edit`]), the meaning
//! of its sensor ([`angle_code`]) and the controller that follows from it ([`design`]). Beside it the files of gaits that a robot
//! plays ([`gait`]).
pub mod angle_code;
pub mod design;
pub mod edit;
mod error;
pub mod gait;
pub mod image;
mod parts;
pub mod reference;
pub mod robot;
pub mod schema;
mod tree;
pub mod unit;

pub use error::{Problem, RobotFileError};
pub use robot::Robot;
