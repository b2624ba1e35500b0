//! Numbers as people write them: as many digits as are known.

/// A value with its standard deviation: two digits of the deviation, and the value to the same place. `27754 ± 60`.
///
/// Very large and very small ones have a power of ten: `(1.234 ± 0.020)e9`.
#[must_use]
pub fn with_uncertainty(value: f64, std: f64) -> String {
    if !value.is_finite() {
        return "not a number".into();
    }
    if !(std.is_finite() && std > 0.0) {
        return plain(value);
    }
    let size = value.abs().max(std);
    if !(1e-3..1e6).contains(&size) {
        let power = exponent(size);
        let scale = 10f64.powi(power);
        return format!("({})e{power}", fixed(value / scale, std / scale));
    }
    fixed(value, std)
}

/// The same with a unit behind.
#[must_use]
pub fn with_uncertainty_in(value: f64, std: f64, unit: &str) -> String {
    format!("{} {unit}", with_uncertainty(value, std)).trim_end().to_owned()
}

/// A value whose uncertainty is not known: four digits.
#[must_use]
pub fn plain(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if !(1e-3..1e6).contains(&value.abs()) {
        return format!("{value:.3e}");
    }
    decimals(value, 3 - exponent(value))
}

fn fixed(value: f64, std: f64) -> String {
    // 0.0996 has two digits as 0.100: the rounded deviation says where they are.
    let first = 1 - exponent(std);
    let places = 1 - exponent((std * 10f64.powi(first)).round() / 10f64.powi(first));
    format!("{} ± {}", decimals(value, places), decimals(std, places))
}

#[allow(clippy::cast_possible_truncation)]
fn exponent(value: f64) -> i32 {
    value.abs().log10().floor() as i32
}

/// Rounded to so many decimals; tens and hundreds where negative.
#[allow(clippy::cast_sign_loss)]
fn decimals(value: f64, places: i32) -> String {
    let scale = 10f64.powi(-places.min(0));
    let rounded = (value / scale).round() * scale;
    let value = if places < 0 { rounded } else { value };
    let text = format!("{value:.*}", places.max(0) as usize);
    if text.trim_start_matches('-').chars().all(|c| matches!(c, '0' | '.')) {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_has_the_digits_that_its_deviation_allows() {
        for (value, std, text) in [
            (27_754.085_493, 60.0, "27754 ± 60"),
            (27_754.085_493, 612.3, "27750 ± 610"),
            (0.123_456, 0.001_234, "0.1235 ± 0.0012"),
            (-0.000_4, 0.02, "0.000 ± 0.020"),
            (3.0, 0.099_6, "3.00 ± 0.10"),
            (1.234_5e9, 2e7, "(1.234 ± 0.020)e9"),
            (-2.5e-7, 1e-8, "(-2.50 ± 0.10)e-7"),
            (5.0, 0.0, "5.000"),
            (5.0, f64::INFINITY, "5.000"),
            (f64::NAN, 1.0, "not a number"),
        ] {
            assert_eq!(with_uncertainty(value, std), text);
        }
        assert_eq!(with_uncertainty_in(95.11, 0.12, "kg"), "95.11 ± 0.12 kg");
    }

    #[test]
    fn a_value_alone_has_four_digits() {
        let texts = [0.0, 1234.56, 0.012_345, -7.0, 1e-9].map(plain);
        assert_eq!(texts, ["0", "1235", "0.01235", "-7.000", "1.000e-9"]);
    }
}
