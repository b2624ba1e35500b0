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
    let digits = buffer.format_finite(value);
    few_digits(digits).unwrap_or_else(|| digits.parse().unwrap_or_else(|_| f64::from(value)))
}

/// A plain decimal of at most fifteen digits: its digits as a whole number and the power of ten are exact in f64, so that one
/// division rounds it as the parser of the standard library would, in a fifth of the time. `None` for any other.
fn few_digits(text: &str) -> Option<f64> {
    const POWERS: [f64; 16] =
        [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (negative, digits) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
    if digits.len() > POWERS.len() {
        return None;
    }
    let (mut whole, mut point) = (0_u32, None);
    for (at, byte) in digits.bytes().enumerate() {
        match byte {
            b'0'..=b'9' => whole = whole.checked_mul(10)?.checked_add(u32::from(byte - b'0'))?,
            b'.' => point = Some(digits.len() - 1 - at),
            _ => return None,
        }
    }
    let value = f64::from(whole) / POWERS[point.unwrap_or(0)];
    Some(if negative { -value } else { value })
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
    fn single_precision_numbers_widen_to_what_their_digits_say() {
        // Every 7919th of all finite f32.
        for bits in (0..=u32::MAX).step_by(7919) {
            let value = f32::from_bits(bits);
            if value.is_finite() {
                let expected: f64 = ryu::Buffer::new().format_finite(value).parse().unwrap();
                assert_eq!(
                    widen(value).to_bits(),
                    if value == 0.0 { f64::from(value) } else { expected }.to_bits()
                );
            }
        }
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
