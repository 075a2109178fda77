//! All tests of the campaigns, in one program: it is linked once, and its tests share both cores.

mod blind_generator;
mod blind_mistakes;
mod blind_score;
mod blind_small;
mod body_small;
mod figures_doc;
mod figures_small;
mod fuzz_small;
mod hidden_effect;
mod link_small;
mod no_panic;
mod safety_doc;
mod safety_small;
