//! The robot's tasks: after [`boot`], [`control_loop`] in an interrupt executor above everything else, [`receive`], [`send`],
//! [`persistence_task`], [`pair`] and [`led`] below it. They share one [`Shared`].
//!
//! ```text
//! radio ──receive──▶ downlinks ──▶ control_loop ──▶ answers ──▶ send ──▶ radio
//!                                            ├─▶ batches ──▶
//!                                            └─▶ work ──▶ keep ──▶ flash
//! serial line ──pair──────────────────────────▶
//! ```
//!
//! Nothing makes the control loop wait: what does not fit into a queue is dropped and counted.

mod boot;
mod command_handler;
mod control_loop;
mod led;
mod median;
mod pair;
mod persistence_task;
mod receive;
mod schedule;
mod send;
mod settings;
mod shared;

pub use boot::{About, Booted, boot};
pub use control_loop::{Parts, control_loop};
pub use led::{Shown, led};
pub use median::MOST_CONVERSIONS;
pub use pair::{Identity, pair};
pub use persistence_task::persistence_task;
pub use receive::receive;
pub use schedule::period_us;
pub use send::send;
pub use settings::{Settings, SettingsError};
pub use shared::Shared;
