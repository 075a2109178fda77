//! Why a session with a robot ends.

use std::time::Duration;

use control::protocol::dongle::Address;
use control::{Fault, Refusal, protocol};
use miette::Diagnostic;
use thiserror::Error;

/// Why a session with a robot ends.
#[derive(Debug, Error, Diagnostic)]
pub enum LinkError {
    /// The operating system refuses to read or write.
    #[error("the line to the dongle broke: {0}")]
    #[diagnostic(help("is the dongle still plugged in? Plug it in again and repeat the command"))]
    Line(#[source] std::io::Error),
    /// Nothing that could be a dongle.
    #[error("no dongle answers: {}", answered(*bytes, *bad_frames))]
    #[diagnostic(help(
        "is this the dongle's port? Put its firmware on it with `cargo flash-dongle esp32c3` (or esp32), then unplug it \
         and plug it in again"
    ))]
    NoDongle {
        /// Bytes that came.
        bytes: u64,
        /// What could not be read among them.
        bad_frames: u32,
    },
    /// Another version of the messages.
    #[error("the dongle speaks version {dongle:08x} of the messages, this program version {:08x}", protocol::VERSION)]
    #[diagnostic(help(
        "build both from one state of the project: `cargo flash-dongle esp32c3` (or esp32), and `cargo flash-robot` for \
         the robot"
    ))]
    Version {
        /// Protocol version of the dongle.
        dongle: u32,
    },
    /// The dongle has stopped answering.
    #[error("the dongle has been silent for {:.1} s", silent.as_secs_f64())]
    #[diagnostic(help("unplug the dongle, plug it in again and repeat the command"))]
    DongleSilent {
        /// Time without a frame.
        silent: Duration,
    },
    /// The robots obey another dongle.
    #[error(
        "this is dongle {}; the robots whose keys are here obey dongle {}",
        super::address(dongle),
        super::address(paired)
    )]
    #[diagnostic(help("plug that one in, or pair the robots with this one: `scram pair`"))]
    OtherDongle {
        /// The one that is plugged in.
        dongle: Address,
        /// The one of the keys.
        paired: Address,
    },
    /// A robot whose keys are not here, or that does not keep them.
    #[error("robot {} is not paired with this console", super::address(address))]
    #[diagnostic(help(
        "pair it over its USB cable: `scram pair`; if that is what failed, stop its motor first, and flash it with this \
         project's partitions.csv"
    ))]
    NotPaired {
        /// Address of the robot.
        address: Address,
    },
    /// A robot of another version.
    #[error(
        "robot {} speaks version {robot:08x} of the messages, this program version {:08x}",
        super::address(address),
        protocol::VERSION
    )]
    #[diagnostic(help("build all from one state of the project: `cargo flash-robot esp32` (or esp32c3)"))]
    RobotVersion {
        /// Address of the robot.
        address: Address,
        /// Protocol version of the robot.
        robot: u32,
    },
    /// The robot on the cable is of another version.
    #[error("the robot speaks version {robot:08x} of the messages, this program version {:08x}", protocol::VERSION)]
    #[diagnostic(help("build both from one state of the project: `cargo flash-robot esp32` (or esp32c3)"))]
    CabledVersion {
        /// Protocol version of the robot.
        robot: u32,
    },
    /// Nothing that could be a robot.
    #[error("no robot answers on this port")]
    #[diagnostic(help(
        "is this the robot's own USB cable? Put its firmware on it with `cargo flash-robot esp32` (or esp32c3), then press \
         its reset button"
    ))]
    NoCabledRobot,
    /// No robot, or not the one that was named.
    #[error("{wanted} does not answer on channel {channel}; {others}")]
    #[diagnostic(help(
        "is the battery in, and does the robot's LED flash? Is it paired with this console (`scram pair`)? Robot and dongle \
         must be of one version and on one channel"
    ))]
    NoRobot {
        /// Name or address that was asked for.
        wanted: String,
        /// The dongle's channel.
        channel: u8,
        /// What was heard, in words.
        others: String,
    },
    /// More than one robot, and none was named.
    #[error("more than one robot is heard: {robots}")]
    #[diagnostic(help("name one with --address, or switch the others off"))]
    ManyRobots {
        /// Names of the robots that are heard.
        robots: String,
    },
    /// The robot has stopped sending.
    #[error("the robot has been silent for {:.1} s", silent.as_secs_f64())]
    #[diagnostic(help("its battery, its range, or its supply under load: is the LED still on?"))]
    RobotSilent {
        /// Time without a frame.
        silent: Duration,
    },
    /// Its tick numbers went back.
    #[error("the robot restarted in the middle: {}", why.unwrap_or("it did not say why"))]
    #[diagnostic(help(
        "a restart when the motor starts is a supply that breaks down: charge the battery, shorten its wires, check the \
         capacitor at the bridge"
    ))]
    RobotRestarted {
        /// Reason that the robot gives.
        why: Option<&'static str>,
    },
    /// The supervisor cut the bridge.
    #[error("the robot stopped itself: {}", super::fault(*fault).0)]
    #[diagnostic(help("{}", super::fault(*fault).1))]
    Fault {
        /// Cause of the fault.
        fault: Fault,
    },
    /// The robot says no.
    #[error("the robot refuses: {}", super::refusal(*refusal))]
    #[diagnostic(help("{}", refusal_help(*refusal)))]
    Refused {
        /// Why the robot refuses.
        refusal: Refusal,
    },
    /// It hears and does not drive.
    #[error("the robot answers, but its bridge {what}")]
    #[diagnostic(help(
        "is another computer commanding the same robot? Is its firmware of the same version as this program?"
    ))]
    NotDriving {
        /// Does not switch on, or was switched off.
        what: &'static str,
    },
    /// The robot's name is not the robot file's.
    #[error("the robot that answers is `{name}`; the robot file describes `{expected}`")]
    #[diagnostic(help("name its own file with --robot, or another robot with --address"))]
    OtherRobot {
        /// Name that the robot gives.
        name: String,
        /// What the file says.
        expected: String,
    },
    /// Its ticks are not those of the robot file.
    #[error("a tick of the robot lasts {measured_ms:.2} ms; by the robot file it is {expected_ms:.2} ms")]
    #[diagnostic(help("the robot's firmware was built from another robot file: name that one with --robot"))]
    OtherTick {
        /// By this computer's clock.
        measured_ms: f64,
        /// Control period of the robot file, ms.
        expected_ms: f64,
    },
    /// A person said stop.
    #[error("stopped on request")]
    Cancelled,
}

fn answered(bytes: u64, bad_frames: u32) -> String {
    match (bytes, bad_frames) {
        (0, _) => "not a byte came".to_owned(),
        (_, 0) => format!("{bytes} bytes came, but no whole message"),
        _ => format!("{bytes} bytes came, which are no dongle's messages of this version"),
    }
}

fn refusal_help(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::Faulted(fault) | Refusal::CausePersists(fault) => super::fault(fault).1,
        Refusal::NoGait => "`gait NAME` sends the robot the gait of a file, with its motor off, and plays it",
        Refusal::GaitName | Refusal::UnevenInterval { .. } => "docs/gaits.md says what a gait's file holds",
        _ => "the limits are in [controller] of the robot file from which its firmware was built",
    }
}
