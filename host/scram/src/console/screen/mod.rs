//! The console's terminal screen.
//!
//! One loop does everything, in turn: it lets the console read and send ([`Console::poll`], heartbeats too), takes the keys
//! that were pressed, and draws if something has changed. So there are heartbeats only while keys are taken: a terminal
//! that is gone, or that blocks what is written to it, ends them, and the robots stop by themselves within half a second.

mod console;
mod history;
mod input;
mod layout;
mod prompt;
mod signals;
#[cfg(test)]
mod tests;
mod text;
mod theme;
mod view;

use std::io::{self, IsTerminal, Write, stdin, stdout};
use std::mem::ManuallyDrop;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use miette::{Diagnostic, Report};
use ratatui::backend::{Backend, CrosstermBackend};
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::event::{self, DisableBracketedPaste, EnableBracketedPaste, Event};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{EnterAlternateScreen, enable_raw_mode};
use ratatui::{DefaultTerminal, Terminal};
use thiserror::Error;

pub use console::Console;
pub use history::History;
pub use input::Screen;
pub use prompt::Prompt;
pub use signals::Signals;
pub use theme::Theme;
pub use view::draw;

/// Time between two pictures while robots tell something.
const FRAME: Duration = Duration::from_millis(100);
/// The same after a key, for the person who types.
const ECHO: Duration = Duration::from_millis(40);
/// The same while nothing happens: the plots move on.
const IDLE: Duration = Duration::from_millis(500);
/// Keys in a row, before the robots get their turn again.
const KEYS: usize = 64;

/// A look at the keyboard. Not zero: one of `crossterm`'s two ways to read does not look at all then.
const GLANCE: Duration = Duration::from_micros(20);

/// How the screen looks and what it keeps.
#[derive(Clone, Debug)]
pub struct ScreenOptions {
    /// What the terminal can show.
    pub theme: Theme,
    /// File of what was typed before; `None`: nothing is kept.
    pub history: Option<PathBuf>,
}

impl ScreenOptions {
    /// What the environment says, with colour and Unicode switched off where a person wants that.
    #[must_use]
    pub fn detect(no_color: bool, ascii: bool) -> Self {
        let found = Theme::detect(&|name| std::env::var(name).ok());
        let theme = Theme { colour: found.colour && !no_color, ascii: found.ascii || ascii };
        Self { theme, history: History::default_path() }
    }
}

/// Why there is no screen, or no more.
#[derive(Debug, Error, Diagnostic)]
enum ScreenError {
    #[error("there is no terminal to show the console on")]
    #[diagnostic(help("run it in a terminal, or without a screen: `--command \"freq 7\"` or `--script FILE`"))]
    NoTerminal,
    #[error("the terminal does not answer any more, so every robot was told to stop: {0}")]
    #[diagnostic(help("was its window closed, or the connection cut?"))]
    Terminal(#[source] io::Error),
    #[error("the end of the program cannot be caught, so the console does not begin: {0}")]
    Signals(#[source] ctrlc::Error),
    #[error("the console was ended from outside; every robot was told to stop")]
    Ended,
}

/// Shows a console until the person leaves. However it ends, the robots are told to stop and the terminal is as it was.
///
/// # Errors
/// There is no terminal, or it is gone; nobody to talk to any more; the process was asked to end.
pub fn run(console: &mut impl Console, options: &ScreenOptions) -> Result<(), Report> {
    let (signals, mut terminal) = match begin() {
        Ok(begun) => begun,
        Err(error) => {
            console.finish();
            return Err(error.into());
        }
    };
    let history = options.history.as_deref().map(History::load).unwrap_or_default();
    let mut screen = Screen::new(options.theme, Prompt::new(history));
    let ended = turn_round(&mut *terminal, console, &mut screen, &mut next_key, &|| signals.asked());
    // Before the terminal, which may not answer.
    console.finish();
    restore();
    if let Some(path) = &options.history
        && let Err(error) = screen.prompt.history.save(path)
        && ended.is_ok()
    {
        let _ = writeln!(io::stderr(), "note: what was typed is not kept: {}: {error}", path.display());
    }
    ended
}

/// A terminal that is not dropped: `ratatui` 0.30 then says on stderr that it cannot show the cursor, and where stderr is
/// gone, too, that is a panic in a destructor, which aborts. [`restore`] shows the cursor.
type Kept = ManuallyDrop<DefaultTerminal>;

fn begin() -> Result<(Signals, Kept), ScreenError> {
    let dumb = std::env::var("TERM").is_ok_and(|term| term == "dumb");
    if !stdin().is_terminal() || !stdout().is_terminal() || dumb {
        return Err(ScreenError::NoTerminal);
    }
    let signals = Signals::listen().map_err(ScreenError::Signals)?;
    restore_on_panic();
    let terminal = enter().map_err(|error| {
        restore();
        ScreenError::Terminal(error)
    })?;
    Ok((signals, ManuallyDrop::new(terminal)))
}

/// As `ratatui::try_init`, without its panic hook, which says on stderr what it cannot restore: see [`Kept`].
fn enter() -> io::Result<DefaultTerminal> {
    enable_raw_mode()?;
    execute!(stdout(), EnterAlternateScreen, EnableBracketedPaste)?;
    Terminal::new(CrosstermBackend::new(stdout()))
}

/// As it was before. A terminal that is gone needs nothing.
fn restore() {
    let _ = execute!(stdout(), DisableBracketedPaste, Show);
    let _ = ratatui::try_restore();
}

fn restore_on_panic() {
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        restore();
        before(panic);
    }));
}

fn next_key() -> io::Result<Option<Event>> {
    if event::poll(GLANCE)? { event::read().map(Some) } else { Ok(None) }
}

/// Event loop: polls the engine, reads the keys, draws.
fn turn_round<B: Backend>(
    terminal: &mut Terminal<B>,
    console: &mut impl Console,
    screen: &mut Screen,
    next_key: &mut dyn FnMut() -> io::Result<Option<Event>>,
    asked_to_end: &dyn Fn() -> bool,
) -> Result<(), Report>
where
    B::Error: Send + Sync + 'static,
{
    // Time until the next picture is due, from the last one.
    let (mut drawn, mut due) = (Instant::now(), Duration::ZERO);
    loop {
        if console.poll().map_err(Report::from)? {
            due = due.min(FRAME);
        }
        for _ in 0..KEYS {
            let Some(event) = next_key().map_err(ScreenError::Terminal)? else { break };
            screen.take(&event, console);
            due = due.min(ECHO);
        }
        if screen.leaves() || console.wants_to_quit() {
            return Ok(());
        }
        if asked_to_end() {
            return Err(ScreenError::Ended.into());
        }
        if drawn.elapsed() >= due {
            show(terminal, console, screen).map_err(ScreenError::Terminal)?;
            (drawn, due) = (Instant::now(), IDLE);
        }
    }
}

fn show<B: Backend>(terminal: &mut Terminal<B>, console: &impl Console, screen: &mut Screen) -> io::Result<()>
where
    B::Error: Send + Sync + 'static,
{
    if std::mem::take(&mut screen.redraw) {
        terminal.clear().map_err(io::Error::other)?;
    }
    terminal.draw(|frame| draw(frame, console.model(), screen)).map_err(io::Error::other)?;
    Ok(())
}
