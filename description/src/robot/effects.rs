//! `[effects.NAME]`: what the model has beyond the linear motor.

use super::Quantity;
use crate::schema::table;

table! {
    /// `[effects.NAME]`: a table that is there is an effect that the model has.
    #[derive(Default)]
    pub struct Effects {
        /// Constant friction; excluded by `stribeck_friction`, which contains it.
        coulomb_friction: Option<CoulombFriction>,
        /// Friction that falls with speed.
        stribeck_friction: Option<StribeckFriction>,
        /// Friction that grows with the torque through the gears.
        load_friction: Option<LoadFriction>,
        /// Gravity on the eccentric.
        gravity_tilt: Option<GravityTilt>,
        /// Voltage lost in the bridge.
        driver_drop: Option<DriverDrop>,
        /// Duty below which the bridge does nothing.
        driver_deadband: Option<DriverDeadband>,
        /// The bridge's supply falls under load.
        battery_sag: Option<BatterySag>,
        /// The sensor's angle error over a turn.
        sensor_nonlinearity: Option<SensorNonlinearity>,
        /// The reading is late.
        sensor_delay: Option<SensorDelay>,
        /// The feet's friction falls with their sliding speed.
        foot_stribeck: Option<FootStribeck>,
        /// The feet's friction differs along and across the module.
        foot_anisotropy: Option<FootAnisotropy>,
        /// The feet's friction coefficient falls with their load.
        foot_load_friction: Option<FootLoadFriction>,
        /// The ground is a slope.
        ground_slope: Option<GroundSlope>,
    }
}

table! {
    /// `[effects.coulomb_friction]`
    pub struct CoulombFriction {
        /// Sliding level.
        torque_nm: Quantity = 0.0..=10.0,
        /// Presliding length (Dahl).
        presliding_deg: Quantity = 0.001..=30.0,
    }
}

table! {
    /// `[effects.stribeck_friction]`: level `torque + excess·exp(−(ω/ω_s)²)`.
    pub struct StribeckFriction {
        /// Sliding level at speed.
        torque_nm: Quantity = 0.0..=10.0,
        /// How much higher at rest.
        breakaway_excess_nm: Quantity = 0.0..=10.0,
        /// Stribeck speed.
        speed_rad_per_s: Quantity = 0.001..=1000.0,
        /// Presliding length (Dahl).
        presliding_deg: Quantity = 0.001..=30.0,
    }
}

table! {
    /// `[effects.load_friction]`
    pub struct LoadFriction {
        /// Friction per transmitted torque |τ_motor − τ_external|.
        coefficient: Quantity = 0.0..=1.0,
        /// Presliding length (Dahl).
        presliding_deg: Quantity = 0.001..=30.0,
    }
}

table! {
    /// `[effects.gravity_tilt]`: torque `−torque·sin(θ − direction)`.
    pub struct GravityTilt {
        /// m g r sin(tilt).
        torque_nm: Quantity = 0.0..=10.0,
        /// Shaft angle at which the mass hangs.
        direction_deg: Quantity = -360.0..=360.0,
    }
}

table! {
    /// `[effects.driver_drop]`
    pub struct DriverDrop {
        /// At zero current.
        drop_v: Quantity = 0.0..=10.0,
        /// Rise with current.
        slope_ohm: Quantity = 0.0..=100.0,
    }
}

table! {
    /// `[effects.driver_deadband]`
    pub struct DriverDeadband {
        /// |duty| up to which nothing comes out; beyond it the output is `duty − sign·width`.
        width_duty: Quantity = 0.0..=0.9,
    }
}

table! {
    /// `[effects.battery_sag]`: the bridge's supply under its own current (duty × motor current).
    pub struct BatterySag {
        /// At once.
        resistance_ohm: Quantity = 0.0..=100.0,
        /// More, with the relaxation time.
        relaxation_ohm: Quantity = 0.0..=100.0,
        /// Relaxation time.
        relaxation_s: Quantity = 1e-4..=1000.0,
    }
}

table! {
    /// `[effects.sensor_nonlinearity]`: reading `θ + Σ_k (cos_k cos kθ + sin_k sin kθ)`, k = 1, 2.
    pub struct SensorNonlinearity {
        /// First harmonic, cosine.
        cos1_deg: Quantity = -30.0..=30.0,
        /// First harmonic, sine.
        sin1_deg: Quantity = -30.0..=30.0,
        /// Second harmonic, cosine.
        cos2_deg: Quantity = -30.0..=30.0,
        /// Second harmonic, sine.
        sin2_deg: Quantity = -30.0..=30.0,
    }
}

table! {
    /// `[effects.sensor_delay]`
    pub struct SensorDelay {
        /// The reading is this old.
        delay_s: Quantity = 0.0..=0.1,
    }
}

table! {
    /// `[effects.foot_stribeck]`: `µ(v) = µ (1 + excess·exp(−(v/v_s)²))`, µ being `ground.friction`.
    pub struct FootStribeck {
        /// How much higher at rest, share of the friction at speed.
        excess_share: Quantity = 0.0..=10.0,
        /// Stribeck speed.
        speed_m_per_s: Quantity = 1e-5..=10.0,
    }
}

table! {
    /// `[effects.foot_anisotropy]`
    pub struct FootAnisotropy {
        /// Friction across the module as a share of the friction along it, which is `ground.friction`.
        lateral_share: Quantity = 0.01..=100.0,
    }
}

table! {
    /// `[effects.foot_load_friction]`: `µ(F) = µ (F/F₀)^−exponent`, at most 3 µ.
    pub struct FootLoadFriction {
        /// Exponent; 1/3 for a smooth elastic sphere.
        exponent: Quantity = 0.0..=1.0,
        /// The load F₀ at which the coefficient is `ground.friction`.
        load_n: Quantity = 1e-4..=100.0,
    }
}

table! {
    /// `[effects.ground_slope]`
    pub struct GroundSlope {
        /// Inclination of the ground.
        angle_deg: Quantity = 0.0..=60.0,
        /// Where it rises to: 0 ahead of the robot, 90 to its left.
        direction_deg: Quantity = -360.0..=360.0,
    }
}
