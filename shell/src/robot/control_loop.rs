//! The control loop: conversions, commands, decision, bridge, telemetry, watchdog; once a control period.

use core::borrow::BorrowMut;

use control::protocol::radio::{Batch, FURTHEST_US, PackedTick, ROUND_US};
use control::{Actuation, AdcCode, Controller, Sample, Telemetry};
use embassy_time::{Instant, Timer};
use heapless::Vec;

use super::command_handler::CommandHandler;
use super::median::median;
use super::schedule::Schedule;
use super::shared::TickCounts;
use super::{Settings, Shared, Shown};
use crate::board::{Bridge, Converter, Watchdog, WatchdogTimeout};

/// The parts of the board that belong to the control loop alone.
#[derive(Debug)]
pub struct Parts<C, B, W> {
    /// The analogue inputs.
    pub converter: C,
    /// The H-bridge.
    pub bridge: B,
    /// The watchdog, armed.
    pub watchdog: W,
}

/// Runs the robot. The watchdog is fed at the end of a whole tick and nowhere else; only a change of its patience counts anew.
///
/// In an interrupt, give it a reference to the controller: a controller by value takes its size of stack again, and that is
/// the stack of whatever is interrupted.
pub async fn control_loop(
    parts: Parts<impl Converter, impl Bridge, impl Watchdog>,
    mut controller: impl BorrowMut<Controller>,
    settings: &Settings,
    shared: &Shared,
) -> ! {
    let Parts { mut converter, mut bridge, mut watchdog } = parts;
    let controller = controller.borrow_mut();
    shared.show_gait(controller.gait());
    bridge.apply(Actuation::OFF);
    let mut schedule = Schedule::new(controller.parameters(), Instant::now().as_micros());
    let mut reporter = Reporter::default();
    let mut command_handler = CommandHandler::default();
    let mut before: Option<(u64, u32)> = None;
    loop {
        let began_us = Instant::now().as_micros();
        let period = schedule.begin(began_us);
        let (sample, outliers) = measure(&mut converter, settings);
        command_handler.serve(period, controller, &settings.parameters, shared);
        actuate(controller.tick(&sample), &mut bridge, &mut watchdog);
        reporter.report(period, &sample, &controller.telemetry(), shared);
        watchdog.feed();

        let ended_us = Instant::now().as_micros();
        shared.count_tick(&TickCounts {
            missed: before.map_or(0, |(_, last)| period.wrapping_sub(last).saturating_sub(1)),
            period_us: before.map(|(last_us, _)| difference(began_us, last_us)),
            outliers,
            execution_us: difference(ended_us, began_us),
        });
        before = Some((began_us, period));
        Timer::at(Instant::from_micros(schedule.end(ended_us))).await;
    }
}

/// Tells the bridge. While it is on, the watchdog is impatient: from before it is switched on until after it is off.
fn actuate(actuation: Actuation, bridge: &mut impl Bridge, watchdog: &mut impl Watchdog) {
    if actuation.enable {
        watchdog.expect(WatchdogTimeout::Driving);
        bridge.apply(actuation);
    } else {
        bridge.apply(actuation);
        watchdog.expect(WatchdogTimeout::Resting);
    }
}

/// The sample, its time in the middle of the first sensor's conversions, and how many conversions of the wipers are far from
/// their median.
fn measure(converter: &mut impl Converter, settings: &Settings) -> (Sample, u32) {
    let first_us = Instant::now().as_micros();
    let (angle, outliers) = median(settings.conversions, settings.outlier_lsb, || converter.angle());
    let time_us = u64::midpoint(first_us, Instant::now().as_micros());
    let (second, second_outliers) = measure_second(converter, settings);
    (Sample { time_us, angle, second, battery: converter.battery() }, outliers.saturating_add(second_outliers))
}

/// The second sensor right after the first one, as its parameters have it.
fn measure_second(converter: &mut impl Converter, settings: &Settings) -> (Option<AdcCode>, u32) {
    if settings.parameters.second.is_none() {
        return (None, 0);
    }
    let mut is_there = true;
    let (code, outliers) = median(settings.conversions, settings.outlier_lsb, || {
        let code = converter.second();
        is_there &= code.is_some();
        code.unwrap_or_default()
    });
    if is_there { (Some(code), outliers) } else { (None, 0) }
}

/// `a − b`, µs.
fn difference(a_us: u64, b_us: u64) -> u32 {
    u32::try_from(a_us.saturating_sub(b_us)).unwrap_or(u32::MAX)
}

/// Collects ticks into telemetry messages and tells the LED.
#[derive(Default)]
struct Reporter {
    batch: Option<Batch>,
    /// Time of the last sample, µs.
    last_us: u64,
}

impl Reporter {
    fn report(&mut self, period: u32, sample: &Sample, telemetry: &Telemetry, shared: &Shared) {
        let after_us = u16::try_from(sample.time_us.wrapping_sub(self.last_us)).ok().filter(|us| *us <= FURTHEST_US);
        self.last_us = sample.time_us;
        if self.batch.as_ref().is_some_and(|batch| after_us.is_none() || !continues(batch, period, telemetry)) {
            self.hand_over(shared);
        }
        // From the row before in the same batch.
        let after_us = if self.batch.is_some() { after_us.unwrap_or_default() } else { 0 };
        let batch = self.batch.get_or_insert_with(|| {
            shared.show(Shown::State(telemetry.state, telemetry.fault));
            Batch {
                first_tick: period,
                time_us: sample.time_us % ROUND_US,
                state: telemetry.state,
                fault: telemetry.fault,
                tracking: telemetry.tracking,
                failed_sensor: telemetry.failed_sensor,
                battery_mv: 0,
                rows: Vec::new(),
            }
        });
        batch.battery_mv = millivolt(telemetry.battery);
        // There is room: a full batch is handed over at once.
        let _ = batch.rows.push(PackedTick::new(sample.angle, telemetry).with_second(sample.second).after(after_us));
        if batch.rows.is_full() {
            self.hand_over(shared);
        }
    }

    /// To the sending task, unless nobody listens.
    fn hand_over(&mut self, shared: &Shared) {
        let Some(batch) = self.batch.take() else { return };
        if !shared.is_listened_to() {
            return;
        }
        let rows = u32::try_from(batch.rows.len()).unwrap_or(u32::MAX);
        if shared.batches.try_send(batch).is_err() {
            shared.count(|c| c.rows_dropped = c.rows_dropped.wrapping_add(rows));
        }
    }
}

/// Whether the tick of a period belongs into the batch.
fn continues(batch: &Batch, period: u32, telemetry: &Telemetry) -> bool {
    usize::try_from(period.wrapping_sub(batch.first_tick)) == Ok(batch.rows.len())
        && batch.state == telemetry.state
        && batch.fault == telemetry.fault
        && batch.tracking == telemetry.tracking
        && batch.failed_sensor == telemetry.failed_sensor
}

/// Rounded to the nearest integer; saturates, and is 0 for NaN.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, as documented")]
fn millivolt(volt: f32) -> u16 {
    (volt * 1e3 + 0.5) as u16
}
