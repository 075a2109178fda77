//! What feeds the bridge: a LiPo cell and a boost converter, and how the rail gives way under the bridge's current where
//! an effect says so.
//!
//! The averaged bridge draws `duty·i` from its rail, i being the motor's current. Everything here is quasi-static but
//! the charge and what the effects remember.

use effects::{Laws, States};
use robot_file::robot::{self, Robot};

use crate::shaft::Shaft;

/// A cell with its boost converter.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Charge when full, A·s.
    pub capacity_as: f64,
    /// Internal resistance, Ω.
    resistance_ohm: f64,
    /// Open-circuit voltage against charge: `[0 … 1, V]`, charge increasing.
    open_circuit_v: Vec<[f64; 2]>,
    /// Boost converter's efficiency, 0 … 1.
    efficiency: f64,
    /// The boost converter's highest output current, A.
    pub limit_a: f64,
    /// What the electronics draw from the rail, A.
    pub logic_a: f64,
    /// State of charge, 0 … 1.
    charge: f64,
    /// Current out of the cell, A.
    pub current: f64,
    /// Open-circuit voltage forced by a fault, V.
    forced_v: Option<f64>,
    /// Open-circuit voltage as charged, V, and the highest power that the rail can take then, W: they are asked for every step,
    /// and change every period.
    open_v: f64,
    power_limit_w: f64,
}

impl Cell {
    /// From the file, at a state of charge (0 … 1).
    #[must_use]
    pub fn new(battery: &robot::Battery, charge: f64) -> Self {
        let mut cell = Self {
            capacity_as: 3600.0 * battery.capacity_ah.value,
            resistance_ohm: battery.resistance_ohm.value,
            open_circuit_v: battery.open_circuit_v.clone(),
            efficiency: battery.boost_efficiency.value,
            limit_a: battery.boost_limit_a.value,
            logic_a: battery.logic_current_a.value,
            charge: charge.clamp(0.0, 1.0),
            current: 0.0,
            forced_v: None,
            open_v: 0.0,
            power_limit_w: 0.0,
        };
        cell.update();
        cell
    }

    /// Forces the open-circuit voltage, V; `None` lets it go.
    pub fn force(&mut self, open_circuit_v: Option<f64>) {
        self.forced_v = open_circuit_v;
        self.update();
    }

    fn update(&mut self) {
        self.open_v = self.forced_v.unwrap_or_else(|| between(&self.open_circuit_v, self.charge));
        let open = self.open_v.max(0.0);
        self.power_limit_w = if self.resistance_ohm > 0.0 {
            self.efficiency * open * open / (4.0 * self.resistance_ohm)
        } else {
            f64::INFINITY
        };
    }

    /// Open-circuit voltage, V: straight between the table's points, constant outside.
    #[must_use]
    pub fn open_circuit(&self) -> f64 {
        self.open_v
    }

    /// Boost converter's efficiency, 0 … 1.
    #[must_use]
    pub fn efficiency(&self) -> f64 {
        self.efficiency
    }

    /// State of charge, 0 … 1.
    #[must_use]
    pub fn charge(&self) -> f64 {
        self.charge
    }

    /// Voltage at the cell's terminals, V.
    #[must_use]
    pub fn voltage(&self) -> f64 {
        self.open_circuit() - self.resistance_ohm * self.current
    }

    /// Highest power that the rail can take, W: the cell matched, `efficiency·OCV²/(4R)`.
    #[must_use]
    pub fn power_limit(&self) -> f64 {
        self.power_limit_w
    }

    /// Draws a mean power (W) at the rail for a time (s).
    pub fn draw(&mut self, rail_w: f64, time: f64) {
        let open = self.open_circuit().max(0.0);
        let power = rail_w.max(0.0) / self.efficiency;
        let root = (open * open - 4.0 * self.resistance_ohm * power).max(0.0).sqrt();
        // 2P/(V + √(V² − 4RP)) is the smaller root of V·i − R·i² = P, and P/V where R is zero.
        self.current = if open > 0.0 && self.charge > 0.0 { 2.0 * power / (open + root) } else { 0.0 };
        self.charge = (self.charge - self.current * time / self.capacity_as).max(0.0);
        self.update();
    }
}

/// A table of ascending abscissae and ordinates at an abscissa: straight between its points, constant outside.
fn between(table: &[[f64; 2]], at: f64) -> f64 {
    let upper = table.partition_point(|point| point[0] < at);
    match (upper.checked_sub(1).map(|index| table[index]), table.get(upper)) {
        (Some(low), Some(high)) => low[1] + (high[1] - low[1]) * (at - low[0]) / (high[0] - low[0]),
        (Some(only), None) => only[1],
        (None, Some(only)) => only[1],
        (None, None) => 0.0,
    }
}

/// The bridge's supply.
#[derive(Clone, Debug, PartialEq)]
pub struct Supply {
    /// Rail with no load, V.
    pub rail_v: f64,
    /// The cell behind it; `None` for a bench supply.
    pub cell: Option<Cell>,
    /// What the effects remember.
    pub states: States,
    /// Rail at present, V.
    bridge_v: f64,
    /// Charge (A·s) and energy (J) taken from the rail by the bridge in this control period.
    drawn_as: f64,
    drawn_j: f64,
}

impl Supply {
    /// From the file, at a state of charge (0 … 1).
    #[must_use]
    pub fn new(robot: &Robot, charge: f64) -> Self {
        Self {
            rail_v: robot.supply.rail_v.value,
            cell: robot.supply.battery.as_ref().map(|battery| Cell::new(battery, charge)),
            states: States::default(),
            bridge_v: robot.supply.rail_v.value,
            drawn_as: 0.0,
            drawn_j: 0.0,
        }
    }

    /// Rail at present, V.
    #[must_use]
    pub fn bridge_v(&self) -> f64 {
        self.bridge_v
    }

    /// The rail (V) while the bridge drives with a duty at a motor's speed (rad/s), kept as the present one.
    pub fn drive(&mut self, shaft: &Shaft, duty: f64, speed: f64) -> f64 {
        self.bridge_v = self.rail(shaft, duty, speed, shaft.laws.supply_fallen(&self.states));
        self.bridge_v
    }

    /// The rail (V) while the bridge drives with a duty at a motor's speed (rad/s) and has fallen slowly by `fallen_v`.
    ///
    /// Rail and current depend on each other, `v = e − R_s·duty·i` and `i = (duty·v − K ω ∓ drop)/R`, ω being the motor's
    /// speed, and are solved together at the settled current, so the supply's resistance has no lag of its own. Beyond the
    /// boost converter's current or power the rail falls to where the bridge takes no more.
    #[inline]
    #[must_use]
    pub fn rail(&self, shaft: &Shaft, duty: f64, speed: f64, fallen_v: f64) -> f64 {
        let open_v = (self.rail_v - fallen_v).max(0.0);
        let bridge = shaft.laws.bridge();
        let supply_ohm = shaft.laws.supply_resistance();
        let commanded = bridge.commanded(duty, open_v);
        let lost_v = duty * open_v - commanded;
        let switching_v = bridge.of_switched(duty) * open_v;
        let net = commanded - shaft.torque_constant * speed;
        let resistance = shaft.resistance_ohm + bridge.slope_ohm;
        let conductance = 1.0 / (resistance + duty * duty * supply_ohm);
        let current = bridge.current(net.abs(), switching_v, conductance).0.copysign(net);
        let rail_v = (open_v - supply_ohm * duty * current).max(0.0);
        let bridge_a = duty * current;
        if let Some(cell) = &self.cell {
            let power_limit = cell.power_limit();
            if bridge_a + cell.logic_a > cell.limit_a || rail_v * (bridge_a + cell.logic_a) > power_limit {
                // What is against a current beyond every knee.
                let against = bridge.drop_v + switching_v;
                let opposing = shaft.torque_constant * speed + lost_v + against.copysign(net);
                let limited = limited_rail(cell, power_limit, duty, opposing, resistance);
                return rail_v.min(limited).max(0.0);
            }
        }
        rail_v
    }

    /// The rail while the bridge is open.
    pub fn idle(&mut self, laws: &Laws) {
        self.bridge_v = (self.rail_v - laws.supply_fallen(&self.states)).max(0.0);
        if let Some(cell) = &self.cell
            && cell.logic_a > 0.0
        {
            self.bridge_v = self.bridge_v.min(cell.power_limit() / cell.logic_a);
        }
    }

    /// Books a mean bridge current (duty × motor current, A) over a step (s).
    pub fn book(&mut self, bridge_a: f64, step: f64) {
        self.drawn_as += bridge_a * step;
        self.drawn_j += bridge_a * self.bridge_v * step;
    }

    /// Ends a control period (s): charge and what the effects remember advance with the period's mean current.
    pub fn end_period(&mut self, laws: &Laws, period: f64) {
        laws.draw(&mut self.states, self.drawn_as / period, period);
        if let Some(cell) = &mut self.cell {
            let rail_w = self.drawn_j / period + cell.logic_a * self.bridge_v;
            cell.draw(rail_w, period);
        }
        self.drawn_as = 0.0;
        self.drawn_j = 0.0;
    }
}

/// The rail (V) at which a bridge with a duty takes what is left of the converter's current and power, its current being
/// `(duty·v − opposing)/resistance` and what it draws `duty` times that.
fn limited_rail(cell: &Cell, power_limit: f64, duty: f64, opposing: f64, resistance: f64) -> f64 {
    let per_v = duty * duty / resistance;
    if per_v <= 0.0 {
        return power_limit / cell.logic_a;
    }
    let offset = cell.logic_a - duty * opposing / resistance;
    let at_current_limit = (cell.limit_a - offset) / per_v;
    // per_v·v² + offset·v = P
    let at_power_limit = (-offset + (offset * offset + 4.0 * per_v * power_limit).sqrt()) / (2.0 * per_v);
    at_current_limit.min(at_power_limit)
}
