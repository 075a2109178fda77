//! `scram.Controller`: the firmware's own tick.

use control::{AdcCode, Sample};
use pyo3::prelude::*;
use simulation::{Drive, Step};

use crate::arguments;
use crate::errors::{InputError, wrong_input};
use crate::robot::Robot;

/// What the bridge is told until the next tick.
#[pyclass(frozen, eq, get_all, module = "scram")]
#[derive(Clone, PartialEq)]
pub struct Actuation {
    duty: f32,
    enable: bool,
}

#[pymethods]
impl Actuation {
    fn __repr__(&self) -> String {
        format!("Actuation(duty={}, enable={})", self.duty, if self.enable { "True" } else { "False" })
    }
}

/// Every decision of the robot: the firmware's own code, one call a control period.
///
/// The same samples and commands give the same bits as on the robot and in ``scram sim``. ``tick`` takes what was measured: the time in
/// µs, which must not go backwards, and the codes of the angle sensor's and the battery's converter.
///
/// Examples
/// --------
/// >>> import scram
/// >>> controller = scram.Controller(scram.Robot("robot.toml"))
/// >>> controller.command("freq:7")
/// >>> controller.tick(time_us=0, angle=2048, battery=2600).enable
/// True
/// >>> controller.telemetry["state"]
/// 'Speed'
#[pyclass(module = "scram")]
pub struct Controller(control::Controller);

#[pymethods]
impl Controller {
    #[new]
    fn new(py: Python<'_>, robot: &Robot) -> PyResult<Self> {
        py.detach(|| simulation::controller(robot.robot())).map(Self).map_err(|error| wrong_input(&error))
    }

    /// Takes a command, in the words of a drive or of a script's line.
    #[pyo3(signature = (command, time_us = 0))]
    fn command(&mut self, command: &str, #[pyo3(from_py_with = arguments::time_us)] time_us: u64) -> PyResult<()> {
        let parsed = match command.split_once(' ') {
            Some((kind, argument)) => Drive::parse(&format!("{kind}:{argument}")),
            None => Drive::parse(command),
        };
        let drive = parsed.map_err(|error| wrong_input(&error))?;
        let [Step { command: given, .. }] = drive.steps.as_slice() else {
            return Err(InputError::new_err(format!("`{command}` is not one command")));
        };
        let limits = self.0.parameters().limits;
        let kept = match given.gait() {
            Some(gait) if self.0.gait() != Some(gait.label()) => self.0.keep_gait(&gait),
            _ => Ok(()),
        };
        let answer = kept.and_then(|()| self.0.command(given.to_control(), time_us));
        answer.map_err(|why| {
            let why = simulation::said(*given, why, &limits);
            InputError::new_err(format!("the robot refuses `{given}`: {why}"))
        })
    }

    /// One control period: what was measured in, what the bridge is told out.
    #[pyo3(signature = (time_us, angle, battery, second = None))]
    fn tick(
        &mut self,
        #[pyo3(from_py_with = arguments::time_us)] time_us: u64,
        #[pyo3(from_py_with = arguments::angle)] angle: u16,
        #[pyo3(from_py_with = arguments::battery)] battery: u16,
        #[pyo3(from_py_with = arguments::second)] second: Option<u16>,
    ) -> Actuation {
        let sample = Sample { time_us, angle: AdcCode(angle), second: second.map(AdcCode), battery: AdcCode(battery) };
        let control::Actuation { duty, enable } = self.0.tick(&sample);
        Actuation { duty, enable }
    }

    /// Control period, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        f64::from(self.0.parameters().tick)
    }

    /// What the controller believes and says since the last tick.
    #[getter]
    fn telemetry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize::pythonize(py, &self.0.telemetry())?)
    }
}
