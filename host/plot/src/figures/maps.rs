//! Which plots a sweep has.

use super::heat::{self, Cell, Map, Scale};
use super::lines;
use super::paths::{self, Path};
use super::{FigureError, tick};
use sweep::{Component, Condition, Conditions, Factor, Measured, Robustness, Stat, Swept, error_percent};

/// Maps of the same sweep that are drawn at most, over the axes that a map does not show.
const MOST_MAPS: usize = 24;

/// Which way a speed is positive.
fn positive(component: Component) -> &'static str {
    match component {
        Component::Longitudinal => "+ ahead",
        Component::Lateral => "+ to the left",
        Component::Rotational => "+ counter-clockwise",
    }
}

/// A plot: its name without `.svg`, and the SVG.
pub type Figure = (String, String);

/// Every plot of a sweep: maps over f and α as in Fig. 5.1, or over the two longest axes, or lines over the only one;
/// with friction varied, σ and φ as in Fig. 5.2; paths where they were kept.
///
/// # Errors
/// The drawing library refuses.
pub fn draw(swept: &Swept, measured: Option<&Measured>) -> Result<Vec<Figure>, FigureError> {
    let conditions = Conditions::new(&swept.design, &swept.runs);
    let nominal = conditions.at_friction(1.0);
    let robustness: Option<Vec<Robustness>> =
        Component::ALL.iter().map(|component| conditions.robustness(*component)).collect();
    let mut figures = Vec::new();
    match plane(&nominal) {
        Plane::Map(x, y) => {
            for slice in slices(&nominal, x, y) {
                figures.push((format!("maps{}", slice.suffix), speeds(&nominal, &slice, measured)?));
                if let Some(robustness) = &robustness {
                    figures.push((format!("sensitivity{}", slice.suffix), merit(&nominal, &slice, robustness)?));
                }
            }
        }
        Plane::Line(x) => figures.push(("lines".into(), over(&nominal, x, robustness.as_deref())?)),
        Plane::Point => {}
    }
    if swept.paths_file.is_some() {
        figures.push(("trajectories".into(), trajectories(swept)?));
    }
    Ok(figures)
}

/// What the plots are over: positions of axes.
enum Plane {
    Map(usize, usize),
    Line(usize),
    Point,
}

/// f across and α upwards where both are varied; else the two axes with most values, the longest across.
fn plane(conditions: &Conditions) -> Plane {
    let mut lengths: Vec<(usize, usize)> =
        (0..conditions.axes.len()).map(|axis| (axis, values(conditions, axis).len())).filter(|(_, n)| *n > 1).collect();
    lengths.sort_by_key(|(axis, count)| (std::cmp::Reverse(*count), *axis));
    let place = |what: Factor| lengths.iter().map(|(axis, _)| *axis).find(|axis| conditions.axes[*axis] == what);
    match (place(Factor::Frequency), place(Factor::Alpha), lengths.as_slice()) {
        (Some(f), Some(alpha), [_, _]) => Plane::Map(f, alpha),
        (.., [(x, _), (y, _), ..]) => Plane::Map(*x, *y),
        (.., [(x, _)]) => Plane::Line(*x),
        _ => Plane::Point,
    }
}

/// The values of an axis, increasing.
fn values(conditions: &Conditions, axis: usize) -> Vec<f64> {
    let mut values: Vec<f64> = conditions.conditions.iter().map(|condition| condition.point[axis]).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// A map's share of the conditions: one value for every axis that it does not show.
struct Slice {
    x: usize,
    y: usize,
    /// (axis, value) of the others.
    fixed: Vec<(usize, f64)>,
    /// Of the file's name.
    suffix: String,
    /// Of the title.
    title: String,
}

impl Slice {
    /// Index of the condition of a cell.
    fn find(&self, conditions: &Conditions, x: f64, y: f64) -> Option<usize> {
        conditions.conditions.iter().position(|condition| {
            let point = &condition.point;
            point[self.x] == x && point[self.y] == y && self.fixed.iter().all(|(axis, value)| point[*axis] == *value)
        })
    }

    fn map(
        &self,
        conditions: &Conditions,
        title: String,
        scale: Scale,
        cell: impl Fn(usize, &Condition) -> Cell,
    ) -> Map {
        let (x, y) = (values(conditions, self.x), values(conditions, self.y));
        let at = |x: f64, y: f64| {
            self.find(conditions, x, y).map_or(Cell::default(), |index| cell(index, &conditions.conditions[index]))
        };
        Map {
            title,
            x_label: conditions.axes[self.x].label(),
            y_label: conditions.axes[self.y].label(),
            cells: y.iter().map(|y| x.iter().map(|x| at(*x, *y)).collect()).collect(),
            x: x.into_iter().map(tick).collect(),
            y: y.into_iter().map(tick).collect(),
            scale,
            full: None,
        }
    }
}

/// One slice for every combination of the axes that are not shown.
fn slices(conditions: &Conditions, x: usize, y: usize) -> Vec<Slice> {
    let mut found = vec![Slice { x, y, fixed: vec![], suffix: String::new(), title: String::new() }];
    for axis in (0..conditions.axes.len()).filter(|axis| *axis != x && *axis != y) {
        let all = values(conditions, axis);
        let longer = |slice: &Slice| {
            let name = conditions.axes[axis].path();
            let said = |value: f64| {
                if all.len() > 1 {
                    (format!("_{name}={value}"), format!(", {name} = {}", tick(value)))
                } else {
                    Default::default()
                }
            };
            all.iter()
                .map(|value| {
                    let (suffix, title) = said(*value);
                    Slice {
                        x,
                        y,
                        fixed: [slice.fixed.as_slice(), &[(axis, *value)]].concat(),
                        suffix: slice.suffix.clone() + &suffix,
                        title: slice.title.clone() + &title,
                    }
                })
                .collect::<Vec<_>>()
        };
        found = found.iter().flat_map(longer).collect();
    }
    found.truncate(MOST_MAPS);
    found
}

fn cell(stat: Stat) -> Cell {
    Cell { value: stat.mean, spread: stat.spread }
}

/// Simulated speeds; beside measured ones and the error (5.1) where there are any.
fn speeds(conditions: &Conditions, slice: &Slice, measured: Option<&Measured>) -> Result<String, FigureError> {
    let thesis = (&conditions.axes[slice.x], &conditions.axes[slice.y]) == (&Factor::Frequency, &Factor::Alpha);
    let row = |component: Component| {
        let name = format!("{} / ({}), {}", component.name(), component.unit(), positive(component));
        let simulated = slice.map(conditions, name.clone(), Scale::Signed, |_, c| cell(c.speed(component)));
        let Some(measured) = measured.filter(|_| thesis) else { return vec![simulated] };
        let (x, y) = (slice.x, slice.y);
        let there = |c: &Condition| measured.speed(c.point[x], c.point[y], component);
        let mut experiment = slice.map(conditions, format!("{name}, measured"), Scale::Signed, |_, c| cell(there(c)));
        let largest = measured.largest(component);
        let error = |c: &Condition| error_percent(c.speed(component).mean?, there(c).mean?, largest);
        let error = slice
            .map(conditions, "Error (5.1) / %".into(), Scale::Signed, |_, c| Cell { value: error(c), spread: None });
        // Measured and simulated speeds in the same colours.
        let mut simulated = Map { title: format!("{name}, simulated"), ..simulated };
        let values =
            |map: &Map| map.cells.iter().flatten().filter_map(|c| c.value).fold(0.0_f64, |m, v| m.max(v.abs()));
        let full = values(&simulated).max(values(&experiment));
        (simulated.full, experiment.full) = (Some(full), Some(full));
        vec![experiment, simulated, error]
    };
    let title = format!("Mean speeds{}", slice.title);
    heat::draw(&title, &Component::ALL.map(row))
}

/// σ (5.2) and φ (5.3).
fn merit(conditions: &Conditions, slice: &Slice, robustness: &[Robustness]) -> Result<String, FigureError> {
    let row = |component: Component| {
        let found = &robustness[component as usize];
        let plain = |value: Option<f64>| Cell { value, spread: None };
        let sigma = format!("{}: σ (5.2) / %", component.name());
        let phi = format!("{}: φ (5.3) / ({})", component.name(), component.unit());
        vec![
            slice.map(conditions, sigma, Scale::Amount, |index, _| plain(found.sensitivity[index].map(|s| 100.0 * s))),
            slice.map(conditions, phi, Scale::Amount, |index, _| plain(found.effectiveness[index])),
        ]
    };
    let title = format!("Sensitivity to 10 % more friction, and effectiveness{}", slice.title);
    heat::draw(&title, &Component::ALL.map(row))
}

/// Lines over the only axis.
fn over(conditions: &Conditions, axis: usize, robustness: Option<&[Robustness]>) -> Result<String, FigureError> {
    let x = |condition: &Condition| condition.point[axis];
    let speed = |component: Component| lines::Panel {
        y_label: format!("{} / ({}), {}", component.name().to_lowercase(), component.unit(), positive(component)),
        points: conditions
            .conditions
            .iter()
            .filter_map(|c| Some((x(c), c.speed(component).mean?, c.speed(component).spread)))
            .collect(),
    };
    let mut panels = Component::ALL.map(speed).to_vec();
    for (component, found) in Component::ALL.iter().zip(robustness.unwrap_or_default()) {
        let all = conditions.conditions.iter().zip(&found.effectiveness);
        panels.push(lines::Panel {
            y_label: format!("φ {} / ({})", component.name().to_lowercase(), component.unit()),
            points: all.filter_map(|(c, phi)| Some((x(c), (*phi)?, None))).collect(),
        });
    }
    lines::draw("Mean speeds", &conditions.axes[axis].label(), &panels)
}

/// A panel an α, every run's path in it.
fn trajectories(swept: &Swept) -> Result<String, FigureError> {
    let design = &swept.design;
    let alpha = design.position(&Factor::Alpha);
    let factor = design.position(&Factor::FrictionFactor);
    let mut panels: Vec<(f64, Vec<Path>)> = Vec::new();
    for run in swept.runs.iter().filter(|run| !run.path.is_empty()) {
        let point = &design.points[run.point];
        if factor.is_some_and(|factor| point[factor] != 1.0) {
            continue;
        }
        let here = alpha.map_or(0.0, |alpha| point[alpha]);
        let path = Path { f_hz: design.frequency(point), points: run.path.clone() };
        match panels.iter_mut().find(|(alpha, _)| *alpha == here) {
            Some((_, paths)) => paths.push(path),
            None => panels.push((here, vec![path])),
        }
    }
    let panels: Vec<paths::Panel> = panels
        .into_iter()
        .map(|(alpha, paths)| paths::Panel { title: format!("α = {}°", tick(alpha)), paths })
        .collect();
    paths::draw("Paths of the centroid, every repeat; frequencies + clockwise", &panels)
}
