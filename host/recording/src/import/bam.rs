//! Reads the logs of BAM (<https://github.com/Rhoban/bam>), which records servos on a pendulum: JSON with a list `entries` and,
//! beside it, what was set and what hung on the servo.
//!
//! The servo is driven by its own position control. What duty that gives for which error was measured by BAM's authors on an
//! oscilloscope, and is in the table below ([`super::goal`] has the law): M. Duclusaud, G. Passault, V. Padois, O. Ly,
//! "Extended Friction Models for the Physics Simulation of Servo Actuators", ICRA 2025.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Map, Value};

use super::goal::PositionControl;
use super::mapping::Mapping;
use super::table::{Table, locate};
use super::units::{Quantity, positive};
use crate::{Metadata, RecordingError, RowNumber};

/// What BAM knows of a servo's position control: gain times error, rad, that gives full duty, and the largest duty.
struct Servo {
    name: &'static str,
    full_scale_rad: f64,
    most_duty: f64,
    /// What this law leaves out, in words.
    caveat: Option<&'static str>,
}

/// Servos whose drive is a voltage. Full scales are 1/`error_gain` of BAM's actuators.
const SERVOS: [Servo; 5] = [
    Servo { name: "mx64", full_scale_rad: 1.0 / 0.158, most_duty: 0.9625, caveat: None },
    Servo { name: "mx106", full_scale_rad: 1.0 / 0.158, most_duty: 0.9625, caveat: None },
    Servo { name: "xl320", full_scale_rad: 1.0 / 0.050_481_99, most_duty: 1.0, caveat: None },
    // 256 · 885 PWM counts, at 4096 counts of angle a turn.
    Servo { name: "xl330", full_scale_rad: 256.0 * 885.0 * TAU / 4096.0, most_duty: 1.0, caveat: None },
    Servo {
        name: "sts3215",
        full_scale_rad: 1.0 / 0.166,
        most_duty: 0.97,
        caveat: Some("it also limits how fast its goal moves, which is not computed here"),
    },
];

/// Servos that regulate a current or a torque.
const NOT_DRIVEN_BY_VOLTAGE: [&str; 4] = ["xl330i", "erob80_50", "erob80_100", "unitree_go1"];

/// A log.
pub(super) struct Log {
    path: PathBuf,
    head: Head,
    /// Keys of the entries.
    names: Vec<String>,
}

#[derive(Deserialize)]
struct Head {
    entries: Vec<Map<String, Value>>,
    motor: Option<String>,
    trajectory: Option<String>,
    kp: Option<f64>,
    vin: Option<f64>,
    dt: Option<f64>,
    mass: Option<f64>,
    #[serde(alias = "arm-mass")]
    arm_mass: Option<f64>,
    length: Option<f64>,
}

impl Log {
    pub(super) fn load(path: &Path) -> Result<Self, RecordingError> {
        let text = std::fs::read(path).map_err(|e| RecordingError::io(path, e))?;
        if text.trim_ascii().is_empty() {
            return Err(RecordingError::Empty { path: path.to_owned() });
        }
        let head: Head = serde_json::from_slice(&text).map_err(|e| RecordingError::Format {
            path: path.to_owned(),
            problem: format!("line {}: {e}", e.line()),
            help: "a log of BAM is an object with a list `entries` of objects, and numbers such as `kp` and `vin`"
                .into(),
        })?;
        if head.entries.is_empty() {
            return Err(RecordingError::NoSamples { path: path.to_owned() });
        }
        let mut names: Vec<String> = Vec::new();
        for key in head.entries.iter().flat_map(Map::keys) {
            if !names.contains(key) {
                names.push(key.clone());
            }
        }
        Ok(Self { path: path.to_owned(), head, names })
    }

    fn has(&self, name: &str) -> bool {
        self.names.iter().any(|known| known == name)
    }

    /// Whether a key holds a number above zero anywhere: a recorder that cannot measure writes zeros.
    fn measured(&self, name: &str) -> bool {
        self.head.entries.iter().any(|entry| entry.get(name).and_then(Value::as_f64).is_some_and(|value| value > 0.0))
    }

    /// What the log itself says of its columns, where nothing else was said, and what a person should know of it.
    pub(super) fn complete(&self, said: &Mapping) -> Result<(Mapping, Vec<String>), RecordingError> {
        let mut own = Mapping::default();
        let mut map = |words: &str| own.map(words).map_err(|error| self.refusal(error.problem, &error.help));
        if !said.has(Quantity::Time) && said.rate_hz.is_none() && self.has("timestamp") {
            map("time=timestamp:s")?;
        }
        if !said.has(Quantity::Speed) {
            map("angle=position:rad")?;
        }
        if self.has("torque_enable") {
            map("enable=torque_enable")?;
        }
        if self.measured("temp") {
            map("temperature=temp:C")?;
        }
        let knows_supply = said.has(Quantity::Supply) || said.supply_v.is_some();
        if !knows_supply && self.measured("input_volts") {
            map("supply=input_volts:V")?;
        } else if !knows_supply {
            own.supply_v = self.head.vin.filter(|volts| positive(*volts));
        }
        if !said.has(Quantity::Time) && said.rate_hz.is_none() && !self.has("timestamp") {
            own.rate_hz = self.head.dt.filter(|step| positive(*step)).map(|step| 1.0 / step);
        }
        let drives = [Quantity::Duty, Quantity::Voltage, Quantity::TerminalVoltage];
        let notes =
            if drives.into_iter().any(|drive| said.has(drive)) { Vec::new() } else { self.drive(said, &mut own)? };
        let mapping = own.overridden_by(said);
        mapping.check().map_err(|error| self.refusal(error.problem, &error.help))?;
        Ok((mapping, notes))
    }

    /// How the servo was driven.
    fn drive(&self, said: &Mapping, own: &mut Mapping) -> Result<Vec<String>, RecordingError> {
        let motor = self.head.motor.as_deref().unwrap_or("not named");
        let servo = SERVOS.iter().find(|servo| servo.name == motor);
        if NOT_DRIVEN_BY_VOLTAGE.contains(&motor) {
            return Err(self.refusal(
                format!("motor `{motor}` regulates a current or a torque, and what its bridge did is not in the log"),
                "a recording needs the duty or the voltage: --map duty=KEY:FULL_SCALE where it was recorded",
            ));
        }
        let map =
            |own: &mut Mapping, words: &str| own.map(words).map_err(|error| self.refusal(error.problem, &error.help));
        if servo.is_some() && self.has("control") && !said.has(Quantity::Goal) {
            map(own, "voltage=control:V")?;
            return Ok(vec!["the drive is `control`, V, over the supply".into()]);
        }
        if !said.has(Quantity::Goal) {
            map(own, "goal=goal_position:rad")?;
        }
        own.control = PositionControl {
            gain: self.head.kp,
            full_scale_rad: servo.map(|servo| servo.full_scale_rad),
            most_duty: servo.map(|servo| servo.most_duty),
        };
        if servo.is_none() && said.control.full_scale_rad.is_none() {
            let known: Vec<&str> = SERVOS.iter().map(|servo| servo.name).collect();
            return Err(self.refusal(
                format!("motor `{motor}`: what its position control does is not known"),
                &format!(
                    "say which gain times error (rad) gives full duty, --p-full-scale RAD, or map a recorded duty, e.g. \
                     --map duty=load:1; known are {}",
                    known.join(", ")
                ),
            ));
        }
        let mut notes = vec!["the drive is computed from goal and angle by the servo's position control".to_owned()];
        if let Some(caveat) = servo.and_then(|servo| servo.caveat) {
            notes.push(format!("motor `{motor}`: {caveat}"));
        }
        Ok(notes)
    }

    fn refusal(&self, problem: String, help: &str) -> RecordingError {
        RecordingError::Format { path: self.path.clone(), problem, help: help.into() }
    }

    /// The wanted columns.
    pub(super) fn table(&self, wanted: &[String]) -> Result<Table, RecordingError> {
        let found = locate(&self.path, &self.names, wanted)?;
        let mut table = Table {
            path: self.path.clone(),
            names: self.names.clone(),
            read: found.into_iter().map(|(name, _)| name).collect(),
            columns: Vec::new(),
            rows: (1..=self.head.entries.len() as u64).map(RowNumber::Entry).collect(),
        };
        for name in &table.read {
            let values = self.head.entries.iter().enumerate().map(|(row, entry)| match entry.get(name) {
                None | Some(Value::Null) => Ok(f64::NAN),
                Some(Value::Bool(truth)) => Ok(f64::from(u8::from(*truth))),
                Some(Value::Number(number)) => Ok(number.as_f64().unwrap_or(f64::NAN)),
                Some(other) => Err(RecordingError::Cell {
                    place: table.place(row),
                    column: name.clone(),
                    problem: format!("{} is not a number", other.to_string().chars().take(40).collect::<String>()),
                    help: "values of an entry are numbers, truths, or null where nothing was measured".into(),
                }),
            });
            table.columns.push(values.collect::<Result<_, _>>()?);
        }
        Ok(table)
    }

    /// What the log says about the run.
    pub(super) fn metadata(&self) -> Metadata {
        let head = &self.head;
        let numbers = [
            ("kp", head.kp, ""),
            ("vin", head.vin, " V"),
            ("mass", head.mass, " kg"),
            ("arm_mass", head.arm_mass, " kg"),
            ("length", head.length, " m"),
        ];
        let mut words: Vec<String> = head.motor.iter().map(|motor| format!("motor {motor}")).collect();
        words.extend(numbers.iter().filter_map(|(name, value, unit)| Some(format!("{name} {}{unit}", (*value)?))));
        let notes = (!words.is_empty()).then(|| format!("log of BAM: {}", words.join(", ")));
        Metadata { excitation: head.trajectory.clone(), notes, ..Metadata::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Drive, ReadOptions, import::import};

    fn log(head: &str, entries: &[&str]) -> Result<super::super::Imported, RecordingError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("log.json");
        std::fs::write(&path, format!("{{{head}, \"entries\": [{}]}}", entries.join(", "))).unwrap();
        import(&path, &Mapping::default(), &ReadOptions::default())
    }

    const ENTRIES: [&str; 3] = [
        r#"{"position": 0.1, "speed": 0.0, "load": 2, "input_volts": 7.3, "temp": 28, "timestamp": 0.0, "goal_position": 0.3, "torque_enable": true}"#,
        r#"{"position": 0.1, "speed": 0.0, "load": 2, "input_volts": 7.2, "temp": 28, "timestamp": 0.005, "goal_position": 9.0, "torque_enable": true}"#,
        r#"{"position": 0.2, "speed": 0.0, "load": 2, "input_volts": 7.3, "temp": 28, "timestamp": 0.010, "goal_position": 9.0, "torque_enable": false}"#,
    ];

    #[test]
    fn a_servo_is_driven_as_its_position_control_does() {
        let imported =
            log(r#""motor": "mx64", "kp": 16, "vin": 15, "arm-mass": 0.1, "trajectory": "sin""#, &ENTRIES).unwrap();
        let run = &imported.loaded.recording;
        let Drive::Duty(duty) = &run.drive else { panic!("a duty") };
        assert!((duty[0] - 0.2 * 16.0 * 0.158).abs() < 1e-12 && duty[1] == 0.9625, "{duty:?}");
        assert_eq!((run.enable.as_slice(), run.supply_v[1]), (&[true, true, false][..], 7.2));
        let metadata = &imported.loaded.metadata;
        assert_eq!(metadata.excitation.as_deref(), Some("sin"));
        assert!(metadata.notes.as_ref().unwrap().contains("arm_mass 0.1 kg"), "{metadata:?}");
        assert_eq!(metadata.import.as_ref().unwrap().not_mapped, ["load", "speed"]);
    }

    #[test]
    fn a_recorded_control_is_the_voltage() {
        let entry = |t: f64| format!(r#"{{"position": 0.1, "control": 3.0, "timestamp": {t}, "goal_position": 0.3}}"#);
        let imported = log(r#""motor": "xl330", "kp": 32, "vin": 7.5"#, &[&entry(0.0), &entry(0.01)]).unwrap();
        assert_eq!(imported.loaded.recording.drive, Drive::Duty(vec![0.4, 0.4]));
    }

    #[test]
    fn what_is_not_known_is_asked_for() {
        let says = |head: &str, entries: &[&str], part: &str| {
            let error = log(head, entries).unwrap_err().to_string();
            assert!(error.contains(part), "`{error}` does not say `{part}`");
        };
        says(r#""motor": "own", "kp": 32"#, &ENTRIES, "motor `own`: what its position control does is not known");
        says(r#""motor": "erob80_50", "kp": 32"#, &ENTRIES, "regulates a current");
        says(r#""motor": "xl330""#, &ENTRIES, "a goal position alone does not say");
        says(r#""motor": "xl330", "kp": 32"#, &[], "no sample");
        says(
            r#""motor": "xl330", "kp": 32"#,
            &[r#"{"position": "x", "timestamp": 0, "goal_position": 0}"#],
            "entry 1, column `position`: \"x\" is not a number",
        );
        says(
            r#""motor": "xl330", "kp": 32"#,
            &[r#"{"timestamp": 0, "goal_position": 0}"#],
            "column \"position\" is not there; the file has: ",
        );
    }
}
