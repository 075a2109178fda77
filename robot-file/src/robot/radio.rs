//! `[radio]`: the ESP-NOW link as the simulated air has it.

use super::Quantity;
use crate::schema::table;

table! {
    /// `[radio]`
    ///
    /// Shares are of frames, 0 … 1. A frame is lost in bursts: two states, in a burst and out of it, of exponential length
    /// (Gilbert 1960, Elliott 1963).
    pub struct Radio {
        /// Wi-Fi channel of everybody.
        channel: Quantity = 1.0..=13.0,
        /// Bit rate of a frame to one station: one of 802.11b or 802.11g.
        unicast_bit_per_s: Quantity = 1e6..=54e6,
        /// Bit rate of a frame to everybody.
        broadcast_bit_per_s: Quantity = 1e6..=54e6,
        /// Tries after the first of a frame to one station, until it is acknowledged.
        retries: Quantity = 0.0..=31.0,
        /// Shortest time that the chips' software takes for a frame, sender and receiver together.
        handling_least_s: Quantity = 0.0..=0.1,
        /// Longest time that it takes, but for the tail.
        handling_most_s: Quantity = 0.0..=0.1,
        /// Share of frames that the software delays longer: the tail.
        tail_share: Quantity = 0.0..=1.0,
        /// Shortest delay in the tail.
        tail_least_s: Quantity = 0.0..=10.0,
        /// Longest delay in the tail.
        tail_most_s: Quantity = 0.0..=10.0,
        /// Share of sends whose callback comes late, after the frame.
        late_callback_share: Quantity = 0.0..=1.0,
        /// Shortest delay of a late callback.
        late_callback_least_s: Quantity = 0.0..=10.0,
        /// Longest delay of a late callback.
        late_callback_most_s: Quantity = 0.0..=10.0,
        /// Share of tries that are lost in the long run.
        loss_share: Quantity = 0.0..=1.0,
        /// Share of tries that are lost out of a burst.
        quiet_loss_share: Quantity = 0.0..=1.0,
        /// Share of tries that are lost in a burst.
        burst_loss_share: Quantity = 0.0..=1.0,
        /// Mean length of a burst; 0 for tries that are lost independently.
        burst_s: Quantity = 0.0..=100.0,
        /// Share of frames that arrive twice.
        duplicate_share: Quantity = 0.0..=1.0,
        /// Share of frames that the receiver's software holds back, so that later ones may overtake them.
        reorder_share: Quantity = 0.0..=1.0,
        /// How long it holds them back.
        reorder_hold_s: Quantity = 0.0..=10.0,
        /// Share of frames that arrive with wrong bits, undetected by the radio's own checksum.
        corruption_share: Quantity = 0.0..=1.0,
        /// Frames that wait for the receiver's program; beyond, the oldest is dropped.
        receive_queue: Quantity = 1.0..=1000.0,
        /// Strength of the signal at 1 m, transmit power and both antennas in it.
        strength_1m_dbm: Quantity = -100.0..=30.0,
        /// Path-loss exponent n: the strength falls by 10·n dB in a decade of distance.
        path_loss_exponent: Quantity = 1.0..=6.0,
        /// Fading: standard deviation of the strength.
        fading_db: Quantity = 0.0..=20.0,
        /// Weaker frames are not received.
        sensitivity_dbm: Quantity = -130.0..=0.0,
    }
}

/// Bit rates of 802.11b (DSSS, CCK) and 802.11g (OFDM), 1/s.
pub(super) const BIT_RATES: [f64; 12] = [1e6, 2e6, 5.5e6, 11e6, 6e6, 9e6, 12e6, 18e6, 24e6, 36e6, 48e6, 54e6];
