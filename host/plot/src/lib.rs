//! Pictures and pages for people: plots of a run as SVG ([`plots`], [`walk_plots`]), maps of a sweep ([`figures`]), the
//! diagnosis report ([`report`]) and the robot walking in 3D ([`view`]). Times in s, angles in degrees, frequencies in Hz
//! with the thesis's sign.
//!
//! ```
//! use std::path::Path;
//!
//! use simulation::{Drive, Plan, run};
//!
//! let robot = robot_file::Robot::load(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../robot.toml")))?;
//! let plan = Plan { drive: Drive::parse("freq:7")?, seconds: 0.5, faults: Vec::new() };
//! let trace = run(&robot, 1, &hal_sim::Settings::default(), &plan)?;
//! let drawn = plot::plots(&trace)?;
//! let (name, svg) = &drawn[0];
//! assert_eq!(*name, "overview");
//! assert!(svg.starts_with("<svg"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What it does not do:
//!
//! * It writes no files: every picture is a string.
//! * It computes nothing that is not drawn: numbers come from `simulation`, `sweep` and `diagnose`.
//! * Its pages load nothing: style sheets, scripts and fonts are in them or the reader's own.

mod exit;
pub mod figures;
mod oscillation;
mod panel;
pub mod picture;
mod potentiometer;
pub mod report;
mod run;
mod timeline;
mod title;
pub mod view;
mod walk;

pub use exit::Exit;
pub use figures::{
    DesignDot, Straightness, TurningRun, designs_svg, maze_svg, speeds_svg, straightness_svg, turning_svg,
};
pub use oscillation::oscillation_svg;
pub use panel::{Band, Line, Panel, PlotError, Size, render, render_under};
pub use picture::picture;
pub use potentiometer::residual_svg;
pub use run::{PLOT_NAMES, plots};
pub use timeline::{Mark, Span, Strip, Timeline};
pub use title::under_title;
pub use walk::{WALK_PLOT_NAMES, walk_plots};
