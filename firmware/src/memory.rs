//! The radio's heap, and what can be on it at the same time, whatever is sent to the chip.
//!
//! Nothing of ours is on it, and nothing of ours takes from it for a frame that comes in: [`shell::inbox`] is static. What is left:
//!
//! | what | when | bound | bytes each |
//! |---|---|---|---|
//! | driver, its tasks' stacks and keys, the tasks of esp-rtos | from the start | [`AT_START`] | |
//! | receive buffers of the hardware | from the start | [`STATIC_RX`] | 1600 |
//! | the driver's copies of frames that are neither ESP-NOW's nor short | until it has looked at them | [`DYNAMIC_RX`] | up to 1600 and 200 of its own |
//! | messages that are sent, and those that the driver has lost track of | until the callback, or for good | [`DYNAMIC_TX`] | ours (250), the envelope, 200 of its own |
//! | the driver's copy of one ESP-NOW frame | while it calls [`crate::radio`] | 1 | up to 1600 |
//!
//! Read in the driver's libraries (esp-wifi-sys 0.3.0: `esf_buf_setup` takes 0x640 bytes a static buffer, `esf_buf_alloc_dynamic`
//! the frame, a header and 0x64, and nothing beyond its limits; `ieee80211_recv_action_vendor_esp_now` copies the frame, calls back
//! and frees it) and not measured. [`AT_START`] is esp-radio's own measurement. An allocation that fails in the driver's libraries
//! drops the frame; one that fails in Rust resets the chip, and there is none left after the start.

use control::protocol::radio::LONGEST;

/// Room for all of it, bytes.
pub const HEAP_BYTES: usize = 72 * 1024;
/// Receive buffers of the hardware. esp-radio's choice of 10 is for streams of data.
pub const STATIC_RX: u8 = 6;
/// Copies of received frames: no fewer than the hardware's buffers, as ESP-IDF asks for. esp-radio's choice of 32 is more than the
/// heap holds.
pub const DYNAMIC_RX: u16 = 6;
/// Messages underway. We have one; the others are there for those that the driver is reported to lose ([`shell::bounded`]).
pub const DYNAMIC_TX: u16 = 16;

/// A receive buffer of the hardware.
const RX_BUFFER: usize = 1600;
/// What the driver adds to a buffer of its own, and the allocator to that.
const OVERHEAD: usize = 200;
/// Header and checksum of an ESP-NOW frame (43), and its encryption's (16).
const ENVELOPE: usize = 59;
/// The most that esp-radio 1.0.0-beta.1 has measured for a station with its own settings (documentation of `esp_radio::wifi`: 47 to 57
/// kB), without the ten receive buffers in it.
const AT_START: usize = 57_000 - 10 * RX_BUFFER;

/// The most that can be on the heap, bytes.
pub const WORST_CASE: usize = AT_START
    + STATIC_RX as usize * RX_BUFFER
    + DYNAMIC_RX as usize * (RX_BUFFER + OVERHEAD)
    + DYNAMIC_TX as usize * (LONGEST + ENVELOPE + OVERHEAD)
    + RX_BUFFER;

const _: () = assert!(WORST_CASE <= HEAP_BYTES, "a flood of frames can fill the radio's heap");

/// Heap and worst case, bytes, for `cargo images`, which finds them in the image by this name.
// SAFETY: no other item has the name.
#[unsafe(no_mangle)]
#[used]
static SCRAM_RADIO_HEAP: [u32; 2] = [HEAP_BYTES as u32, WORST_CASE as u32];

/// The least that was free of the heap since boot, bytes.
#[must_use]
pub fn least_free() -> u32 {
    let stats = esp_alloc::HEAP.stats();
    u32::try_from(stats.size.saturating_sub(stats.max_usage)).unwrap_or(u32::MAX)
}
