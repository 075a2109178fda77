//! Pictures of a walk: the path from above, the traces of the feet, and which foot touches when. Lengths in mm.

mod feet;
mod gait;
pub(crate) mod map;
mod path;

use hal_sim::body::Track;

use super::panel::PlotError;

/// Every name (without `.svg`) that [`walk_plots`] gives.
pub const WALK_PLOT_NAMES: [&str; 3] = ["path", "feet", "gait"];

/// The pictures of a walk by name, without `.svg`.
///
/// # Errors
/// The drawing library refuses.
pub fn walk_plots(track: &Track) -> Result<Vec<(&'static str, String)>, PlotError> {
    let drawn = [path::draw(track), feet::draw(track), gait::draw(track)];
    WALK_PLOT_NAMES.into_iter().zip(drawn).map(|(name, svg)| Ok((name, svg?))).collect()
}

/// Metres as people read them.
fn mm(m: f64) -> f64 {
    1e3 * m
}

/// "1 left" and so on, as the feet stand in a snapshot.
fn foot_name(foot: usize) -> String {
    format!("{} {}", foot / 2 + 1, if foot.is_multiple_of(2) { "left" } else { "right" })
}
