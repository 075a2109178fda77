//! Tests of sessions that hold to the wall clock: a console at a terminal, a page in a browser, and programs at a serial port.

#[path = "../common/mod.rs"]
mod common;

mod bring_up;
mod console;
mod hil;
mod view;
