//! A log as the drive's analysis uses it: net force, smooth motion, direction, and what counts.
//!
//! In a contact log the friction torque that the bridge measured is taken off M2's torque: what is
//! left accelerates the disc and overcomes its bearing. Position is smoothed without phase and
//! differentiated twice. The direction of motion is the sign of the speed where the speed exceeds its
//! noise and more than creep; below that the drive is at rest: friction is a reaction there, and the
//! sample tells nothing about the drive.

use super::noise;
use super::whitening::Whitener;
use crate::diagnose::analysis::Role;
use crate::files::log::{Log, LogKind};
use crate::fit::drive::butterworth::LowPass;
use crate::fit::drive::decimate::Decimator;
use crate::fit::drive::inverse::Motion;
use crate::fit::drive::record::{DriveRecord, Grid, derivatives};

/// Cut-off of the position filter, Hz.
const CUTOFF_HZ: f64 = 180.0;
/// It is at most this share of the rate.
const LARGEST_CUTOFF_SHARE: f64 = 0.25;
/// Force is judged up to this share of the cut-off, where the smoothing has lost 0.4 %.
const BAND_SHARE: f64 = 0.5;
/// Speeds above this many standard deviations of their noise have a sign.
const SIGN_DEVIATIONS: f64 = 4.0;
/// Speeds below this share of the log's typical speed are creep: friction there is not yet that of
/// sliding, in any bearing.
const CREEP_SHARE: f64 = 0.004;
/// Left out at each end, s: where the filters start up.
const BORDER_S: f64 = 0.05;
/// Rate of the force error of the contract, Hz: 10 to 1 at 1 kHz.
pub const REPORT_HZ: f64 = 100.0;

/// What a contact log knows about the contact.
#[derive(Debug, Clone)]
pub struct ContactChannels {
    /// Friction torque of the bridge.
    pub friction: Vec<f64>,
    /// Normal force.
    pub normal: Vec<f64>,
    /// Standard deviation of the friction's white noise.
    pub friction_std: f64,
}

/// A conditioned log.
#[derive(Debug, Clone)]
pub struct DriveLog {
    /// Fitted or held out.
    pub role: Role,
    /// Units.
    pub motion: Motion,
    /// Time, smooth net effort and raw position on an even grid.
    pub record: DriveRecord,
    /// Present in a contact log.
    pub contact: Option<ContactChannels>,
    /// Smooth position.
    pub position: Vec<f64>,
    /// Its first derivative.
    pub speed: Vec<f64>,
    /// Its second derivative.
    pub acceleration: Vec<f64>,
    /// −1, 0 or 1.
    pub direction: Vec<f64>,
    /// 1 where a sample counts, else 0.
    pub weight: Vec<f64>,
    /// Standard deviation of the force's white noise.
    pub force_std: f64,
    /// Standard deviation of the position's white noise.
    pub position_std: f64,
    /// Highest frequency that is judged, Hz.
    pub band_hz: f64,
}

impl DriveLog {
    /// Conditions a log; the error says what it lacks.
    pub fn new(log: &Log, role: Role) -> Result<Self, String> {
        let kind = log.kind().map_err(|e| e.to_string())?;
        let signals = log.drive().map_err(|e| e.to_string())?;
        let motion = if kind == LogKind::LinearDrive { Motion::Linear } else { Motion::Rotary };
        let short = || format!("{}: too short or uneven for the drive's analysis", log.source);
        let mut record =
            DriveRecord::new(signals.time_s, signals.effort, signals.position).ok_or_else(short)?;
        let contact = if kind == LogKind::Contact {
            let contact = log.contact().map_err(|e| e.to_string())?;
            let (friction, normal) = (contact.friction_torque_nm, contact.normal_force_n);
            let grid = Grid::over(signals.time_s).ok_or_else(short)?;
            let even = |values: &[f64]| grid.resample(signals.time_s, values);
            {
                let friction = even(friction);
                let friction_std = noise::white_std(&friction);
                Some(ContactChannels { friction, normal: even(normal), friction_std })
            }
        } else {
            None
        };
        if let Some(contact) = &contact {
            record
                .effort
                .iter_mut()
                .zip(&contact.friction)
                .for_each(|(effort, friction)| *effort -= friction);
        }
        Ok(Self::from_record(record, contact, motion, role))
    }

    /// Conditions a record.
    pub fn from_record(
        record: DriveRecord,
        contact: Option<ContactChannels>,
        motion: Motion,
        role: Role,
    ) -> Self {
        let rate_hz = record.rate_hz();
        let cutoff_hz = CUTOFF_HZ.min(LARGEST_CUTOFF_SHARE * rate_hz);
        let position_std = noise::white_std(&record.position);
        let force_std = noise::white_std(&record.effort);
        let position = LowPass::new(cutoff_hz, rate_hz).zero_phase(&record.position);
        let (speed, acceleration) = derivatives(&position, record.step_s);
        // Both sides of the equation through the same filter.
        let filter = LowPass::new(cutoff_hz, rate_hz);
        let mut record = record;
        record.effort = filter.zero_phase(&record.effort);
        let contact = contact.map(|contact| ContactChannels {
            friction: filter.zero_phase(&contact.friction),
            normal: filter.zero_phase(&contact.normal),
            friction_std: contact.friction_std,
        });
        // Derivative of white noise behind a low-pass: σ 2π f_c √(2 f_c/(3 rate)).
        let omega = 2.0 * std::f64::consts::PI * cutoff_hz;
        let speed_noise = position_std * omega * (2.0 * cutoff_hz / (3.0 * rate_hz)).sqrt();
        let rest = (SIGN_DEVIATIONS * speed_noise).max(CREEP_SHARE * typical_speed(&speed));
        let direction: Vec<f64> =
            speed.iter().map(|v| if v.abs() > rest { v.signum() } else { 0.0 }).collect();
        let count = record.len();
        let border = (BORDER_S * rate_hz) as usize;
        let reach = (rate_hz / cutoff_hz).ceil() as usize;
        let mut weight = vec![1.0; count];
        for at in 0..count {
            if at < border || at + border >= count {
                weight[at] = 0.0;
            } else if direction[at] == 0.0 {
                weight[at - reach.min(at)..(at + reach + 1).min(count)].fill(0.0);
            }
        }
        Self {
            role,
            motion,
            record,
            contact,
            position,
            speed,
            acceleration,
            direction,
            weight,
            force_std,
            position_std,
            band_hz: BAND_SHARE * cutoff_hz,
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.record.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.record.is_empty()
    }

    /// The whitening filter for this log's noise and an inertia.
    pub fn whitener(&self, inertia: f64) -> Whitener {
        Whitener::new(self.record.rate_hz(), self.band_hz, self.force_std, self.position_std, inertia)
    }

    /// The decimation of the reported force error.
    pub fn decimator(&self) -> Decimator {
        Decimator::new((self.record.rate_hz() / REPORT_HZ).round() as usize)
    }

    /// Standard deviation of u − J q̈ behind the filters, for an inertia.
    pub fn shaft_torque_noise(&self, inertia: f64) -> f64 {
        let cutoff_hz = self.band_hz / BAND_SHARE;
        let share = 2.0 * cutoff_hz / self.record.rate_hz();
        let omega = 2.0 * std::f64::consts::PI * cutoff_hz;
        // ∫ (2πf)⁴ df over the pass band.
        let curved = inertia * self.position_std * omega.powi(2);
        (share * (self.force_std.powi(2) + curved.powi(2) / 5.0)).sqrt()
    }

    /// Speeds in the moving part of the log at given shares of their distribution (0 to 1), by size.
    pub fn speed_quantiles(&self, shares: &[f64]) -> Vec<f64> {
        let mut speeds: Vec<f64> =
            self.speed.iter().zip(&self.weight).filter(|(_, w)| **w > 0.0).map(|(v, _)| v.abs()).collect();
        speeds.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let last = speeds.len().saturating_sub(1);
            speeds.get((share * last as f64) as usize).copied().unwrap_or(0.0)
        };
        shares.iter().map(|share| at(*share)).collect()
    }
}

/// The speed that is exceeded a tenth of the time.
fn typical_speed(speed: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = speed.iter().map(|v| v.abs()).collect();
    let at = sizes.len() * 9 / 10;
    if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(at, f64::total_cmp).1 }
}
