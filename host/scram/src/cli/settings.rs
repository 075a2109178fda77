//! `--set PATH=VALUE`: another value of a quantity of the robot file, for one command.

use clap::Args;
use miette::{Diagnostic, Report, miette};
use robot_file::Robot;
use robot_file::edit::Document;
use sweep::{SettingError, VariantBuilder};

use super::{Failure, load_robot};

/// Values that differ from the robot file's.
#[derive(Args)]
pub struct Settings {
    /// Another value of a quantity of the robot file, by its dotted path, e.g. motor.resistance_ohm=18; repeatable
    #[arg(long, value_name = "PATH=VALUE", value_parser = assignment, allow_hyphen_values = true)]
    set: Vec<(String, f64)>,
}

/// `PATH=VALUE`.
fn assignment(text: &str) -> Result<(String, f64), String> {
    let (path, value) = text.split_once('=').ok_or("write PATH=VALUE, e.g. motor.resistance_ohm=18")?;
    match value.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok((path.trim().to_owned(), number)),
        _ => Err(format!("`{}` is not a finite number", value.trim())),
    }
}

impl Settings {
    /// `PATH=VALUE`, each.
    pub fn words(&self) -> impl Iterator<Item = String> {
        self.set.iter().map(|(path, value)| format!("{path}={value}"))
    }

    /// The robot of a file with these values in place of its own. The file itself is not changed.
    ///
    /// # Errors
    /// The file is no robot; there is no such quantity (exit code 2), or its value is not allowed.
    pub fn robot(&self, file: &std::path::Path) -> Result<Robot, Failure> {
        let robot = load_robot(file)?;
        if self.set.is_empty() {
            return Ok(robot);
        }
        let document = Document::load(file).map_err(Report::from)?;
        let values: Vec<(&str, f64)> = self.set.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        let changed = VariantBuilder::of_any(document, robot).set(&values).map_err(refused)?;
        Ok(changed.robot().map_err(Report::from)?)
    }
}

/// With the option's name in front; a wrong name is wrong usage.
fn refused(error: SettingError) -> Failure {
    let named = |error: &SettingError| {
        let help = error.help().map_or_else(String::new, |help| help.to_string());
        miette!(help = help, "--set {error}")
    };
    match error {
        SettingError::File(error) => Failure::Failed(error.into()),
        SettingError::Refused { .. } => Failure::Failed(named(&error)),
        SettingError::Unknown { .. } | SettingError::Twice { .. } => Failure::Usage(named(&error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_assignment_is_a_path_and_a_finite_number() {
        assert_eq!(assignment("motor.resistance_ohm = 18"), Ok(("motor.resistance_ohm".into(), 18.0)));
        assert!(assignment("motor.resistance_ohm").is_err());
        for wrong in ["a=", "a=x", "a=nan", "a=inf", "a=18 Ω"] {
            assert!(assignment(wrong).is_err(), "{wrong}");
        }
    }
}
