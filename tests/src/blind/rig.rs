//! The rig's numbers: what the robot file says, and what the specimen on the bench really has.
//!
//! The robot file is read as plain TOML text, not through the `robot_file` crate, so that a mistake there cannot
//! hide on both sides of the test.

use rand::RngExt;
use rand_pcg::Pcg64;
use std::path::Path;

/// Linear motor at the output shaft, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    /// Winding resistance R, Ω.
    pub resistance_ohm: f64,
    /// Winding inductance L, H.
    pub inductance_h: f64,
    /// K = Kt = Ke, N·m/A = V·s/rad.
    pub torque_constant: f64,
    /// Everything that turns, kg·m².
    pub inertia_kg_m2: f64,
    /// Viscous damping b, N·m·s/rad.
    pub viscous: f64,
    /// The bridge's supply without load, V.
    pub rail_v: f64,
}

/// What is wrong with a robot file for this purpose.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// It could not be read.
    #[error("{path}: {source}")]
    Read {
        /// The robot file.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is not TOML.
    #[error("robot file is not TOML: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A number is missing.
    #[error("robot file has no number `{0}`: expected a number or a table with `value`")]
    Missing(String),
    /// An effect that hardly shows on this rig.
    #[error("{0} cannot be made as visible as wanted in this data set: take another seed, or --ratio nearer to 1")]
    Invisible(String),
}

/// A robot file's text with everything that it takes from its `base` written out, so that it stands alone, and without
/// its controller: the rig is only diagnosed.
///
/// # Errors
/// It or its base cannot be read or is not TOML.
pub fn flatten(path: &Path) -> Result<String, RigError> {
    let mut table = standing_alone(path)?;
    table.remove("controller");
    Ok(table.to_string())
}

/// The file's table over its base's: what `remove` lists is taken out of the base first.
fn standing_alone(path: &Path) -> Result<toml::Table, RigError> {
    let text =
        std::fs::read_to_string(path).map_err(|source| RigError::Read { path: path.display().to_string(), source })?;
    let mut own: toml::Table = text.parse()?;
    let Some(toml::Value::String(base)) = own.remove("base") else { return Ok(own) };
    let mut table = standing_alone(&path.parent().unwrap_or(Path::new(".")).join(base))?;
    if let Some(toml::Value::Array(removed)) = own.remove("remove") {
        for dotted in removed.iter().filter_map(toml::Value::as_str) {
            let (parents, last) = dotted.rsplit_once('.').unwrap_or(("", dotted));
            let mut at = Some(&mut table);
            for parent in parents.split('.').filter(|part| !part.is_empty()) {
                at = at.and_then(|table| table.get_mut(parent)).and_then(toml::Value::as_table_mut);
            }
            if let Some(at) = at {
                at.remove(last);
            }
        }
    }
    overlay(&mut table, own);
    Ok(table)
}

/// Puts `own` over `table`, table by table; a quantity replaces the whole quantity.
fn overlay(table: &mut toml::Table, own: toml::Table) {
    for (key, value) in own {
        match (table.get_mut(&key), value) {
            (Some(toml::Value::Table(under)), toml::Value::Table(over)) if !over.contains_key("value") => {
                overlay(under, over);
            }
            (_, value) => {
                table.insert(key, value);
            }
        }
    }
}

/// The number at a dotted path: either plain or a table with `value`.
///
/// # Errors
/// Names the path if there is no such number.
pub fn number(root: &toml::Table, path: &str) -> Result<f64, RigError> {
    let missing = || RigError::Missing(path.to_owned());
    let mut parts = path.split('.');
    let first = parts.next().ok_or_else(missing)?;
    let mut at = root.get(first).ok_or_else(missing)?;
    for part in parts {
        at = at.get(part).ok_or_else(missing)?;
    }
    let plain = at.get("value").unwrap_or(at);
    plain.as_float().or_else(|| plain.as_integer().map(|whole| whole as f64)).ok_or_else(missing)
}

impl Rig {
    /// Nominal numbers out of a robot file's text.
    ///
    /// # Errors
    /// Names the number that is missing.
    pub fn nominal(robot_file: &str) -> Result<Self, RigError> {
        let root: toml::Table = robot_file.parse()?;
        Ok(Self {
            resistance_ohm: number(&root, "motor.resistance_ohm")?,
            inductance_h: number(&root, "motor.inductance_h")?,
            torque_constant: number(&root, "motor.torque_constant_nm_per_a")?,
            inertia_kg_m2: number(&root, "motor.rotor_inertia_kg_m2")? + number(&root, "load.inertia_kg_m2")?,
            viscous: number(&root, "motor.viscous_nm_s_per_rad")?,
            rail_v: number(&root, "supply.rail_v")?,
        })
    }

    /// A specimen whose R, L, K, J and b are each off the nominal by a share between two, up or down.
    #[must_use]
    pub fn specimen(&self, off: (f64, f64), rng: &mut Pcg64) -> Self {
        let mut off = |nominal: f64| {
            let share = rng.random_range(off.0..off.1);
            nominal * if rng.random_bool(0.5) { 1.0 + share } else { 1.0 - share }
        };
        let (resistance_ohm, torque_constant) = (off(self.resistance_ohm), off(self.torque_constant));
        let (inertia_kg_m2, viscous) = (off(self.inertia_kg_m2), off(self.viscous));
        let inductance_h = off(self.inductance_h);
        Self { resistance_ohm, inductance_h, torque_constant, inertia_kg_m2, viscous, rail_v: self.rail_v }
    }

    /// Speed at the full rail with nothing but viscous damping, rad/s.
    #[must_use]
    pub fn free_speed(&self) -> f64 {
        let k = self.torque_constant;
        self.rail_v * k / (k * k + self.viscous * self.resistance_ohm)
    }

    /// Stall torque at the full rail, N·m.
    #[must_use]
    pub fn stall_torque(&self) -> f64 {
        self.rail_v * self.torque_constant / self.resistance_ohm
    }
}
