//! Sentences with numbers about an effect in a fit.

use crate::diagnose::analysis::{Fit, Role};

/// What a fit says about one of its effects.
pub fn sentences(effect: &'static str, fit: &Fit) -> Vec<String> {
    let value = |name: &str| fit.get(Some(effect), name).map(|p| p.value);
    let mut all = Vec::new();
    all.extend(meaning(effect, &value));
    let significant: Vec<String> = fit
        .parameters
        .iter()
        .filter(|p| p.effect == Some(effect) && p.log.is_none() && p.std.is_finite())
        .filter(|p| p.value.abs() > 2.0 * p.std)
        .map(|p| format!("{} = {:.4} ± {:.1e}", p.name, p.value, p.std))
        .collect();
    if !significant.is_empty() {
        all.push(format!("fitted to the friction channel: {}", significant.join(", ")));
    }
    if let (Some(error), Some(floor)) = (fit.nrmse(Role::Holdout), fit.noise_floor(Role::Holdout)) {
        all.push(format!("with it the held-out error is {:.2} times that of noise alone", error / floor));
    }
    all
}

fn meaning(effect: &str, value: &dyn Fn(&str) -> Option<f64>) -> Option<String> {
    let percent = |x: f64| 100.0 * x;
    Some(match effect {
        "element_compliance" => {
            let (k_u, c_u) = (value("k_u_n_per_m")?, value("c_u_n_s_per_m")?);
            format!(
                "friction overshoots and settles late after starts and load steps, as a block of {:.0} N/mm \
                 that relaxes in {:.1} ms does",
                1e-3 * k_u,
                1e3 * c_u / k_u
            )
        }
        "thermal_fade" => format!(
            "at the mean power friction fades by a measure of {:.2} within {:.1} s and {:.2} within {:.1} s, \
             and comes back at rest",
            value("fast_fade")?,
            value("cooling_s")?,
            value("slow_fade")?,
            value("slow_cooling_s")?
        ),
        "wear_drift" => format!(
            "friction has changed by {:+.1} % at the end of a record, with distance slid and not with time",
            percent(value("change_over_record")?)
        ),
        "disc_angle" => {
            let amplitude = |k: usize| Some(value(&format!("cos{k}"))?.hypot(value(&format!("sin{k}"))?));
            let (order, size) =
                (1..=10).filter_map(|k| amplitude(k).map(|a| (k, a))).max_by(|a, b| a.1.total_cmp(&b.1))?;
            format!(
                "friction varies with the disc's angle, most at order {order} ({:.1} % of it)",
                percent(size)
            )
        }
        "load_dependence" => {
            format!(
                "around the usual load friction goes with normal force to the power {:.3}",
                1.0 - value("exponent")?
            )
        }
        "static_ageing" => format!(
            "friction grows by {:.1} % for each e-fold of rest beyond {:.2} s, and {:.2} mm of sliding renew it",
            percent(value("growth")?),
            value("onset_s")?,
            1e3 * value("memory_m")?
        ),
        "direction_asymmetry" => {
            format!(
                "friction differs between the directions by {:.1} % in slow and {:.1} % in fast sliding",
                percent(2.0 * value("asymmetry_slow")?),
                percent(2.0 * value("asymmetry_fast")?)
            )
        }
        "bell_curve" => format!(
            "friction has a hump of {:.0} % around {:.3} m/s",
            percent(value("height")?),
            value("peak_m_s")?
        ),
        "rubber_relaxation" => format!(
            "a held force creeps: within {:.3} s by {:.0} % of the block's deflection, {:.2} s by {:.0} %, \
             {:.1} s by {:.0} %",
            value("relaxation_s")?,
            percent(value("creep_ratio")?),
            value("relaxation_2_s")?,
            percent(value("creep_ratio_2")?),
            value("relaxation_3_s")?,
            percent(value("creep_ratio_3")?)
        ),
        "viscous_film" => format!(
            "a force of {:.2} N per m/s does not depend on normal force",
            value("coefficient_n_s_per_m")?
        ),
        "bridge_crosstalk" => format!(
            "the channel shows {:.4} N m for each newton of normal force, in both directions and at rest",
            value("gain_nm_per_n")?
        ),
        "bridge_drift" => match (value("friction_zero_nm"), value("friction_gain")) {
            (Some(zero), Some(gain)) => format!(
                "over a record the friction bridge's zero moves by {zero:.3} N m and its gain by {:.1} %",
                percent(gain)
            ),
            _ => format!(
                "over a record the normal bridge's zero moves by {:.1} N and its gain by {:.1} %",
                value("normal_zero_n")?,
                percent(value("normal_gain")?)
            ),
        },
        "friction_delay" => {
            format!("every change of friction is shown {:.2} ms late", 1e3 * value("delay_s")?)
        }
        "ring_resonance" => format!(
            "the channel rings at {:.1} Hz with a damping ratio of {:.3}",
            value("mode_hz")?,
            value("damping_ratio")?
        ),
        "adc_saturation" => "the channel stands at one extreme value while motion and load go on".into(),
        _ => return None,
    })
}
