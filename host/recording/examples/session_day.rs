//! Writes a long console session as fast as it goes, and says what that took: time, file size, memory.
//!
//! `cargo run --example session_day -- FILE [ROWS [ROBOTS]]`; 8 640 000 rows of 1 robot unless said otherwise. Flushes ten
//! times for every second of telemetry, as a console does. The file must not exist.

use std::path::PathBuf;
use std::time::Instant;

use control::{Command, State};
use recording::{LinkQuality, Metadata, SessionEvent, SessionRecorder, Stated, TelemetryRow};

/// Ticks between two flushes: 0.1 s at 1 kHz.
const FLUSH_EVERY: u64 = 100;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let path = PathBuf::from(words.next().ok_or("name the file to write")?);
    let rows: u64 = words.next().map_or(Ok(8_640_000), |word| word.parse())?;
    let robots: u64 = words.next().map_or(Ok(1), |word| word.parse())?;
    let begin = Instant::now();
    let mut recorder = SessionRecorder::create(&path, &Metadata::default())?;
    let robots = (0..robots).map(|_| recorder.robot("scram-26")).collect::<Result<Vec<_>, _>>()?;
    let mut halfway = None;
    for tick in 0..rows {
        let t_s = tick as f64 * 1e-3;
        for robot in &robots {
            if tick.is_multiple_of(60_000) {
                let command = Some(Command::Speed { omega: -44.0 });
                let command = SessionEvent::Command { text: "freq 7".into(), command, repeat: false, gait: None };
                recorder.event(t_s, Some(*robot), &command)?;
            }
            if tick.is_multiple_of(1000) {
                let quality = LinkQuality { rate_hz: 100.0, loss: 0.01, latency_s: Some(0.006), rssi_dbm: Some(-52.0) };
                recorder.link(t_s, *robot, &quality)?;
            }
            recorder.sample(*robot, &row(tick, t_s))?;
        }
        if tick.is_multiple_of(FLUSH_EVERY) {
            recorder.flush()?;
        }
        if tick == rows / 2 {
            halfway = memory_kib();
        }
    }
    recorder.finish()?;
    let (seconds, bytes) = (begin.elapsed().as_secs_f64(), std::fs::metadata(&path)?.len());
    let per_row = bytes as f64 / (rows * robots.len() as u64).max(1) as f64;
    let memory = |kib: Option<u64>| kib.map_or("not known here".to_owned(), |kib| format!("{kib} KiB"));
    println!("{rows} rows of {} robot(s) in {seconds:.1} s, {bytes} bytes, {per_row:.1} a row", robots.len());
    println!("memory at most: {} halfway, {} at the end", memory(halfway), memory(memory_kib()));
    Ok(())
}

/// A motion with the digits of a real one.
fn row(tick: u64, t_s: f64) -> TelemetryRow {
    let wave = (t_s * 7.3).sin() as f32;
    let steps = |value: f32, steps: f32| (value * steps).round() / steps;
    TelemetryRow {
        t_s,
        tick,
        time_us: Some(1000 * tick),
        adc: (2048.0 + 1900.0 * wave) as u16,
        adc_second: None,
        duty: Some(steps(wave, 32767.0)),
        angle_rad: steps(wave * 3.1, 32767.0 / std::f32::consts::PI),
        speed_rad_per_s: steps(-44.0 + wave, 256.0),
        battery_v: Some(steps(3.9 + 0.01 * ((tick / 10) as f32).sin(), 1000.0)),
        supply_v: None,
        pose: None,
        stated: Stated { state: State::Speed, fault: None, tracking: true, failed_sensor: None },
    }
}

/// Largest resident memory of this process until now.
fn memory_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}
