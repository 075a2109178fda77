//! The page of a robot that runs: what stands still of it. What moves comes over the page's own line.

use hal_sim::body::{Plan, Snapshot};
use serde_json::json;

use super::frames::row;
use super::{SCRIPTS, STYLE, THREE_LICENCE, fill, import_map, in_script, scene};
use crate::report::svg::escape;

const TEMPLATE: &str = include_str!("../../assets/live/page.html");
const LIVE_STYLE: &str = include_str!("../../assets/live/style.css");
pub(super) const LIVE_SCRIPTS: [(&str, &str); 8] = [
    ("live/main", include_str!("../../assets/live/main.js")),
    ("live/scene", include_str!("../../assets/live/scene.js")),
    ("live/motion", include_str!("../../assets/live/motion.js")),
    ("live/trail", include_str!("../../assets/live/trail.js")),
    ("live/plot", include_str!("../../assets/live/plot.js")),
    ("live/line", include_str!("../../assets/live/line.js")),
    ("live/drive", include_str!("../../assets/live/drive.js")),
    ("live/readout", include_str!("../../assets/live/readout.js")),
];

/// What the page knows before anything comes.
#[derive(Clone, Copy, Debug)]
pub struct Setup<'a> {
    /// Name of the robot, plain text.
    pub title: &'a str,
    /// The body and how it stands at the start; none where only plots can be shown.
    pub body: Option<(&'a Plan, &'a Snapshot)>,
    /// Whether the body's states come; otherwise its rotor turns as the plots say.
    pub moves: bool,
    /// Whether the page may give commands.
    pub drive: bool,
    /// Largest frequency that a person can ask for, Hz.
    pub frequency_limit_hz: f64,
}

/// The page. It connects to `/live` where it came from and is told, as JSON, what `scram::live::told` writes.
#[must_use]
pub fn live_page(setup: &Setup<'_>) -> String {
    let title = escape(setup.title);
    let known = json!({
        "drive": setup.drive,
        "moves": setup.moves,
        "frequency_limit_hz": setup.frequency_limit_hz,
        "plan": setup.body.map(|(plan, _)| scene::plan(plan)),
        "rest": setup.body.map(|(_, rest)| channels(rest)),
    });
    fill(TEMPLATE, |name| match name {
        "title" => title.clone(),
        "style" => format!("{STYLE}{LIVE_STYLE}"),
        "three_licence" => THREE_LICENCE.to_owned(),
        "import_map" => import_map(SCRIPTS.iter().chain(&LIVE_SCRIPTS)),
        "setup" => in_script(&known),
        _ => unreachable!("the template names `{name}`"),
    })
}

/// A state as the page takes it: the numbers of a frame of [`super::page`], in SI units; of the rotor its angle, rad, and its
/// frequency, Hz with the thesis's sign.
#[must_use]
pub fn channels(snapshot: &Snapshot) -> Vec<f64> {
    row(snapshot, &vec![1.0; snapshot.modules.len() + snapshot.segments.len()])
}
