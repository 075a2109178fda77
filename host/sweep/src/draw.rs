//! Robots drawn from the spreads of a robot file.

use hal_sim::random::{Source, Stream};
use robot_file::edit::Document;

use super::search::{CHOSEN, Unknown};
use super::setting::SettingError;
use super::variant::{LOAD, VariantBuilder, WHOLE};

/// What is decided and not uncertain: the controller's own numbers, the link, and how the chip drives and converts.
const DECIDED: [&str; 5] = ["controller.", "radio.", "driver.pwm_", "sensor.adc.bits", "sensor.adc.conversions"];

impl VariantBuilder {
    /// The robot file with every uncertain number drawn from its spread: uniform from low to high, in the logarithm where high is more than
    /// three times a positive low. What is decided stays: the controller's
    /// numbers, the link's and the chip's, α, whole numbers. The same seed gives the same robot.
    ///
    /// # Errors
    /// Numbers that were drawn do not go together.
    pub fn drawn(&self, seed: u64) -> Result<Document, SettingError> {
        let mut stream = Stream::new(seed, Source::Variation);
        // What the shaft carries follows from the eccentric.
        let follows = |path: &str| path == LOAD && self.robot().eccentric.is_some();
        let stays = |path: &str| {
            DECIDED.iter().chain(&CHOSEN).any(|beginning| path.starts_with(beginning))
                || WHOLE.contains(&path)
                || follows(path)
        };
        let mut values = Vec::new();
        for (path, quantity) in self.quantities().iter().filter(|(path, _)| !stays(path)) {
            if quantity.low < quantity.high {
                let spread = Unknown { path: path.clone(), low: quantity.low, high: quantity.high };
                values.push((path.as_str(), spread.value(stream.uniform(0.0, 1.0))));
            }
        }
        self.set(&values)
    }
}

#[cfg(test)]
mod tests {
    use robot_file::Robot;
    use robot_file::edit::Document;

    use super::*;

    #[test]
    fn every_uncertain_number_is_drawn_from_its_spread_and_nothing_else_changes() {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robot.toml");
        let builder = VariantBuilder::of_any(Document::load(&file).unwrap(), Robot::load(&file).unwrap());
        let quantities = |document: &Document| {
            let robot = document.robot().unwrap();
            VariantBuilder::of_any(document.clone(), robot).quantities().to_vec()
        };
        let (one, again, other) = (builder.drawn(3).unwrap(), builder.drawn(3).unwrap(), builder.drawn(4).unwrap());
        assert_eq!(quantities(&one), quantities(&again));
        assert_ne!(quantities(&one), quantities(&other));
        let mut drawn = 0;
        for ((path, file), (_, robot)) in builder.quantities().iter().zip(&quantities(&one)) {
            if path.starts_with("controller.") || path == "backbone.alpha_deg" {
                assert_eq!(file, robot, "{path}");
            } else if path != "load.inertia_kg_m2" {
                assert!((file.low..=file.high).contains(&robot.value), "{path}: {robot:?}");
                assert_eq!((file.low, file.high), (robot.low, robot.high), "{path}");
            }
            drawn += usize::from(file.value != robot.value);
        }
        assert!(drawn > 20, "{drawn}");
        for seed in 0..50 {
            builder.drawn(seed).unwrap();
        }
    }
}
