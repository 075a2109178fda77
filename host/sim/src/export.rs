//! From a run to a recording: the standard columns hold what a robot would have measured, the extra ones what only a
//! simulation knows and what the controller believed.

use robot_file::angle_code::angle_scale;
use robot_file::robot::{Robot, Sensor};

use super::{Tick, Trace};
use recording::{AngleReading, Drive, ExtraColumn, LoggedCommand, Recording, RunLog, Stated};

/// The run as its robot would have recorded it.
#[must_use]
pub fn recording(trace: &Trace, robot: &Robot) -> Recording {
    let ticks = &trace.ticks;
    let angle = match &robot.sensor {
        Sensor::Potentiometer(_) => AngleReading::Adc(ticks.iter().map(|t| Some(t.sample.angle.0)).collect()),
        digital @ (Sensor::Ideal | Sensor::Encoder(_)) => {
            let scale = angle_scale(digital);
            AngleReading::Angle(ticks.iter().map(|t| Some(scale.angle(f64::from(t.sample.angle.0)))).collect())
        }
    };
    let has_second = ticks.iter().any(|t| t.sample.second.is_some());
    let seconds = ticks.iter().map(|t| t.sample.second.map(|code| code.0));
    let adc_second = if has_second { seconds.collect() } else { Vec::new() };
    Recording {
        t_s: ticks.iter().map(|t| t.sample.time_us as f64 / 1e6).collect(),
        enable: ticks.iter().map(|t| t.actuation.enable).collect(),
        drive: Drive::Duty(ticks.iter().map(|t| f64::from(t.actuation.duty)).collect()),
        angle,
        adc_second,
        ..Recording::default()
    }
}

/// What it takes to decide the run again, and what was decided then.
#[must_use]
pub fn run_log(trace: &Trace, robot: &Robot) -> RunLog {
    let column = |name: &str, value: fn(&Tick) -> f64| ExtraColumn {
        name: name.to_owned(),
        values: trace.ticks.iter().map(|tick| Some(value(tick))).collect(),
    };
    // Whole µs are exact in an f64 for three centuries.
    let mut numbers =
        vec![column("time_us", |t| t.sample.time_us as f64), column("battery_adc", |t| f64::from(t.sample.battery.0))];
    if !matches!(robot.sensor, Sensor::Potentiometer(_)) {
        numbers.push(column("angle_code", |t| f64::from(t.sample.angle.0)));
    }
    let said = trace.ticks.iter().map(|tick| &tick.telemetry);
    let stated = said
        .map(|t| Stated { state: t.state, fault: t.fault, tracking: t.tracking, failed_sensor: t.failed_sensor })
        .collect();
    let told = trace.told.iter().map(|told| LoggedCommand {
        row: told.tick,
        text: told.command.to_string(),
        command: Some(told.command.to_control()),
        repeat: told.repeat,
        gait: None,
    });
    let kept = trace.kept.iter().map(|(row, gait)| LoggedCommand {
        row: *row,
        text: format!("keep gait {}", gait.name()),
        command: None,
        repeat: false,
        gait: Some(*gait),
    });
    let mut commands: Vec<LoggedCommand> = kept.chain(told).collect();
    commands.sort_by_key(|command| command.row);
    RunLog { numbers, stated, commands }
}

/// Truth and belief.
#[must_use]
pub fn extra_columns(trace: &Trace) -> Vec<ExtraColumn> {
    let column = |name: &str, value: fn(&Tick) -> Option<f64>| ExtraColumn {
        name: name.to_owned(),
        values: trace.ticks.iter().map(value).collect(),
    };
    let tracked = |t: &Tick, value: f32| t.telemetry.tracking.then_some(f64::from(value));
    let tracked_column = |name: &str, value: fn(&Tick) -> f32| ExtraColumn {
        name: name.to_owned(),
        values: trace.ticks.iter().map(|t| tracked(t, value(t))).collect(),
    };
    vec![
        column("truth_angle_rad", |t| Some(t.truth.angle)),
        column("truth_speed_rad_per_s", |t| Some(t.truth.speed)),
        column("truth_current_a", |t| Some(t.truth.current)),
        column("truth_terminal_v", |t| Some(t.truth.terminal_v)),
        column("truth_bridge_supply_v", |t| Some(t.truth.bridge_supply_v)),
        column("truth_battery_v", |t| Some(t.truth.battery_v)),
        tracked_column("estimate_angle_rad", |t| t.telemetry.angle),
        tracked_column("estimate_speed_rad_per_s", |t| t.telemetry.speed),
        tracked_column("estimate_current_a", |t| t.telemetry.current),
        tracked_column("estimate_drag_nm", |t| t.telemetry.drag),
        column("reference_angle_rad", |t| Some(f64::from(t.telemetry.reference_angle))),
        column("reference_speed_rad_per_s", |t| Some(f64::from(t.telemetry.reference_speed))),
        column("blind", |t| Some(f64::from(u8::from(t.telemetry.blind)))),
    ]
}
