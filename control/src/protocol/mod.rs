//! What the robot, the dongle, a board in a test and the host say to each other, and how it is framed.
//!
//! Messages are `postcard`; on a serial line each is a [`frame`]. [`lockstep`] lets a host run a plant against the
//! controller of a chip; [`radio`] is what the robot hears and tells over ESP-NOW; [`dongle`] carries radio messages
//! over the dongle's USB. Every decoder survives any bytes.

pub mod dongle;
pub mod frame;
pub mod lockstep;
pub mod radio;

/// Version of every message here. Raised with each change that an older end would misread.
pub const VERSION: u16 = 1;
