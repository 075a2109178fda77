//! The linear motor of the thesis, (4.1) and (4.2), and its exact discretisation.

use nalgebra::{DMatrix, Matrix3, Matrix5, RowVector3, Vector3};

use effects::{CoulombFriction, DriverDrop, LoadFriction, StribeckFriction};

use crate::robot::Robot;

/// `x' = A x + B v − G τ`, x = [θ, ω, i], v the voltage at the winding, τ a drag torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Continuous {
    /// A: state matrix of [θ, ω, i], 1/s.
    pub a: Matrix3<f64>,
    /// B, per V.
    pub b: Vector3<f64>,
    /// G, per N·m.
    pub g: Vector3<f64>,
}

/// `x⁺ = Φ x + Γ v − H τ` over one period with v and τ held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discrete {
    /// Φ: state transition over one period.
    pub phi: Matrix3<f64>,
    /// Γ, per V.
    pub gamma: Vector3<f64>,
    /// H, per N·m.
    pub eta: Vector3<f64>,
    /// Period, s.
    pub period: f64,
}

/// What the linear model and the controller need of a robot file, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorValues {
    /// Winding and the bridge's slope, Ω.
    pub resistance: f64,
    /// Winding inductance L, H.
    pub inductance: f64,
    /// Torque constant K, N·m/A.
    pub torque_constant: f64,
    /// Moment of inertia J about the shaft, kg·m².
    pub inertia: f64,
    /// Viscous damping b, N·m·s/rad.
    pub viscous: f64,
    /// Expected drag torque at speed, N·m.
    pub drag: f64,
}

impl MotorValues {
    /// From the file's nominal values.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let effects = &robot.effects;
        let sliding = effects.get::<CoulombFriction>().map_or(0.0, |friction| friction.torque_nm)
            + effects.get::<StribeckFriction>().map_or(0.0, |friction| friction.torque_nm);
        // At a steady speed the teeth transmit the drag itself: τ = c + µτ.
        let share = effects.get::<LoadFriction>().map_or(0.0, |friction| friction.coefficient).min(0.9);
        Self {
            resistance: robot.motor.resistance_ohm.value
                + effects.get::<DriverDrop>().map_or(0.0, |drop| drop.slope_ohm),
            inductance: robot.motor.inductance_h.value,
            torque_constant: robot.motor.torque_constant_nm_per_a.value,
            inertia: robot.motor.rotor_inertia_kg_m2.value + robot.load.inertia_kg_m2.value,
            viscous: robot.motor.viscous_nm_s_per_rad.value,
            drag: sliding / (1.0 - share),
        }
    }

    /// Torque at standstill per volt, N·m/V.
    #[must_use]
    pub fn torque_per_volt(&self) -> f64 {
        self.torque_constant / self.resistance
    }

    /// The continuous model.
    #[must_use]
    pub fn continuous(&self) -> Continuous {
        let Self { resistance: r, inductance: l, torque_constant: k, inertia: j, viscous: b, .. } = *self;
        Continuous {
            a: Matrix3::new(0.0, 1.0, 0.0, 0.0, -b / j, k / j, 0.0, -k / l, -r / l),
            b: Vector3::new(0.0, 0.0, 1.0 / l),
            g: Vector3::new(0.0, 1.0 / j, 0.0),
        }
    }
}

impl Continuous {
    /// Exact zero-order hold: the exponential of the model augmented with its constant inputs (Van Loan 1978).
    #[must_use]
    pub fn discretise(&self, period: f64) -> Discrete {
        let mut augmented = Matrix5::<f64>::zeros();
        augmented.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.a);
        augmented.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.b);
        augmented.fixed_view_mut::<3, 1>(0, 4).copy_from(&self.g);
        let exponential = (augmented * period).exp();
        Discrete {
            phi: exponential.fixed_view::<3, 3>(0, 0).into_owned(),
            gamma: exponential.fixed_view::<3, 1>(0, 3).into_owned(),
            // The input is −τ.
            eta: exponential.fixed_view::<3, 1>(0, 4).into_owned(),
            period,
        }
    }
}

impl Discrete {
    /// The model of the filter: [θ, ω, i, τ] with the drag as a constant state that acts along −sign ω, here for ω > 0.
    #[must_use]
    pub fn with_drag(&self) -> DMatrix<f64> {
        let mut phi = DMatrix::identity(4, 4);
        phi.view_mut((0, 0), (3, 3)).copy_from(&self.phi);
        phi.view_mut((0, 3), (3, 1)).copy_from(&-self.eta);
        phi
    }

    /// Reading of the angle.
    #[must_use]
    pub fn reading() -> RowVector3<f64> {
        RowVector3::new(1.0, 0.0, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOTOR: MotorValues = MotorValues {
        resistance: 15.89,
        inductance: 150e-6,
        torque_constant: 0.0209,
        inertia: 1.5e-6,
        viscous: 1.12e-6,
        drag: 2.24e-3,
    };

    /// Fourth-order Runge-Kutta with steps far below the electrical time constant.
    fn integrate(model: &Continuous, mut x: Vector3<f64>, v: f64, torque: f64, period: f64) -> Vector3<f64> {
        let steps = 20_000;
        let h = period / f64::from(steps);
        let rate = |x: &Vector3<f64>| model.a * x + model.b * v - model.g * torque;
        for _ in 0..steps {
            let k1 = rate(&x);
            let k2 = rate(&(x + k1 * (0.5 * h)));
            let k3 = rate(&(x + k2 * (0.5 * h)));
            let k4 = rate(&(x + k3 * h));
            x += (k1 + k2 * 2.0 + k3 * 2.0 + k4) * (h / 6.0);
        }
        x
    }

    #[test]
    fn the_hold_agrees_with_a_fine_integration() {
        let model = MOTOR.continuous();
        let hold = model.discretise(1e-3);
        let start = Vector3::new(0.3, 20.0, 0.05);
        let (v, torque) = (2.4, 1.1e-3);
        let stepped = hold.phi * start + hold.gamma * v - hold.eta * torque;
        let integrated = integrate(&model, start, v, torque, 1e-3);
        let error = (stepped - integrated).component_div(&Vector3::new(1e-2, 1.0, 0.1)).norm();
        assert!(error < 1e-9, "{error:e}: {stepped} against {integrated}");
    }

    #[test]
    fn the_hold_agrees_with_the_series_where_it_converges() {
        let slow = MotorValues { inductance: 0.05, ..MOTOR }.continuous();
        let period = 1e-4;
        let hold = slow.discretise(period);
        let (mut term, mut phi) = (Matrix3::identity(), Matrix3::identity());
        let (mut integral, mut power) = (Matrix3::identity() * period, Matrix3::identity() * period);
        for n in 1..40 {
            term = term * slow.a * period / f64::from(n);
            phi += term;
            power = power * slow.a * period / f64::from(n + 1);
            integral += power;
        }
        assert!((hold.phi - phi).norm() < 1e-12 * phi.norm());
        assert!((hold.gamma - integral * slow.b).norm() < 1e-12 * hold.gamma.norm());
        assert!((hold.eta - integral * slow.g).norm() < 1e-12 * hold.eta.norm());
    }

    #[test]
    fn without_inductance_the_motor_is_of_first_order() {
        let model = MotorValues { inductance: 1e-7, ..MOTOR };
        let hold = model.continuous().discretise(1e-3);
        let rate = (model.torque_constant.powi(2) / model.resistance + model.viscous) / model.inertia;
        assert!((hold.phi[(1, 1)] - (-rate * 1e-3).exp()).abs() < 1e-5);
        assert!(hold.phi[(2, 2)].abs() < 1e-4);
    }
}
