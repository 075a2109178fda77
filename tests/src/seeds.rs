//! Seeds for judging.

/// First of a release campaign's seeds, drawn anew: above every seed that was ever used by hand, and short enough to be typed.
///
/// # Errors
/// The machine gives no random numbers.
pub fn fresh() -> Result<u64, getrandom::Error> {
    const LEAST: u64 = 1_000_000;
    let mut bytes = [0; 8];
    getrandom::fill(&mut bytes)?;
    Ok(LEAST + u64::from_le_bytes(bytes) % 1_000_000_000_000)
}
