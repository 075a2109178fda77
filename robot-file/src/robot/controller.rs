//! `[controller]`: the numbers that the controllers are designed with and bounded by, in groups.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Quantity;
use crate::schema::{Field, Part, Place, Reader, Shape, join};

/// `[controller]`: how the controllers are designed and what bounds them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Controller {
    /// Control period.
    pub tick_s: Quantity,
    /// Every further number as `group.key`, e.g. `lqg.phase_deg`: exactly those of the list in this file.
    pub numbers: BTreeMap<String, Quantity>,
}

/// A key of a group: name, least and greatest allowed value, meaning.
type Number = (&'static str, f64, f64, &'static str);

/// The groups of `[controller]`. A number that the design needs is added by a line here and one in the robot file.
pub(super) const GROUPS: &[(&str, &str, &[Number])] = &[
    (
        "lqg",
        "Speed control by LQG: the largest tolerated deviations of Bryson's rule, and what surrounds the law.",
        &[
            ("phase_deg", 0.1, 360.0, "Largest tolerated phase error."),
            ("speed_rad_per_s", 0.01, 1000.0, "Largest tolerated speed error."),
            ("current_a", 1e-3, 100.0, "Largest tolerated current deviation."),
            ("voltage_v", 0.01, 100.0, "Largest voltage that the control should spend on it."),
            ("anchor_deg", 1.0, 170.0, "Phase error beyond which the reference starts again from the estimate."),
            ("fade_a", 1e-4, 1.0, "Current below which the inverted voltage drop fades out."),
        ],
    ),
    (
        "estimator",
        "The Kalman filter, its gate, and how it finds an unknown angle.",
        &[
            ("edge_margin_deg", 0.0, 30.0, "How far beyond the blind arc's edges readings are distrusted."),
            (
                "reading_deg",
                0.01,
                30.0,
                "Reading error of an uncalibrated sensor while holding a speed, standard deviation.",
            ),
            ("reading_calibrated_deg", 0.01, 30.0, "The same for a calibrated sensor."),
            ("speed_rad_per_s", 1e-4, 0.011, "Speed disturbance in a tick while holding a speed, standard deviation."),
            (
                "drag_share",
                1e-6,
                1.0,
                "Change of the drag torque in a tick while holding a speed, standard deviation, share of the stall torque.",
            ),
            (
                "stroke_reading_deg",
                0.01,
                30.0,
                "Reading error of an uncalibrated sensor in strokes, standard deviation.",
            ),
            ("stroke_reading_calibrated_deg", 0.01, 30.0, "The same for a calibrated sensor."),
            ("stroke_speed_rad_per_s", 1e-4, 0.16, "Speed disturbance in a tick in strokes, standard deviation."),
            ("stroke_drag_share", 1e-6, 1.0, "The same in strokes."),
            ("blind_reading_deg", 250.0, 1e4, "Reading error in the blind arc, standard deviation."),
            ("gate_sigma", 1.0, 4.2, "Innovations beyond so many standard deviations are rejected."),
            ("rejected_limit", 2.0, 16.0, "So many rejected samples in a row outside the arc: the estimate is lost."),
            ("drag_limit_share", 1.0, 100.0, "Highest estimated drag, share of the expected one."),
            ("initial_angle_deg", 0.01, 3.2, "Standard deviation of the angle after acquisition."),
            ("initial_rad_per_s", 0.01, 5.5, "Standard deviation of the speed after acquisition."),
            ("initial_drag_share", 0.01, 10.0, "Standard deviation of the drag at first, share of the expected one."),
            ("acquire_samples", 11.0, 16.0, "Samples of the line fit that finds an unknown angle."),
            ("acquire_residual_deg", 0.01, 2.2, "RMS residual of that line that is accepted."),
            ("acquire_least_rad_per_s", 7.0, 1000.0, "Least speed at which the line is accepted."),
            ("acquire_rad_per_s", 0.01, 1000.0, "Speed aimed at while searching."),
            ("acquire_patience_s", 0.001, 10.0, "After so long without an angle, full voltage."),
            (
                "sensor_persistence_s",
                0.02,
                1.0,
                "Of two angle sensors, one that contradicts the other for so long has failed.",
            ),
        ],
    ),
    (
        "position",
        "Position control, thesis (4.7) and (4.8).",
        &[
            ("proportional_v_per_rad", 1e-3, 1e4, "Kp."),
            ("integral_v_per_rad_s", 0.0, 1e6, "Ki; 0 in the thesis."),
            ("derivative_v_s_per_rad", 0.0, 1e4, "Kd; 0 in the thesis."),
            ("average_samples", 1.0, 16.0, "Length of the moving average."),
            ("tolerance_deg", 0.0, 90.0, "Errors up to this are left alone."),
            ("drag_share", 0.0, 2.0, "Share of the estimated drag that is fed forward."),
        ],
    ),
    (
        "oscillator",
        "Swinging between two bounds.",
        &[
            (
                "brake_share",
                0.05,
                1.0,
                "Share of the full braking torque that the predicted stopping distance counts on.",
            ),
            ("proportional_v_per_rad", 1e-3, 1e4, "Kp of the proportional stroke."),
            ("switch_margin_deg", 0.0, 57.0, "The proportional stroke turns round this far before its bound."),
        ],
    ),
    (
        "supervisor",
        "What ends with the bridge off: a limit, how long it must be seen, and when at the latest the bridge is off.",
        &[
            ("stall_rad_per_s", 3.0, 1000.0, "Stall: a current drives it, and it is slower than this."),
            ("stall_persistence_s", 0.0, 0.25, "Stall: seen so long."),
            ("stall_bound_s", 0.0, 0.6, "Stall: bridge off at the latest after."),
            ("runaway_rad_per_s", 0.1, 1e4, "Runaway: faster than this, or driven hard and turning the other way."),
            ("runaway_persistence_s", 0.0, 0.1, "Runaway: seen so long."),
            ("runaway_bound_s", 0.0, 0.6, "Runaway: bridge off at the latest after."),
            ("open_rad_per_s", 0.0, 7.0, "Sensor open: nothing believable while it should turn faster than this."),
            ("open_persistence_s", 0.0, 0.4, "Sensor open: seen so long."),
            ("open_bound_s", 0.0, 1.5, "Sensor open: bridge off at the latest after."),
            (
                "shorted_rad_per_s",
                0.0,
                7.0,
                "Sensor shorted: codes of one end only while it should turn faster than this.",
            ),
            ("shorted_persistence_s", 0.0, 0.3, "Sensor shorted: seen so long."),
            ("shorted_bound_s", 0.0, 0.7, "Sensor shorted: bridge off at the latest after."),
            ("frozen_lsb", 0.5, 100.0, "Sensor frozen: the code stays within this while it should turn."),
            ("frozen_persistence_s", 0.0, 0.1, "Sensor frozen: seen so long."),
            ("frozen_bound_s", 0.0, 0.4, "Sensor frozen: bridge off at the latest after."),
            ("supply_v", 3.0, 60.0, "Supply low: cell below this."),
            ("supply_persistence_s", 0.0, 0.06, "Supply low: seen so long."),
            ("supply_bound_s", 0.0, 0.15, "Supply low: bridge off at the latest after."),
            ("link_slow_s", 0.0, 0.4, "No sign of life for longer: the duty fades to zero until `command_age_s`."),
            ("command_age_s", 0.0, 0.6, "Command too old: older than this."),
            ("command_persistence_s", 0.0, 0.05, "Command too old: seen so long."),
            ("command_bound_s", 0.0, 0.7, "Command too old: bridge off at the latest so long after the last command."),
            (
                "clock_gap_s",
                1e-3,
                0.025,
                "Clock: samples further apart than this, or time stands still or goes backwards.",
            ),
            ("clock_persistence_s", 0.0, 0.06, "Clock: seen so long."),
            ("clock_bound_s", 0.0, 0.15, "Clock: bridge off at the latest after."),
            ("starved_s", 0.01, 0.06, "Loop starved: control periods missed for longer than this in all."),
            ("starved_persistence_s", 0.0, 0.01, "Loop starved: seen so long."),
            ("starved_bound_s", 0.01, 0.2, "Loop starved: bridge off at the latest after."),
            ("starved_share", 0.0, 0.12, "Share of the control periods that may be missed for ever."),
            (
                "heat_share",
                1.0,
                3.0,
                "Overheated: the winding holds more heat than so many times what the continuous current keeps in it.",
            ),
            ("heat_persistence_s", 0.0, 0.01, "Overheated: seen so long."),
            ("heat_bound_s", 0.0, 0.1, "Overheated: bridge off at the latest after."),
            ("driven_duty", 0.01, 0.7, "|duty| from which on the shaft counts as driven hard."),
            ("driven_a", 1e-4, 0.02, "Current through a motor at rest from which on the shaft counts as driven."),
            ("stall_window_deg", 5.0, 30.0, "Stall: the reading stays within this of one place."),
            ("supply_high_v", 3.0, 60.0, "No drive begins with a cell above this."),
            (
                "rest_least_lsb",
                0.0,
                100.0,
                "No drive begins while the wiper's code changes by less than this from reading to reading, in the mean.",
            ),
            ("rest_most_lsb", 0.0, 120.0, "The same, by more than this."),
        ],
    ),
    (
        "limits",
        "What may be commanded.",
        &[
            ("frequency_hz", 0.01, 150.0, "Highest frequency."),
            ("least_frequency_hz", 0.0, 100.0, "Lowest frequency other than standstill."),
            ("least_stroke_deg", 0.1, 343.0, "Shortest stroke."),
        ],
    ),
];

/// The control period's allowed range.
const TICK_S: std::ops::RangeInclusive<f64> = 1e-4..=1e-2;

impl Part for Controller {
    type Spec = ();

    fn shape((): &()) -> Shape {
        let tick =
            Field { key: "tick_s", meaning: "Control period.", optional: false, shape: Quantity::shape(&TICK_S) };
        let number = |&(key, low, high, meaning): &Number| Field {
            key,
            meaning,
            optional: false,
            shape: Shape::Quantity(low, high),
        };
        let group = |&(key, meaning, numbers): &(&'static str, &'static str, &'static [Number])| Field {
            key,
            meaning,
            optional: false,
            shape: Shape::Table(numbers.iter().map(number).collect()),
        };
        Shape::Table(std::iter::once(tick).chain(GROUPS.iter().map(group)).collect())
    }

    fn read(reader: &mut Reader, place: &Place<'_>, (): &()) -> Option<Self> {
        let path = place.field();
        let table = reader.need_table(place)?;
        let known: Vec<_> = std::iter::once("tick_s").chain(GROUPS.iter().map(|(group, ..)| *group)).collect();
        reader.refuse_unknown(table, &path, &known);
        let tick = Place { table, path: &path, key: "tick_s", meaning: "control period" };
        let tick_s = Quantity::read(reader, &tick, &TICK_S);
        let mut numbers = BTreeMap::new();
        for &(group, meaning, list) in GROUPS {
            let place = Place { table, path: &path, key: group, meaning };
            read_group(reader, &place, list, &mut numbers);
        }
        Some(Self { tick_s: tick_s?, numbers })
    }
}

/// Reads a group into the numbers; what is missing or wrong is noted and left out.
fn read_group(reader: &mut Reader, place: &Place<'_>, list: &[Number], numbers: &mut BTreeMap<String, Quantity>) {
    let path = place.field();
    let Some(table) = reader.need_table(place) else { return };
    let known: Vec<_> = list.iter().map(|(key, ..)| *key).collect();
    reader.refuse_unknown(table, &path, &known);
    for &(key, low, high, meaning) in list {
        let inner = Place { table, path: &path, key, meaning };
        if let Some(quantity) = Quantity::read(reader, &inner, &(low..=high)) {
            numbers.insert(join(place.key, key), quantity);
        }
    }
}
