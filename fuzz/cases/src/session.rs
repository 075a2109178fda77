//! Anything from a dongle and a robot at a console: any bytes on the line, any message of the dongle, any radio frame, and
//! anything that the paired robot can seal.

use std::time::Duration;

use control::protocol::dongle::FromDongle;
use control::protocol::radio::Uplink;
use scram::console::runner::robot_state;

use crate::bytes::Bytes;
use crate::scripted_peer::console;

const MOST_STEPS: u32 = 200;
/// Until the session lives.
const GREETING: u32 = 20;
/// What a person may type meanwhile.
const LINES: [&str; 8] =
    ["freq 7", "stop", "set frequency_hz 9; undo", "get frequency_hz", "save", "status; list", "clear", "stop all"];

/// Runs the commands.
pub fn session(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let (mut console, cable) = console();
    for _ in 0..GREETING {
        console.poll().expect("a good beginning");
    }
    for _ in 0..MOST_STEPS {
        let Some(command) = bytes.next() else { break };
        match command % 8 {
            0..=2 => {
                if let Some(uplink) = bytes.message::<Uplink>() {
                    cable.scripted_peer().robot(&uplink);
                }
            }
            3 => {
                // Of another version it ends the session: that is for an input's end.
                if let Some(message) = bytes.message::<FromDongle>() {
                    cable.scripted_peer().dongle(&message);
                }
            }
            4 => cable.scripted_peer().bytes(bytes.some()),
            5 => cable.scripted_peer().radio(bytes.some()),
            6 => drop(console.submit(LINES[usize::from(bytes.u8()) % LINES.len()])),
            _ => cable.scripted_peer().wait(Duration::from_millis(u64::from(bytes.u8()))),
        }
        for _ in 0..=command / 64 {
            if console.poll().is_err() {
                return;
            }
        }
        let state = robot_state(&console, 0).expect("there is one robot");
        assert!(state.loss.is_none_or(|loss| (0.0..=1.0).contains(&loss)), "a loss of {:?}", state.loss);
    }
    console.finish();
}
