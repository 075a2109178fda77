//! The numbers of `[controller.*]` by name, with errors that name the field.

use control::parameters::FaultLimit;

use super::DesignError;
use crate::robot::Controller;

/// Reads `[controller.*]`.
pub(super) struct Numbers<'a>(pub &'a Controller);

impl Numbers<'_> {
    /// A number as it stands in the file.
    pub fn get(&self, key: &str) -> Result<f64, DesignError> {
        let field = || format!("controller.{key}");
        let quantity = self.0.numbers.get(key).ok_or_else(|| DesignError::Missing { field: field() })?;
        if !quantity.value.is_finite() {
            return Err(DesignError::OutOfRange {
                field: field(),
                value: quantity.value,
                low: f64::MIN,
                high: f64::MAX,
            });
        }
        Ok(quantity.value)
    }

    /// A number within bounds.
    pub fn within(&self, key: &str, low: f64, high: f64) -> Result<f64, DesignError> {
        let value = self.get(key)?;
        if value < low || value > high {
            return Err(DesignError::OutOfRange { field: format!("controller.{key}"), value, low, high });
        }
        Ok(value)
    }

    /// Must be positive.
    pub fn positive(&self, key: &str) -> Result<f64, DesignError> {
        self.within(key, f64::MIN_POSITIVE, 1e9)
    }

    /// An angle that the file has in degrees, rad.
    pub fn angle(&self, key: &str) -> Result<f64, DesignError> {
        Ok(self.get(key)?.to_radians())
    }

    /// A positive angle, rad.
    pub fn positive_angle(&self, key: &str) -> Result<f64, DesignError> {
        Ok(self.positive(key)?.to_radians())
    }

    /// Integer from `low` to `high`.
    pub fn count(&self, key: &str, low: u16, high: u16) -> Result<u16, DesignError> {
        Ok(self.within(key, f64::from(low), f64::from(high))?.round() as u16)
    }

    /// A supervisor's watch: `NAME` is the limit's key, `GROUP_persistence_s` and `GROUP_bound_s` its times.
    pub fn fault_limit(&self, limit: &str, group: &str) -> Result<FaultLimit, DesignError> {
        let time = |what: &str| self.within(&format!("supervisor.{group}_{what}_s"), 0.0, 10.0);
        let persistence = time("persistence")?;
        let bound = time("bound")?;
        Ok(FaultLimit {
            limit: self.get(&format!("supervisor.{limit}"))? as f32,
            persistence: persistence as f32,
            bound: bound as f32,
        })
    }
}
