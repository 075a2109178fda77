//! What the page knows of a run: the body, the ground, the speeds, the motion. SI units.

use hal_sim::body::{Plan, Track};
use serde_json::{Value, json};

use super::frames::Frames;
use simulation::mean_speeds;

/// Everything, as `host/plot/assets/view/run.js` reads it.
pub fn run(track: &Track, title: &str) -> Value {
    let frames = Frames::of(track);
    json!({
        "title": title,
        "plan": plan(&track.plan),
        "speeds": speeds(track),
        "start_s": frames.start_s,
        "interval_s": frames.interval_s,
        "frames": frames.count,
        "scale": frames.scale,
        "codes": frames.hex(),
    })
}

/// The body, as `host/plot/assets/view/body.js` reads it.
pub(super) fn plan(plan: &Plan) -> Value {
    let modules: Vec<_> = plan
        .modules
        .iter()
        .map(|module| json!({ "kind": module.kind.name(), "size": module.size, "feet": module.feet }))
        .collect();
    let backbones: Vec<_> = plan
        .backbones
        .iter()
        .map(|b| json!({ "roll": b.roll, "length": b.length, "segments": b.segments, "section": b.section }))
        .collect();
    let eccentric = plan.eccentric.map(|eccentric| {
        json!({
            "radius": eccentric.radius,
            "height": eccentric.height,
            "bolt_radius": eccentric.bolt[0],
            "bolt_length": eccentric.bolt[1],
        })
    });
    let contact = plan.contact.as_ref().map(|contact| {
        json!({
            "foot_radius": contact.foot_radius,
            "friction": contact.friction,
            "steps": contact.steps,
            "patches": contact.patches,
        })
    });
    let walls: Vec<_> = plan.walls.iter().map(|wall| [wall.from[0], wall.from[1], wall.to[0], wall.to[1]]).collect();
    json!({
        "modules": modules,
        "backbones": backbones,
        "eccentric": eccentric,
        "contact": contact,
        "walls": walls,
        "clamped": plan.clamped,
        "gravity": plan.gravity,
        "mass": plan.mass(),
    })
}

/// As `scram sim` prints them: over the second half of the run.
fn speeds(track: &Track) -> Value {
    mean_speeds(track).map_or(Value::Null, |(speeds, [from, to])| {
        json!({
            "from_s": from,
            "to_s": to,
            "longitudinal": speeds.longitudinal,
            "lateral": speeds.lateral,
            "yaw": speeds.yaw,
        })
    })
}
