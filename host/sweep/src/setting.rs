//! Other values of a robot file's quantities, by name: what `--set PATH=VALUE` takes.

use robot_file::RobotFileError;
use robot_file::edit::Document;

use super::axis::AxisError;
use super::variant::VariantBuilder;

/// Names that are proposed for one that is unknown.
const PROPOSED: usize = 3;

/// Why a quantity cannot be set. The messages begin with its path.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum SettingError {
    /// The robot file has no such quantity.
    #[error("{path}: `{robot}` has no such quantity")]
    #[diagnostic(help("near are {near}"))]
    Unknown {
        /// As given.
        path: String,
        /// Name of the robot.
        robot: String,
        /// Names that differ least.
        near: String,
    },
    /// It is given twice.
    #[error("{path} is given twice")]
    #[diagnostic(help("give one value"))]
    Twice {
        /// As given.
        path: String,
    },
    /// The value is not allowed.
    #[error("{axis}: {problem}")]
    #[diagnostic(help("{help}"))]
    Refused {
        /// The path with its value.
        axis: String,
        /// Problem, as a clause that follows the name.
        problem: String,
        /// What is allowed.
        help: String,
    },
    /// The file cannot be changed.
    #[error(transparent)]
    #[diagnostic(transparent)]
    File(#[from] RobotFileError),
}

impl VariantBuilder {
    /// The robot file with other values of some quantities, each named once. The file on the disk is not changed.
    ///
    /// # Errors
    /// There is no such quantity, it is named twice, or its value is not allowed.
    pub fn set(&self, values: &[(&str, f64)]) -> Result<Document, SettingError> {
        for (index, (path, _)) in values.iter().enumerate() {
            if self.quantity(path).is_none() {
                return Err(self.unknown_setting(path));
            }
            if values[..index].iter().any(|(other, _)| other == path) {
                return Err(SettingError::Twice { path: (*path).to_owned() });
            }
        }
        self.edited(values).map_err(|error| match error {
            AxisError::Unreachable { axis, problem, help } => SettingError::Refused { axis, problem, help },
            other => SettingError::Refused { axis: "value".into(), problem: other.to_string(), help: String::new() },
        })
    }

    /// Says which names are near: those that have the given one in them (`alpha`), then those that differ least.
    fn unknown_setting(&self, path: &str) -> SettingError {
        let quantities = self.quantities().iter().map(|(known, _)| known.as_str());
        let mut near: Vec<&str> = quantities.collect();
        near.sort_by_key(|known| (!known.contains(path), distance(path, known)));
        near.truncate(PROPOSED);
        SettingError::Unknown { path: path.to_owned(), robot: self.robot().name.clone(), near: near.join(", ") }
    }
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
}
