//! Why a recording gives no correction.

use miette::Diagnostic;
use thiserror::Error;

/// Why there is no correction.
#[derive(Clone, Debug, PartialEq, Error, Diagnostic)]
pub enum PotentiometerError {
    /// The robot file has no potentiometer.
    #[error("the robot file's [sensor] is {kind}, which has nothing to correct")]
    #[diagnostic(help("set [sensor] kind = \"potentiometer\" with its [sensor.adc], or name the right robot file"))]
    NoPotentiometer {
        /// `kind` in the file.
        kind: &'static str,
    },
    /// The recording has no raw codes.
    #[error("{run}: no column `{column}`: a correction is made from raw codes, not from angles")]
    #[diagnostic(help("record the raw code, e.g. `scram sim --drive duty:1 --seconds 2.5`"))]
    NoCodes {
        /// The run.
        run: String,
        /// The column.
        column: &'static str,
    },
    /// The robot has one sensor.
    #[error("the robot file has no [sensor.second]")]
    #[diagnostic(help("take the first sensor, or name the right robot file"))]
    NoSecond,
    /// A code that this converter cannot give.
    #[error("{run}: sample {sample} (t_s = {t_s}): code {code} is above full scale ({top}) of sensor.adc.bits")]
    #[diagnostic(help("is this the right robot file?"))]
    CodeTooLarge {
        /// The run.
        run: String,
        /// Its index, first is 0.
        sample: usize,
        /// Its time, s.
        t_s: f64,
        /// The code.
        code: u16,
        /// Full scale.
        top: u16,
    },
    /// Not enough of a run.
    #[error("only {turns:.1} turns in {seconds:.2} s; at least {fewest} turns at a steady speed are needed")]
    #[diagnostic(help("record longer: 2.5 s at constant voltage is plenty"))]
    TooShort {
        /// Steady turns found.
        turns: f64,
        /// In this time, s.
        seconds: f64,
        /// Turns needed.
        fewest: f64,
    },
    /// No rotation.
    #[error("the shaft does not turn steadily: {detail}")]
    #[diagnostic(help(
        "record at constant voltage, e.g. `scram sim --drive duty:1 --seconds 2.5`; is the bridge enabled?"
    ))]
    NotTurning {
        /// What was seen.
        detail: String,
    },
    /// The drive was not constant.
    #[error(
        "the {column} varies by {percent:.0} % of its mean: at constant speed command the sensor's error is fed back into the real speed and cannot be seen"
    )]
    #[diagnostic(help("drive with a constant voltage, e.g. `scram sim --drive duty:1 --seconds 2.5`"))]
    DriveVaries {
        /// Column name.
        column: &'static str,
        /// Standard deviation over mean.
        percent: f64,
    },
    /// Speed drifts or jumps.
    #[error("the speed varies from {low_hz:.2} to {high_hz:.2} turns/s; time is the reference, so it must be constant")]
    #[diagnostic(help("constant voltage, a warmed-up gearbox, a supply that holds; leave out the start"))]
    SpeedVaries {
        /// Slowest, turns/s.
        low_hz: f64,
        /// Fastest, turns/s.
        high_hz: f64,
    },
    /// Turns of different length.
    #[error("single turns are {rms_deg:.2}° RMS early or late against a smooth speed; {limit_deg:.1}° are allowed")]
    #[diagnostic(help("something brakes the shaft now and then: free it, or record again"))]
    RoughTurns {
        /// RMS, degrees.
        rms_deg: f64,
        /// Limit, degrees.
        limit_deg: f64,
    },
    /// The codes never stop, or never start, to follow.
    #[error("no blind arc was found: {detail}")]
    #[diagnostic(help(
        "are these codes of the potentiometer in the robot file? Check sensor.electrical_angle_deg and sensor.adc"
    ))]
    NoArc {
        /// What was seen.
        detail: String,
    },
    /// The fit has no solution.
    #[error("{samples} usable samples do not determine line and harmonics")]
    #[diagnostic(help("record longer"))]
    Undetermined {
        /// Samples outside the arc.
        samples: usize,
    },
}
