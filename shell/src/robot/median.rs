//! Several conversions make one code.

use control::AdcCode;

/// Most conversions in a tick that a robot file can ask for.
pub const MOST_CONVERSIONS: usize = 64;

/// Takes `count` conversions (1 … [`MOST_CONVERSIONS`]): their median, of an even number the lower middle one, and how
/// many are farther than `outlier_lsb` from it.
pub(super) fn median(count: u8, outlier_lsb: u16, mut convert: impl FnMut() -> AdcCode) -> (AdcCode, u32) {
    let mut codes = [AdcCode::default(); MOST_CONVERSIONS];
    let count = usize::from(count).clamp(1, MOST_CONVERSIONS);
    let (codes, _) = codes.split_at_mut(count);
    codes.fill_with(&mut convert);
    codes.sort_unstable_by_key(|code| code.0);
    let middle = codes.get((count - 1) / 2).copied().unwrap_or_default();
    let far = codes.iter().filter(|code| code.0.abs_diff(middle.0) > outlier_lsb).count();
    (middle, u32::try_from(far).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(codes: &[u16]) -> (u16, u32) {
        let mut left = codes.iter();
        let count = u8::try_from(codes.len()).expect("few");
        let (code, outliers) = median(count, 50, || AdcCode(*left.next().expect("no more than asked for")));
        assert_eq!(left.next(), None, "every conversion is taken");
        (code.0, outliers)
    }

    #[test]
    fn the_middle_one_and_the_far_ones() {
        assert_eq!(of(&[7]), (7, 0));
        assert_eq!(of(&[100, 4095, 110]), (110, 1));
        assert_eq!(of(&[200, 100]), (100, 1));
        assert_eq!(of(&[0, 1000, 1050, 951, 1051]), (1000, 2));
        assert_eq!(of(&[3; MOST_CONVERSIONS]), (3, 0));
    }
}
