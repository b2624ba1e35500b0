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

#[cfg(test)]
mod tests {
    use super::*;

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
