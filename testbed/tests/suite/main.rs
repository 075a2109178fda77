//! All tests of the firmware's tasks on simulated hardware, in one program: it is linked once, and its tests share both cores.

mod bench;
mod common;
mod dongle;
mod pairing;
mod robot;
mod robot_gait;
mod robot_link;
mod robot_radio;
mod robot_rubbish;
mod robot_trouble;
mod time;
