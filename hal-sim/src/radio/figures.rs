//! The numbers in force: those of the robot file, and what a [`Trouble`] makes of them. µs.

use robot_file::robot::{Quantity, Radio};

use super::airtime::Rate;
use super::loss::Loss;
use super::trouble::Trouble;

/// A delay that some have: its share, and its ends, µs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tail {
    pub share: f64,
    pub least_us: f64,
    pub most_us: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Figures {
    pub unicast: Rate,
    pub broadcast: Rate,
    pub retries: u32,
    pub handling_least_us: f64,
    pub handling_most_us: f64,
    pub extra_delay_us: u64,
    pub tail: Tail,
    pub late_callback: Tail,
    pub loss: Loss,
    pub silence: bool,
    pub duplicate_share: f64,
    pub reorder_share: f64,
    pub reorder_hold_us: u64,
    pub corruption_share: f64,
    pub receive_queue: usize,
    pub strength_1m_dbm: f64,
    pub path_loss_exponent: f64,
    pub fading_db: f64,
    pub sensitivity_dbm: f64,
}

impl Figures {
    pub fn new(radio: &Radio) -> Self {
        let us = |quantity: &Quantity| quantity.value * 1e6;
        let tail = |share: &Quantity, least: &Quantity, most: &Quantity| Tail {
            share: share.value,
            least_us: us(least),
            most_us: us(most),
        };
        let (late, least, most) =
            (&radio.late_callback_share, &radio.late_callback_least_s, &radio.late_callback_most_s);
        Self {
            unicast: Rate::new(radio.unicast_bit_per_s.value),
            broadcast: Rate::new(radio.broadcast_bit_per_s.value),
            retries: radio.retries.value as u32,
            handling_least_us: us(&radio.handling_least_s),
            handling_most_us: us(&radio.handling_most_s),
            extra_delay_us: 0,
            tail: tail(&radio.tail_share, &radio.tail_least_s, &radio.tail_most_s),
            late_callback: tail(late, least, most),
            loss: Loss {
                share: radio.loss_share.value,
                quiet_share: radio.quiet_loss_share.value,
                burst_share: radio.burst_loss_share.value,
                burst_us: us(&radio.burst_s),
            },
            silence: false,
            duplicate_share: radio.duplicate_share.value,
            reorder_share: radio.reorder_share.value,
            reorder_hold_us: us(&radio.reorder_hold_s).round() as u64,
            corruption_share: radio.corruption_share.value,
            receive_queue: radio.receive_queue.value as usize,
            strength_1m_dbm: radio.strength_1m_dbm.value,
            path_loss_exponent: radio.path_loss_exponent.value,
            fading_db: radio.fading_db.value,
            sensitivity_dbm: radio.sensitivity_dbm.value,
        }
    }

    /// These with the trouble's overrides.
    pub fn with(self, trouble: &Trouble) -> Self {
        let tail_most_us = trouble.tail_most_us.map_or(self.tail.most_us, |us| us as f64);
        Self {
            silence: trouble.silence,
            loss: troubled_loss(self.loss, trouble),
            extra_delay_us: trouble.extra_delay_us,
            tail: Tail {
                share: trouble.tail_share.unwrap_or(self.tail.share),
                least_us: self.tail.least_us.min(tail_most_us),
                most_us: tail_most_us,
            },
            late_callback: Tail {
                share: trouble.late_callback_share.unwrap_or(self.late_callback.share),
                ..self.late_callback
            },
            duplicate_share: trouble.duplicate_share.unwrap_or(self.duplicate_share),
            reorder_share: trouble.reorder_share.unwrap_or(self.reorder_share),
            reorder_hold_us: trouble.reorder_hold_us.unwrap_or(self.reorder_hold_us),
            corruption_share: trouble.corruption_share.unwrap_or(self.corruption_share),
            receive_queue: trouble.receive_queue.unwrap_or(self.receive_queue),
            ..self
        }
    }

    /// Strength of the signal at a distance without fading, dBm. The law holds from 1 m on.
    pub fn strength_dbm(&self, distance_m: f64) -> f64 {
        self.strength_1m_dbm - 10.0 * self.path_loss_exponent * distance_m.max(1.0).log10()
    }
}

fn troubled_loss(loss: Loss, trouble: &Trouble) -> Loss {
    let share = trouble.loss_share.unwrap_or(loss.share);
    Loss {
        share,
        quiet_share: trouble.quiet_loss_share.unwrap_or(loss.quiet_share).min(share),
        burst_share: trouble.burst_loss_share.unwrap_or(loss.burst_share).max(share),
        burst_us: trouble.burst_us.map_or(loss.burst_us, |us| us as f64),
    }
}
