//! All tests of robot files, in one program: it is linked once, and its tests share both cores.

mod base;
mod body;
mod edit;
mod errors;
mod files;
mod gait;
mod image;
mod mutations;
mod parameters;
mod reference;
mod uneven;
