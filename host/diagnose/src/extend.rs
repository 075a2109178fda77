//! Writes what a diagnosis found into the robot file: refitted numbers and the tables of the effects.

use std::collections::BTreeMap;

use effects::Id;
use robot_file::RobotFileError;
use robot_file::edit::Document;
use robot_file::robot::Quantity;

use super::verdict::FittedParameter;

/// Puts the fitted numbers of a model and its effects into a robot file: those of [`Detail::extended`], or of one of
/// [`Detail::rivals`]. `source` says where they come from (the runs, the date), for each number's `source`.
///
/// [`Detail::extended`]: super::Detail::extended
/// [`Detail::rivals`]: super::Detail::rivals
///
/// # Errors
/// A fitted number lies outside what the robot file allows.
pub fn extend(document: &mut Document, fitted: &[FittedParameter], source: &str) -> Result<(), RobotFileError> {
    let mut tables: BTreeMap<&str, Vec<(&str, &FittedParameter)>> = BTreeMap::new();
    for one in fitted {
        match one.path.strip_prefix("effects.").and_then(|rest| rest.split_once('.')) {
            Some((table, key)) => tables.entry(table).or_default().push((key, one)),
            None => set(document, one, source)?,
        }
    }
    let effects = document.robot()?.effects;
    for (table, numbers) in tables {
        if numbers.iter().any(|(_, one)| one.file_value.is_some()) {
            for (_, one) in numbers {
                set(document, one, source)?;
            }
            continue;
        }
        // What it contains it takes the place of.
        for inner in effects.listed().filter(|inner| Id::of(table).is_some_and(|outer| outer.contains(*inner))) {
            document.remove(&format!("effects.{}", inner.name()))?;
        }
        let quantities = |narrow: bool| -> Vec<(&str, Quantity)> {
            numbers.iter().map(|(key, one)| (*key, quantity(one, narrow, source))).collect()
        };
        document.set_effect(table, &quantities(false)).or_else(|_| document.set_effect(table, &quantities(true)))?;
    }
    Ok(())
}

fn set(document: &mut Document, one: &FittedParameter, source: &str) -> Result<(), RobotFileError> {
    document
        .set(&one.path, &quantity(one, false, source))
        .or_else(|_| document.set(&one.path, &quantity(one, true, source)))
}

/// The fitted number with its interval; `narrow` leaves the interval out where it reaches beyond what a file allows.
fn quantity(one: &FittedParameter, narrow: bool, source: &str) -> Quantity {
    let (low, high) = if narrow { (one.value, one.value) } else { (one.low.min(one.value), one.high.max(one.value)) };
    Quantity { value: one.value, low, high, source: source.to_owned() }
}
