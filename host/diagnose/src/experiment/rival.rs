//! A model that is still standing, made ready to predict and to be fitted.

use std::f64::consts::PI;

use recording::{AngleReading, Drive, Recording};
use robot_file::design::design;
use robot_file::robot::{Robot, Sensor};

use super::script::Piece;
use crate::DiagnoseError;
use crate::blind_arc::BlindArc;
use crate::fit::{self, Data, Fit, Until};
use crate::model::Plant;
use crate::nominal::FileModel;
use crate::rollout;
use crate::track::{Cut, Segment, Track, deviation};

/// Time between the readings that are predicted, s.
const SAMPLE_S: f64 = 2e-3;
/// Standard deviation of the reading where the robot file has a perfect sensor, rad.
const PERFECT: f64 = 1e-4;
/// Without a controller in the robot file: a driven shaft that is slower than this share of its speed without load stands.
const STANDS: f64 = 0.02;
/// The same: how long a driven shaft may stand or turn the other way, s.
const PATIENCE_S: f64 = 0.1;
/// Share of the supervisor's highest speed that a drive may reach: its estimate of the speed scatters.
const FAST: f64 = 0.9;
/// Share of the supervisor's patience that a drive may use up.
const OF_PATIENCE: f64 = 0.5;
/// Rollouts of these shares of the usual length are fitted one after the other: in short ones a wrong model stays near enough to the
/// readings to be led to where it is the least wrong.
const LENGTHS: [f64; 2] = [0.25, 1.0];
/// The speed is taken over so many readings.
const SPEED_OVER: usize = 10;

/// A model.
pub struct Rival {
    robot: Robot,
    model: FileModel,
    plant: Plant,
    arc: Option<BlindArc>,
    /// Standard deviation of the reading, rad.
    sigma: f64,
    /// Of the rollouts that it is judged by, s.
    horizon_s: f64,
    patience: Patience,
}

/// What a supervisor lets pass.
#[derive(Clone, Copy)]
struct Patience {
    /// A driven shaft that is slower stands, rad/s.
    slow: f64,
    /// No shaft is faster than this, rad/s.
    fast: f64,
    /// How long one may stand, s.
    standing_s: f64,
    /// |duty| from which on a shaft is driven hard.
    hard_duty: f64,
    /// How long it may turn the other way, s.
    against_s: f64,
}

impl Patience {
    /// The robot's own supervisor's, where its file has a controller.
    fn new(robot: &Robot, model: &FileModel) -> Self {
        let Ok(designed) = design(robot) else {
            let slow = STANDS * model.no_load_speed(model.rail_v);
            return Self { slow, fast: f64::INFINITY, standing_s: PATIENCE_S, hard_duty: 0.0, against_s: PATIENCE_S };
        };
        let supervisor = designed.parameters.supervisor;
        Self {
            slow: f64::from(supervisor.stall.limit),
            fast: FAST * f64::from(supervisor.runaway.limit),
            standing_s: f64::from(supervisor.stall.persistence),
            hard_duty: f64::from(supervisor.driven_duty),
            against_s: f64::from(supervisor.runaway.persistence),
        }
    }
}

impl Rival {
    /// From its robot file.
    pub fn new(robot: &Robot) -> Self {
        let model = FileModel::new(robot);
        let plant = Fit::begin(&model, &[], 0, Vec::new()).plant(&model);
        let horizon_s = model.usual_horizon(SAMPLE_S);
        let patience = Patience::new(robot, &model);
        let (arc, sigma) = (BlindArc::of(robot), sigma(robot));
        Self { robot: robot.clone(), plant, arc, sigma, horizon_s, patience, model }
    }

    /// What its sensor shows without noise in a drive from rest; nothing in a sensor's blind arc.
    ///
    /// # Errors
    /// The drive makes no recording.
    pub fn read(&self, script: &[Piece]) -> Result<Track, DiagnoseError> {
        let mut track = Track::new(&self.robot, &silent(script), 0)?;
        let n = track.t.len();
        track.segments = vec![Segment { first: 0, last: n, linked: false, whole: true }];
        let from = self.arc.map_or(0.0, |arc| arc.middle + PI);
        track.angle = rollout::rollout(&self.plant, &track, &[[from, 0.0]], None, false).readings;
        if let Some(arc) = self.arc {
            for (weight, angle) in track.weight.iter_mut().zip(&track.angle) {
                *weight = f64::from(!arc.contains(*angle));
            }
        }
        Ok(track)
    }

    /// Whether the robot's supervisor may end a recording: the shaft turns faster than it allows, or it stands still although it
    /// is driven, or turns against a hard drive, nearly as long as it looks on.
    pub fn trips(&self, track: &Track) -> bool {
        let Patience { slow, fast, standing_s, hard_duty, against_s } = self.patience;
        let most = [standing_s, against_s].map(|seconds| (OF_PATIENCE * seconds / SAMPLE_S) as usize);
        let mut seen = [0; 2];
        for k in SPEED_OVER..track.t.len() {
            let speed = (track.angle[k] - track.angle[k - SPEED_OVER]) / (track.t[k] - track.t[k - SPEED_OVER]);
            if speed.abs() > fast {
                return true;
            }
            let stands = track.enable[k] && track.enable[k - SPEED_OVER] && speed.abs() < slow;
            let against = track.enable[k] && track.drive[k].abs() >= hard_duty && speed * track.drive[k] < 0.0;
            for ((seen, now), most) in seen.iter_mut().zip([stands, against]).zip(most) {
                *seen = if now { *seen + 1 } else { 0 };
                if *seen > most {
                    return true;
                }
            }
        }
        false
    }

    /// How far this model stays from another one's readings when its numbers and the starts of its rollouts are fitted to
    /// them: its expected error over that of the noise alone.
    pub fn ratio_on(&self, read: &Track, rounds: usize) -> f64 {
        let (mut fit, mut readings) = (Fit::begin(&self.model, &[], 0, Vec::new()), 0.0);
        for share in LENGTHS {
            let mut track = read.clone();
            let horizon_s = share * self.horizon_s;
            track.cut(Cut { horizon_s, most_segments: usize::MAX });
            readings = track.segments.iter().map(|one| track.weight[one.first..one.last].iter().sum::<f64>()).sum();
            fit.starts = vec![rollout::guess(&track, 0.25 * horizon_s)];
            let tracks = [track];
            let _ = rollout::refine_all(&fit.plant(&self.model), &tracks, &mut fit.starts, &[], 2);
            let data = Data { tracks: &tracks, sigma: self.sigma, sigma_current: None };
            fit = fit::fit(&self.model, &data, fit, Until::settled(rounds, 1e-3));
        }
        (1.0 + fit.cost / f64::max(readings, 1.0)).sqrt()
    }
}

/// A recording of a drive whose angle nobody has read.
fn silent(script: &[Piece]) -> Recording {
    let seconds: f64 = script.iter().map(|piece| piece.seconds).sum();
    let n = (seconds / SAMPLE_S).round() as usize;
    let (mut place, mut ends) = (0, script.first().map_or(0.0, |piece| piece.seconds));
    let mut duties = Vec::with_capacity(n);
    for k in 0..n {
        while (k as f64 + 0.5) * SAMPLE_S > ends && place + 1 < script.len() {
            place += 1;
            ends += script[place].seconds;
        }
        duties.push(script[place].duty);
    }
    Recording {
        t_s: (0..n).map(|k| k as f64 * SAMPLE_S).collect(),
        enable: duties.iter().map(Option::is_some).collect(),
        drive: Drive::Duty(duties.iter().map(|duty| duty.unwrap_or(0.0)).collect()),
        angle: AngleReading::Angle(vec![Some(0.0); n]),
        ..Recording::default()
    }
}

/// Standard deviation of what the sensor shows, rad.
fn sigma(robot: &Robot) -> f64 {
    let of_sensor = match &robot.sensor {
        Sensor::Ideal => 0.0,
        Sensor::Encoder(encoder) => {
            let step = 2.0 * PI / encoder.counts_per_turn.value;
            encoder.noise_deg.value.to_radians().hypot(step / 12f64.sqrt())
        }
        Sensor::Potentiometer(sensor) => deviation(sensor),
    };
    of_sensor.max(PERFECT)
}
