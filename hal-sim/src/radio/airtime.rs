//! How long a frame keeps the channel busy: IEEE 802.11-2020, DSSS and CCK (802.11b) and OFDM (802.11g). µs and bytes.

/// Bytes around a payload: MAC header 24, category 1, identifier 3, random 4, element 7, checksum 4 (ESP-IDF, "ESP-NOW").
const ENVELOPE: usize = 43;
/// Bytes of CCMP around an encrypted frame: header 8, integrity code 8.
const CCMP: usize = 16;
/// Bytes of an acknowledgement.
const ACKNOWLEDGEMENT: usize = 14;
/// Between a frame and its acknowledgement.
const SIFS_US: f64 = 10.0;
/// The contention window does not grow beyond this.
const LARGEST_WINDOW: u32 = 1023;

/// A bit rate with the times of its kind of modulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    bit_per_us: f64,
    ofdm: bool,
}

impl Rate {
    /// Of a bit rate, bit/s: one of 802.11b's (1, 2, 5.5, 11 Mb/s), or else 802.11g's.
    #[must_use]
    pub fn new(bit_per_s: f64) -> Self {
        Self { bit_per_us: bit_per_s * 1e-6, ofdm: ![1e6, 2e6, 5.5e6, 11e6].contains(&bit_per_s) }
    }

    /// A frame of ESP-NOW with its preamble. What goes to one station is encrypted, what goes to everybody cannot be.
    #[must_use]
    pub fn frame_us(self, payload: usize, encrypted: bool) -> f64 {
        self.bytes_us(ENVELOPE + payload + if encrypted { CCMP } else { 0 })
    }

    /// From the end of a frame to the end of its acknowledgement, which comes at the lowest rate of its kind. The sender
    /// waits as long for one that does not come.
    #[must_use]
    pub fn acknowledgement_us(self) -> f64 {
        SIFS_US + Self::new(if self.ofdm { 6e6 } else { 1e6 }).bytes_us(ACKNOWLEDGEMENT)
    }

    /// From a free channel to the frame, when the draw is the least: the distributed interframe space.
    #[must_use]
    pub fn spacing_us(self) -> f64 {
        SIFS_US + 2.0 * self.slot_us()
    }

    /// One slot of the backoff.
    #[must_use]
    pub fn slot_us(self) -> f64 {
        if self.ofdm { 9.0 } else { 20.0 }
    }

    /// The backoff is a whole number of slots below this, for a frame that was tried so often before.
    #[must_use]
    pub fn window(self, tries_before: u32) -> u32 {
        let first: u32 = if self.ofdm { 16 } else { 32 };
        first.saturating_mul(1 << tries_before.min(10)).min(LARGEST_WINDOW + 1)
    }

    fn bytes_us(self, bytes: usize) -> f64 {
        let bits = 8.0 * bytes as f64;
        if self.ofdm {
            // Preamble and SIGNAL 20 µs; symbols of 4 µs with 16 bits of SERVICE and 6 of tail; 6 µs for 802.11b's sake.
            20.0 + 4.0 * ((22.0 + bits) / (4.0 * self.bit_per_us)).ceil() + 6.0
        } else {
            192.0 + bits / self.bit_per_us
        }
    }
}
