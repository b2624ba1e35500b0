//! Whether a logged speed is in time with the logged angle: drives report a speed that they have filtered.
//!
//! Over a stretch ∫ω dt = Δθ − τ Δω where ω lags by τ: the slope of what is missing of the angle over the change of
//! speed, by least squares over all stretches.

/// Length of a stretch, s: noise averages out over it, and speeds change.
const STRETCH_S: f64 = 0.02;
/// A lag that is surely more than this share of a sample is one: channels of one scan are closer.
const IN_TIME: f64 = 0.05;
/// Standard errors within which it is not sure.
const SURELY: f64 = 3.0;

/// A lag, s, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    /// τ.
    pub lag_s: f64,
    /// Its standard error.
    pub std_s: f64,
}

/// The lag of a speed behind an angle; `None` where there is none that is sure to matter.
pub fn lag(time_s: &[f64], speed_rad_s: &[f64], angle_rad: &[f64]) -> Option<Lag> {
    let (mut changes, mut missing) = (Vec::new(), Vec::new());
    let (mut from, mut sum) = (0, 0.0);
    for at in 1..time_s.len() {
        sum += 0.5 * (speed_rad_s[at] + speed_rad_s[at - 1]) * (time_s[at] - time_s[at - 1]);
        if time_s[at] - time_s[from] < STRETCH_S {
            continue;
        }
        let off = angle_rad[at] - angle_rad[from] - sum;
        // An angle may begin anew at each turn.
        if off.abs() < std::f64::consts::PI {
            changes.push(speed_rad_s[at] - speed_rad_s[from]);
            missing.push(off);
        }
        (from, sum) = (at, 0.0);
    }
    let count = changes.len() as f64;
    let square: f64 = changes.iter().map(|c| c * c).sum();
    if count < 2.0 || square <= 0.0 {
        return None;
    }
    let lag_s = changes.iter().zip(&missing).map(|(c, m)| c * m).sum::<f64>() / square;
    let left: f64 = changes.iter().zip(&missing).map(|(c, m)| (m - lag_s * c).powi(2)).sum();
    let std_s = (left / (count - 1.0) / square).sqrt();
    let step_s = (time_s[time_s.len() - 1] - time_s[0]) / (time_s.len() - 1) as f64;
    (lag_s.abs() > IN_TIME * step_s + SURELY * std_s).then_some(Lag { lag_s, std_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 1e-3;

    /// A disc that speeds up and slows down, and its speed a while before.
    fn found(late_s: f64) -> Option<Lag> {
        let time_s: Vec<f64> = (0..8000).map(|i| STEP_S * f64::from(i)).collect();
        let speed: Vec<f64> = time_s.iter().map(|t| 4.0 + 3.0 * (2.0 * (t - late_s)).sin()).collect();
        let angle: Vec<f64> = time_s.iter().map(|t| 4.0 * t - 1.5 * (2.0 * t).cos()).collect();
        lag(&time_s, &speed, &angle)
    }

    #[test]
    fn a_filtered_speed_is_found_to_lag_and_one_that_is_in_time_is_not() {
        assert_eq!(found(0.0), None);
        for late_s in [2e-3, 5e-4, -1e-3] {
            let Lag { lag_s, std_s } = found(late_s).expect("it lags");
            assert!((lag_s - late_s).abs() < 1e-5 + 3.0 * std_s, "{late_s}: {lag_s} {std_s}");
        }
    }
}
