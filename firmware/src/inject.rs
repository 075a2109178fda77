//! What an image with fault injection does to itself on request: see [`shell::inject`].

use core::hint::black_box;

use control::protocol::radio::Crash;
use esp_hal::gpio::{AnyPin, Pin};
use esp_hal::time::{Duration, Instant};
use portable_atomic::{AtomicU8, Ordering};
use shell::inject::FaultInjector;

/// Printed at the start, and what `cargo images` looks for: no image that is handed out has it.
pub const NOTICE: &str = "FAULT INJECTION BUILT IN: this image breaks itself on request, it is for bring-up only";

/// Number of the LED's pin.
static LED: AtomicU8 = AtomicU8::new(0);

/// The processor, and the LED's pin as a sign for an oscilloscope.
#[derive(Clone, Copy)]
pub struct ImageFaultInjector;

impl ImageFaultInjector {
    /// The LED is on this pin. Called once, before anything is asked for.
    pub fn take_led(pin: &AnyPin<'static>) {
        LED.store(pin.number(), Ordering::Relaxed);
    }
}

impl FaultInjector for ImageFaultInjector {
    /// The LED is lit while the robot drives.
    fn mark(&mut self) {
        esp_hal::peripherals::GPIO::regs().out_w1tc().write(|w| {
            // SAFETY: any bits may be written; each one set makes its pin low, and this is the LED's.
            unsafe { w.bits(1 << LED.load(Ordering::Relaxed)) }
        });
    }

    fn block(&mut self, for_us: u64) {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_micros(for_us) {}
    }

    fn crash(&mut self, how: Crash) -> ! {
        match how {
            Crash::Panic => {}
            Crash::StackOverflow => _ = black_box(deeper(0)),
            Crash::Exception => {
                let nowhere: *const u32 = black_box(core::ptr::null());
                // SAFETY: there is nothing there: the processor's exception is what is wanted, and nothing uses what is read.
                let _ = black_box(unsafe { nowhere.read_volatile() });
            }
        }
        // The only way of the first, and what is left of the others where the chip lets them pass.
        panic!("asked for: {how:?}")
    }
}

/// Uses stack until there is none.
#[inline(never)]
#[expect(unconditional_recursion, reason = "that is what it is for")]
fn deeper(depth: u32) -> u32 {
    let frame = black_box([depth; 16]);
    deeper(depth.wrapping_add(1)).wrapping_add(black_box(frame)[0])
}
