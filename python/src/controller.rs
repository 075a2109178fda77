//! `scram.Controller`: the firmware's own tick.

use std::path::PathBuf;

use control::{AdcCode, Sample};
use pyo3::prelude::*;
use simulation::Step;

use crate::arguments;
use crate::errors::{InputError, wrong_input};
use crate::robot::Robot;
use crate::simulate::parsed;

/// What the bridge is told until the next tick.
#[pyclass(frozen, eq, get_all, module = "scram")]
#[derive(Clone, PartialEq)]
pub struct Actuation {
    /// −1 … 1, positive turns counter-clockwise.
    duty: f32,
    /// Whether the bridge drives; otherwise the shaft coasts.
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
/// µs, which must not go backwards, and the codes of the angle sensor's and the battery's converter, with as many bits as the robot file
/// says (``sensor.adc.bits``: 12 of robot.toml, so that codes are 0 … 4095).
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
pub struct Controller {
    inner: control::Controller,
    /// Gaits by their names may be beside it.
    robot_file: PathBuf,
    /// Time of the last tick, µs.
    last_us: u64,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(py: Python<'_>, robot: &Robot) -> PyResult<Self> {
        let inner = py.detach(|| simulation::controller(robot.robot())).map_err(|error| wrong_input(&error))?;
        Ok(Self { inner, robot_file: robot.path().clone(), last_us: 0 })
    }

    /// Takes a command, in the words of a drive or of a script's line: ``freq:7``, ``oscillate -100..100``, ``gait:NAME``, ``coast``,
    /// ``idle``, ``clear``.
    ///
    /// Parameters
    /// ----------
    /// command
    ///     As ``simulate`` takes a drive.
    /// time_us
    ///     When it comes, µs.
    ///
    /// Raises
    /// ------
    /// MissingFileError
    ///     There is no such gait.
    /// InputError
    ///     It is not understood, or the robot refuses it.
    #[pyo3(signature = (command, time_us = 0))]
    fn command(&mut self, command: &str, #[pyo3(from_py_with = arguments::time_us)] time_us: u64) -> PyResult<()> {
        let drive = parsed(&command.replacen(' ', ":", 1), &self.robot_file)?;
        let [Step { command: given, .. }] = drive.steps.as_slice() else {
            return Err(InputError::new_err(format!("`{command}` is not one command")));
        };
        let limits = self.inner.parameters().limits;
        let kept = match given.gait() {
            Some(gait) if self.inner.gait() != Some(gait.label()) => self.inner.keep_gait(&gait),
            _ => Ok(()),
        };
        let answer = kept.and_then(|()| self.inner.command(given.to_control(), time_us));
        answer.map_err(|why| {
            let why = simulation::said(*given, why, &limits);
            InputError::new_err(format!("the robot refuses `{given}`: {why}"))
        })
    }

    /// One control period: what was measured in, what the bridge is told out.
    ///
    /// Parameters
    /// ----------
    /// time_us
    ///     Time of the sample, µs; not before the last tick's.
    /// angle
    ///     Code of the angle sensor's converter, with the bits that the robot file says (``sensor.adc.bits``).
    /// battery
    ///     Code of the battery's converter.
    /// second
    ///     Code of the second angle sensor's converter, of a robot with two.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     A number is out of its range, or the time goes backwards.
    #[pyo3(signature = (time_us, angle, battery, second = None))]
    fn tick(
        &mut self,
        #[pyo3(from_py_with = arguments::time_us)] time_us: u64,
        #[pyo3(from_py_with = arguments::angle)] angle: u16,
        #[pyo3(from_py_with = arguments::battery)] battery: u16,
        #[pyo3(from_py_with = arguments::second)] second: Option<u16>,
    ) -> PyResult<Actuation> {
        if time_us < self.last_us {
            let what = format!("time_us: {time_us} is before {}, the time of the last tick", self.last_us);
            return Err(InputError::new_err(format!("{what}\n  help: make another Controller to begin anew")));
        }
        self.last_us = time_us;
        let sample = Sample { time_us, angle: AdcCode(angle), second: second.map(AdcCode), battery: AdcCode(battery) };
        let control::Actuation { duty, enable } = self.inner.tick(&sample);
        Ok(Actuation { duty, enable })
    }

    /// Control period, s.
    #[getter]
    fn tick_s(&self) -> f64 {
        f64::from(self.inner.parameters().tick)
    }

    /// What the controller believes and says since the last tick: a dictionary.
    ///
    /// ``time_us`` (time of the sample, µs), ``state`` and ``fault`` (words; None without a fault), ``tracking`` (an angle has been
    /// acquired; without, ``angle`` means nothing), ``angle`` (rad, −π … π), ``speed`` (rad/s), ``current`` (A), ``drag`` (torque against
    /// the motion, N·m), ``reference_angle`` (rad) and ``reference_speed`` (rad/s), ``reading`` (rad; None of a code that can only come
    /// from the blind arc), ``accepted`` (the reading was used), ``blind`` (the wiper is believed to be in the blind arc),
    /// ``failed_sensor`` (of two, ``First`` or ``Second``), ``saturated`` (the demand was beyond the supply), ``battery`` (V; 0 where it is
    /// not measured) and ``actuation`` (``duty``, −1 … 1, and ``enable``). Angles and speeds are counter-clockwise.
    #[getter]
    fn telemetry<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize::pythonize(py, &self.inner.telemetry())?)
    }
}
