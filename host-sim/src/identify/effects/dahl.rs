//! Dahl's spring (P. R. Dahl, Aerospace Corp. TOR-158, 1968), dz/dx = (1 − z sgn ẋ)/X: after a reversal half way it is softer than
//! stops side by side, and what swings to and fro makes it forget.

use rayon::prelude::*;

use super::stops::{COARSE, FINE, about, coarse, log_prior};
use crate::identify::balance::{Alternative, Balance, Company};
use crate::identify::term::Parameter;

/// Finer grids, one about the best of the other: to 0.3 %. What the spring keeps where motion ends by a ring hangs on the way of each
/// swing: one that is off by 15 % was seen to leave half more, so 4 %, the most by a single finer grid, leaves some 6 %.
const ZOOMS: i32 = 3;
/// Name of the way among the constants.
const YIELD_WAY: &str = "yield_way";

/// A spring of an effect.
pub(super) struct Spring<'s> {
    /// The effect's id.
    pub(super) effect: &'static str,
    /// A large sliding force or torque.
    pub(super) size: f64,
    /// Name of that parameter, with its unit.
    pub(super) sliding: &'s str,
    /// Unit of the way, as names have it.
    pub(super) unit: &'s str,
    /// Column of a way over all rows.
    pub(super) column: &'s (dyn Fn(f64) -> Vec<f64> + Sync),
    /// What a column is, times its way, with its unit, where it is the spring's own deflection.
    pub(super) deflection: Option<&'s str>,
}

impl Spring<'_> {
    /// With this way.
    fn of_way(&self, way: f64) -> Alternative {
        let column = (self.column)(way);
        let follows = |name: &str| (name.to_string(), column.iter().map(|z| way * z).collect());
        Alternative {
            form: "Dahl's spring".into(),
            coordinate: self.deflection.map(follows),
            constants: vec![(format!("{YIELD_WAY}_{}", self.unit), way)],
            ..Alternative::columns(
                self.effect,
                vec![Parameter::positive(self.sliding, self.size)],
                vec![column],
            )
        }
    }

    /// With the way that was found on other logs; `None` where what was found is no spring.
    pub(super) fn of_constants(&self, constants: &[(String, f64)]) -> Option<Alternative> {
        let (_, way) = constants.iter().find(|(name, _)| name.starts_with(YIELD_WAY))?;
        Some(self.of_way(*way))
    }

    /// With the way that a balance asks for beside what stands in it, between these.
    pub(super) fn searched(
        &self,
        balance: &Balance,
        company: Company<'_>,
        between @ [_, longest]: [f64; 2],
    ) -> Alternative {
        let best = |ways: Vec<f64>| {
            let evidence = |way: f64| balance.solve_forms(&company.with(&self.of_way(way))).log_evidence;
            let tried: Vec<(f64, f64)> = ways.into_par_iter().map(|way| (evidence(way), way)).collect();
            tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(longest, |(_, way)| way)
        };
        let ways = coarse(between);
        let (mut way, mut apart, mut log_prior) = (best(ways.clone()), COARSE, log_prior(&ways));
        for _ in 0..ZOOMS {
            way = best(about(way, apart).collect());
            apart = apart.powf(1.0 / f64::from(FINE));
        }
        log_prior -= f64::from(ZOOMS - 1) * f64::from(FINE).ln();
        Alternative { log_prior, ..self.of_way(way) }
    }
}

/// The spring over its full force, −1 to 1.
pub(super) fn spring(position: &[f64], way: f64) -> Vec<f64> {
    let (mut z, mut last) = (0.0, position.first().copied().unwrap_or(0.0));
    let follow = |x: &f64| {
        let moved = (x - last) / way;
        last = *x;
        if moved != 0.0 {
            z = moved.signum() + (z - moved.signum()) * (-moved.abs()).exp();
        }
        z
    };
    position.iter().map(follow).collect()
}
