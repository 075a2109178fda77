//! Tests that hide an effect and require finding it.
//!
//! A data set is six recordings of a rig whose physics differs from its robot file in one thing or two, plus nominal
//! parameters that are wrong by 10–50 %. The diagnosing side sees the CSV files and the robot file, nothing else.
//!
//! The hidden truth shares no code with the model that is fitted: this module has its own laws ([`laws`]), its own
//! integrator ([`world`]), its own noise and quantisation ([`sensing`]), and its own measure of how large the effect is
//! ([`measure`]). It may not touch `hal-sim`, `control`, or anything of `diagnose` except through [`score`] and [`heard`],
//! which hand files to the diagnosis and to the check of the rig and read what they say.
//!
//! What is hidden and why it is richer than the library is told in `docs/blind-tests.md`.

pub mod beside;
pub mod case;
pub mod excite;
pub mod files;
pub mod heard;
pub mod hidden;
pub mod laws;
pub mod measure;
pub mod memory;
pub mod mistake;
pub mod noise;
pub mod report;
pub mod rig;
pub mod run;
pub mod score;
pub mod sensing;
pub mod setting;
pub mod world;
