//! Every key does what the help says, in every state of the screen.

use super::*;

fn typed(screen: &mut Screen, console: &mut Scripted, text: &str) {
    for c in text.chars() {
        screen.take(&key(KeyCode::Char(c)), console);
    }
}

fn press(screen: &mut Screen, console: &mut Scripted, codes: &[KeyCode]) {
    for code in codes {
        screen.take(&key(*code), console);
    }
}

#[test]
fn esc_stops_whatever_is_shown_or_typed() {
    type Before<'a> = &'a dyn Fn(&mut Screen, &mut Scripted);
    let alt = |code| Event::Key(KeyEvent::new(code, KeyModifiers::ALT));
    let before: [Before<'_>; 8] = [
        &|_, _| {},
        &|screen, console| typed(screen, console, "freq 7"),
        &|screen, console| press(screen, console, &[KeyCode::Char('f'), KeyCode::Tab]),
        &|screen, console| press(screen, console, &[KeyCode::Char('f'), KeyCode::Tab, KeyCode::Tab]),
        &|screen, console| press(screen, console, &[KeyCode::F(1), KeyCode::PageDown]),
        &|screen, console| press(screen, console, &[KeyCode::PageUp]),
        &|screen, console| {
            typed(screen, console, "bad line");
            press(screen, console, &[KeyCode::Enter]);
        },
        &|_, console| console.model = model(0),
    ];
    for (number, before) in before.into_iter().enumerate() {
        for esc in [key(KeyCode::Esc), alt(KeyCode::Esc), alt(KeyCode::Enter), alt(KeyCode::Tab)] {
            let (mut screen, mut console) = (screen(UNICODE), Scripted::with(2));
            before(&mut screen, &mut console);
            console.asked.clear();
            screen.take(&esc, &mut console);
            assert_eq!(console.deeds(), ["stop all"], "{number}: {esc:?}");
            // An Enter that comes late does nothing.
            screen.take(&key(KeyCode::Enter), &mut console);
            assert_eq!(console.deeds(), ["stop all"], "{number}: {esc:?}");
            assert!(screen.help.is_none(), "{number}");
        }
    }
}

#[test]
fn esc_and_a_letter_that_come_together_stop_and_type() {
    let (mut screen, mut console) = (screen(UNICODE), Scripted::with(1));
    typed(&mut screen, &mut console, "freq 7");
    screen.take(&Event::Key(KeyEvent::new(KeyCode::Char('x'), KeyModifiers::ALT)), &mut console);
    assert_eq!((console.deeds(), screen.prompt.line()), (vec!["stop all"], "x"));
    press(&mut screen, &mut console, &[KeyCode::Up]);
    assert_eq!(screen.prompt.line(), "freq 7", "what was typed can be had again");
    let both = KeyModifiers::ALT | KeyModifiers::CONTROL;
    screen.take(&Event::Key(KeyEvent::new(KeyCode::Char('c'), both)), &mut console);
    assert_eq!((console.deeds().len(), screen.leaves()), (2, true));
}

#[test]
fn a_line_is_done_on_enter_and_what_is_wrong_is_shown() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    typed(&mut screen, &mut console, " freq 7; stop");
    assert!(console.deeds().is_empty());
    press(&mut screen, &mut console, &[KeyCode::Enter, KeyCode::Enter]);
    assert_eq!((console.deeds(), screen.message.as_ref()), (vec!["submit freq 7; stop"], None));
    typed(&mut screen, &mut console, "bad thing");
    press(&mut screen, &mut console, &[KeyCode::Enter]);
    let rows = picture(&console.model, &mut screen, 80, 24);
    assert!(rows.iter().any(|row| row.starts_with("!! `bad thing` is no command")), "{rows:#?}");
    press(&mut screen, &mut console, &[KeyCode::Up]);
    assert_eq!(screen.prompt.line(), "bad thing", "so that it can be mended");
}

#[test]
fn the_space_bar_is_text() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    typed(&mut screen, &mut console, " a b ");
    assert_eq!((screen.prompt.line(), console.deeds().len()), (" a b ", 0));
}

#[test]
fn tab_completes_and_goes_round_and_enter_only_takes() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    press(&mut screen, &mut console, &[KeyCode::Char('s'), KeyCode::Tab]);
    assert_eq!((screen.prompt.line(), screen.prompt.menu().is_none()), ("stop", true));
    screen.take(&control_and('u'), &mut console);
    press(&mut screen, &mut console, &[KeyCode::Char('f'), KeyCode::Tab]);
    let rows = picture(&console.model, &mut screen, 80, 24).join("\n");
    assert!(rows.contains("2 possibilities") && rows.contains("what factory does"), "{rows}");
    press(&mut screen, &mut console, &[KeyCode::Tab, KeyCode::Tab]);
    assert_eq!(screen.prompt.line(), "factory");
    let rows = picture(&console.model, &mut screen, 80, 24);
    assert!(rows.iter().any(|row| row.starts_with(">factory")), "the chosen one has a mark: {rows:#?}");
    press(&mut screen, &mut console, &[KeyCode::Enter]);
    assert_eq!((screen.prompt.menu().is_none(), console.deeds().len()), (true, 0), "looked at before it is done");
    press(&mut screen, &mut console, &[KeyCode::Enter]);
    assert_eq!(console.deeds(), ["submit factory"]);
    typed(&mut screen, &mut console, "xyz");
    press(&mut screen, &mut console, &[KeyCode::Tab]);
    assert!(screen.message.as_ref().is_some_and(|(_, text)| text.contains("nothing fits")));
}

#[test]
fn robots_are_picked_with_one_key() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(3));
    let mut picked = Vec::new();
    for event in [key(KeyCode::F(7)), control_and('n'), control_and('n'), control_and('p'), control_and('p')] {
        screen.take(&event, &mut console);
        picked.push(console.model.selected);
    }
    assert_eq!(picked, [2, 0, 1, 0, 2]);
    press(&mut screen, &mut console, &[KeyCode::F(12)]);
    assert_eq!(console.model.selected, 2);
    assert_eq!(screen.message, Some((Level::Warning, "there is no robot 8".into())));
    console.model = model(0);
    screen.take(&control_and('n'), &mut console);
    assert_eq!(console.model.selected, 0);
}

#[test]
fn undo_says_why_it_cannot() {
    for event in [key(KeyCode::F(4)), control_and('z')] {
        let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
        screen.take(&event, &mut console);
        assert_eq!(console.deeds(), ["undo"]);
        assert_eq!(screen.message, Some((Level::Bad, "there is no `set` to take back".into())));
    }
}

#[test]
fn the_log_goes_back_page_by_page_and_stays_where_it_is_read() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    let shows = |screen: &mut Screen, console: &Scripted, number: usize| {
        let rows = picture(&console.model, screen, 80, 24).join("\n");
        rows.contains(&format!("event {number} "))
    };
    assert!(shows(&mut screen, &console, 39));
    press(&mut screen, &mut console, &[KeyCode::PageUp]);
    assert!(!shows(&mut screen, &console, 39) && shows(&mut screen, &console, 36));
    console.model.log(None, Level::Note, "something new");
    assert!(shows(&mut screen, &console, 36));
    for _ in 0..30 {
        press(&mut screen, &mut console, &[KeyCode::PageUp]);
        shows(&mut screen, &console, 0);
    }
    assert!(shows(&mut screen, &console, 0));
    for _ in 0..30 {
        press(&mut screen, &mut console, &[KeyCode::PageDown]);
    }
    assert_eq!(screen.log_until, None);
}

#[test]
fn a_list_of_one_moment_is_read_to_its_beginning() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    for number in 0..30 {
        console.model.say(None, format!("listed {number} "));
    }
    let mut seen = String::new();
    for _ in 0..30 {
        seen += &picture(&console.model, &mut screen, 80, 24).join("\n");
        press(&mut screen, &mut console, &[KeyCode::PageUp]);
    }
    for number in 0..30 {
        assert!(seen.contains(&format!("listed {number} ")), "{number}");
    }
}

#[test]
fn the_help_lists_keys_and_commands_and_can_be_read_to_its_end() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    typed(&mut screen, &mut console, "help");
    press(&mut screen, &mut console, &[KeyCode::Enter]);
    assert!(console.deeds().is_empty());
    let mut read = String::new();
    for _ in 0..40 {
        read += &picture(&console.model, &mut screen, 80, 24).join("\n");
        press(&mut screen, &mut console, &[KeyCode::PageDown]);
    }
    for (name, _) in super::super::input::KEYS.iter().chain(crate::console::HELP) {
        assert!(read.contains(name), "{name} is missing");
    }
    typed(&mut screen, &mut console, "g");
    assert_eq!((screen.help, screen.prompt.line()), (None, "g"), "typing goes on");
}

#[test]
fn a_released_key_is_no_key() {
    let (mut screen, mut console) = (screen(ASCII), Scripted::with(1));
    let mut released = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
    released.kind = ratatui::crossterm::event::KeyEventKind::Release;
    screen.take(&Event::Key(released), &mut console);
    assert!(console.deeds().is_empty());
}
