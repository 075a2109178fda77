//! `scram export`

use std::path::PathBuf;

use clap::{Args, Subcommand};
use hal_sim::body::Plan;
use miette::{IntoDiagnostic, Report, WrapErr, miette};
use mjcf::{Cone, Integrator, Options, Solver};

use super::{Done, load_robot, print, same_file, walk, write};

/// Write the robot for another program
#[derive(Subcommand)]
pub enum Export {
    Mjcf(Mjcf),
}

impl Export {
    pub fn run(&self) -> Done {
        match self {
            Self::Mjcf(command) => command.run(),
        }
    }
}

/// Write the body as a model for MuJoCo
///
/// The model is the same robot: geometry, masses, hinges, clamp, slope, steps, patches of friction, eccentric. MuJoCo's
/// rotor turns counter-clockwise with positive speed. It has another law of contact: forces at the feet differ.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram export mjcf > robot.xml\n  \
    scram export mjcf --alpha 60 --output robot.xml && python -m mujoco.viewer --mjcf=robot.xml\n  \
    scram export mjcf --root 1 --cone pyramidal --solver PGS --timestep 5e-4 -o fast.xml")]
pub struct Mjcf {
    /// The robot file
    #[arg(long, value_name = "FILE", default_value = "robot.toml")]
    robot: PathBuf,
    /// Where the model goes; - is stdout
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    /// Backbones rolled by α, 2α, 3α, degrees, instead of the robot file's
    #[arg(long, value_name = "DEG", value_parser = walk::alpha, allow_negative_numbers = true)]
    alpha: Option<f64>,
    /// The module that carries the free joint, 1 is the front one [default: 2, or the clamped one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    root: Option<u16>,
    /// The feet touch nothing
    #[arg(long)]
    no_contact: bool,
    /// Time step, s
    #[arg(long, value_name = "S", default_value_t = Options::default().timestep_s)]
    timestep: f64,
    /// Method of integration
    #[arg(long, value_enum, default_value_t = Options::default().integrator)]
    integrator: Integrator,
    /// Friction cone
    #[arg(long, value_enum, default_value_t = Options::default().cone)]
    cone: Cone,
    /// Ratio of friction's to the normal's impedance in a contact
    #[arg(long, value_name = "RATIO", default_value_t = Options::default().impratio)]
    impratio: f64,
    /// What solves the contacts
    #[arg(long, value_enum, default_value_t = Options::default().solver)]
    solver: Solver,
    /// Stiffness of the rotor's position servo, N·m/rad
    #[arg(long, value_name = "NM", default_value_t = Options::default().servo_nm_per_rad)]
    kp: f64,
    /// Damping of the rotor's position servo, N·m·s/rad
    #[arg(long, value_name = "NMS", default_value_t = Options::default().servo_nm_s_per_rad)]
    kv: f64,
}

impl Mjcf {
    fn run(&self) -> Done {
        let mut robot = load_robot(&self.robot)?;
        let named = || self.robot.display().to_string();
        walk::roll(&mut robot, self.alpha).wrap_err_with(named)?;
        let plan = Plan::new(&robot).into_diagnostic().wrap_err_with(named)?;
        let model = mjcf::model(&robot.name, &plan, &self.options()).map_err(Report::from).wrap_err_with(named)?;
        self.write(&model)
    }

    fn options(&self) -> Options {
        Options {
            root: self.root.map(|number| usize::from(number) - 1),
            contact: !self.no_contact,
            timestep_s: self.timestep,
            integrator: self.integrator,
            cone: self.cone,
            impratio: self.impratio,
            solver: self.solver,
            servo_nm_per_rad: self.kp,
            servo_nm_s_per_rad: self.kv,
            ..Options::default()
        }
    }

    fn write(&self, model: &str) -> Done {
        let path = &self.output;
        if path.as_os_str() == "-" {
            print(model.trim_end());
            return Ok(());
        }
        if same_file(path, &self.robot) {
            return Err(miette!("{} is the robot file that was read; it is not written over", path.display()).into());
        }
        Ok(write(path, model)?)
    }
}
