//! What a sweep varies: `f=-8,-7,7,8`, `alpha=0:120:5`, `ground.friction=0.5:1.0:6`, `backbone.roll_deg[2]=…`.

use robot_file::unit;

/// Values that one axis may have at most.
const MOST_VALUES: usize = 10_000;

/// What an axis changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Factor {
    /// The actuation frequency, Hz, the thesis's sign: positive clockwise seen from above.
    Frequency,
    /// α: backbone b is rolled by b·α, degrees.
    Alpha,
    /// The roll of one backbone (from 0) by itself, degrees; the others stay at b·α.
    Roll(usize),
    /// How many modules: an actuator, a courier, then passive ones.
    Modules,
    /// A quantity of the robot file by its dotted path.
    Quantity(String),
    /// A factor on the feet's friction.
    FrictionFactor,
    /// The shaft swings between 0 and this angle, degrees counter-clockwise, instead of turning; at 0 it turns.
    Swing,
}

/// Something that is varied, and its values in the order in which they were given.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Factor that is varied.
    pub what: Factor,
    /// In the unit of the column.
    pub values: Vec<f64>,
}

/// Why something is no axis.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error, miette::Diagnostic)]
pub enum AxisError {
    /// The words make no axis.
    #[error("`--axis {text}`: {problem}")]
    #[diagnostic(help("write PATH=from:to:count or PATH=v1,v2,…, e.g. ground.friction=0.5:1.0:6 or f=-7,7"))]
    Words {
        /// As typed.
        text: String,
        /// Problem, as a clause that follows the name.
        problem: String,
    },
    /// Two axes change the same.
    #[error("axis `{0}` is given twice")]
    #[diagnostic(help("put all of its values into one --axis"))]
    Twice(String),
    /// The robot has no body, or one that cannot be built.
    #[error("{0}")]
    #[diagnostic(help("a sweep needs a robot file with [body], [backbone], [eccentric], [feet] and [ground]"))]
    NoBody(String),
    /// The robot cannot be brought there.
    #[error("axis `{axis}`: {problem}")]
    Unreachable {
        /// The axis, with the value where one is at fault.
        axis: String,
        /// Problem, as a clause that follows the name.
        problem: String,
        /// What is allowed or near.
        #[help]
        help: String,
    },
}

impl Axis {
    /// Reads `PATH=from:to:count` or `PATH=v1,v2,…`.
    ///
    /// # Errors
    /// The text is neither, a value is no finite number, or is there twice.
    pub fn parse(text: &str) -> Result<Self, AxisError> {
        let wrong = |problem: String| AxisError::Words { text: text.into(), problem };
        let Some((path, values)) = text.split_once('=') else { return Err(wrong("there is no `=`".into())) };
        let what = Factor::parse(path.trim()).map_err(wrong)?;
        let values = if values.contains(':') { range(values) } else { list(values) }.map_err(wrong)?;
        for (index, value) in values.iter().enumerate() {
            if values[..index].contains(value) {
                return Err(wrong(format!("{value} is there twice")));
            }
        }
        Ok(Self { what, values })
    }

    /// The same for several, none of them twice.
    ///
    /// # Errors
    /// As [`Self::parse`], or two change the same.
    pub fn parse_all(texts: &[String]) -> Result<Vec<Self>, AxisError> {
        let axes = texts.iter().map(|text| Self::parse(text)).collect::<Result<Vec<_>, _>>()?;
        for (index, axis) in axes.iter().enumerate() {
            if axes[..index].iter().any(|other| other.what == axis.what) {
                return Err(AxisError::Twice(axis.what.path()));
            }
        }
        Ok(axes)
    }
}

impl Factor {
    /// Reads what stands before the `=` of an axis.
    ///
    /// # Errors
    /// What is wrong, for a person.
    pub fn parse(path: &str) -> Result<Self, String> {
        match path {
            "" => return Err("the path before `=` is empty".into()),
            "f" => return Ok(Self::Frequency),
            "alpha" | "backbone.alpha_deg" => return Ok(Self::Alpha),
            "body.modules" => return Ok(Self::Modules),
            "swing" => return Ok(Self::Swing),
            _ => {}
        }
        let Some(rest) = path.strip_prefix("backbone.roll_deg") else { return Ok(Self::Quantity(path.into())) };
        let number: Option<usize> =
            rest.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).and_then(|n| n.parse().ok());
        match number {
            Some(number) if number > 0 => Ok(Self::Roll(number - 1)),
            _ => Err("name the backbone, from 1 at the front: backbone.roll_deg[2]".into()),
        }
    }

    /// As a person types it.
    #[must_use]
    pub fn path(&self) -> String {
        match self {
            Self::Frequency => "f".into(),
            Self::Alpha => "alpha".into(),
            Self::Roll(backbone) => format!("backbone.roll_deg[{}]", backbone + 1),
            Self::Modules => "body.modules".into(),
            Self::Quantity(path) => path.clone(),
            Self::FrictionFactor => "friction_factor".into(),
            Self::Swing => "swing".into(),
        }
    }

    /// Its column in a table, with the unit in the name.
    #[must_use]
    pub fn column(&self) -> String {
        match self {
            Self::Frequency => "f_hz".into(),
            Self::Alpha => "alpha_deg".into(),
            Self::Swing => "swing_deg".into(),
            other => other.path(),
        }
    }

    /// For a plot: name and unit, and which way it is positive.
    #[must_use]
    pub fn label(&self) -> String {
        match self {
            Self::Frequency => "f / Hz, + clockwise".into(),
            Self::Alpha => "α / °".into(),
            Self::Roll(backbone) => format!("roll of backbone {} / °", backbone + 1),
            Self::Modules => "modules".into(),
            Self::FrictionFactor => "factor on the friction".into(),
            Self::Swing => "swing from 0 to / °".into(),
            Self::Quantity(path) => match unit::of(path) {
                "1" => path.clone(),
                unit => format!("{path} / {unit}"),
            },
        }
    }
}

fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value + 0.0),
        _ => Err(format!("`{}` is not a finite number", text.trim())),
    }
}

fn list(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(finite).collect()
}

fn range(text: &str) -> Result<Vec<f64>, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let [from, to, count] = parts.as_slice() else {
        return Err(format!("`{text}` is not from:to:count"));
    };
    let (from, to) = (finite(from)?, finite(to)?);
    let count = match count.trim().parse::<usize>() {
        Ok(count) if (1..=MOST_VALUES).contains(&count) => count,
        _ => return Err(format!("`{}` is not a count from 1 to {MOST_VALUES}", count.trim())),
    };
    if count > 1 && from == to {
        return Err(format!("{count} values from {from} to {to} are all the same"));
    }
    let step = if count > 1 { (to - from) / (count - 1) as f64 } else { 0.0 };
    Ok((0..count).map(|index| significant(from + index as f64 * step, 12)).collect())
}

/// Rounded to so many digits, so that 0.1 + 0.2 is 0.3 in a table.
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse::<f64>().unwrap_or(value) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_lists() {
        let axis = Axis::parse("ground.friction=0.5:1.0:6").unwrap();
        assert_eq!(axis.values, [0.5, 0.6, 0.7, 0.8, 0.9, 1.0], "no digits of the binary fraction");
        assert_eq!(axis.what, Factor::Quantity("ground.friction".into()));
        assert_eq!(Axis::parse("f=-8, 8").unwrap(), Axis { what: Factor::Frequency, values: vec![-8.0, 8.0] });
        assert_eq!(Axis::parse("alpha=90:0:4").unwrap().values, [90.0, 60.0, 30.0, 0.0]);
        assert_eq!(Axis::parse("backbone.alpha_deg=5:9:1").unwrap(), Axis { what: Factor::Alpha, values: vec![5.0] });
        assert_eq!(Axis::parse("backbone.roll_deg[2]=10").unwrap().what, Factor::Roll(1));
        assert_eq!(Axis::parse("swing=-100,100").unwrap().what, Factor::Swing);
        assert_eq!(Axis::parse("body.modules=2:5:4").unwrap().values, [2.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn what_is_no_axis_is_said() {
        for (text, says) in [
            ("friction", "there is no `=`"),
            ("=1,2", "empty"),
            ("f=7,seven", "`seven` is not a finite number"),
            ("f=NaN", "not a finite number"),
            ("f=", "not a finite number"),
            ("f=1:inf:3", "not a finite number"),
            ("f=6:8", "from:to:count"),
            ("f=6:8:0", "count from 1"),
            ("f=6:8:2.5", "count from 1"),
            ("f=7:7:3", "all the same"),
            ("f=7,8,7", "7 is there twice"),
            ("backbone.roll_deg=3", "from 1 at the front"),
            ("backbone.roll_deg[0]=3", "from 1 at the front"),
        ] {
            let message = Axis::parse(text).unwrap_err().to_string();
            assert!(message.contains(says) && message.contains(text), "{text}: {message}");
        }
        let twice = ["alpha=1".to_owned(), "backbone.alpha_deg=2".to_owned()];
        assert_eq!(Axis::parse_all(&twice), Err(AxisError::Twice("alpha".into())));
    }
}
