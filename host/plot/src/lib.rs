//! Plots of a run as SVG. Times in s, angles in degrees, frequencies in Hz with the thesis's sign.

pub mod figures;
mod identify;
mod panel;
pub mod report;
mod run;
mod timeline;
pub mod view;
mod walk;

pub use identify::residual_svg;
pub use panel::{Band, Line, Panel, PlotError, Size, render, render_under};
pub use run::{PLOT_NAMES, plots};
pub use timeline::{Mark, Span, Strip, Timeline};
pub use walk::{WALK_PLOT_NAMES, walk_plots};
