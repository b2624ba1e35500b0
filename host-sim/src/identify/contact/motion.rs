//! The disc's angle from the columns of its angle and its speed, each where it is the quieter one.

use crate::identify::filters::{gaussian, rms, shifted};
use crate::identify::grid::Grid;
use crate::identify::noise;

/// Width over which the angle is blended into the integrated speed, samples: above its frequency the integrated speed is
/// quieter, below it the angle.
const BLEND: f64 = 12.0;
/// A speed that lags by more samples than a mean over four has been filtered more than a shift in time makes up for.
const LATEST: f64 = 2.5;

/// A logged speed.
pub(super) struct Speed {
    /// On the grid, rad/s.
    pub(super) values_rad_s: Vec<f64>,
    /// How far it lags the angle, s; 0 where it is in time.
    pub(super) lag_s: f64,
}

/// How the disc moved.
pub(super) struct Motion {
    /// Its angle, rad.
    pub(super) angle_rad: Vec<f64>,
    /// Noise of the angle's slope from sample to sample, rad/s.
    pub(super) slope_noise_rad_s: f64,
    /// Noise of the angle itself, rad; 0 where there is none but a speed's integral, whose errors are no noise of samples.
    pub(super) noise_rad: f64,
    /// By how much the instants of the logged angle jitter, s, where the speed is used for what is fast in its place.
    pub(super) jitter_s: Option<f64>,
}

impl Motion {
    /// From the columns that there are, on a grid.
    pub(super) fn new(grid: &Grid, speed: Option<&Speed>, angle: Option<&[f64]>) -> Self {
        let step_s = grid.step_s;
        let noise = |values: &[f64]| noise::standard_deviation(values);
        let of = |angle_rad: Vec<f64>, slope_noise_rad_s| Self {
            angle_rad,
            slope_noise_rad_s,
            noise_rad: 0.0,
            jitter_s: None,
        };
        let logged = |angle: &[f64]| {
            let noise_rad = noise(angle);
            Self { noise_rad, ..of(angle.to_vec(), std::f64::consts::SQRT_2 * noise_rad / step_s) }
        };
        let both = |speed_rad_s: &[f64], angle: &[f64]| {
            let both = blended(speed_rad_s, angle, step_s);
            Self { noise_rad: noise(&both), ..of(both, noise(speed_rad_s)) }
        };
        match (speed, angle) {
            (None, None) => of(vec![0.0; grid.len()], 0.0),
            (Some(Speed { values_rad_s, .. }), None) => {
                of(integrated(values_rad_s, step_s), noise(values_rad_s))
            }
            (None, Some(angle)) => logged(angle),
            (Some(Speed { values_rad_s, lag_s }), Some(angle)) => {
                let logged = logged(angle);
                if *lag_s == 0.0 && noise(values_rad_s) < logged.slope_noise_rad_s {
                    return both(values_rad_s, angle);
                }
                let jitter = noise::jitter(angle);
                let usual_rad = rms(values_rad_s) * step_s;
                if jitter * usual_rad > logged.noise_rad && lag_s.abs() < LATEST * step_s {
                    let both = both(&shifted(values_rad_s, lag_s / step_s), angle);
                    if noise::jitter(&both.angle_rad) < 0.5 * jitter {
                        return Self { jitter_s: Some(jitter * step_s), ..both };
                    }
                }
                logged
            }
        }
    }
}

fn integrated(speed_rad_s: &[f64], step_s: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = vec![0.0; speed_rad_s.len()];
    for i in 1..speed_rad_s.len() {
        sum += 0.5 * (speed_rad_s[i] + speed_rad_s[i - 1]) * step_s;
        sums[i] = sum;
    }
    sums
}

/// What is slow of the angle, and what is fast of the speed.
fn blended(speed_rad_s: &[f64], angle_rad: &[f64], step_s: f64) -> Vec<f64> {
    let from_speed = integrated(speed_rad_s, step_s);
    let off: Vec<f64> = from_speed.iter().zip(angle_rad).map(|(s, a)| s - a).collect();
    from_speed.iter().zip(gaussian(&off, BLEND, 0)).map(|(s, off)| s - off).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    const COUNT: usize = 12_000;
    const STEP_S: f64 = 1e-3;
    const COUNT_RAD: f64 = 5.2e-5;

    /// An angle whose instants jitter, and the drive's speed, a difference of counts over two of its own steps.
    fn columns(jitter_s: f64) -> (Grid, Speed, Vec<f64>) {
        let turned = |t: f64| 12.0 * (0.7 * t).sin();
        let counted = |t: f64| (turned(t) / COUNT_RAD).round() * COUNT_RAD;
        let time_s: Vec<f64> = (0..COUNT).map(|i| STEP_S * i as f64).collect();
        let angle = time_s.iter().zip(&white(COUNT, 3)).map(|(t, e)| counted(t + jitter_s * e)).collect();
        let speed = |t: &f64| (counted(*t) - counted(t - 2.0 * STEP_S)) / (2.0 * STEP_S);
        let values_rad_s = time_s.iter().map(speed).collect();
        (Grid::new(&time_s), Speed { values_rad_s, lag_s: STEP_S }, angle)
    }

    #[test]
    fn a_late_speed_says_what_is_fast_where_the_instants_of_the_angle_jitter() {
        let (grid, speed, angle) = columns(60e-6);
        let found = Motion::new(&grid, Some(&speed), Some(&angle));
        assert!(found.jitter_s.is_some_and(|s| (s / 60e-6 - 1.0).abs() < 0.15), "{:?}", found.jitter_s);
        let off = |angle_rad: &[f64]| {
            let truth = (0..COUNT).map(|i| 12.0 * (0.7 * STEP_S * i as f64).sin());
            rms(&angle_rad.iter().zip(truth).map(|(a, b)| a - b).collect::<Vec<_>>()[100..COUNT - 100])
        };
        assert!(off(&found.angle_rad) < 0.3 * off(&angle), "{} {}", off(&found.angle_rad), off(&angle));
        // Without jitter the angle is what it is, and so it is where the speed is far behind.
        let (grid, speed, angle) = columns(0.0);
        assert_eq!(Motion::new(&grid, Some(&speed), Some(&angle)).angle_rad, angle);
        let (grid, speed, angle) = columns(60e-6);
        let far = Speed { lag_s: 4e-3, ..speed };
        assert_eq!(Motion::new(&grid, Some(&far), Some(&angle)).angle_rad, angle);
    }
}
