//! The loop: in turn, and how it ends.

use std::io;

use super::super::turn_round;
use super::*;

/// Runs the loop with some keys, one a round; it ends after some more rounds.
fn run(console: &mut Scripted, keys: Vec<io::Result<Option<Event>>>) -> Result<(), miette::Report> {
    let mut keys = keys.into_iter();
    let rounds = std::cell::Cell::new(0);
    let mut next = move || keys.next().unwrap_or(Ok(None));
    let asked = || {
        rounds.set(rounds.get() + 1);
        rounds.get() > 100
    };
    turn_round(&mut terminal(80, 24), console, &mut screen(UNICODE), &mut next, &asked)
}

#[test]
fn control_c_and_quit_leave() {
    let mut console = Scripted::with(1);
    assert!(run(&mut console, vec![Ok(Some(control_and('c')))]).is_ok());
    let mut keys: Vec<_> = "quit".chars().map(|c| Ok(Some(key(KeyCode::Char(c))))).collect();
    keys.push(Ok(Some(key(KeyCode::Enter))));
    let mut console = Scripted::with(1);
    assert!(run(&mut console, keys).is_ok());
    assert_eq!(console.deeds(), ["submit quit"]);
}

#[test]
fn a_signal_a_broken_line_and_a_lost_terminal_end_it() {
    let ended = run(&mut Scripted::with(1), Vec::new()).expect_err("it was asked to end");
    assert!(ended.to_string().contains("ended from outside"), "{ended}");
    let silent = LinkError::DongleSilent { silent: Duration::from_secs(1) };
    let mut console = Scripted { polls: vec![Ok(true), Err(silent)], ..Scripted::with(1) };
    let ended = run(&mut console, Vec::new()).expect_err("the dongle is silent");
    assert!(ended.to_string().contains("silent"), "{ended}");
    let gone = vec![Ok(None), Err(io::Error::from(io::ErrorKind::BrokenPipe))];
    let ended = run(&mut Scripted::with(1), gone).expect_err("no keys");
    assert!(ended.to_string().contains("terminal"), "{ended}");
}

#[test]
fn many_keys_at_once_do_not_keep_the_robots_waiting() {
    let mut console = Scripted::with(1);
    let mut keys: Vec<_> = (0..1000).map(|_| Ok(Some(key(KeyCode::Char('x'))))).collect();
    keys.push(Ok(Some(key(KeyCode::Esc))));
    assert!(run(&mut console, keys).is_err());
    let stop = console.asked.iter().position(|deed| deed == "stop all").expect("it was stopped");
    let polls = console.asked[..stop].iter().filter(|deed| *deed == "poll").count();
    assert!(polls >= 1000 / 64, "{polls} polls before the stop");
}
