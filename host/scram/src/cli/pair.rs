//! `scram pair`

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use link::{Cabled, Keys, KeysError, LinkError, SerialLine};
use miette::{Report, miette};

use super::{Done, print, print_json, say};

/// A board that was just restarted by opening its port needs a second to boot.
const PATIENCE: Duration = Duration::from_secs(4);

/// Where the keys are.
#[derive(Args, Clone)]
pub struct KeysFile {
    /// The console's keys [default: scram/keys.toml in the user's configuration directory]
    #[arg(long, value_name = "FILE")]
    keys: Option<PathBuf>,
}

impl KeysFile {
    /// The file that was named.
    pub fn given(&self) -> Option<&Path> {
        self.keys.as_deref()
    }

    fn path(&self) -> Result<PathBuf, Report> {
        match &self.keys {
            Some(path) => Ok(path.clone()),
            None => Ok(Keys::default_path()?),
        }
    }

    /// Reads them.
    pub fn load(&self) -> Result<Keys, Report> {
        Ok(Keys::load(&self.path()?)?)
    }
}

/// Pair a robot with this computer and its dongle, once: plug in both, the robot with its own USB cable
///
/// Makes new keys, gives them to the robot, and keeps them in a file that only you can read. From then on the robot obeys
/// this console and no other. Pairing again replaces the keys; a robot has one console.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    scram pair --port /dev/ttyUSB0 --dongle /dev/ttyACM0\n  \
    scram pair --port /dev/ttyUSB0 --forget\n  \
    scram pair --list")]
pub struct Pair {
    /// The robot's own serial port
    #[arg(long, value_name = "PORT", required_unless_present = "list")]
    port: Option<String>,
    /// The dongle's serial port
    #[arg(long, value_name = "PORT", required_unless_present_any = ["list", "forget"])]
    dongle: Option<String>,
    /// Make the robot obey nobody
    #[arg(long, conflicts_with_all = ["dongle", "list"])]
    forget: bool,
    /// Only list the robots that are paired
    #[arg(long, conflicts_with_all = ["port", "dongle"])]
    list: bool,
    #[command(flatten)]
    keys: KeysFile,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

impl Pair {
    pub fn run(&self) -> Done {
        match (&self.port, &self.dongle) {
            (Some(port), Some(dongle)) => self.pair(port, dongle),
            (Some(port), None) => self.forget(port),
            (None, _) => self.list(),
        }
    }

    fn pair(&self, port: &str, dongle: &str) -> Done {
        let path = self.keys.path()?;
        let mut keys = match Keys::load(&path) {
            Err(KeysError::NoFile { .. }) => Keys::generate().map_err(Report::from)?,
            keys => keys.map_err(Report::from)?,
        };
        say(&format!("1/3  Looking for the dongle on {dongle}"));
        let line = SerialLine::open(dongle).map_err(Report::from)?;
        let console = link::dongle_address(line, PATIENCE).map_err(Report::from)?;
        say(&format!("     dongle {}", link::address(&console)));
        say(&format!("2/3  Looking for the robot on {port}"));
        let robot = cabled(port)?;
        say(&format!("     {} at {}, {}", robot.name, link::address(&robot.address), obeys(robot.console.as_ref())));
        let before = keys.clone();
        let known = keys.pair(&robot.name, robot.address, console).map_err(Report::from)?.clone();
        // First here: keys that only the robot has would be of no use.
        keys.save(&path).map_err(Report::from)?;
        say("3/3  Giving it its keys");
        if let Err(error) = robot.pair(&known.pairing) {
            if matches!(error, LinkError::NotPaired { .. }) {
                // It says that it obeys whom it obeyed before.
                before.save(&path).map_err(Report::from)?;
            }
            return Err(Report::from(error).into());
        }
        let address = link::address(&known.address);
        if self.json {
            print_json(&serde_json::json!({ "name": known.name, "address": address, "keys": path }))?;
        } else {
            print(&format!("{} at {address} obeys this console; keys in {}", known.name, path.display()));
        }
        Ok(())
    }

    fn forget(&self, port: &str) -> Done {
        let robot = cabled(port)?;
        let (name, address) = (robot.name.clone(), link::address(&robot.address));
        robot.forget().map_err(Report::from)?;
        if self.json {
            print_json(&serde_json::json!({ "name": name, "address": address }))?;
        } else {
            print(&format!("{name} at {address} obeys nobody"));
        }
        Ok(())
    }

    fn list(&self) -> Done {
        let keys = self.keys.load()?;
        let robots = keys.robots.iter();
        if self.json {
            let list: Vec<_> = robots
                .map(|robot| {
                    let (address, dongle) = (link::address(&robot.address), link::address(&robot.pairing.console));
                    serde_json::json!({ "name": robot.name, "address": address, "dongle": dongle })
                })
                .collect();
            print_json(&list)?;
        } else {
            for robot in robots {
                let (address, dongle) = (link::address(&robot.address), link::address(&robot.pairing.console));
                print(&format!("{:<32} {address}  through dongle {dongle}", robot.name));
            }
        }
        Ok(())
    }
}

fn cabled(port: &str) -> Result<Cabled<SerialLine>, Report> {
    let robot = Cabled::open(SerialLine::open(port)?, PATIENCE)?;
    if robot.name.is_empty() {
        return Err(miette!("the robot on {port} has no name: build its firmware anew"));
    }
    Ok(robot)
}

fn obeys(console: Option<&[u8; 6]>) -> String {
    console.map_or_else(|| "which obeys nobody yet".into(), |at| format!("which obeys dongle {}", link::address(at)))
}
