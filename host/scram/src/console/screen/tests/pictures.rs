//! What is on the screen, at every size.

use super::*;

fn has(rows: &[String], words: &[&str]) {
    // Folded text goes over the ends of rows.
    let all = rows.iter().map(|row| row.trim()).collect::<Vec<_>>().join(" ");
    for word in words {
        assert!(all.contains(word), "`{word}` is missing in\n{}", rows.join("\n"));
    }
}

#[test]
fn everything_is_there_at_80_by_24() {
    let rows = picture(&model(3), &mut screen(UNICODE), 80, 24);
    let words = [
        "/dev/ttyACM0",
        "channel 6",
        "recording walk.mcap 1.2 MB",
        ">1  alpha",
        " 2  beta",
        "gamma",
        "speed",
        "freq 7",
        "3.92 V",
        "100/s",
        "2.1 %",
        "12 ms",
        "-52 dBm",
        "frequency",
        "angle",
        "duty",
        "cell",
        "frames lost",
        "round trip",
        "event 39",
        "alpha>",
        "Esc STOP ALL",
        "^C leave",
        "F1 help",
        "6.91 Hz",
        "30 s",
        "up 1:02:05",
        "ticks lost 10 of 75000",
    ];
    has(&rows, &words);
    assert!(rows.iter().flat_map(|row| row.chars()).any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "{rows:#?}");
    has(&picture(&model(3), &mut screen(UNICODE), 120, 40), &["dongle 7c:df:a1:00:11:22"]);
}

#[test]
fn plain_terminals_get_plain_characters() {
    let mut robots = model(3);
    fault(&mut robots, Fault::SensorOpen);
    robots.robots[2].present = false;
    for help in [None, Some(0)] {
        for (width, height) in [(80, 24), (40, 10), (200, 60)] {
            let mut screen = screen(ASCII);
            screen.help = help;
            let mut terminal = terminal(width, height);
            terminal.draw(|frame| draw(frame, &robots, &mut screen)).expect("it cannot fail");
            for cell in terminal.backend().buffer().content() {
                assert!(cell.symbol().is_ascii(), "{:?}", cell.symbol());
                let plain = ratatui::style::Color::Reset;
                assert_eq!((cell.fg, cell.bg), (plain, plain), "{:?}", cell.symbol());
            }
        }
    }
}

#[test]
fn a_fault_is_told_with_what_to_do_down_to_40_by_10() {
    for cause in [Fault::Stall, Fault::Runaway, Fault::SensorOpen, Fault::CommandTooOld, Fault::Restarted] {
        let mut robots = model(3);
        fault(&mut robots, cause);
        let (what, advice) = link::fault(cause);
        for (width, height) in [(80, 24), (60, 16), (40, 12), (200, 60)] {
            let rows = picture(&robots, &mut screen(UNICODE), width, height);
            has(&rows, &["FAULT", what, advice, "`clear`", "!! alpha"]);
        }
        let rows = picture(&robots, &mut screen(UNICODE), 40, 10);
        has(&rows, &["FAULT", what, "alpha>"]);
    }
}

#[test]
fn what_is_not_well_is_told_in_words() {
    let mut robots = model(4);
    robots.robots[0].present = false;
    robots.robots[1].stopping = true;
    robots.robots[2].other_version = Some(0xabcd);
    fault(&mut robots, Fault::Stall);
    robots.robots[3].state = None;
    let row = |name: &str| {
        let rows = picture(&robots, &mut screen(ASCII), 80, 24);
        rows.into_iter().find(|row| row[4..].starts_with(name)).expect("it is in the list")
    };
    assert!(row("alpha").contains("absent") && !row("alpha").contains("3.92"), "{}", row("alpha"));
    assert!(row("beta").contains("STOPPING") && row("gamma").contains("VERSION!"));
    has(&picture(&robots, &mut screen(ASCII), 80, 24), &["does not answer any more", "is its battery in"]);
    robots.selected = 2;
    has(&picture(&robots, &mut screen(ASCII), 80, 24), &["speaks version 0000abcd", "flash it"]);
}

#[test]
fn no_robots_and_many() {
    has(&picture(&model(0), &mut screen(ASCII), 80, 24), &["no robots", "no robot is paired", "scram pair"]);
    let mut many = model(40);
    for selected in [0, 17, 39] {
        many.selected = selected;
        for (width, height) in [(80, 24), (40, 10), (200, 60)] {
            let rows = picture(&many, &mut screen(ASCII), width, height);
            assert!(rows.iter().any(|row| row.starts_with(&format!(">{} ", selected + 1))), "{rows:#?}");
        }
    }
}

#[test]
fn a_recording_that_failed_and_one_that_never_was() {
    let mut robots = model(1);
    robots.recording.as_mut().expect("it is there").failed = Some("No space left on device".into());
    for (width, height) in [(80, 24), (50, 12)] {
        has(&picture(&robots, &mut screen(ASCII), width, height), &["!! NOT RECORDED: No space le"]);
    }
    robots.recording = None;
    has(&picture(&robots, &mut screen(ASCII), 80, 24), &["! not recorded"]);
}

#[test]
fn a_script_tells_where_it_is() {
    let mut robots = model(1);
    robots.script = Some((PathBuf::from("gaits/walk.scram"), 12));
    has(&picture(&robots, &mut screen(ASCII), 80, 24), &["gaits/walk.scram: line 12 is next"]);
}

#[test]
fn values_that_are_not_of_the_present_are_not_shown() {
    let mut robots = model(1);
    robots.now += Duration::from_secs(5);
    let rows = picture(&robots, &mut screen(ASCII), 80, 24);
    has(&rows, &["frequency  - ", "angle not known"]);
    robots.now += Duration::from_secs(60);
    has(&picture(&robots, &mut screen(ASCII), 80, 24), &["nothing to show"]);
}

#[test]
fn a_small_window_still_tells_the_state_and_how_to_stop() {
    let mut robots = model(1);
    fault(&mut robots, Fault::Stall);
    let rows = picture(&robots, &mut screen(ASCII), 39, 5);
    has(&rows, &["too small: 40x10 at least", "!! alpha FAULT", "Esc stops every robot"]);
    has(&picture(&robots, &mut screen(ASCII), 20, 1), &["!! alpha FAULT"]);
}

#[test]
fn long_names_and_wide_text_stay_in_their_places() {
    let mut robots = model(2);
    robots.robots[0].name = "a name that has all 32 bytes of.".into();
    robots.robots[1].name = "漢字漢字漢字漢字漢字".into();
    robots.robots[1].target = Some("oscillate -100 100 proportional".into());
    robots.log(Some(1), Level::Bad, "漢字".repeat(60));
    robots.log(None, Level::Bad, "control\u{1b}[31m characters\u{7}\n");
    let mut screen = screen(UNICODE);
    screen.prompt.paste(&"漢字 ".repeat(30));
    for (width, height) in [(80, 24), (40, 10), (120, 40)] {
        let rows = picture(&robots, &mut screen, width, height);
        assert!(rows.iter().all(|row| !row.contains(char::is_control)), "{rows:#?}");
        // A wide character takes two cells, the second of which is blank.
        let wide = rows.iter().find(|row| row.contains(" 2  漢")).expect("it is in the list");
        assert!(wide.contains('…') && wide.contains("speed"), "{wide}");
    }
}

#[test]
fn a_small_window_shows_the_beginning_of_the_latest_event_and_some_help() {
    let mut robots = model(3);
    fault(&mut robots, Fault::Stall);
    robots.log(Some(0), Level::Bad, "the latest event in a sentence that takes more than a row");
    has(&picture(&robots, &mut screen(ASCII), 40, 10), &["alpha: the latest event"]);
    let mut screen = screen(ASCII);
    screen.help = Some(0);
    has(&picture(&robots, &mut screen, 40, 10), &["Help; F1: away", "STOP every robot"]);
}

#[test]
fn every_size_is_borne() {
    let mut robots = model(3);
    fault(&mut robots, Fault::SensorShorted);
    robots.robots[1].present = false;
    robots.script = Some((PathBuf::from("x"), 1));
    // What does not depend on the size shall not make the test slow.
    for robot in &mut robots.robots {
        robot.series = Series::default();
        for point in 0..50 {
            robot.series.frequency.push(NOW_S - 30.0 + f64::from(point) / 2.0, f64::from(point));
        }
    }
    let help = |screen: &mut Screen| screen.help = Some(3);
    let menu = |screen: &mut Screen| {
        let candidates = (0..20).map(|n| Candidate { text: format!("x{n}"), help: "help".into() });
        screen.prompt.complete(Completion { start: 0, candidates: candidates.collect() });
        screen.prompt.choose(true);
        screen.message = Some((Level::Bad, "what was wrong, in a long sentence that has to be folded".into()));
    };
    let states: [&dyn Fn(&mut Screen); 3] = [&|_| {}, &help, &menu];
    for theme in [UNICODE, ASCII] {
        for state in states {
            let mut screen = screen(theme);
            state(&mut screen);
            for width in 1..=100 {
                for height in 1..=40 {
                    let rows = picture(&robots, &mut screen, width, height);
                    assert_eq!(rows.len(), usize::from(height));
                }
            }
        }
    }
}

#[test]
fn a_window_may_shrink_and_grow_while_it_is_shown() {
    let (robots, mut screen) = (model(3), screen(UNICODE));
    let mut terminal = terminal(120, 40);
    for (width, height) in [(120, 40), (80, 24), (40, 10), (10, 3), (1, 1), (200, 60)] {
        terminal.backend_mut().resize(width, height);
        terminal.draw(|frame| draw(frame, &robots, &mut screen)).expect("it cannot fail");
        assert_eq!(terminal.backend().buffer().area.as_size(), (width, height).into());
    }
}

#[test]
fn the_cursor_stands_behind_what_was_typed() {
    let mut screen = screen(UNICODE);
    screen.prompt.paste("freq 7");
    let mut terminal = terminal(80, 24);
    terminal.draw(|frame| draw(frame, &model(1), &mut screen)).expect("it cannot fail");
    terminal.backend_mut().assert_cursor_position((13, 22));
    screen.prompt.paste(&"x".repeat(300));
    terminal.draw(|frame| draw(frame, &model(1), &mut screen)).expect("it cannot fail");
    terminal.backend_mut().assert_cursor_position((79, 22));
}
