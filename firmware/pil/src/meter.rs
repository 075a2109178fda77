//! Instructions and stack of a tick.

use core::arch::asm;
use core::hint::black_box;

use control::protocol::lockstep::{Cost, Meter, Target};
use riscv::register::minstret;

/// Bytes of free stack that are painted before a tick, several times what it takes. A tick that took more would show as
/// exactly this.
const PAINTED: usize = 2 * 1024;
const PAINT: u32 = 0xA5C3_96E1;

/// Counts retired instructions and looks how deep the stack was.
pub struct Instructions {
    /// What measuring nothing costs.
    overhead: u32,
}

impl Instructions {
    /// Measures its own overhead.
    pub fn new() -> Self {
        let (_, overhead) = count(|| black_box(()));
        Self { overhead }
    }
}

impl Meter for Instructions {
    const TARGET: Target = Target::Rv32;

    fn measure<R>(&mut self, tick: impl FnOnce() -> R) -> (R, Cost) {
        paint();
        let (result, count) = count(tick);
        (result, Cost { time: count.saturating_sub(self.overhead), stack: depth() })
    }
}

#[inline(always)]
fn count<R>(work: impl FnOnce() -> R) -> (R, u32) {
    let before = minstret::read();
    let result = run(work);
    let after = minstret::read();
    (result, after.wrapping_sub(before) as u32)
}

/// A frame of its own, so that all of the work's stack lies below that of the measuring.
#[inline(never)]
fn run<R>(work: impl FnOnce() -> R) -> R {
    work()
}

/// Paints the free stack. In assembly, and inlined like `depth`, because a frame of its own would lie in what it paints.
#[inline(always)]
fn paint() {
    // SAFETY: nothing is kept below the stack pointer, no interrupt is enabled, and far more than this is free there.
    unsafe {
        asm!(
            "sub {at}, sp, {size}",
            "2:",
            "sw {paint}, 0({at})",
            "addi {at}, {at}, 4",
            "bltu {at}, sp, 2b",
            at = out(reg) _,
            size = in(reg) PAINTED,
            paint = in(reg) PAINT,
            options(nostack)
        );
    }
}

/// How far down the paint is gone, bytes.
#[inline(always)]
fn depth() -> u32 {
    let depth;
    // SAFETY: reads memory only, the same as `paint` wrote.
    unsafe {
        asm!(
            "sub {at}, sp, {size}",
            "2:",
            "lw {word}, 0({at})",
            "bne {word}, {paint}, 3f",
            "addi {at}, {at}, 4",
            "bltu {at}, sp, 2b",
            "3:",
            "sub {at}, sp, {at}",
            at = out(reg) depth,
            word = out(reg) _,
            size = in(reg) PAINTED,
            paint = in(reg) PAINT,
            options(nostack, readonly)
        );
    }
    depth
}
