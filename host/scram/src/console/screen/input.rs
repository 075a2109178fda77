//! What a person does: every key, in every state of the screen.

use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

use super::console::Console;
use super::prompt::Prompt;
use super::theme::Theme;
use crate::console::model::{Level, Model};

/// The keys, for the help. Esc is first everywhere.
pub const KEYS: &[(&str, &str)] = &[
    ("Esc", "STOP every robot, at once, whatever is shown or typed; what is typed can be had again with Up"),
    ("Enter", "do what is typed"),
    ("Tab", "complete; again for the next possibility"),
    ("Up, Down", "what was typed before"),
    ("Ctrl-N, Ctrl-P", "the next robot, the one before"),
    ("F5 ... F12", "robot 1 ... 8"),
    ("Ctrl-Z, F4", "take the last `set` back"),
    ("PgUp, PgDn", "older and newer events"),
    ("Ctrl-L", "draw everything again"),
    ("F1", "this help, and away again"),
    ("Ctrl-C", "stop every robot and leave"),
];

/// What is shown besides the model, and what the keys act on.
#[derive(Debug)]
pub struct Screen {
    /// What the terminal can show.
    pub theme: Theme,
    /// The command line.
    pub prompt: Prompt,
    /// What became of the last key or line.
    pub message: Option<(Level, String)>,
    /// Rows of the help that are above the window, while it is shown.
    pub help: Option<u16>,
    /// The log is shown up to this time; `None`: to its end.
    pub log_until: Option<u64>,
    /// Events that were last shown.
    pub log_shown: usize,
    /// Everything has to be drawn again, e.g. after another program wrote over it.
    pub redraw: bool,
    leave: bool,
}

impl Screen {
    /// An empty command line.
    #[must_use]
    pub fn new(theme: Theme, prompt: Prompt) -> Self {
        Self { theme, prompt, message: None, help: None, log_until: None, log_shown: 1, redraw: false, leave: false }
    }

    /// The person wants to leave.
    #[must_use]
    pub fn leaves(&self) -> bool {
        self.leave
    }

    /// Does what an event of the terminal asks for.
    pub fn take(&mut self, event: &Event, console: &mut impl Console) {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => self.key(*key, console),
            Event::Paste(text) => self.prompt.paste(text),
            _ => {}
        }
    }

    fn key(&mut self, mut key: KeyEvent, console: &mut impl Console) {
        // To a terminal, Alt with a key is Esc and that key in one go, and the other way round: it stops, too. AltGr on
        // Windows is another thing.
        let alt_gr = cfg!(windows) && key.modifiers.contains(KeyModifiers::CONTROL | KeyModifiers::ALT);
        let alt = key.modifiers.contains(KeyModifiers::ALT) && !alt_gr;
        if key.code == KeyCode::Esc || alt {
            self.stop(console);
            key.modifiers.remove(KeyModifiers::ALT);
        }
        if key.code == KeyCode::Esc {
            return;
        }
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('c') if control => self.leave = true,
            KeyCode::Char('z') if control => self.undo(console),
            KeyCode::Char('l') if control => self.redraw = true,
            KeyCode::Char('n') if control => pick_beside(console, true),
            KeyCode::Char('p') if control => pick_beside(console, false),
            KeyCode::F(1) => self.help = if self.help.is_none() { Some(0) } else { None },
            KeyCode::F(4) => self.undo(console),
            KeyCode::F(number @ 5..=12) => self.pick(console, usize::from(number - 5)),
            KeyCode::PageUp => self.page(console.model(), true),
            KeyCode::PageDown => self.page(console.model(), false),
            _ => self.typed(key, console),
        }
    }

    fn stop(&mut self, console: &mut impl Console) {
        console.stop_all();
        self.help = None;
        // So that an Enter that comes late does not set a robot going again.
        self.prompt.take();
        self.message = Some((Level::Warning, "STOP to every robot".into()));
    }

    fn undo(&mut self, console: &mut impl Console) {
        self.message = console.undo().err().map(|why| (Level::Bad, why));
    }

    fn pick(&mut self, console: &mut impl Console, index: usize) {
        self.message = None;
        if index < console.model().robots.len() {
            console.select(index);
        } else {
            self.message = Some((Level::Warning, format!("there is no robot {}", index + 1)));
        }
    }

    fn page(&mut self, model: &Model, older: bool) {
        if let Some(from) = &mut self.help {
            // The view knows where the end is.
            *from = if older { from.saturating_sub(5) } else { from.saturating_add(5) };
            return;
        }
        let end = self.log_end(model);
        let page = self.log_shown.max(1);
        let end = if older { end.saturating_sub(page).max(page.min(model.log.len())) } else { end + page };
        self.log_until = if end >= model.log.len() { None } else { Some(first_kept(model) + end as u64) };
    }

    /// Events up to the last that is to be shown.
    #[must_use]
    pub fn log_end(&self, model: &Model) -> usize {
        let all = model.log.len();
        self.log_until.map_or(all, |until| {
            usize::try_from(until.saturating_sub(first_kept(model))).map_or(all, |end| end.min(all))
        })
    }

    fn typed(&mut self, key: KeyEvent, console: &mut impl Console) {
        self.help = None;
        match (key.code, self.prompt.menu().is_some()) {
            (KeyCode::Tab | KeyCode::Down, true) => self.prompt.choose(true),
            (KeyCode::BackTab | KeyCode::Up, true) => self.prompt.choose(false),
            // What was chosen is looked at before it is done.
            (KeyCode::Enter, true) => self.prompt.close_menu(),
            (KeyCode::Tab, false) => self.complete(console),
            (KeyCode::Enter, false) => self.enter(console),
            (KeyCode::Up, false) => self.prompt.older(),
            (KeyCode::Down, false) => self.prompt.newer(),
            _ => self.prompt.edit(&Event::Key(key)),
        }
    }

    fn complete(&mut self, console: &impl Console) {
        let completion = console.complete(self.prompt.line(), self.prompt.cursor());
        let found = self.prompt.complete(completion);
        self.message = (!found).then(|| (Level::Note, "nothing fits; F1 lists the commands".into()));
    }

    fn enter(&mut self, console: &mut impl Console) {
        let line = self.prompt.take();
        self.message = None;
        self.log_until = None;
        match line.trim() {
            "" => {}
            "help" => self.help = Some(0),
            line => self.message = console.submit(line).err().map(|why| (Level::Bad, why)),
        }
    }
}

fn pick_beside(console: &mut impl Console, forward: bool) {
    let (count, at) = (console.model().robots.len(), console.model().selected);
    if count > 0 {
        console.select(if forward { (at + 1) % count } else { (at + count - 1) % count });
    }
}

/// Number of the oldest line of the log that is still there, counted from the console's beginning: many lines may have one
/// time.
fn first_kept(model: &Model) -> u64 {
    model.logged.saturating_sub(model.log.len() as u64)
}
