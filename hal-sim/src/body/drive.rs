//! What turns the eccentric.

/// What turns a body's eccentric during a step. Angles against the module, counter-clockwise seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// At a prescribed phase: angle = speed·time, whatever torque that takes.
    Phase {
        /// Speed of the shaft against its module, rad/s.
        speed: f64,
    },
    /// MuJoCo's position servo with the phase fed forward, as the reference model has it:
    /// `torque = stiffness·(speed·t − angle) + damping·(speed − dangle/dt)`.
    Servo {
        /// Speed of the shaft against its module, rad/s.
        speed: f64,
        /// Stiffness of the servo, N·m/rad.
        stiffness: f64,
        /// Damping of the servo, N·m·s/rad.
        damping: f64,
    },
    /// As a motor says that turned on its own for the step: its angle, speed and acceleration in the step's middle.
    Motor {
        /// Angle of the shaft against its module, rad.
        angle: f64,
        /// Speed of the shaft against its module, rad/s.
        speed: f64,
        /// Acceleration of the shaft against its module, rad/s².
        acceleration: f64,
        /// Angular momentum of what spins in the gearmotor, over the output shaft's speed, kg·m².
        rotor_inertia: f64,
    },
}
