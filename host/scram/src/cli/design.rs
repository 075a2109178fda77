//! `scram design`

use clap::Args;
use common::conventions::degrees;
use miette::miette;
use robot_file::design::{Design as Designed, design};
use serde_json::{Value, json};

use super::settings::Settings;
use super::{Common, Done, print, print_json, table};

/// Design the controller from the robot file: gains, poles, margins, uncertainty in the blind arc
#[derive(Args)]
#[command(
    after_help = "Examples:\n  scram design --robot robots/motor-136.toml\n  scram design --set motor.resistance_ohm=18"
)]
pub struct Design {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    common: Common,
}

impl Design {
    pub fn run(&self) -> Done {
        let robot = self.settings.robot(&self.common.robot)?;
        let designed = design(&robot).map_err(|e| {
            miette!(
                help = "the [controller] table of robot.toml has every number that a design needs",
                "{}: {e}",
                self.common.robot.display()
            )
        })?;
        if self.common.json {
            print_json(&as_json(&robot.name, &designed))?;
        } else {
            print(&format!("controller of {}, one tick is {} s", robot.name, designed.parameters.tick));
            print(&table::facts(facts(&designed)));
        }
        Ok(())
    }
}

fn facts(d: &Designed) -> Vec<(&'static str, String)> {
    let poles = |poles: &[nalgebra::Complex<f64>]| {
        let shown: Vec<String> = poles
            .iter()
            .map(|p| if p.im == 0.0 { format!("{:.4}", p.re) } else { format!("{:.4}{:+.4}i", p.re, p.im) })
            .collect();
        shown.join(", ")
    };
    let margins = |m: &robot_file::design::margins::Margins| {
        format!(
            "gain × {:.2} … {:.2}, phase {:.0}°, delay {:.1} ms at {:.0} Hz, distance {:.2}",
            m.gain_down,
            m.gain_up,
            degrees(m.phase),
            1e3 * m.delay,
            m.crossover_hz,
            m.modulus
        )
    };
    let mut rows = vec![
        (
            "gain on angle, speed, current",
            format!("{:.4} V/rad, {:.5} V·s/rad, {:.4} V/A", d.gain[0], d.gain[1], d.gain[2]),
        ),
        ("regulator's poles (z)", poles(&d.regulator_poles)),
        ("filter's poles (z), reliable zone", poles(&d.filter_poles)),
        ("margins, state known", margins(&d.regulator_margins)),
        ("margins with the filter", margins(&d.loop_margins)),
        ("highest frequency the supply holds", format!("{:.2} Hz", d.ceiling / std::f64::consts::TAU)),
    ];
    for crossing in &d.crossings {
        let what = match crossing.frequency_hz.round() as i64 {
            6 => "blind arc at 6 Hz",
            7 => "blind arc at 7 Hz",
            8 => "blind arc at 8 Hz",
            _ => "blind arc",
        };
        let text = format!("{:.1} ms, σ at its end {:.2}°", 1e3 * crossing.time_s, degrees(crossing.angle));
        rows.push((what, text));
    }
    rows
}

fn as_json(name: &str, d: &Designed) -> Value {
    let poles = |poles: &[nalgebra::Complex<f64>]| poles.iter().map(|p| [p.re, p.im]).collect::<Vec<_>>();
    // JSON has no infinity: a margin without bound is null.
    let finite = |value: f64| value.is_finite().then_some(value);
    let margins = |m: &robot_file::design::margins::Margins| {
        json!({
            "gain_down": m.gain_down,
            "gain_up": finite(m.gain_up),
            "phase_deg": degrees(m.phase),
            "delay_s": finite(m.delay),
            "crossover_hz": m.crossover_hz,
            "modulus": m.modulus,
        })
    };
    let crossings: Vec<Value> = d
        .crossings
        .iter()
        .map(|c| json!({ "frequency_hz": c.frequency_hz, "time_s": c.time_s, "sigma_deg": degrees(c.angle) }))
        .collect();
    json!({
        "robot": name,
        "tick_s": d.parameters.tick,
        "gain": { "angle_v_per_rad": d.gain[0], "speed_v_s_per_rad": d.gain[1], "current_v_per_a": d.gain[2] },
        "regulator_poles": poles(&d.regulator_poles),
        "filter_poles": poles(&d.filter_poles),
        "regulator_margins": margins(&d.regulator_margins),
        "loop_margins": margins(&d.loop_margins),
        "blind_arc": crossings,
        "ceiling_hz": d.ceiling / std::f64::consts::TAU,
        "riccati_residuals": d.residuals,
    })
}
