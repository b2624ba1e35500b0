//! A course as an experiment file, and how far the rig lets it go.

use super::family::{Ask, Course};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;

/// Share of M1's rated torque that is asked for at most: the load overshoots.
const M1_SHARE: f64 = 0.75;
/// Share of M2's rated torque that friction may take: the rest turns and corrects.
const M2_SHARE: f64 = 0.7;

/// Largest normal force (N) that M1 can make and under which M2 can still turn against every model.
#[must_use]
pub fn largest_load_n(rig: &RigFile, models: &[ModelFile]) -> f64 {
    let pressed = M1_SHARE * rig.m1.rated_torque_nm * rig.lever_gain_n_per_nm - rig.preload_n;
    let coefficient = models.iter().map(largest_coefficient).fold(0.1, f64::max);
    let turned = M2_SHARE * rig.m2.rated_torque_nm / (coefficient * rig.friction_radius_m);
    pressed.min(turned).max(1.0)
}

fn largest_coefficient(model: &ModelFile) -> f64 {
    // A model file that was read makes a model.
    model.friction_model(1e-4).map_or(1.0, |friction| friction.largest_coefficient())
}

/// The experiment file's text.
#[must_use]
pub fn toml(name: &str, title: &str, course: &Course, rig: &RigFile) -> String {
    let mut text = format!(
        "# Proposed by `rig design`. Loads are torques of M1 through lever and preload.\n\
         name = \"{name}\"\ntitle = \"{title}\"\nduration_s = {}\nseed = 1\nlog_rate_hz = 1000\n",
        tidy(course.duration_s)
    );
    for (start_s, ask) in &course.load {
        let torque_nm = |newtons: f64| match newtons {
            n if n <= 0.0 => 0.0,
            n => (n + rig.preload_n) / rig.lever_gain_n_per_nm,
        };
        text += &format!("\n[[m1]]\nstart_s = {}\n", tidy(*start_s));
        match ask {
            Ask::Hold(load_n) => {
                text += &format!("torque_nm = {}   # {:.1} N\n", tidy(torque_nm(*load_n)), load_n);
            }
            Ask::Sine(amplitude_n, angular) => {
                let amplitude_nm = amplitude_n / rig.lever_gain_n_per_nm;
                text += &format!(
                    "shape = \"sine\"\ntorque_nm = 0.0\namplitude_torque_nm = {}\nangular_frequency_rad_s = {}\n",
                    tidy(amplitude_nm),
                    tidy(*angular)
                );
            }
        }
    }
    for (start_s, ask) in &course.speed {
        text += &format!("\n[[m2]]\nstart_s = {}\n", tidy(*start_s));
        match ask {
            Ask::Hold(rpm) => text += &format!("speed_rpm = {}\n", tidy(*rpm)),
            Ask::Sine(amplitude_rpm, angular) => {
                text += &format!(
                    "shape = \"sine\"\nspeed_rpm = 0.0\namplitude_speed_rpm = {}\nangular_frequency_rad_s = {}\n",
                    tidy(*amplitude_rpm),
                    tidy(*angular)
                );
            }
        }
    }
    text
}

/// Rounded to what the control period and the eye can tell: a float in TOML's spelling.
fn tidy(value: f64) -> String {
    let rounded = (value * 1e4).round() / 1e4;
    format!("{:?}", if rounded == 0.0 { 0.0 } else { rounded })
}

#[cfg(test)]
mod tests {
    use super::super::family::{Family, Setting};
    use super::*;
    use crate::files::experiment_file::ExperimentFile;

    #[test]
    fn every_family_is_an_experiment_that_the_core_takes() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        for family in Family::ALL {
            let setting = Setting { family, load_n: 60.0, speed_rpm: 30.0, hold_s: 0.7 };
            let text = toml("proposed", family.words(), &setting.course(), &rig);
            let experiment = ExperimentFile::parse("proposed.toml", &text).unwrap();
            experiment.for_core(&rig).unwrap();
        }
    }

    #[test]
    fn the_load_stays_within_what_both_motors_can_do() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let model = ModelFile::read_or_assumed(None, &[]).unwrap();
        let load_n = largest_load_n(&rig, &[model]);
        // 1.2 is the assumed rubber's largest coefficient.
        assert!(1.2 * load_n * rig.friction_radius_m <= M2_SHARE * rig.m2.rated_torque_nm + 1e-9);
        assert!(load_n > 20.0);
    }
}
