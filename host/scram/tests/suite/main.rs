//! All tests of the commands but for those that hold to the wall clock, in one program: it is linked once, and its tests share both cores.

#[path = "../common/mod.rs"]
mod common;

mod book;
mod calibrate;
mod cli;
mod design_experiment;
mod diagnose;
mod diagnose_walk;
mod engine;
mod export;
mod identify_backbone;
mod identify_motor;
mod identify_robot;
mod import;
mod learn;
mod new_rig;
mod outputs;
mod pil;
mod replay;
mod sweep;
mod then_run;
mod viewers;
mod walk;
