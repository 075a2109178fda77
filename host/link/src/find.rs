//! Waiting for a robot, and for a command's end.

use std::time::Duration;

use control::protocol::dongle::Address;
use control::protocol::radio::Request;

use super::{Event, Heard, Line, LinkError, Outcome, RobotId, Session, words};

/// Time after the first robot in which others may answer.
const SETTLE: Duration = Duration::from_millis(700);

impl<L: Line> Session<L> {
    /// Waits for a robot: the one that is named, or the only one that is switched on.
    ///
    /// # Errors
    /// None is there, or more than one; the line breaks.
    pub fn find(&mut self, wanted: Option<Address>, patience: Duration) -> Result<RobotId, LinkError> {
        if let Some(address) = wanted
            && self.robots().all(|(_, robot)| robot.address() != address)
        {
            return Err(LinkError::NotPaired { address });
        }
        let start = self.now();
        let mut first = None;
        while self.now().saturating_sub(start) < patience {
            self.poll()?;
            let present = self.present();
            let fits = |id: &RobotId| wanted.is_none_or(|address| self.robot(*id).address() == address);
            let Some(found) = present.iter().copied().find(fits) else { continue };
            let since = *first.get_or_insert(self.now());
            // Its status comes with the beginning of the session.
            if self.robot(found).status().is_none() || wanted.is_none() && self.now().saturating_sub(since) < SETTLE {
                continue;
            }
            if wanted.is_none() && present.len() > 1 {
                return Err(LinkError::ManyRobots { robots: self.list(&present) });
            }
            return Ok(found);
        }
        Err(self.nobody(wanted))
    }

    /// Commands something and waits for its end. Everything that happens meanwhile goes to `heard`.
    ///
    /// # Errors
    /// The line breaks.
    pub fn ask(&mut self, id: RobotId, request: Request, mut heard: impl FnMut(&Heard)) -> Result<Outcome, LinkError> {
        let asked = self.request(id, request);
        loop {
            let Some(happened) = self.poll()? else { continue };
            heard(&happened);
            if let Event::Answered { number, outcome, .. } = happened.event
                && happened.robot == id
                && number == asked
            {
                return Ok(outcome);
            }
        }
    }

    fn present(&self) -> Vec<RobotId> {
        self.robots().filter(|(_, robot)| robot.is_present()).map(|(id, _)| id).collect()
    }

    fn list(&self, robots: &[RobotId]) -> String {
        let one = |id: &RobotId| {
            let robot = self.robot(*id);
            format!("{} ({})", words::address(&robot.address()), robot.name())
        };
        robots.iter().map(one).collect::<Vec<_>>().join(", ")
    }

    fn nobody(&self, wanted: Option<Address>) -> LinkError {
        let wanted_robot = |address: Address| wanted.is_none_or(|wanted| wanted == address);
        let older = self.robots().find(|(_, robot)| wanted_robot(robot.address()) && robot.other_version().is_some());
        if let Some((_, robot)) = older {
            let address = robot.address();
            return LinkError::RobotVersion { address, robot: robot.other_version().unwrap_or_default() };
        }
        let present = self.present();
        LinkError::NoRobot {
            wanted: wanted.map_or_else(|| "a robot".to_owned(), |one| format!("robot {}", words::address(&one))),
            channel: self.channel(),
            others: if present.is_empty() { "nothing else either".into() } else { self.list(&present) },
        }
    }
}
