//! Who drives, and whether it is still there: a page that has given a command beats while it can be seen, and when it is
//! silent the robots are told to stop.

use std::time::Duration;

/// Tells a page from another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PageId(pub u64);

/// A page that is silent for so long is gone. It beats ten times a second while it can be seen; drawing on a slow computer keeps it
/// from that for some tenths of a second.
pub const SILENCE: Duration = Duration::from_secs(1);

/// The page that drives: the last one that gave a command.
#[derive(Clone, Debug, Default)]
pub struct Driver {
    page: Option<(PageId, Duration)>,
    gone: bool,
}

impl Driver {
    /// A page has given a command.
    pub fn commands(&mut self, page: PageId, now: Duration) {
        self.page = Some((page, now));
    }

    /// A page says that it is there.
    pub fn beat(&mut self, page: PageId, now: Duration) {
        if let Some((driving, heard)) = &mut self.page
            && *driving == page
        {
            *heard = now;
        }
    }

    /// A page was closed.
    pub fn gone(&mut self, page: PageId) {
        if self.page.is_some_and(|(driving, _)| driving == page) {
            self.page = None;
            self.gone = true;
        }
    }

    /// Whether the page that drove went away or fell silent: once, for then the robots are told to stop.
    pub fn has_gone(&mut self, now: Duration) -> bool {
        if self.page.is_some_and(|(_, heard)| now.saturating_sub(heard) > SILENCE) {
            self.page = None;
            self.gone = true;
        }
        std::mem::take(&mut self.gone)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: PageId = PageId(1);
    const OTHER: PageId = PageId(2);

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_page_that_drives_and_goes_is_noticed_once() {
        let mut driver = Driver::default();
        driver.commands(ONE, ms(0));
        assert!(!driver.has_gone(ms(100)));
        driver.gone(ONE);
        assert!(driver.has_gone(ms(101)) && !driver.has_gone(ms(102)));
    }

    #[test]
    fn a_page_that_drives_must_beat() {
        let mut driver = Driver::default();
        driver.commands(ONE, ms(0));
        driver.beat(ONE, ms(800));
        driver.beat(OTHER, ms(1600));
        assert!(!driver.has_gone(ms(1800)));
        assert!(driver.has_gone(ms(1801)));
        driver.beat(ONE, ms(1850));
        assert!(!driver.has_gone(ms(5000)), "it drives no more until it gives a command");
    }

    #[test]
    fn a_page_that_only_looks_may_go_and_be_silent() {
        let mut driver = Driver::default();
        driver.gone(ONE);
        assert!(!driver.has_gone(ms(9000)));
        driver.commands(ONE, ms(9000));
        driver.commands(OTHER, ms(9100));
        driver.gone(ONE);
        assert!(!driver.has_gone(ms(9200)), "the other page drives now");
    }
}
