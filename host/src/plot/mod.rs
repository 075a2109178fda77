//! Plots of a run as SVG. Times in s, angles in degrees, frequencies in Hz with the thesis's sign.

mod panel;
mod run;

pub use panel::{Band, Line, Panel, PlotError, Size, render};
pub use run::{PLOT_NAMES, plots};
