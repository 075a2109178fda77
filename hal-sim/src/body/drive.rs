//! What turns the eccentric.

/// What turns a body's eccentric during a step. Angles against the module, counter-clockwise seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// At a prescribed phase: angle = speed·time, whatever torque that takes.
    Phase {
        /// rad/s.
        speed: f64,
    },
    /// MuJoCo's position servo with the phase fed forward, as the reference model has it:
    /// `torque = stiffness·(speed·t − angle) + damping·(speed − dangle/dt)`.
    Servo {
        /// rad/s.
        speed: f64,
        /// N·m/rad.
        stiffness: f64,
        /// N·m·s/rad.
        damping: f64,
    },
    /// As a motor says that turned on its own for the step: its angle, speed and acceleration in the step's middle.
    Motor {
        /// rad.
        angle: f64,
        /// rad/s.
        speed: f64,
        /// rad/s².
        acceleration: f64,
        /// Angular momentum of what spins in the gearmotor, over the output shaft's speed, kg·m².
        spin_inertia: f64,
    },
}
