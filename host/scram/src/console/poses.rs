//! Where the robots are, told from outside by UDP: by motion capture, a camera over the ground, or a simulation.
//!
//! A pose is a datagram, a JSON object: `{"robot": "scram-26", "t_s": 12.34, "x_m": 0.1, "y_m": -0.02, "yaw_rad": 1.57}`.

use std::io::{self, ErrorKind};
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;

use common::angle::wrap;
use serde::{Deserialize, Serialize};
use tasks::Pose;

/// A pose as it is sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseDatagram {
    /// The robot's name or address; may be missing where the console has one robot only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Time of the measurement on the sender's clock, s. One that is not later than the last does not count: it was overtaken on its way, or
    /// is repeated by a sender that has lost the robot. One that is a second or more earlier is of a clock that has begun anew.
    pub t_s: f64,
    /// x of the mean of the modules' centres over the ground, m.
    pub x_m: f64,
    /// y of it, m.
    pub y_m: f64,
    /// Heading, from the last module to the first, rad, counter-clockwise.
    pub yaw_rad: f64,
}

/// A pose is older than the last if it is so by less than this, s: a sender whose clock begins anew is believed.
const OVERTAKEN_S: f64 = 1.0;
/// Farthest that a robot is believed to be, m; and most that it has turned, rad.
const FARTHEST: f64 = 1000.0;
/// Between two words about datagrams that are no pose.
const BETWEEN_COMPLAINTS: Duration = Duration::from_secs(5);
/// Datagrams that are read at once at most: whoever floods the port does not keep the console from its robots.
const AT_ONCE: usize = 100;
/// Longest datagram, bytes.
const LONGEST: usize = 1024;

/// A pose of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Received {
    /// When it came, in the session's time.
    pub at: Duration,
    /// When it was measured, on the sender's clock, s.
    pub measured_s: f64,
    pub pose: Pose,
}

/// Poses as they come.
pub struct Poses {
    socket: UdpSocket,
    /// Of each robot of the console.
    last: Vec<Option<Received>>,
    /// When a wrong datagram was last complained of.
    complained: Option<Duration>,
}

/// What has come.
pub(super) enum News {
    /// A pose of a robot.
    Pose(usize, Received),
    /// Something that is none.
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
        Ok(Self { socket, last: Vec::new(), complained: None })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// The system's.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// The last pose of a robot.
    pub(super) fn last(&self, robot: usize) -> Option<Received> {
        self.last.get(robot).copied().flatten()
    }

    /// Takes what has come until now; `find` tells which robot of how many a name is. Of what is no pose, some is said.
    pub(super) fn receive(
        &mut self,
        now: Duration,
        robots: usize,
        find: &dyn Fn(&str) -> Result<usize, String>,
    ) -> Vec<News> {
        self.last.resize(robots, None);
        let mut bytes = [0; LONGEST];
        let mut news = Vec::new();
        for _ in 0..AT_ONCE {
            let (length, from) = match self.socket.recv_from(&mut bytes) {
                Ok(received) => received,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                // Nothing more, or nothing that could be mended here: poses that stay away are noticed as such.
                Err(_) => break,
            };
            match read(&bytes[..length], robots, find) {
                Ok((robot, datagram)) => news.extend(self.keep(now, robot, &datagram)),
                Err(problem) => {
                    if self.complained.is_none_or(|last| now.saturating_sub(last) >= BETWEEN_COMPLAINTS) {
                        self.complained = Some(now);
                        news.push(News::Wrong(format!("what came from {from} is no pose: {problem}")));
                    }
                }
            }
        }
        news
    }

    fn keep(&mut self, now: Duration, robot: usize, datagram: &PoseDatagram) -> Option<News> {
        let measured_s = datagram.t_s;
        if self.last[robot].is_some_and(|last| (0.0..OVERTAKEN_S).contains(&(last.measured_s - measured_s))) {
            return None;
        }
        let pose = Pose { x: datagram.x_m, y: datagram.y_m, heading: wrap(datagram.yaw_rad) };
        let received = Received { at: now, measured_s, pose };
        self.last[robot] = Some(received);
        Some(News::Pose(robot, received))
    }
}

fn read(
    bytes: &[u8],
    robots: usize,
    find: &dyn Fn(&str) -> Result<usize, String>,
) -> Result<(usize, PoseDatagram), String> {
    let datagram: PoseDatagram = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    let numbers = [("x_m", datagram.x_m), ("y_m", datagram.y_m), ("yaw_rad", datagram.yaw_rad)];
    if let Some((name, value)) = numbers.into_iter().find(|(_, value)| value.abs() > FARTHEST) {
        return Err(format!("{name} is {value}: expected metres and radians, at most {FARTHEST}"));
    }
    let robot = match &datagram.robot {
        Some(name) => find(name)?,
        None if robots == 1 => 0,
        None => return Err("of which robot? There are several: `robot` is missing".into()),
    };
    Ok((robot, datagram))
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
        let news = poses.receive(NOW, robots, &find).into_iter().map(|news| match news {
            News::Pose(robot, Received { pose: Pose { x, y, heading }, .. }) => format!("{robot}: {x} {y} {heading}"),
            News::Wrong(problem) => problem.split_once("no pose: ").expect("its reason").1.to_owned(),
        });
        news.collect()
    }

    #[test]
    fn poses_are_read_and_what_is_none_is_said_now_and_then() {
        let good = r#"{"t_s": 1, "x_m": 0.1, "y_m": -0.5, "yaw_rad": 0.25, "z_m": 3}"#;
        assert_eq!(told(1, &[good]), ["0: 0.1 -0.5 0.25"]);
        assert_eq!(told(2, &[good]), ["of which robot? There are several: `robot` is missing"]);
        let second = r#"{"robot": "two", "t_s": 1, "x_m": 1, "y_m": 2, "yaw_rad": 0}"#;
        assert_eq!(told(2, &[second]), ["1: 1 2 0"]);
        let nobody = r#"{"robot": "three", "t_s": 1, "x_m": 1, "y_m": 2, "yaw_rad": 0}"#;
        // Of a stream of what is none the log would have room for nothing else.
        assert_eq!(told(2, &[nobody, "x", nobody, second]), ["there is no robot three", "1: 1 2 0"]);
        for (text, part) in [
            (r#"{"t_s": 1, "x_m": 1, "y_m": 2}"#, "missing field `yaw_rad`"),
            (r#"{"x_m": 1, "y_m": 2, "yaw_rad": 0}"#, "missing field `t_s`"),
            (r#"{"t_s": 1, "x_m": NaN, "y_m": 2, "yaw_rad": 0}"#, "expected value"),
            (r#"{"t_s": 1, "x_m": 1e308, "y_m": 2, "yaw_rad": 0}"#, "expected metres and radians"),
            (r#"{"t_s": 1, "x_m": 1e999, "y_m": 2, "yaw_rad": 0}"#, "number out of range"),
            ("", "EOF"),
        ] {
            let said = told(1, &[text]);
            assert!(said.len() == 1 && said[0].contains(part), "{text}: {said:?}");
        }
    }

    #[test]
    fn what_was_overtaken_or_repeated_does_not_count_and_a_new_clock_does() {
        let at = |t_s: f64, x: f64| format!(r#"{{"t_s": {t_s}, "x_m": {x}, "y_m": 0, "yaw_rad": 0}}"#);
        let sent = [at(50.0, 1.0), at(49.9, 2.0), at(50.0, 3.0), at(50.1, 4.0), at(0.5, 5.0), at(0.6, 6.0)];
        let sent: Vec<&str> = sent.iter().map(String::as_str).collect();
        assert_eq!(told(1, &sent), ["0: 1 0 0", "0: 4 0 0", "0: 5 0 0", "0: 6 0 0"]);
    }
}
