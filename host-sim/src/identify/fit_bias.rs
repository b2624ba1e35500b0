//! What the observed slip makes of logs whose numbers are known, and the bias that it shows of itself.
//!
//! The observer knows force and load only at the samples: it interpolates what rings between them, sees a slip that begins or
//! ends within one late, and smooths what it differentiates. Each of these moves the numbers that fit best, by the same in
//! every log of the kind. So the fitted contact is simulated with the logs' own motion and load, noise is put on all channels,
//! and the same likelihood is asked where its top is: at φ + b(φ), with φ = ln g at some speeds and what is no number of the curve
//! ([`super::fit_curve`]), where b changes little along the ridge that the law's numbers make. The numbers are those that come
//! closest, with the prior, to the measured logs' top less b, b being taken where they are (indirect inference, Gouriéroux, Monfort
//! and Renault 1993). No instant of slip has to be that of the rig. b is the mean over noise and the same noise with the other sign,
//! so that what it does in first order cancels and what it biases stays.
//! Left out: what differs between the rig and the model.

use nalgebra::DVector;
use rayon::prelude::*;

use super::contact::log::ContactLog;
use super::contact::problem::{Baseline, Near, Numbers, Problem};
use super::fit_curve::{Likelihood, Seen, along_curve};
use super::fit_parameters::{set_all, values};
use super::noise::{White, standard_deviation};
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::input_error::InputError;
use crate::predict::curve::{resampled, shifted};
use crate::predict::{BridgeModel, ContactInputs, integral, simulate_friction};

/// Simulations at most.
const ROUNDS: usize = 6;
/// Gauss–Newton steps in a simulated log, from the numbers it was simulated with.
const STEPS: usize = 12;
/// The search ends where the bias that is taken off is the one that is there but for this share of what white noise leaves open.
const CONVERGED: f64 = 0.05;

/// What was fitted, and to what.
pub(super) struct Resimulated<'a> {
    pub(super) model: &'a ModelFile,
    pub(super) rig: &'a RigFile,
    pub(super) baseline: &'a Baseline,
    pub(super) free: &'a [String],
    pub(super) raw: &'a [Log],
}

/// Channels of a log without noise, each with the noise that is to be put on.
type Quiet = Vec<(Signal, Vec<f64>, f64)>;

impl Resimulated<'_> {
    fn quiet(&self, p: &[f64], raw: &Log, log: &ContactLog) -> Result<Quiet, InputError> {
        let mut model = self.model.clone();
        model.extensions.clear();
        set_all(&mut model, self.free, &values(self.model, self.baseline, p, self.free))?;
        let (time_s, grid) = (raw.time_s(), &log.grid);
        let on = |values: &[f64]| resampled(&grid.time_s, values, time_s.iter().map(|t| t - grid.start_s));
        // What noise is in the motion would excite the contact where the rig's disc does not.
        let sliding_speed_m_s = on(&log.root_speed_m_s);
        let speed_rad_s: Vec<f64> = sliding_speed_m_s.iter().map(|v| v / log.radius_m).collect();
        let Numbers { late_ms, friction_zero_nm, normal_zero_n, .. } = self.baseline.numbers(p);
        let inputs = ContactInputs {
            time_s: time_s.to_vec(),
            sliding_speed_m_s,
            disc_angle_rad: integral(time_s, &speed_rad_s),
            normal_force_n: on(&log.load_above(normal_zero_n)),
            initial_friction_n: log.smooth_nm.first().copied().unwrap_or_default() / log.radius_m,
        };
        let torque_nm = simulate_friction(&model, self.rig, &inputs)?;
        let behind_s = -BridgeModel::delay_s(&self.rig.normal_bridge);
        // A mean over samples is quieter than each.
        let of_sample = (time_s.len() as f64 / log.len().max(1) as f64).max(1.0).sqrt();
        let of_motion = |signal: Signal, values: Vec<f64>| {
            raw.signal(signal).map(|column| (signal, values, standard_deviation(column)))
        };
        let above = |values: Vec<f64>, zero: f64| values.into_iter().map(|x| x + zero).collect::<Vec<f64>>();
        let bridges = [
            (
                Signal::FrictionTorque,
                above(shifted(time_s, &torque_nm, -1e-3 * late_ms), friction_zero_nm),
                of_sample * log.friction_noise_nm,
            ),
            (
                Signal::NormalForce,
                above(shifted(time_s, &inputs.normal_force_n, behind_s), normal_zero_n),
                of_sample * log.normal_noise_n,
            ),
        ];
        let motion =
            [of_motion(Signal::M2Speed, speed_rad_s), of_motion(Signal::M2Angle, inputs.disc_angle_rad)];
        Ok(bridges.into_iter().chain(motion.into_iter().flatten()).collect())
    }

    /// How far from `p` the likelihood's top is in logs with these numbers, in what is seen.
    fn bias(&self, measured: &Problem<'_>, seen: &Seen<'_>, p: &[f64]) -> Result<DVector<f64>, InputError> {
        let pairs: Vec<(&Log, &ContactLog)> = self.raw.iter().zip(measured.logs).collect();
        let quiet: Vec<Quiet> =
            pairs.par_iter().map(|(raw, log)| self.quiet(p, raw, log)).collect::<Result<_, InputError>>()?;
        let top = |sign: f64| -> Result<DVector<f64>, InputError> {
            let mut white = White::new(1);
            let mut logs = Vec::new();
            for ((raw, _), quiet) in pairs.iter().zip(&quiet) {
                let mut shown = (*raw).clone();
                for (signal, values, noise) in quiet {
                    let noisy = values.iter().map(|x| x + sign * noise * white.next()).collect();
                    shown.set_signal(*signal, noisy);
                }
                logs.push(ContactLog::new(&shown, self.rig)?.at_rest_for(&self.baseline.numbers));
            }
            let problem = Problem::new(&logs, self.baseline, &[]);
            let noise = problem.noise_at(&[], p).fitted_as(&logs, &measured.noise);
            let problem = Problem::with_noise(&logs, self.baseline, &[], noise);
            let fit = along_curve(&problem, problem.fit(&[], p.to_vec(), STEPS, Near::Nothing));
            Ok(Likelihood::seen(seen.clone(), &problem, &fit).top())
        };
        let (plus, minus) = rayon::join(|| top(1.0), || top(-1.0));
        Ok(0.5 * (plus? + minus?) - seen.at(p))
    }

    /// The numbers in whose logs the likelihood's top would be at the one that was found, as far as the prior lets them.
    ///
    /// # Errors
    /// Logs without the columns; a model that does not take the numbers.
    pub(super) fn unbiased(
        &self,
        problem: &Problem<'_>,
        (found, likelihood): (&[f64], &Likelihood<'_>),
        progress: &(dyn Fn() + Sync),
    ) -> Result<Vec<f64>, InputError> {
        let open = likelihood.covariance.diagonal().map(f64::sqrt);
        let mut posterior = likelihood.posterior();
        progress();
        let mut taken = self.bias(problem, &likelihood.seen, found)?;
        let mut best = (f64::INFINITY, found.to_vec());
        for _ in 1..ROUNDS {
            progress();
            posterior.top = likelihood.top() - &taken;
            let p = posterior.best(&best.1, None);
            let there = self.bias(problem, &likelihood.seen, &p)?;
            let off = (&there - &taken).component_div(&open).amax();
            if off < best.0 {
                best = (off, p);
            }
            if off < CONVERGED {
                break;
            }
            // Half of the way: what grows with the number itself, as the damping's does, would swing to and fro.
            taken = 0.5 * (taken + there);
        }
        Ok(best.1)
    }
}
