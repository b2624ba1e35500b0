//! Rate-independent hysteresis as stops side by side (W. D. Iwan, J. Appl. Mech. 33, 1966): y = Σ f_w · stop_w(x)/w, f_w ≥ 0.
//!
//! A stop of width w follows x and slides at ± w. Their sum has any concave curve after a reversal, the same after each. The
//! widths are those that the logs ask for: of a coarse grid, then of a fine one about what was found.

use crate::identify::balance::{Alternative, Balance, Company};
use crate::identify::term::Parameter;

/// Factor between neighbours of the coarse grid, and steps of the fine one in it.
pub(super) const COARSE: f64 = std::f64::consts::SQRT_2;
pub(super) const FINE: i32 = 4;
/// Names of the widths among the constants.
const WIDTH: &str = "width_";

/// Widths from the longest on down to the shortest, the coarse grid.
pub(super) fn coarse([shortest, longest]: [f64; 2]) -> Vec<f64> {
    let count = ((longest / shortest).ln() / COARSE.ln()).round() as i32;
    (0..=count).map(|i| longest * COARSE.powi(-i)).collect()
}

/// A width of a grid whose neighbours are `factor` apart, and the finer ones up to them.
pub(super) fn about(width: f64, factor: f64) -> impl Iterator<Item = f64> {
    (1 - FINE..FINE).map(move |step| width * factor.powf(f64::from(step) / f64::from(FINE)))
}

/// ln prior of a width that is chosen on these grids.
pub(super) fn log_prior(coarse: &[f64]) -> f64 {
    -(f64::from(FINE) * coarse.len() as f64).ln()
}

/// A play operator: follows its input at a distance of at most `width`.
pub(super) fn play(values: &[f64], width: f64) -> impl Iterator<Item = f64> + '_ {
    let mut state = values.first().copied().unwrap_or(0.0);
    values.iter().map(move |x| {
        state = state.clamp(x - width, x + width);
        state
    })
}

/// A stop over its width, −1 to 1.
pub(super) fn stop(values: &[f64], width: f64) -> Vec<f64> {
    values.iter().zip(play(values, width)).map(|(x, follows)| (x - follows) / width).collect()
}

/// Stops of an effect.
pub(super) struct Stops<'s> {
    /// The effect's id.
    pub(super) effect: &'static str,
    /// A large amplitude of their sum, of which each has its share: more stops are not more friction.
    pub(super) size: f64,
    /// Units of the widths and of the amplitudes, as names have them.
    pub(super) units: [&'static str; 2],
    /// Columns of a width over all rows.
    pub(super) column: &'s dyn Fn(f64) -> Vec<f64>,
    /// What a column is, times its width, with its unit, where it is the stop's own deflection.
    pub(super) deflection: Option<&'s str>,
}

impl Stops<'_> {
    /// With these widths.
    pub(super) fn of_widths(&self, widths: &[f64]) -> Alternative {
        let [of_width, of_size] = self.units;
        let own = self.size / (widths.len().max(1) as f64).sqrt();
        let parameter = |i: usize| Parameter::positive(format!("sliding_at_width_{}_{of_size}", i + 1), own);
        let constant = |(i, width): (usize, &f64)| (format!("{WIDTH}{}_{of_width}", i + 1), *width);
        Alternative {
            constants: widths.iter().enumerate().map(constant).collect(),
            ..Alternative::columns(
                self.effect,
                (0..widths.len()).map(parameter).collect(),
                widths.iter().map(|width| (self.column)(*width)).collect(),
            )
        }
    }

    /// With the widths that were found on other logs.
    pub(super) fn of_constants(&self, constants: &[(String, f64)]) -> Alternative {
        let widths: Vec<f64> =
            constants.iter().filter(|(name, _)| name.starts_with(WIDTH)).map(|c| c.1).collect();
        self.of_widths(&widths)
    }

    /// With the widths that a balance asks for beside what stands in it, of these and those about them.
    pub(super) fn searched(&self, balance: &Balance, company: Company<'_>, coarse: &[f64]) -> Alternative {
        // Those with a size, and that of the largest.
        let asked_for = |widths: &[f64]| -> (Vec<f64>, Option<f64>) {
            let form = self.of_widths(widths);
            let solved = balance.solve_forms(&company.with(&form));
            let own = &solved.p[solved.p.len() - widths.len()..];
            let sized = || widths.iter().zip(own).filter(|(_, size)| **size > 0.0);
            let largest = sized().max_by(|a, b| a.1.total_cmp(b.1)).map(|(width, _)| *width);
            (sized().map(|(width, _)| *width).collect(), largest)
        };
        let longest = coarse.first().copied().unwrap_or(0.0);
        let mut fine: Vec<f64> = asked_for(coarse)
            .0
            .into_iter()
            .flat_map(|w| about(w, COARSE))
            .filter(|w| *w <= longest)
            .collect();
        fine.sort_by(|a, b| b.total_cmp(a));
        fine.dedup_by(|a, b| *a > 0.999 * *b);
        let (found, largest) = asked_for(&fine);
        if found.is_empty() {
            return self.of_widths(coarse);
        }
        let follows = |(name, width): (&str, f64)| {
            (name.to_string(), (self.column)(width).iter().map(|share| width * share).collect())
        };
        Alternative {
            // The widths were chosen among so many.
            log_prior: found.len() as f64 * log_prior(coarse),
            coordinate: self.deflection.zip(largest).map(follows),
            ..self.of_widths(&found)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::balance::tests::white_log;
    use crate::identify::noise::tests::white;

    #[test]
    fn the_widths_of_a_hysteresis_are_found_between_those_of_the_coarse_grid() {
        const ROWS: usize = 6000;
        let x: Vec<f64> = (0..ROWS)
            .map(|i| {
                let t = 0.002 * i as f64;
                (1.3 * t).sin() + 0.4 * (7.1 * t).sin() + 0.1 * (31.0 * t).sin()
            })
            .collect();
        let (first, second) = (stop(&x, 0.067), stop(&x, 0.31));
        let noise = white(ROWS, 4);
        let y: Vec<f64> =
            (0..ROWS).map(|i| 2.0 * x[i] + 0.2 * first[i] + 0.1 * second[i] + 0.005 * noise[i]).collect();
        let balance = Balance::new(
            y,
            vec![(Parameter::amplitude("gain", 10.0), x.clone())],
            &[white_log(ROWS, 0.005)],
            1.0,
        );
        let stops = Stops {
            effect: "lever_hysteresis",
            size: 0.5,
            units: ["nm", "nm"],
            column: &|width| stop(&x, width),
            deflection: None,
        };
        let alone = Company { forms: &[], residual: &balance.response };
        let found = stops.searched(&balance, alone, &coarse([0.01, 0.64]));
        let solved = balance.solve_forms(&[&found]);
        let about = |width: f64| -> f64 {
            let near = |(own, size): (&(String, f64), &f64)| {
                if (own.1 / width).ln().abs() < 0.1 { *size } else { 0.0 }
            };
            found.constants.iter().zip(&solved.p[1..]).map(near).sum()
        };
        assert!(
            (about(0.067) - 0.2).abs() < 0.01 && (about(0.31) - 0.1).abs() < 0.01,
            "{:?} {:?}",
            found.constants,
            solved.p
        );
        // Held-out logs take what was found.
        assert_eq!(stops.of_constants(&found.constants).columns, found.columns);
    }
}
