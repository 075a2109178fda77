//! All tests of the decisions, in one program: it is linked once, and its tests share both cores.

mod closed_loop;
mod commands;
mod common;
mod gait;
mod missed;
mod open_loop;
mod parameters;
mod properties;
mod retune;
mod safety;
mod self_check;
mod two_sensors;
