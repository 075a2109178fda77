//! `scram hil`

use std::path::PathBuf;

use clap::Args;
use control::Parameters;
use hal_sim::{Settings, SimulatedRobot};
use miette::Report;
use scram::hil::{Client, HilError, Port, Qemu, Remote, Transport, build_program};
use simulation::{OnGround, Ran, SimError, closed_loop_in};

use super::Done;
use super::on_chip::OnChip;
use super::sim::{Beside, Run, Task};

/// Run a chip's decisions on the simulated robot
///
/// As `scram sim`, with the same table and files, but the firmware's decisions are made by a board on a serial port that
/// runs `hil` (`cargo flash-hil`), or by RISC-V machine code in QEMU. The simulation waits for every answer: the result
/// does not depend on how fast the line is.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram hil --qemu                                 7 Hz for 2 s\n  \
    scram hil --port /dev/ttyUSB0 --drive oscillate:-100..100 --seconds 5\n  \
    scram hil --port COM3 --faults sensor-open@1.0 --json")]
pub struct Hil {
    #[command(flatten)]
    target: Which,
    /// The program for QEMU [default: built from firmware/pil]
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    elf: Option<PathBuf>,
    #[command(flatten)]
    run: Run,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
struct Which {
    /// Serial port of a board with `hil` on it
    #[arg(long)]
    port: Option<String>,
    /// RISC-V machine code in QEMU instead of a board
    #[arg(long)]
    qemu: bool,
}

impl Hil {
    pub fn run(&self) -> Done {
        let task = self.run.task()?;
        let parameters = robot_file::design::parameters(&task.robot).map_err(SimError::Design).map_err(Report::from)?;
        let (ran, chip) = match &self.target.port {
            Some(port) => self.on(Port::open(port).map_err(Report::from)?, &task, &parameters)?,
            None => self.on(self.qemu().map_err(Report::from)?, &task, &parameters)?,
        };
        self.run.tell(&task, &ran, &Beside { chip: Some(&chip), before: None })
    }

    fn qemu(&self) -> Result<Qemu, HilError> {
        // Building takes a while: in vain without QEMU.
        Qemu::is_installed()?;
        match &self.elf {
            Some(elf) => Qemu::start(elf),
            None => Qemu::start(&build_program()?),
        }
    }

    fn on<T: Transport>(&self, line: T, task: &Task, parameters: &Parameters) -> Result<(Ran, OnChip), Report> {
        let (seed, settings) = (self.run.common.seed, Settings::default());
        let ground = task.walks.then(|| OnGround::new(&task.robot, seed, &settings, task.plan.seconds));
        let ground = ground.transpose().map_err(SimError::Body)?;
        let mut chip = Remote::start(Client::connect(line)?, parameters)?;
        let ran = match ground {
            Some(mut ground) => {
                let trace = closed_loop_in(&mut ground, &mut chip, &task.plan)?;
                Ran { trace, walk: Some(ground.into_walk().map_err(SimError::BlowUp)?) }
            }
            None => {
                let mut bench = SimulatedRobot::with(&task.robot, seed, &settings);
                Ran { trace: closed_loop_in(&mut bench, &mut chip, &task.plan)?, walk: None }
            }
        };
        Ok((ran, OnChip::of(&chip)))
    }
}
