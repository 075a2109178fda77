//! Unit mistakes that the numbers give away, found while a recording streams by.

/// What a value may be, in the unit of the column's name.
pub(super) struct Range {
    pub(super) low: f64,
    pub(super) high: f64,
    /// What a value outside it probably is.
    pub(super) suspicion: &'static str,
}

/// Duty outside −1 … 1 by no more than rounding is accepted.
pub(super) const DUTY: Range = Range {
    low: -1.0 - 1e-9,
    high: 1.0 + 1e-9,
    suspicion: "duty is a share of 1; divide by 100 if the file holds percent, by the full scale if it holds counts",
};
pub(super) const VOLTAGE: Range =
    Range { low: -100.0, high: 100.0, suspicion: "voltage_v is in volts; divide by 1000 if the file holds millivolts" };
pub(super) const SUPPLY: Range =
    Range { low: 0.0, high: 100.0, suspicion: "supply_v is in volts; divide by 1000 if the file holds millivolts" };
pub(super) const CURRENT: Range = Range {
    low: -100.0,
    high: 100.0,
    suspicion: "current_a is in amperes; divide by 1000 if the file holds milliamperes",
};
pub(super) const TEMPERATURE: Range =
    Range { low: -80.0, high: 300.0, suspicion: "temperature_c is in degrees Celsius; subtract 273.15 from kelvin" };

/// A step in angle that can only be the wrap of a full turn in degrees: radians wrap by 6.28.
const DEGREE_WRAP: std::ops::Range<f64> = 300.0..420.0;
/// A wrapped reading in degrees is no larger, but for a little that it overshoots.
const FULL_TURN_DEG: f64 = 365.0;
/// Two readings this far apart still belong to one motion: half a turn at 15 Hz, s.
const SAME_MOTION_S: f64 = 0.033;
/// No gearmotor's output turns at 95 turns a second, rad/s.
const FASTEST_RAD_PER_S: f64 = 600.0;
/// Steps in one direction that make a motion, not a glitch.
const STEPS_OF_A_MOTION: u32 = 32;
/// A control recording has many rows a second; steps this long mean another unit, s.
const SLOWEST_ROW_S: f64 = 0.5;
/// Steps that are looked at to judge the time column.
const STEPS_OF_TIME: u32 = 64;

/// What gave a unit away: the column, the problem, and what to do.
pub(super) type Suspicion = (&'static str, String, String);

/// Watches a stream of samples.
#[derive(Default)]
pub(super) struct Watch {
    last: Option<(f64, f64)>,
    run_steps: u32,
    run_sign: f64,
    run_travel: f64,
    run_time: f64,
    time_steps: u32,
    shortest_step: f64,
}

impl Watch {
    /// A step of the clock, s. The time column is judged after enough steps, and at the end by [`Watch::finish`].
    pub(super) fn time_step(&mut self, step_s: f64) -> Result<(), Suspicion> {
        if self.time_steps >= STEPS_OF_TIME {
            return Ok(());
        }
        self.shortest_step = if self.time_steps == 0 { step_s } else { self.shortest_step.min(step_s) };
        self.time_steps += 1;
        if self.time_steps == STEPS_OF_TIME { self.judge_time() } else { Ok(()) }
    }

    /// Judges what a short file could not fill.
    pub(super) fn finish(&self) -> Result<(), Suspicion> {
        if (1..STEPS_OF_TIME).contains(&self.time_steps) { self.judge_time() } else { Ok(()) }
    }

    fn judge_time(&self) -> Result<(), Suspicion> {
        if self.shortest_step < SLOWEST_ROW_S {
            return Ok(());
        }
        Err((
            "t_s",
            format!("time advances by {} or more a row; expected are seconds, many rows each", self.shortest_step),
            "t_s is in seconds: divide by 1000 if the file holds milliseconds, by 1e6 if it holds microseconds".into(),
        ))
    }

    /// An angle at a time.
    pub(super) fn angle(&mut self, t_s: f64, angle: f64) -> Result<(), Suspicion> {
        let Some((last_t, last_angle)) = self.last.replace((t_s, angle)) else { return Ok(()) };
        let (step_t, step) = (t_s - last_t, angle - last_angle);
        let jump = step.abs();
        if step_t > SAME_MOTION_S {
            self.run_steps = 0;
            return Ok(());
        }
        if DEGREE_WRAP.contains(&jump) && angle.abs().max(last_angle.abs()) <= FULL_TURN_DEG {
            return Err(degrees(format!("the angle jumps by {jump:.1} within {:.1} ms", step_t * 1e3)));
        }
        if step == 0.0 || step.signum() != self.run_sign {
            self.run_sign = step.signum();
            (self.run_steps, self.run_travel, self.run_time) = (0, 0.0, 0.0);
        }
        self.run_steps += 1;
        self.run_travel += jump;
        self.run_time += step_t;
        if self.run_steps >= STEPS_OF_A_MOTION && self.run_travel > FASTEST_RAD_PER_S * self.run_time {
            let speed = self.run_travel / self.run_time;
            return Err((
                "angle_rad",
                format!(
                    "the angle changes by {speed:.0} a second, which no gearmotor's output does; expected are radians of the output"
                ),
                "these may be degrees (multiply by π/180), counts, or radians of the motor before its gears: scram new-rig --check \
                 ROBOT.toml RUN says which"
                    .into(),
            ));
        }
        Ok(())
    }
}

fn degrees(problem: String) -> Suspicion {
    (
        "angle_rad",
        format!("{problem}: these look like degrees, expected are radians"),
        "multiply the column by π/180".into(),
    )
}
