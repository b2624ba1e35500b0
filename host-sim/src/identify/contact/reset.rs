//! A tip that has broken loose and slips on until the motion reverses or stops, however slow it is (brush with reset).
//!
//! From single samples slip is seen only where it is faster than the force's noise lets the spring look. A block of some mass sticks
//! again before it is that slow; this tip does not, so that it is remembered to slip. It sticks again where the root stands, where
//! the root goes against the force, and where over several samples the spring is seen to go with the root: then what was taken
//! for slip was noise.

use super::observer::{Drive, LEAST_SHARE, Motion, SLIP_NOISES, WIDTH, sigmoid};

/// Samples over which slow motion is seen, with a tenth of the noise that it has from sample to sample: a breakaway takes as many.
const OVER: usize = 10;

/// How far the tip slips.
pub(super) struct Loose {
    /// Share of slip, 0 to 1.
    pub(super) share: f64,
    /// Speed of the root over several samples, m/s: that of the slip where it is too slow to be seen.
    pub(super) slow_m_s: f64,
    /// Speed of the root from sample to sample, of the root over several, and of the spring over several, beyond noise, m/s.
    told_m_s: [f64; 3],
}

impl Loose {
    /// At rest; slip from sample to sample has this noise.
    pub(super) fn new(drive: &Drive<'_>, slip_noise_m_s: f64) -> Self {
        let told = |noise_m_s: f64| (SLIP_NOISES * noise_m_s).max(f64::MIN_POSITIVE);
        let (root, both) = (told(drive.noise.0), told(drive.noise.0.hypot(slip_noise_m_s)));
        Self { share: 0.0, slow_m_s: 0.0, told_m_s: [root, root / OVER as f64, both / OVER as f64] }
    }

    /// Whether the root goes in the direction of the force; where it does not, or the spring goes with it, the tip sticks again.
    pub(super) fn towards(&mut self, motion: &Motion<'_>, i: usize, force_n: f64) -> f64 {
        let [at_once, over, slip_over] = self.told_m_s;
        let (now, (root, spring)) = (motion.root_m_s(i), motion.over(i, OVER));
        self.slow_m_s = root.abs().max(over);
        let side = 1f64.copysign(force_n);
        let beyond = |speed: f64, told: f64| sigmoid((side * speed / told - 1.0) / WIDTH);
        let goes = beyond(now, at_once).max(beyond(root, over) * (1.0 - beyond(-now, at_once)));
        let shows = sigmoid((LEAST_SHARE * root.abs() / slip_over - 1.0) / WIDTH);
        // A load that grows winds the spring up faster than the root goes: that is slip too.
        let slips = sigmoid(((root - spring).abs() / (LEAST_SHARE * self.slow_m_s) - 1.0) / WIDTH);
        self.share *= goes * (1.0 - shows * (1.0 - slips));
        goes
    }
}

#[cfg(test)]
mod tests {
    use super::super::baseline::{KNOWN_WITHIN, baseline};
    use super::super::log::ContactLog;
    use super::super::problem::{Baseline, Near, Problem, Role};
    use crate::files::log::Log;
    use crate::files::model_file::{ModelFile, ModelKind};
    use crate::files::rig_file::{Mode, RigFile};
    use crate::files::signal::Signal;
    use crate::identify::noise::White;
    use model_core::friction::brush::BrushParameters;
    use model_core::friction::{Contact, FrictionModel};

    const STEP_S: f64 = 1e-3;
    const COUNT: usize = 6000;
    const LOAD_N: f64 = 40.0;
    const NOISE_NM: f64 = 0.03;
    const STATIC: f64 = 0.9;
    const COULOMB: f64 = 0.6;

    /// Speed of the root, m/s: into slip, down to a creep that the noise of the spring hides, a rest, slip, a reversal, a rest.
    fn root_m_s(t: f64) -> f64 {
        match t {
            ..1.0 => 0.02,
            1.0..2.0 => 0.002,
            2.0..2.5 => 0.0,
            2.5..3.5 => 0.01,
            3.5..5.0 => -0.005,
            _ => 0.0,
        }
    }

    /// A log of a brush element by the core, and what the torque is without noise.
    fn log(rig: &RigFile) -> (ContactLog, Vec<f64>) {
        let parameters = BrushParameters { c_n_per_m: 6e4, mu_s: STATIC, mu_c: COULOMB };
        let brush = FrictionModel::brush(&parameters, STEP_S).unwrap();
        let mut state = brush.rest();
        let mut white = White::new(4);
        let (mut angle_rad, mut angle, mut clean, mut noisy) = (0.0, Vec::new(), Vec::new(), Vec::new());
        for i in 0..COUNT {
            let speed = root_m_s(STEP_S * i as f64);
            angle_rad += STEP_S * speed / rig.friction_radius_m;
            let force = brush.step(&mut state, &Contact::new(speed, LOAD_N)).force_n;
            clean.push(rig.friction_radius_m * force);
            noisy.push(rig.friction_radius_m * force + NOISE_NM * white.next());
            angle.push(angle_rad + 2e-6 * white.next());
        }
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| STEP_S * i as f64).collect());
        log.set_signal(Signal::M2Angle, angle);
        log.set_signal(Signal::NormalForce, (0..COUNT).map(|_| LOAD_N + 0.2 * white.next()).collect());
        log.set_signal(Signal::FrictionTorque, noisy);
        (ContactLog::new(&log, rig).unwrap(), clean)
    }

    fn brush(mu_s: f64, mu_c: f64) -> Baseline {
        let numbers = [("c_n_per_m", 6e4), ("mu_s", mu_s), ("mu_c", mu_c)];
        baseline(&ModelFile::new("model", ModelKind::Brush, &numbers).unwrap(), KNOWN_WITHIN)
    }

    fn means(baseline: &Baseline) -> Vec<f64> {
        baseline.free.iter().map(|b| b.parameter.mean).collect()
    }

    #[test]
    fn a_tip_that_is_loose_slips_on_however_slowly_until_it_stops_or_turns() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let (log, clean) = log(&rig);
        let logs = [log.seen_through(&brush(STATIC, COULOMB).numbers)];
        let worst = |baseline: &Baseline| {
            let problem = Problem::new(&logs, baseline, &[]);
            let shown = problem.predict(&[], &means(baseline)).shown_nm;
            // Breaking loose is a jump, known to some samples.
            let jump = |i: usize| (1..10).any(|k| (clean[i + k] - clean[i + k - 5]).abs() > 0.2);
            let judged = (10..COUNT - 10).filter(|i| !jump(*i));
            judged.map(|i| (shown[i] - clean[i]).abs()).fold(0.0, f64::max)
        };
        let fall_nm = (STATIC - COULOMB) * LOAD_N * rig.friction_radius_m;
        let right = brush(STATIC, COULOMB);
        assert!(worst(&right) < 0.2 * fall_nm, "{} of {fall_nm}", worst(&right));
        let mut sticks_again = right;
        sticks_again.numbers.slips_on = false;
        assert!(worst(&sticks_again) > 0.6 * fall_nm, "{} of {fall_nm}", worst(&sticks_again));
    }

    #[test]
    fn a_fall_within_a_sample_is_known_to_a_share_of_itself_and_rings_where_samples_do_not_show_it() {
        let deviations = |mode: Option<Mode>| {
            let mut rig = RigFile::assumed_rig(&[]).unwrap();
            (rig.friction_bridge.mode, rig.friction_bridge.lowpass_hz) = (mode, None);
            let (log, clean) = log(&rig);
            let falls = clean.windows(2).position(|pair| pair[1] < pair[0] - 0.1).unwrap();
            let baseline = brush(STATIC, COULOMB);
            let deviation = Problem::new(&[log], &baseline, &[]).noise.deviation;
            let fall_nm = (STATIC - COULOMB) * LOAD_N * rig.friction_radius_m;
            [0, 20, 400].map(|behind| deviation[falls + behind] / fall_nm)
        };
        let [at, behind, long_behind] = deviations(None);
        assert!(at > 0.3 && behind < 1.1 * long_behind, "{at} {behind} {long_behind}");
        let [_, rings, long_behind] = deviations(Some(Mode { mode_hz: 700.0, damping_ratio: 0.01 }));
        let expected = std::f64::consts::FRAC_1_SQRT_2 * (-20.0 * STEP_S * std::f64::consts::TAU * 7.0).exp();
        assert!((rings / expected.hypot(long_behind) - 1.0).abs() < 0.15, "{rings}, expected {expected}");
        // A slower one is in the samples.
        let [_, seen, long_behind] = deviations(Some(Mode { mode_hz: 300.0, damping_ratio: 0.01 }));
        assert!(seen < 1.1 * long_behind, "{seen} {long_behind}");
    }

    #[test]
    fn both_coefficients_are_known_within_a_share_of_themselves_and_not_their_difference() {
        let near = brush(0.76, 0.72);
        let mut p = means(&near);
        for (at, base) in near.free.iter().enumerate() {
            match base.role {
                Role::A0 => p[at] = COULOMB.ln(),
                Role::Static => p[at] = STATIC.ln(),
                _ => continue,
            }
            assert!((p[at] - base.parameter.mean).abs() < 1.2 * base.parameter.sd, "{:?}", base.role);
        }
        let numbers = near.numbers(&p);
        assert!((numbers.a0 + numbers.a1 - STATIC).abs() < 0.01 && (numbers.a0 - COULOMB).abs() < 0.01);
    }

    #[test]
    fn static_friction_is_found_where_slopes_do_not_lead_to_it() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let (log, _) = log(&rig);
        let baseline = brush(0.75, COULOMB);
        let logs = [log.seen_through(&baseline.numbers)];
        let problem = Problem::new(&logs, &baseline, &[]);
        let off = |p: &[f64]| {
            let numbers = baseline.numbers(p);
            ((numbers.a0 + numbers.a1) / STATIC - 1.0).abs()
        };
        let fit = problem.fit(&[], means(&baseline), 12, Near::Nothing);
        assert!(off(&fit.p) > 0.1, "{}", off(&fit.p));
        let better = problem.better_static(&fit).unwrap();
        assert!(off(&better) < 0.03, "{}", off(&better));
    }
}
