//! `driver_dead_time`: in every PWM period the bridge is open for a while, and the current takes the diodes' way.
//!
//! `Δv = −V·lost·sat(i/knee)` with `lost = t_d·f_pwm`, at every duty but 0 and ±1, at which nothing switches (N. Mohan, T. Undeland,
//! W. Robbins, "Power Electronics", 2003, section 8.5: effect of blanking time). A current whose ripple passes zero takes the diodes of
//! either side within one period: of a mean below half of the ripple only a part is lost (J.-W. Choi, S.-K. Sul, IEEE Transactions on
//! Power Electronics 11, 1996). Without a knee no current flows while the winding's own voltage is less than the loss. Near full duty
//! drivers differ: one that delays every switching on loses as much as elsewhere, others drop the pulses of the idle switch that are too
//! short for it ("minimum pulse width", "pulse dropping"): there the loss falls to nothing. What the robot file's `driver.dead_time_s`
//! says is taken off the duty whichever way the current flows.

use crate::effect::{BridgeDrop, Effect};
use crate::fit::{FitNumber, Sizes};
use crate::spec::{Acts, Confusion, Coordinate, Parameter, Spec};

/// The share of a period that goes to the diodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverDeadTime {
    /// Dead time × PWM frequency, 1.
    pub lost_duty: f64,
    /// Shortest pulse × PWM frequency, 1.
    pub shortest_duty: f64,
    /// Current from which on all of it is lost, A.
    pub knee_a: f64,
}

impl Effect for DriverDeadTime {
    type State = ();

    const SPEC: Spec = Spec {
        name: "driver_dead_time",
        summary: "Voltage lost against the current in every PWM period that switches.",
        title: "the driver's dead time",
        clause: "a share of every PWM period in which the bridge is open",
        law: "v = duty·V − lost·V·sat(i/knee) where 0 < |duty| < 1, lost = t_dead·f_pwm·min(1, (1 − |duty|)/shortest), sat(x) = max(−1, min(x, 1)); without a knee i = 0 while |duty·V − K ω| < lost·V",
        source: "N. Mohan, T. Undeland, W. Robbins, \"Power Electronics\", 2003, 8.5 (effect of blanking time); J.-W. Choi, S.-K. Sul, IEEE \
                 Trans. Power Electronics 11, 1996 (a ripple that passes zero)",
        parameters: &[
            Parameter::new("lost_duty", "Dead time × PWM frequency.", 0.0, 0.5),
            Parameter::new(
                "shortest_duty",
                "Shortest pulse × PWM frequency: where less is left to full duty, the loss falls to nothing; 0: never.",
                0.0,
                0.5,
            ),
            Parameter::new(
                "knee_a",
                "Mean current from which on all of it is lost, half of the ripple of a period: below it a part in proportion; 0: always all.",
                0.0,
                10.0,
            ),
        ],
        acts: Acts::Bridge,
        shows_in: Coordinate::Voltage,
        candidate: true,
        contains: &[],
        mistaken_for: &[
            Confusion {
                with: "driver_drop",
                when: "the supply is the same everywhere and the duty never full",
                experiment: "hold full duty and one step less: dead time is gone at full duty, a drop stays; or halve the \
                             supply, which halves the one and leaves the other",
            },
            Confusion {
                with: "driver_deadband",
                when: "the motor never brakes itself through the bridge",
                experiment: "lower the duty in steps while the shaft turns fast: a deadband takes a share of the command \
                             whichever way the current flows, dead time acts against the current",
            },
        ],
        experiment: None,
        not_in_mujoco: None,
    };

    fn from_values(values: &[f64]) -> Self {
        Self { lost_duty: values[0], shortest_duty: values[1], knee_a: values[2] }
    }

    /// How near to full duty the loss ends only those recordings tell that come as near, and how small its knee is only those whose current
    /// is seldom more.
    fn fit(sizes: &Sizes) -> Vec<FitNumber> {
        let shortest = "the distance to full duty within which dead time fades";
        let small_a = 0.01 * sizes.rail_v / sizes.resistance_ohm;
        let (in_full, ends) = ("the current from which on dead time counts in full", [1e-4 * small_a, 5.0 * small_a]);
        let knee = FitNumber::linear("dead_time_knee_a", in_full, small_a, 0.5 * small_a, ends);
        vec![
            FitNumber::linear("lost_duty", "the share lost to dead time", 0.01, 0.03, [0.0, 0.5]),
            FitNumber::log("shortest_duty", shortest, [0.03, 2e-3], [1e-3, 0.2], 1.0),
            FitNumber { prior: 2.0, ..knee },
        ]
    }

    #[inline]
    fn bridge(&self) -> BridgeDrop {
        BridgeDrop {
            of_supply: self.lost_duty,
            fades_within: self.shortest_duty,
            switching_knee_a: self.knee_a,
            ..BridgeDrop::default()
        }
    }
}
