//! A progress bar for large files, on stderr and only where a person sees it.

use std::path::Path;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};

/// Below this the file is read before a bar could be drawn.
const WORTH_A_BAR_BYTES: u64 = 16 << 20;

/// A bar over the reading of a recording, a [`recording::Progress`]; hidden for small files and where stderr is not a
/// terminal.
pub fn bar(path: &Path, bytes: u64) -> Box<dyn FnMut(u64)> {
    if bytes < WORTH_A_BAR_BYTES {
        return Box::new(|_| {});
    }
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    // `stderr()` draws nothing where stderr is not a terminal.
    let bar =
        ProgressBar::with_draw_target(Some(bytes), ProgressDrawTarget::stderr()).with_finish(ProgressFinish::AndClear);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {bytes}/{total_bytes} {eta}") {
        bar.set_style(style);
    }
    bar.set_message(format!("reading {name}"));
    Box::new(move |read| bar.set_position(read))
}
