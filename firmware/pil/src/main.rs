//! The decisions as RISC-V machine code (RV32IMC, the ESP32-C3's instruction set) on QEMU's `virt` machine, asked over
//! its serial port by the host with the simulated plant: see [`control::protocol::lockstep`].

#![no_std]
#![no_main]

mod machine;
mod meter;

use control::protocol::frame::{Deframer, LONGEST, encode};
use control::protocol::lockstep::{QuestionFrame, Server};

use crate::meter::Instructions;

/// Answers for ever.
#[riscv_rt::entry]
fn main() -> ! {
    let mut uart = machine::uart();
    let mut deframer = Deframer::default();
    let mut server = Server::new(Instructions::new());
    let mut received = [0; 64];
    let mut frame = [0; LONGEST + 1];
    let mut idle = 0;
    loop {
        let count = uart.receive_bytes(&mut received);
        idle = if count == 0 { idle + 1 } else { 0 };
        if idle > 0 {
            machine::rest();
        }
        if idle > machine::PATIENCE {
            machine::end(machine::FORSAKEN);
        }
        for byte in received.iter().take(count) {
            // The deframer counts what is no request; the host hears of it in the next reply.
            if let Some(Ok(request)) = deframer.push::<QuestionFrame>(*byte)
                && let Ok(frame) = encode(&server.serve(&request, deframer.bad()), &mut frame)
            {
                uart.send_bytes_exact(frame);
            }
        }
    }
}
