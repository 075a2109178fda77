//! What goes back to rest at a rate.

/// Where `value` is after a time (s) on its way to a constant target, `dv/dt = (target − v)/τ` in closed form; at the target
/// where the time constant τ (s) is 0.
#[inline]
pub fn relaxed(value: f64, target: f64, time: f64, time_constant: f64) -> f64 {
    let left = if time_constant <= 0.0 { 0.0 } else { (-time / time_constant).exp() };
    target + (value - target) * left
}
