//! Numbers as text: the shortest decimal that reads back as the same f64.

/// Appends a number to a line; whole numbers come without `.0`.
pub fn push(text: &mut String, value: f64) {
    let mut buffer = ryu::Buffer::new();
    let digits = buffer.format(value);
    text.push_str(digits.strip_suffix(".0").unwrap_or(digits));
}

/// A number as text.
pub fn text(value: f64) -> String {
    let mut text = String::new();
    push(&mut text, value);
    text
}

/// The shortest decimal that names this `f32`, as `f64`: what stands in a log is then as short as what
/// was measured.
#[must_use]
pub fn widen(value: f32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return f64::from(value);
    }
    let mut buffer = ryu::Buffer::new();
    buffer.format_finite(value).parse().unwrap_or_else(|_| f64::from(value))
}

/// Angle of an encoder count, rounded to 1 nrad, a ten-thousandth of a count, so that it is short in a log.
#[allow(clippy::cast_precision_loss)]
#[must_use]
pub fn angle_rad(count: i64, counts_per_rev: u32) -> f64 {
    let angle = count as f64 * std::f64::consts::TAU / f64::from(counts_per_rev.max(1));
    (angle * 1e9).round() / 1e9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_numbers_stay_short_and_counts_become_angles() {
        assert_eq!(widen(0.1f32), 0.1);
        assert_eq!(widen(-88.0f32), -88.0);
        assert_eq!(angle_rad(100_000, 480_000), 1.308_996_939);
        assert_eq!(angle_rad(-480_000 * 7, 480_000), -43.982_297_150);
    }

    #[test]
    fn numbers_are_compact_and_read_back_as_the_same_bits() {
        for (value, expected) in [(0.0, "0"), (-3.0, "-3"), (0.1, "0.1"), (1e-7, "1e-7"), (1e300, "1e300")] {
            assert_eq!(text(value), expected);
        }
        let mut x = 1.0e-12_f64;
        while x < 1e12 {
            x *= 1.37;
            assert_eq!(text(-x).parse::<f64>().unwrap().to_bits(), (-x).to_bits());
        }
    }
}
