//! The angle error of one specimen of a sensor, drawn where the file knows only bounds.

use effects::{Effect, SensorNonlinearity};
use robot_file::robot::{Effects, Quantity};

use crate::random::Stream;

/// The quantities of `[effects.sensor_nonlinearity]`, in the order of its parameters.
fn quantities(effects: &Effects) -> Option<Vec<&Quantity>> {
    let spec = SensorNonlinearity::SPEC;
    spec.parameters.iter().map(|one| effects.quantity(spec.name, one.key)).collect()
}

/// The error of one specimen; `None` where the file has no such effect. Where the file states values (an identified
/// sensor) these are it. Where all its values are zero the file knows only bounds: see [`draw_unknown`].
#[must_use]
pub fn draw(effects: &Effects, stream: &mut Stream) -> Option<SensorNonlinearity> {
    let stated = effects.get::<SensorNonlinearity>()?;
    if quantities(effects)?.iter().any(|quantity| quantity.value != 0.0) {
        return Some(stated);
    }
    draw_unknown(effects, stream)
}

/// The error of a specimen that nobody has identified; `None` where the file has no such effect. The shape is drawn from
/// the four ranges, and its peak uniformly up to the largest of their ends (an amplitude of ±3° bounds the whole error to
/// ±3°).
#[must_use]
pub fn draw_unknown(effects: &Effects, stream: &mut Stream) -> Option<SensorNonlinearity> {
    let quantities = quantities(effects)?;
    let bound = quantities.iter().map(|quantity| quantity.low.abs().max(quantity.high.abs())).fold(0.0, f64::max);
    let amplitudes: Vec<f64> =
        quantities.iter().map(|quantity| stream.uniform(quantity.low, quantity.high).to_radians()).collect();
    Some(SensorNonlinearity::from_values(&amplitudes).with_peak(stream.uniform(0.0, bound).to_radians()))
}
