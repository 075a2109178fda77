//! Who gets which part of the window. What a person must not miss comes first: the command line, the state, the fault.

use ratatui::layout::Rect;

/// Smaller than this, and only the state of the robot fits.
pub const LEAST: (u16, u16) = (40, 10);

/// How many rows some parts would like.
#[derive(Clone, Copy, Debug)]
pub struct WantedRows {
    /// One a robot.
    pub robots: u16,
    /// What the matter is with the selected robot.
    pub health: u16,
    /// What was wrong with what was typed.
    pub message: u16,
}

/// The parts of the window, from above. A part without room has a height of 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct Areas {
    /// Port, recording.
    pub header: Rect,
    /// Titles of the list of robots.
    pub titles: Rect,
    /// All robots.
    pub robots: Rect,
    /// What the matter is with the selected one.
    pub health: Rect,
    /// Its plots.
    pub plots: Rect,
    /// The last events.
    pub log: Rect,
    /// What was wrong with what was typed.
    pub message: Rect,
    /// The command line.
    pub prompt: Rect,
    /// What the keys do.
    pub keys: Rect,
}

impl Areas {
    /// For a window; `None` where it is too small.
    #[must_use]
    pub fn new(area: Rect, needs: WantedRows, least_plot: u16) -> Option<Self> {
        let (width, height) = (area.width, area.height);
        if width < LEAST.0 || height < LEAST.1 {
            return None;
        }
        let header = u16::from(height >= 12);
        let keys = u16::from(height >= 12);
        let prompt = 1;
        let message = needs.message.clamp(1, if height >= 20 { 3 } else { 2 });
        let titles = u16::from(height >= 18);
        let left = height - header - keys - prompt - message - titles;
        // A fault and what to do about it are cut last of all.
        let health = needs.health.clamp(1, left.saturating_sub(2).max(1));
        let left = left - health;
        let robots = needs.robots.clamp(1, (height / 4).min(left.saturating_sub(1)).max(1));
        let left = left - robots;
        let log_least = if height >= 16 { 4 } else { 2 };
        let plots = left.saturating_sub((height / 5).clamp(log_least, 12));
        let plots = if plots >= least_plot { plots } else { 0 };
        let mut y = area.y;
        let mut room = |rows: u16| {
            let rect = Rect { x: area.x, y, width, height: rows };
            y += rows;
            rect
        };
        Some(Self {
            header: room(header),
            titles: room(titles),
            robots: room(robots),
            health: room(health),
            plots: room(plots),
            log: room(left - plots),
            message: room(message),
            prompt: room(prompt),
            keys: room(keys),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_fill_every_window_and_the_important_ones_are_always_there() {
        for width in 40..=200 {
            for height in 10..=100 {
                for (robots, health, message) in [(0, 1, 0), (1, 2, 1), (5, 4, 1), (40, 9, 9)] {
                    let area = Rect::new(0, 0, width, height);
                    let needs = WantedRows { robots, health, message };
                    let areas = Areas::new(area, needs, 3).expect("it is large enough");
                    let Areas { header, titles, robots, health, plots, log, message, prompt, keys } = areas;
                    let all = [header, titles, robots, health, plots, log, message, prompt, keys];
                    assert_eq!(all.iter().map(|room| room.height).sum::<u16>(), height, "{width}x{height} {areas:?}");
                    for must in [robots, health, message, prompt] {
                        assert!(must.height > 0, "{width}x{height} {areas:?}");
                    }
                }
            }
        }
        assert!(Areas::new(Rect::new(0, 0, 39, 10), WantedRows { robots: 1, health: 1, message: 1 }, 3).is_none());
    }
}
