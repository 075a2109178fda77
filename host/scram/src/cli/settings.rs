//! `--set PATH=VALUE`: another value of a quantity of the robot file, for one command.

use clap::Args;
use miette::{Report, miette};
use robot_file::Robot;
use robot_file::edit::Document;
use sweep::{AxisError, VariantBuilder};

use super::{Failure, load_robot};

/// Names that are proposed for one that is unknown.
const PROPOSED: usize = 3;

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
        let workshop = VariantBuilder::of_any(document, robot);
        for (index, (path, _)) in self.set.iter().enumerate() {
            if workshop.quantity(path).is_none() {
                return Err(Failure::Usage(unknown(path, &workshop)));
            }
            if self.set[..index].iter().any(|(other, _)| other == path) {
                return Err(Failure::Usage(miette!("--set {path} is given twice")));
            }
        }
        let values: Vec<(&str, f64)> = self.set.iter().map(|(path, value)| (path.as_str(), *value)).collect();
        let changed = workshop.edited(&values).map_err(|error| refused(&error))?;
        Ok(changed.robot().map_err(Report::from)?)
    }
}

fn refused(error: &AxisError) -> Report {
    match error {
        AxisError::Unreachable { axis, problem, help } => miette!(help = help.clone(), "--set {axis}: {problem}"),
        other => miette!("--set: {other}"),
    }
}

/// Says which names are near.
fn unknown(path: &str, workshop: &VariantBuilder) -> Report {
    let mut near: Vec<(usize, &str)> =
        workshop.quantities().iter().map(|(known, _)| (distance(path, known), known.as_str())).collect();
    near.sort();
    let near: Vec<&str> = near.into_iter().take(PROPOSED).map(|(_, known)| known).collect();
    miette!(
        help = format!("near are {}", near.join(", ")),
        "--set {path}: `{}` has no such quantity",
        workshop.robot().name
    )
}

/// Letters to insert, remove or replace to make one word of the other.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, one) in a.chars().enumerate() {
        let mut diagonal = i;
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(one != *other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_levenshtein() {
        for (a, b, expected) in [("", "", 0), ("kitten", "sitting", 3), ("abc", "", 3), ("flaw", "lawn", 2)] {
            assert_eq!((distance(a, b), distance(b, a)), (expected, expected), "{a} {b}");
        }
    }

    #[test]
    fn an_assignment_is_a_path_and_a_finite_number() {
        assert_eq!(assignment("motor.resistance_ohm = 18"), Ok(("motor.resistance_ohm".into(), 18.0)));
        assert!(assignment("motor.resistance_ohm").is_err());
        for wrong in ["a=", "a=x", "a=nan", "a=inf", "a=18 Ω"] {
            assert!(assignment(wrong).is_err(), "{wrong}");
        }
    }
}
