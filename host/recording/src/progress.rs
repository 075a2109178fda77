//! A progress bar for large files, on stderr and only where a person sees it.

use std::io::Read;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Below this the file is read before a bar could be drawn.
const WORTH_A_BAR_BYTES: u64 = 16 << 20;

/// A bar over `bytes`; hidden for small files, on request, and where stderr is not a terminal.
pub(super) fn bar(bytes: u64, wanted: bool, name: String) -> ProgressBar {
    if !wanted || bytes < WORTH_A_BAR_BYTES {
        return ProgressBar::hidden();
    }
    // `stderr()` draws nothing where stderr is not a terminal.
    let bar = ProgressBar::with_draw_target(Some(bytes), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {bytes}/{total_bytes} {eta}") {
        bar.set_style(style);
    }
    bar.set_message(format!("reading {name}"));
    bar
}

/// Opens a file behind a bar.
pub(super) fn open(path: &std::path::Path, wanted: bool) -> std::io::Result<(ProgressBar, impl Read + use<>)> {
    let file = std::fs::File::open(path)?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let bar = bar(file.metadata()?.len(), wanted, name);
    let reader = bar.wrap_read(file);
    Ok((bar, reader))
}
