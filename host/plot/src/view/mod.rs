//! The robot walking, in 3D: one self-contained HTML page from a [`Track`], and the page of a robot that runs ([`live_page`]),
//! which is told how it moves.
//!
//! The pages' own source is `host/plot/assets/view/` and `host/plot/assets/live/`, three.js is `host/plot/assets/three/`. Everything is in the page: a policy in
//! its head forbids it to load anything. Scripts stand in an import map, since a page opened from a file may not import
//! its neighbours.

mod frames;
mod live;
mod scene;
#[cfg(test)]
pub(crate) mod synthetic;
#[cfg(test)]
mod tests;

use std::fmt::Write as _;

use hal_sim::body::Track;
use serde_json::{Map, Value};

use crate::report::svg::escape;

pub use live::{Setup, channels, live_page};

const TEMPLATE: &str = include_str!("../../assets/view/page.html");
const STYLE: &str = include_str!("../../assets/view/style.css");
const THREE_LICENCE: &str = include_str!("../../assets/three/LICENSE");
/// What the scripts import each other by.
const SCRIPTS: [(&str, &str); 16] = [
    ("three", include_str!("../../assets/three/three.min.js")),
    ("view/main", include_str!("../../assets/view/main.js")),
    ("view/body", include_str!("../../assets/view/body.js")),
    ("view/feet", include_str!("../../assets/view/feet.js")),
    ("view/words", include_str!("../../assets/view/words.js")),
    ("view/run", include_str!("../../assets/view/run.js")),
    ("view/stage", include_str!("../../assets/view/stage.js")),
    ("view/theme", include_str!("../../assets/view/theme.js")),
    ("view/ground", include_str!("../../assets/view/ground.js")),
    ("view/walls", include_str!("../../assets/view/walls.js")),
    ("view/robot", include_str!("../../assets/view/robot.js")),
    ("view/backbone", include_str!("../../assets/view/backbone.js")),
    ("view/traces", include_str!("../../assets/view/traces.js")),
    ("view/forces", include_str!("../../assets/view/forces.js")),
    ("view/gait", include_str!("../../assets/view/gait.js")),
    ("view/panel", include_str!("../../assets/view/panel.js")),
];

/// A page on which the robot of `track` walks, named `title` (plain text). Drawn are about 200 of the snapshots a second
/// of it, and fewer for a run of more than 30 s.
///
/// Positions are stored to 1/65535 of the range that each moves in, the page interpolates between them.
#[must_use]
pub fn page(track: &Track, title: &str) -> String {
    let title_text = escape(title);
    fill(TEMPLATE, |name| match name {
        "title" => title_text.clone(),
        "style" => STYLE.to_owned(),
        "three_licence" => THREE_LICENCE.to_owned(),
        "import_map" => import_map(SCRIPTS.iter()),
        "run" => in_script(&scene::run(track, title)),
        _ => unreachable!("the template names `{name}`"),
    })
}

/// The template with each `{{name}}` replaced; what is put in is not searched again.
fn fill(template: &str, value: impl Fn(&str) -> String) -> String {
    let mut pieces = template.split("{{");
    let mut page = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let (name, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        page.push_str(&value(name));
        page.push_str(rest);
    }
    page
}

/// As the text of a `<script>`: nothing in it ends the element or opens a comment.
fn in_script(value: &Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

fn import_map<'a>(scripts: impl Iterator<Item = &'a (&'a str, &'a str)>) -> String {
    let imports: Map<String, Value> =
        scripts.map(|(name, source)| ((*name).to_owned(), Value::String(data_url(source)))).collect();
    in_script(&serde_json::json!({ "imports": imports }))
}

/// A script as a URL that holds it.
fn data_url(source: &str) -> String {
    let mut url = String::with_capacity(source.len() + source.len() / 8);
    url.push_str("data:text/javascript;charset=utf-8,");
    for character in source.chars() {
        // What a URL would drop or take for something else; and what JSON or HTML would make longer.
        if character.is_ascii_control() || matches!(character, ' ' | '%' | '#' | '"' | '\\' | '<') {
            let _ = write!(url, "%{:02X}", u32::from(character));
        } else {
            url.push(character);
        }
    }
    url
}
