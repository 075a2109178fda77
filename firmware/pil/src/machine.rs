//! QEMU's `virt` machine: a 16550 and the device that ends the emulation.

use core::num::NonZero;
use core::panic::PanicInfo;
use core::ptr;

use uart_16550::backend::MmioBackend;
use uart_16550::{Config, Uart16550};

/// Addresses of `hw/riscv/virt.c`.
const UART: NonZero<usize> = NonZero::new(0x1000_0000).expect("not zero");
const TEST_DEVICE: usize = 0x10_0000;
/// What the test device takes for "end with the code in the upper half".
const FAIL: u32 = 0x3333;

/// Codes that QEMU ends with; `host/scram/src/hil/qemu.rs` reads them.
const PANICKED: u32 = 101;
const TRAPPED: u32 = 102;
/// Nobody asks any more: whoever started QEMU was killed, and it would run for ever.
pub const FORSAKEN: u32 = 103;
/// Looks for a byte without one, some minutes.
pub const PATIENCE: u32 = 20_000_000;
/// Instructions between two looks. Every look takes the lock under which QEMU brings bytes: without a pause it comes to
/// that late, and on a busy computer not for seconds.
const PAUSE: u32 = 1000;

/// The serial port, 14 bytes in its FIFO at a time.
pub fn uart() -> Uart16550<MmioBackend> {
    // SAFETY: the `virt` machine has a 16550 with byte-wide registers there, and nothing else here touches it.
    let mut uart = unsafe { Uart16550::new_mmio_from_address(UART, 1) }.expect("the address has room for registers");
    uart.init(Config::DEFAULT).expect("QEMU has a 16550 here");
    uart
}

/// Leaves QEMU alone for some microseconds.
pub fn rest() {
    riscv::asm::delay(PAUSE);
}

/// Ends QEMU with an exit code: nobody looks at a machine that hangs.
pub fn end(code: u32) -> ! {
    let device = ptr::with_exposed_provenance_mut::<u32>(TEST_DEVICE);
    // SAFETY: the `virt` machine's test device takes a word there and ends the emulation.
    unsafe { device.write_volatile(code << 16 | FAIL) };
    loop {
        riscv::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    end(PANICKED)
}

// SAFETY: riscv-rt's name for what handles every exception.
#[unsafe(export_name = "ExceptionHandler")]
fn exception(_: &riscv_rt::TrapFrame) -> ! {
    end(TRAPPED)
}
