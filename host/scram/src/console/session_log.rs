//! The recording of a console session.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::Duration;

use control::parameters::table;
use control::protocol::radio::{Batch, Request};

use super::model::RecordingModel;
use super::poses::Received;
use common::angle::wrap;
use link::{Outcome, Quality, outcome};
use recording::{
    self, LinkQuality, MeasuredPose, Metadata, ParameterValue, RecordingError, RobotChannel, SessionEvent,
    SessionRecorder, Stated, TelemetryRow,
};

/// Longest time until a received sample is handed to the operating system.
const FLUSH: Duration = Duration::from_millis(200);
/// Distance between a tick's time and its arrival, s, beyond which the tick belongs to another count.
const FAR_S: f64 = 0.3;
/// A pose that found no tick within this time, s, was not measured while the robot was heard.
const LATE_POSE_S: f64 = 0.1;
/// Poses that wait for a tick at most.
const WAITING_POSES: usize = 1000;
/// Interval at which the link's quality is recorded.
const LINK: Duration = Duration::from_secs(1);

/// Writes everything down from the beginning. Its failure stops nothing but itself.
pub(super) struct SessionLog {
    recorder: Option<SessionRecorder>,
    path: PathBuf,
    failed: Option<String>,
    robots: Vec<Clock>,
    /// Whether poses are measured: then every row has their columns.
    with_poses: bool,
    flush_due: Duration,
    link_due: Duration,
}

/// A robot's ticks against the session's time.
struct Clock {
    channel: Option<RobotChannel>,
    tick_s: f64,
    /// Number of the next tick, and its time in the session.
    next: Option<(u32, f64)>,
    tick: u64,
    /// Its tick numbers may not go on from the last.
    restarted: bool,
    /// Poses that wait for their ticks.
    poses: VecDeque<Received>,
    /// Heading of the last pose, rad, not wrapped.
    yaw: Option<f64>,
}

impl SessionLog {
    /// Begins the first file `console-NNNN.mcap` of a directory that is not there yet.
    pub fn begin(
        directory: &Path,
        names: &[String],
        tick_s: f64,
        with_poses: bool,
        now: Duration,
    ) -> Result<Self, RecordingError> {
        let metadata = Metadata { excitation: Some("console".into()), ..Metadata::default() };
        let mut number = 1;
        let mut recorder = loop {
            let path = directory.join(format!("console-{number:04}.mcap"));
            match SessionRecorder::create(&path, &metadata) {
                Err(RecordingError::Exists { .. }) => number += 1,
                created => break created?,
            }
        };
        let mut robots = Vec::new();
        for name in names {
            let channel = Some(recorder.robot(name)?);
            robots.push(Clock {
                channel,
                tick_s,
                next: None,
                tick: 0,
                restarted: false,
                poses: VecDeque::new(),
                yaw: None,
            });
        }
        let path = recorder.path().to_owned();
        Ok(Self {
            recorder: Some(recorder),
            path,
            failed: None,
            robots,
            with_poses,
            flush_due: now + FLUSH,
            link_due: now,
        })
    }

    /// What to show of it.
    pub fn model(&self) -> RecordingModel {
        let bytes = std::fs::metadata(&self.path).map_or(0, |metadata| metadata.len());
        RecordingModel { path: self.path.clone(), bytes, failed: self.failed.clone() }
    }

    /// A telemetry message of a robot; how many ticks are missing before it.
    pub fn telemetry(&mut self, robot: usize, batch: &Batch, at: Duration) -> u64 {
        let Some(clock) = self.robots.get_mut(robot) else { return 0 };
        let (missing, start_s) = clock.place(batch, at);
        let first = clock.tick;
        let count = batch.rows.len() as u64;
        clock.tick += count;
        let (tick_s, channel) = (clock.tick_s, clock.channel);
        let stated = Stated {
            state: batch.state,
            fault: batch.fault,
            tracking: batch.tracking,
            failed_sensor: batch.failed_sensor,
        };
        let battery_v = (batch.battery_mv > 0).then(|| f32::from(batch.battery_mv) * 1e-3);
        for ((index, row), time_us) in (0_u32..).zip(&batch.rows).zip(batch.times_us()) {
            let t_s = start_s + f64::from(index) * tick_s;
            let row = TelemetryRow {
                t_s,
                tick: first + u64::from(index),
                time_us: Some(time_us),
                adc: row.code,
                adc_second: row.second,
                duty: row.duty(),
                angle_rad: row.angle(),
                speed_rad_per_s: row.speed(),
                battery_v,
                supply_v: None,
                pose: self.with_poses.then(|| self.robots[robot].pose(t_s)),
                stated,
            };
            self.write(|recorder| channel.map_or(Ok(()), |channel| recorder.sample(channel, &row)));
        }
        missing
    }

    /// A pose of a robot, for its next tick.
    pub fn pose(&mut self, robot: usize, received: Received) {
        if let Some(clock) = self.robots.get_mut(robot).filter(|_| self.with_poses) {
            if clock.poses.len() == WAITING_POSES {
                clock.poses.pop_front();
            }
            clock.poses.push_back(received);
        }
    }

    /// Number in the recording of a control period of a robot, before or after the telemetry of it has come.
    pub fn tick_of(&self, robot: usize, period: u32) -> Option<u64> {
        let clock = self.robots.get(robot)?;
        let (expected, _) = clock.next?;
        clock.tick.checked_add_signed(i64::from(period.wrapping_sub(expected).cast_signed()))
    }

    /// A robot is here again: its ticks may have begun anew.
    pub fn renew(&mut self, robot: usize) {
        if let Some(clock) = self.robots.get_mut(robot) {
            clock.restarted = true;
        }
    }

    /// Writes an event.
    pub fn event(&mut self, robot: Option<usize>, event: &SessionEvent, at: Duration) {
        let channel = robot.and_then(|robot| self.robots.get(robot)?.channel);
        self.write(|recorder| recorder.event(at.as_secs_f64(), channel, event));
    }

    /// Writes what is due. `quality` tells a robot's link.
    pub fn write_due(&mut self, now: Duration, quality: impl Fn(usize) -> Quality) {
        if now >= self.link_due {
            self.link_due = now + LINK;
            for index in 0..self.robots.len() {
                let (quality, channel) = (quality(index), self.robots[index].channel);
                if quality.loss.is_some() {
                    let quality = LinkQuality {
                        rate_hz: quality.rate_hz as f32,
                        loss: quality.loss.unwrap_or_default() as f32,
                        latency_s: quality.round_trip.map(|trip| trip.as_secs_f32()),
                        rssi_dbm: quality.rssi_dbm.map(f32::from),
                    };
                    self.write(|recorder| {
                        channel.map_or(Ok(()), |channel| recorder.link(now.as_secs_f64(), channel, &quality))
                    });
                }
            }
        }
        if now >= self.flush_due {
            self.flush_due = now + FLUSH;
            self.write(SessionRecorder::flush);
        }
    }

    /// Ends the file.
    pub fn finish(&mut self) {
        if let Some(recorder) = self.recorder.take()
            && let Err(error) = recorder.finish()
        {
            self.failed = Some(error.to_string());
        }
    }

    /// Whether it has just failed.
    pub fn failure(&self) -> Option<&str> {
        self.failed.as_deref()
    }

    fn write(&mut self, write: impl FnOnce(&mut SessionRecorder) -> Result<(), RecordingError>) {
        let Some(recorder) = &mut self.recorder else { return };
        match write(recorder) {
            // A row that comes twice or late is left out; the recording goes on.
            Ok(()) | Err(RecordingError::Format { .. }) => {}
            Err(error) => {
                self.failed = Some(error.to_string());
                self.recorder = None;
            }
        }
    }
}

impl Clock {
    /// The first pose that had come by the time of a tick and that no tick before it has; nothing where there is none.
    fn pose(&mut self, t_s: f64) -> MeasuredPose {
        let before = |pose: &Received, time_s: f64| pose.at.as_secs_f64() <= time_s;
        // Of a time without telemetry there is no tick that they could stand in.
        while self.poses.front().is_some_and(|pose| before(pose, t_s - LATE_POSE_S)) {
            self.poses.pop_front();
        }
        let Some(Received { measured_s, pose, .. }) = self.poses.pop_front_if(|pose| before(pose, t_s)) else {
            return MeasuredPose::default();
        };
        let yaw = self.yaw.map_or(pose.heading, |last| last + wrap(pose.heading - last));
        self.yaw = Some(yaw);
        MeasuredPose { x_m: Some(pose.x), y_m: Some(pose.y), yaw_rad: Some(yaw), pose_t_s: Some(measured_s) }
    }

    /// How many ticks are missing before a message, and its time in the session: by the robot's ticks from the first one
    /// on, and anew where the robot has restarted.
    fn place(&mut self, batch: &Batch, at: Duration) -> (u64, f64) {
        let length = u32::try_from(batch.rows.len()).unwrap_or(u32::MAX);
        let arrived_s = at.as_secs_f64() - f64::from(length) * self.tick_s;
        let (missing, start_s) = match self.next {
            Some((expected, time_s)) => {
                let skipped = batch.first_tick.wrapping_sub(expected);
                let by_ticks = time_s + f64::from(skipped) * self.tick_s;
                let late = (by_ticks - arrived_s).abs() > FAR_S;
                if skipped.cast_signed() < 0 || std::mem::take(&mut self.restarted) && late {
                    // Its counter began anew; ticks in the past would be no recording.
                    (0, arrived_s.max(time_s))
                } else {
                    (u64::from(skipped), by_ticks)
                }
            }
            None => (0, arrived_s.max(0.0)),
        };
        self.tick += missing;
        self.next = Some((batch.first_tick.wrapping_add(length), start_s + f64::from(length) * self.tick_s));
        (missing, start_s)
    }
}

/// What became of a command, as a recording has it, and the tick of the recording from which on it counts.
pub(super) fn answer(what: Request, tick: Option<u64>, outcome_: Outcome) -> SessionEvent {
    let parameter = match (what, outcome_) {
        (Request::Set { index, .. }, Outcome::Done(Some(value))) => {
            let entry = table::TABLE.get(usize::from(index));
            entry.map(|entry| ParameterValue { name: entry.name.to_owned(), value: value.now })
        }
        _ => None,
    };
    let text = outcome(outcome_);
    let outcome = match outcome_ {
        Outcome::Done(_) => recording::Outcome::Done,
        Outcome::Refused(_) | Outcome::Absent | Outcome::Overtaken => recording::Outcome::Refused,
        Outcome::TooLate | Outcome::Unanswered => recording::Outcome::TooLate,
    };
    SessionEvent::Answer { text, outcome, tick, parameter }
}
