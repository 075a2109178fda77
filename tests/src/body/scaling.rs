//! What a step costs against the number of modules.

use hal_sim::body::{Ensemble, Plan, Settings};
use plot::report::svg::{COLOURS, Chart, STYLE};
use robot_file::Robot;
use serde_json::json;

use super::PeerSetup;
use super::error_measures::slope;
use super::reference::{plan, servo};
use super::stopwatch::Stopwatch;
use crate::row::FigureRow;

/// Numbers of modules.
const MODULES: [usize; 9] = [2, 3, 4, 6, 8, 12, 16, 24, 32];
/// Steps that are timed, and how often; the shortest counts. All numbers of modules take turns: what slows the machine down for
/// a second or two slows all of them.
const STEPS: usize = 1000;
const ROUNDS: usize = 21;
/// The largest exponent of the cost over the degrees of freedom that counts as linear. Less is a fixed part, or lanes that
/// are better used.
const EXPONENT: f64 = 1.1;
/// The plot.
pub const FILE: &str = "cost-against-modules.svg";

/// Runs the campaign; the table has one row.
#[must_use]
pub fn rows(bench: &PeerSetup) -> Vec<FigureRow> {
    let cost = costs_us(&bench.robot);
    let (per_module, fixed) = line(&cost);
    let off_line = cost.iter().map(|(n, us)| (us / (fixed + per_module * n) - 1.0).abs()).fold(0.0, f64::max);
    let freedom = |&n: &usize| longer(&bench.robot, n).degrees_of_freedom() as f64;
    let logarithms: Vec<(f64, f64)> = MODULES.iter().map(freedom).zip(&cost).map(|(f, c)| (f.ln(), c.1.ln())).collect();
    let exponent = slope(&logarithms);
    let path = bench.out.join(FILE);
    let svg = picture(&cost, per_module, fixed);
    let written = std::fs::create_dir_all(&bench.out).and_then(|()| std::fs::write(&path, svg));
    let told = written.map_or_else(|error| error.to_string(), |()| path.display().to_string());
    vec![FigureRow::new(
        "cost of a step against the number of modules, 2 … 32, one robot",
        "linear: exponent over the degrees of freedom up to 1.1",
        format!(
            "exponent {exponent:.3}; slope {per_module:.3} µs a module, points within {:.0} % of the line; {told}",
            100.0 * off_line
        ),
        exponent <= EXPONENT,
        json!({ "us": cost, "per_module_us": per_module, "fixed_us": fixed, "exponent": exponent }),
    )]
}

/// The robot with more passive modules, or fewer.
fn longer(robot: &Robot, modules: usize) -> Plan {
    let mut plan = plan(robot, 60.0);
    let (last, backbone) = (plan.modules[plan.modules.len() - 1], plan.backbones[0]);
    plan.modules.resize(modules, last);
    plan.backbones.resize(modules - 1, backbone);
    for (b, backbone) in plan.backbones.iter_mut().enumerate() {
        backbone.roll = (60.0 * (b + 1) as f64).to_radians();
    }
    plan
}

/// The numbers of modules, and the processor time of a step of each, µs.
fn costs_us(robot: &Robot) -> Vec<(f64, f64)> {
    let drive = [servo(7.0)];
    let made = |&modules: &usize| {
        let made = Ensemble::new(&[longer(robot, modules)], Settings::default());
        let mut body = made.unwrap_or_else(|error| panic!("{error}"));
        body.advance(STEPS, &drive);
        body
    };
    let mut bodies: Vec<Ensemble> = MODULES.iter().map(made).collect();
    let mut shortest_s = [f64::INFINITY; MODULES.len()];
    for _ in 0..ROUNDS {
        for (body, shortest_s) in bodies.iter_mut().zip(&mut shortest_s) {
            let watch = Stopwatch::start();
            body.advance(STEPS, &drive);
            *shortest_s = shortest_s.min(watch.busy_s());
        }
    }
    MODULES.iter().zip(shortest_s).map(|(&n, s)| (n as f64, 1e6 * s / STEPS as f64)).collect()
}

/// A line through the points with the smallest relative errors, as slope and intercept.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    // y/x = slope + intercept/x, fitted with weights x²/y².
    let sum = |f: fn(f64, f64) -> f64| points.iter().map(|&(x, y)| f(x, y)).sum::<f64>();
    let (one, x, xx) = (sum(|_, y| 1.0 / (y * y)), sum(|x, y| x / (y * y)), sum(|x, y| x * x / (y * y)));
    let (y, xy) = (sum(|_, y| 1.0 / y), sum(|x, y| x / y));
    let slope = (one * xy - x * y) / (one * xx - x * x);
    (slope, (y - slope * x) / one)
}

fn picture(cost: &[(f64, f64)], per_module: f64, fixed: f64) -> String {
    let most = cost.iter().map(|(_, us)| *us).fold(0.0, f64::max);
    let mut chart = Chart::new("cost", (720.0, 400.0), (0.0, 33.0), (0.0, 1.1 * most));
    chart.line([2.0, 32.0].map(|n| (n, fixed + per_module * n)), "after");
    chart.dots(cost.iter().copied(), 3.5, "before fill");
    let title = format!("Cost of a step against the number of modules: {per_module:.2} µs a module");
    let svg = chart.finish(&title, "modules", "processor time of a step, µs", &title);
    // A style sheet of its own, so that the file stands alone.
    svg.replacen("<defs>", &format!("<style>{COLOURS}{STYLE}svg{{background:var(--paper)}}</style><defs>"), 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found() {
        let (slope, intercept) = line(&[(1.0, 5.0), (2.0, 7.0), (10.0, 23.0)]);
        assert!((slope - 2.0).abs() < 1e-9 && (intercept - 3.0).abs() < 1e-9);
    }
}
