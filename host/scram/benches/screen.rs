//! One picture of the console with five robots and 30 s of a hundred messages a second behind it: `cargo bench -p scram`.
//! Ten a second are drawn: 20 ms a picture would be a fifth of a core.

use std::time::Duration;

use control::State;
use divan::Bencher;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use scram::console::model::{Level, Model, RobotModel, Series};
use scram::console::screen::{History, Prompt, Screen, Theme, draw};

fn main() {
    divan::main();
}

fn series(now_s: f64) -> Series {
    let mut series = Series::default();
    for point in 0..3000 {
        let t = now_s - 29.99 + f64::from(point) / 100.0;
        series.frequency.push(t, 7.0 * (0.5 * t).sin());
        series.angle.push(t, (t * 2520.0).rem_euclid(360.0) - 180.0);
        series.duty.push(t, 0.6 * (9.0 * t).sin());
        series.battery.push(t, 3.9 + 0.1 * (t * 3.0).sin());
        series.loss.push(t, 0.02 + 0.02 * t.sin());
        series.round_trip.push(t, 12.0 + 5.0 * (20.0 * t).sin());
    }
    series
}

#[divan::bench(args = [(80, 24), (200, 60)])]
fn picture(bencher: Bencher<'_, '_>, (width, height): (u16, u16)) {
    let now_s = 75.0;
    let robot = |number| RobotModel {
        name: format!("robot {number}"),
        present: true,
        state: Some(State::Oscillate),
        tracking: true,
        series: series(now_s),
        ..RobotModel::default()
    };
    let mut model =
        Model { now: Duration::from_secs_f64(now_s), robots: (0..5).map(robot).collect(), ..Model::default() };
    for number in 0..500 {
        model.log(Some(0), Level::Note, format!("event {number} that tells something about a robot"));
    }
    let mut screen = Screen::new(Theme { colour: true, ascii: false }, Prompt::new(History::default()));
    let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("it cannot fail");
    bencher.bench_local(|| {
        // Every picture is another one, as with live data.
        model.now += Duration::from_millis(1);
        terminal.draw(|frame| draw(frame, &model, &mut screen)).expect("it cannot fail");
    });
}
