//! `scram console --push`: what a robot file asks of a robot that runs already.

use control::Parameters;
use control::parameters::table::{self, TABLE};
use robot_file::Robot;
use robot_file::design::{DesignError, design};
use scram::console::runner;

/// Relative difference below which two numbers are one: they went through text and f32.
const SAME: f32 = 1e-5;

/// What is sent, and what is not.
#[derive(Debug, Default, PartialEq)]
pub struct Push {
    /// Entries of the table with their new values, in an order in which the robot takes each.
    pub set: Vec<(u16, f32)>,
    /// What the robot would refuse, a sentence each.
    pub left: Vec<String>,
    /// The file's controller differs in what is built into the image, too.
    pub needs_flashing: bool,
}

impl Push {
    /// The commands that do it; nothing where nothing is to be done.
    pub fn commands(&self) -> String {
        let sets: Vec<String> = self.set.iter().map(|(index, value)| format!("set {} {value}", name(*index))).collect();
        if sets.is_empty() { String::new() } else { format!("{}; save", sets.join("; ")) }
    }
}

/// The commands that ask a robot for every parameter.
pub fn questions() -> String {
    let gets: Vec<String> = TABLE.iter().map(|entry| format!("get {}", entry.name)).collect();
    gets.join("; ")
}

/// What must be set so that a robot with these parameters runs the controller of a robot file, and what of it cannot be
/// set; `built_in` is the file that the robot's image is of.
///
/// # Errors
/// There is no controller for one of the files.
pub fn push(file: &Robot, built_in: &Robot, robot: &[runner::Parameter]) -> Result<Push, DesignError> {
    let wanted = design(file)?.parameters;
    let mut found = Push::default();
    let mut open = Vec::new();
    for (index, entry) in (0..).zip(TABLE) {
        let (Some(value), Some(there)) = (table::get(&wanted, index), robot.iter().find(|one| one.name == entry.name))
        else {
            continue;
        };
        if is_same(value, there.value) {
            continue;
        }
        let (low, high) = entry.allowed_beside(there.factory);
        if !(low..=high).contains(&value) && !is_same(value, there.factory) {
            let (now, factory) = (there.value, there.factory);
            found.left.push(format!(
                "{} stays {now} {unit}: {value} would make a failsafe weaker than the {factory} that are built in; flash the robot",
                entry.name,
                unit = entry.unit
            ));
        } else {
            open.push((index, value));
        }
    }
    let values = robot.iter().filter_map(|one| Some((table::find(one.name)?, one.value)));
    let mut now = wanted;
    set_in_order(&mut now, values.collect());
    let [set, rest] = set_in_order(&mut now, open);
    found.set = set;
    found
        .left
        .extend(rest.iter().map(|(index, value)| format!("{} cannot be {value} beside the others", name(*index))));
    found.needs_flashing = is_more_than_the_table(&wanted, &design(built_in)?.parameters);
    Ok(found)
}

fn name(index: u16) -> &'static str {
    TABLE[usize::from(index)].name
}

fn is_same(a: f32, b: f32) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

/// Sets what can be set, in an order in which every step is sound: a bound is raised before what it bounds. What was set, in
/// that order, and what cannot stand beside the rest.
fn set_in_order(now: &mut Parameters, mut open: Vec<(u16, f32)>) -> [Vec<(u16, f32)>; 2] {
    let mut set = Vec::new();
    while let Some((at, next)) =
        open.iter().enumerate().find_map(|(at, (index, value))| Some((at, now.with(*index, *value).ok()?)))
    {
        set.push(open.remove(at));
        *now = next;
    }
    [set, open]
}

/// Whether two designs differ in more than the table's numbers.
fn is_more_than_the_table(wanted: &Parameters, built_in: &Parameters) -> bool {
    let mut other = *built_in;
    let values = (0..).zip(TABLE).filter_map(|(index, _)| Some((index, table::get(wanted, index)?)));
    set_in_order(&mut other, values.collect());
    (other.motor, other.transition, other.speed) != (wanted.motor, wanted.transition, wanted.speed)
        || (other.bridge, other.sensor, other.second) != (wanted.bridge, wanted.sensor, wanted.second)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use robot_file::edit::Document;
    use robot_file::robot::Quantity;

    use super::*;

    fn document() -> Document {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        Document::parse(&std::fs::read_to_string(file).unwrap(), "robot.toml").unwrap()
    }

    fn quantity(value: f64) -> Quantity {
        Quantity { value, low: value, high: value, source: "test".into() }
    }

    /// What a robot that was flashed with a file answers.
    fn answers(robot: &Robot) -> Vec<runner::Parameter> {
        let built_in = design(robot).unwrap().parameters;
        let value = |index: u16| table::get(&built_in, index).unwrap();
        (0..)
            .zip(TABLE)
            .map(|(index, entry)| runner::Parameter {
                name: entry.name,
                value: value(index),
                factory: value(index),
                unit: entry.unit,
            })
            .collect()
    }

    fn named(push: &Push) -> Vec<(&str, f32)> {
        push.set.iter().map(|(index, value)| (name(*index), *value)).collect()
    }

    #[test]
    fn nothing_is_sent_to_a_robot_that_has_it_all() {
        let robot = document().robot().unwrap();
        assert_eq!(push(&robot, &robot, &answers(&robot)), Ok(Push::default()));
    }

    #[test]
    fn a_late_reading_is_sent_and_a_larger_drop_is_not() {
        let before = document().robot().unwrap();
        let mut extended = document();
        extended.set_effect("sensor_delay", &[("delay_s", quantity(3e-3))]).unwrap();
        extended.set("effects.driver_drop.drop_v", &quantity(2.3)).unwrap();
        let pushed = push(&extended.robot().unwrap(), &before, &answers(&before)).unwrap();
        assert_eq!(named(&pushed), [("effects.sensor_delay.delay_s", 3e-3)]);
        assert_eq!(pushed.commands(), "set effects.sensor_delay.delay_s 0.003; save");
        assert_eq!(pushed.left.len(), 1, "{:?}", pushed.left);
        assert!(pushed.left[0].starts_with("effects.driver_drop.drop_v stays 2.07 V"), "{:?}", pushed.left);
        // A smaller one is: it makes the robot see more current.
        extended.set("effects.driver_drop.drop_v", &quantity(1.8)).unwrap();
        let pushed = push(&extended.robot().unwrap(), &before, &answers(&before)).unwrap();
        assert_eq!(named(&pushed), [("effects.driver_drop.drop_v", 1.8), ("effects.sensor_delay.delay_s", 3e-3)]);
        assert!(pushed.left.is_empty() && !pushed.needs_flashing, "{pushed:?}");
    }

    #[test]
    fn a_limit_is_sent_after_the_one_that_it_needs() {
        let before = document().robot().unwrap();
        let mut other = document();
        // The lowest frequency rises beyond what is now the highest.
        other.set("controller.limits.frequency_hz", &quantity(9.0)).unwrap();
        other.set("controller.limits.least_frequency_hz", &quantity(8.0)).unwrap();
        let mut there = answers(&before);
        there.iter_mut().filter(|one| one.name == "controller.limits.frequency_hz").for_each(|one| one.value = 7.0);
        let pushed = push(&other.robot().unwrap(), &before, &there).unwrap();
        let order = [("controller.limits.frequency_hz", 9.0), ("controller.limits.least_frequency_hz", 8.0)];
        assert_eq!(named(&pushed), order);
    }

    #[test]
    fn another_motor_is_said_to_need_flashing() {
        let before = document().robot().unwrap();
        let mut other = document();
        other.set("motor.resistance_ohm", &quantity(18.0)).unwrap();
        let pushed = push(&other.robot().unwrap(), &before, &answers(&before)).unwrap();
        assert_eq!(pushed, Push { needs_flashing: true, ..Push::default() });
    }
}
