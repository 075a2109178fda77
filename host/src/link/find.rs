//! Which robot there is.

use std::time::Duration;

use control::Command;
use control::protocol::VERSION;
use control::protocol::dongle::Address;

use super::{Line, LinkError, Session, words};

/// Every robot.
pub const BROADCAST: Address = [0xff; 6];

/// Others may be heard for so long after the first robot. Each tells its status once a second.
const SETTLE: Duration = Duration::from_millis(1300);

impl<L: Line> Session<L> {
    /// Tells every robot to stay idle and waits for one to answer: the one that is named, or the only one.
    ///
    /// # Errors
    /// None answers, or more than one; the line breaks.
    pub fn find(&mut self, wanted: Option<Address>, patience: Duration) -> Result<Address, LinkError> {
        // A robot talks to the address that it last heard.
        self.hold(wanted.unwrap_or(BROADCAST), Command::Idle)?;
        let start = self.now();
        let mut first = None;
        while self.now().saturating_sub(start) < patience {
            self.poll()?;
            let robots = self.robots();
            let found = wanted.map_or_else(|| robots.first().copied(), |one| robots.contains(&one).then_some(one));
            let Some(found) = found else { continue };
            let since = *first.get_or_insert(self.now());
            let known = wanted.is_some() && self.stations.get(&found).is_some_and(|station| station.status.is_some());
            if !known && self.now().saturating_sub(since) < SETTLE {
                continue;
            }
            if wanted.is_none() && robots.len() > 1 {
                return Err(LinkError::ManyRobots { robots: self.list(&robots) });
            }
            self.hold(found, Command::Idle)?;
            return Ok(found);
        }
        Err(LinkError::NoRobot {
            wanted: wanted.map_or_else(|| "a robot".to_owned(), |one| format!("robot {}", words::address(&one))),
            channel: self.channel(),
            others: self.others(),
        })
    }

    fn robots(&self) -> Vec<Address> {
        self.stations.iter().filter(|(_, station)| station.is_robot()).map(|(address, _)| *address).collect()
    }

    fn list(&self, addresses: &[Address]) -> String {
        let one = |address: &Address| {
            let rssi = self.stations.get(address).map_or(0, |station| station.rssi);
            format!("{} ({rssi} dBm)", words::address(address))
        };
        addresses.iter().map(one).collect::<Vec<_>>().join(", ")
    }

    /// What else was heard.
    fn others(&self) -> String {
        let robots = self.robots();
        let strangers: Vec<Address> = self.stations.keys().filter(|key| !robots.contains(key)).copied().collect();
        let older = self.stations.values().find_map(|station| station.other_version);
        match (robots.is_empty(), older, strangers.is_empty()) {
            (false, _, _) => format!("heard: {}", self.list(&robots)),
            (true, Some(version), _) => {
                let list = self.list(&strangers);
                format!("heard: {list}, which speaks version {version} of the messages and not {VERSION}")
            }
            (true, None, false) => format!("heard, but no robot: {}", self.list(&strangers)),
            (true, None, true) => "nothing else is heard either".to_owned(),
        }
    }
}
