//! Logs whose units are right raise no doubt, whatever effects hide in them, at any rate, of any machine.

use host_sim::files::log::Log;
use host_sim::files::plausible::findings;
use rig_tests::{Base, Effect, Form, Scenario, generate};

#[track_caller]
fn raises_no_doubt(name: &str, scenario: &Scenario) {
    let case = generate(scenario).unwrap();
    for text in case.train.iter().chain([&case.holdout]) {
        let log = Log::parse_csv(name, text.as_bytes()).unwrap();
        assert_eq!(findings(&log), [], "{name}");
    }
}

#[test]
fn logs_with_nothing_hidden_raise_no_doubt() {
    raises_no_doubt("nothing hidden", &Scenario { duration_s: 6.0, ..Scenario::new(&[], 7) });
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn no_effect_looks_like_a_wrong_unit() {
        for effect in Effect::ALL.chunks(1) {
            raises_no_doubt(effect[0].id(), &Scenario { duration_s: 6.0, ..Scenario::new(effect, 7) });
        }
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn no_rate_noise_or_form_looks_like_a_wrong_unit() {
        for rate_hz in [200.0, 20_000.0] {
            let scenario = Scenario { rate_hz, duration_s: 4.0, ..Scenario::new(&[], 3) };
            raises_no_doubt(&format!("{rate_hz} Hz"), &scenario);
        }
        raises_no_doubt("noise", &Scenario { noise_factor: 3.0, ..Scenario::new(&[], 4) });
        for form in [Form::Drive, Form::LinearStage] {
            raises_no_doubt("drive", &Scenario { form, ..Scenario::new(&[], 5) });
        }
        raises_no_doubt("modified LuGre", &Scenario { base: Base::ModifiedLugre, ..Scenario::new(&[], 6) });
    }
}
