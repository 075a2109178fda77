//! Hardware in the loop: the decisions on the board, asked over its serial line by `scram hil --port`, which has the
//! simulated plant. No robot, no radio, no interrupt: the cycles that it counts are the decisions' alone.

#![no_std]
#![no_main]

use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::lockstep::{Cost, Meter, QuestionFrame, Server, Target};
use embedded_io::{Read, Write};
use esp_hal::clock::CpuClock;
use esp_hal::{Config, main};
// Linked for the radio's driver, which is in the same library and asks for it before the linker throws both away.
use esp_rtos as _;
use firmware::board;

esp_bootloader_esp_idf::esp_app_desc!();

#[main]
fn main() -> ! {
    board::cut_bridge();
    let mut serial = board::lockstep_serial(esp_hal::init(Config::default().with_cpu_clock(CpuClock::max())));
    let mut deframer = Deframer::default();
    let mut server = Server::new(Cycles::new());
    let mut received = [0; 64];
    let mut frame = [0; LONGEST + 1];
    loop {
        // The ESP32's UART has methods of its own by these names, with other errors: the traits' are meant.
        // A byte that was garbled on the line is a bad frame, which the host hears of in the next reply.
        let count = Read::read(&mut serial, &mut received).unwrap_or(0);
        for byte in received.iter().take(count) {
            if let Some(Ok(request)) = deframer.push::<QuestionFrame>(*byte)
                && let Ok(frame) = encode(&server.serve(&request, deframer.bad()), &mut frame)
            {
                // A reply that does not get through is asked for again.
                let _ = serial.write_all(frame).and_then(|()| Write::flush(&mut serial));
            }
        }
    }
}

/// Counts processor cycles.
struct Cycles;

impl Cycles {
    fn new() -> Self {
        board::start_cycles();
        Self
    }
}

impl Meter for Cycles {
    const TARGET: Target = board::TARGET;

    fn measure<R>(&mut self, tick: impl FnOnce() -> R) -> (R, Cost) {
        let before = board::cycles();
        let result = tick();
        (result, Cost { time: board::cycles().wrapping_sub(before), stack: 0 })
    }
}
