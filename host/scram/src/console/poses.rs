//! Where the robots are, told from outside by UDP: by motion capture, a camera over the ground, or a simulation.
//!
//! A pose is a datagram, a JSON object: `{"robot": "scram-26", "t_s": 12.34, "x_m": 0.1, "y_m": -0.02, "yaw_rad": 1.57}`.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use recording::MeasuredPose;
use serde::{Deserialize, Serialize};
use tasks::Pose;

/// A pose as it is sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseDatagram {
    /// The robot's name or address; may be missing where the console has one robot only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Time of the measurement on the sender's clock, s. One that is a little older than the last was overtaken on its way and does not
    /// count; without a time all count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub t_s: Option<f64>,
    /// Mean of the modules' centres over the ground, m.
    pub x_m: f64,
    /// As `x_m`.
    pub y_m: f64,
    /// Heading, from the last module to the first, rad, counter-clockwise.
    pub yaw_rad: f64,
}

/// A pose is older than the last if it is so by less than this, s: a sender whose clock begins anew is believed.
const OVERTAKEN_S: f64 = 1.0;
/// Datagrams that are read at once at most: whoever floods the port does not keep the console from its robots.
const AT_ONCE: usize = 100;
/// Longest datagram, bytes.
const LONGEST: usize = 1024;

/// A robot's last pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// When it came, in the session's time.
    pub at: Duration,
    pub pose: Pose,
    sent_s: Option<f64>,
}

/// Poses as they come.
pub struct Poses {
    socket: UdpSocket,
    /// Of each robot of the console.
    last: Vec<Option<Seen>>,
    /// What was said of a wrong datagram and is not said again.
    complaint: Option<String>,
}

/// What has come.
pub(super) enum Came {
    /// A pose of a robot.
    Pose(usize, Pose),
    /// Something that is none, said once.
    Wrong(String),
}

impl Poses {
    /// Listens at an address.
    ///
    /// # Errors
    /// The address is taken, or not this computer's.
    pub fn listen(address: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, last: Vec::new(), complaint: None })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// The last pose of a robot.
    pub(super) fn last(&self, robot: usize) -> Option<Seen> {
        self.last.get(robot).copied().flatten()
    }

    /// Takes what has come until now; `find` tells which robot of how many a name is.
    pub(super) fn take(
        &mut self,
        now: Duration,
        robots: usize,
        find: &dyn Fn(&str) -> Result<usize, String>,
    ) -> Vec<Came> {
        self.last.resize(robots, None);
        let mut bytes = [0; LONGEST];
        let mut came = Vec::new();
        for _ in 0..AT_ONCE {
            let (length, from) = match self.socket.recv_from(&mut bytes) {
                Ok(received) => received,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                // Nothing more, or nothing that could be mended here: poses that stay away are noticed as such.
                Err(_) => break,
            };
            match read(&bytes[..length], robots, find) {
                Ok((robot, datagram)) => came.extend(self.keep(now, robot, &datagram)),
                Err(problem) => {
                    let problem = format!("what came from {from} is no pose: {problem}");
                    if self.complaint.as_ref() != Some(&problem) {
                        self.complaint = Some(problem.clone());
                        came.push(Came::Wrong(problem));
                    }
                }
            }
        }
        came
    }

    fn keep(&mut self, now: Duration, robot: usize, datagram: &PoseDatagram) -> Option<Came> {
        let sent_s = datagram.t_s;
        let before = self.last[robot].and_then(|seen| seen.sent_s).zip(sent_s).map(|(before, sent)| before - sent);
        if before.is_some_and(|before| (0.0..OVERTAKEN_S).contains(&before)) {
            return None;
        }
        let pose = Pose { x: datagram.x_m, y: datagram.y_m, heading: common::angle::wrap(datagram.yaw_rad) };
        self.last[robot] = Some(Seen { at: now, pose, sent_s });
        Some(Came::Pose(robot, pose))
    }
}

fn read(
    bytes: &[u8],
    robots: usize,
    find: &dyn Fn(&str) -> Result<usize, String>,
) -> Result<(usize, PoseDatagram), String> {
    let datagram: PoseDatagram = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    let robot = match &datagram.robot {
        Some(name) => find(name)?,
        None if robots == 1 => 0,
        None => return Err("of which robot? There are several: `robot` is missing".into()),
    };
    Ok((robot, datagram))
}

/// As a recording has it.
pub(super) fn measured(pose: Pose) -> MeasuredPose {
    MeasuredPose { x_m: Some(pose.x), y_m: Some(pose.y), yaw_rad: Some(pose.heading) }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const NOW: Duration = Duration::from_secs(1);

    fn find(name: &str) -> Result<usize, String> {
        ["one", "two"].iter().position(|known| *known == name).ok_or_else(|| format!("there is no robot {name}"))
    }

    /// What became of datagrams that were sent one after the other.
    fn told(robots: usize, datagrams: &[&str]) -> Vec<String> {
        let mut poses = Poses::listen((Ipv4Addr::LOCALHOST, 0).into()).expect("a free port");
        let sender = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
        let to = poses.address().expect("it listens");
        for text in datagrams {
            sender.send_to(text.as_bytes(), to).expect("sent");
        }
        let came = poses.take(NOW, robots, &find).into_iter().map(|came| match came {
            Came::Pose(robot, Pose { x, y, heading }) => format!("{robot}: {x} {y} {heading}"),
            Came::Wrong(problem) => problem.split_once("no pose: ").expect("its reason").1.to_owned(),
        });
        came.collect()
    }

    #[test]
    fn poses_are_read_and_what_is_none_is_said_once() {
        let good = r#"{"x_m": 0.1, "y_m": -0.5, "yaw_rad": 0.25, "z_m": 3}"#;
        assert_eq!(told(1, &[good]), ["0: 0.1 -0.5 0.25"]);
        assert_eq!(told(2, &[good]), ["of which robot? There are several: `robot` is missing"]);
        let second = r#"{"robot": "two", "x_m": 1, "y_m": 2, "yaw_rad": 0}"#;
        assert_eq!(told(2, &[second]), ["1: 1 2 0"]);
        let nobody = r#"{"robot": "three", "x_m": 1, "y_m": 2, "yaw_rad": 0}"#;
        assert_eq!(told(2, &[nobody, nobody, second]), ["there is no robot three", "1: 1 2 0"]);
        let short = r#"{"x_m": 1, "y_m": 2}"#;
        let said = told(1, &[short, "x", ""]);
        assert!(said.len() == 3 && said[0].contains("missing field `yaw_rad`"), "{said:?}");
        // JSON has no numbers that are none.
        assert_eq!(told(1, &[r#"{"x_m": NaN, "y_m": 2, "yaw_rad": 0}"#]).len(), 1);
        assert!(!told(1, &[r#"{"x_m": 1e999, "y_m": 2, "yaw_rad": 0}"#])[0].starts_with("0:"));
    }

    #[test]
    fn what_was_overtaken_does_not_count_and_a_new_clock_does() {
        let at = |t_s: f64, x: f64| format!(r#"{{"t_s": {t_s}, "x_m": {x}, "y_m": 0, "yaw_rad": 0}}"#);
        let sent = [at(50.0, 1.0), at(49.9, 2.0), at(50.0, 3.0), at(50.1, 4.0), at(0.5, 5.0), at(0.6, 6.0)];
        let sent: Vec<&str> = sent.iter().map(String::as_str).collect();
        assert_eq!(told(1, &sent), ["0: 1 0 0", "0: 4 0 0", "0: 5 0 0", "0: 6 0 0"]);
    }
}
