//! JSON schemas of the messages, for viewers.

use serde_json::{Value, json};

fn object(title: &str, properties: Value) -> Value {
    json!({ "title": title, "type": "object", "properties": properties })
}

/// `/NAME/sample` of a session.
pub(super) fn sample_schema() -> Value {
    let (number, whole, perhaps) = (json!("number"), json!("integer"), json!(["number", "null"]));
    object(
        "scram.Sample",
        json!({
            "t_s": { "type": number }, "tick": { "type": whole }, "time_us": { "type": whole }, "enable": { "type": whole },
            "duty": { "type": number }, "adc": { "type": whole }, "adc_second": { "type": whole }, "estimate_angle_rad": { "type": perhaps },
            "estimate_speed_rad_per_s": { "type": perhaps }, "supply_v": { "type": number },
            "battery_v": { "type": number }, "x_m": { "type": perhaps }, "y_m": { "type": perhaps }, "yaw_rad": { "type": perhaps }, "pose_t_s": { "type": perhaps },
        }),
    )
}

/// `/state`, `/NAME/state`; of a robot with two sensors also which of them has failed.
pub(super) fn state_schema(two_sensors: bool) -> Value {
    let mut properties = json!({
        "t_s": { "type": "number" }, "state": { "type": "string" }, "fault": { "type": ["string", "null"] },
        "tracking": { "type": "boolean" },
    });
    if two_sensors {
        properties["failed_sensor"] = json!({ "type": ["string", "null"] });
    }
    object("scram.State", properties)
}

/// `/event`, `/NAME/event`.
pub(super) fn event_schema() -> Value {
    object(
        "scram.Event",
        json!({
            "t_s": { "type": "number" }, "kind": { "type": "string" }, "text": { "type": "string" },
            "command": { "type": ["object", "string", "null"] }, "repeat": { "type": "boolean" },
            "outcome": { "type": "string" }, "fault": { "type": "string" }, "tick": { "type": "integer" },
            "parameter": { "type": "object" }, "gait": { "type": "object" },
        }),
    )
}

/// `/NAME/link`.
pub(super) fn link_schema() -> Value {
    let perhaps = json!({ "type": ["number", "null"] });
    object(
        "scram.Link",
        json!({
            "t_s": { "type": "number" }, "rate_hz": { "type": "number" }, "loss": { "type": "number" },
            "latency_s": perhaps, "rssi_dbm": perhaps,
        }),
    )
}
