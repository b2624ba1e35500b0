//! `wear_drift`: µ changes with the distance slid and does not come back.
//!
//! Coordinate: distance slid, in each log, where the track is swept or new before each, or in all of them in the order in which
//! they are given. Columns: changes that run out over four shares of the longest distance. Law: the core's
//! ([`model_core::extension::wear_drift`]).

use model_core::extension::wear_drift::WearDrift as Law;

use super::coordinates::saturating;
use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::problem::Numbers;
use crate::identify::contact_part::ContactPart;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct WearDrift;

/// Bends of the law over distance, in shares of the longest.
const BENDS: [f64; 4] = [0.02, 0.06, 0.2, 1.0];

/// Names of the forms in which each log begins with a fresh track.
const SWEPT: &str = "";
const LAW: &str = "law";
/// And of those in which it begins with the wear of the logs before it.
const KEPT: &str = "from log to log";
const KEPT_LAW: &str = "law from log to log";

impl Effect for WearDrift {
    fn about(&self) -> About {
        About {
            id: "wear_drift",
            meaning: "friction changes with the distance slid and does not come back",
            experiment: "repeat one short slide before and after 50 m of sliding, each after 10 minutes of rest",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let s = view.scales;
        let of_logs: Vec<Vec<f64>> = view.coordinates.iter().map(|c| c.distance_m.clone()).collect();
        if view.train_count < 2 {
            return self.over(of_logs, s.distance_m, [SWEPT, LAW], 0.0);
        }
        // A held-out log comes after those that are fitted.
        let mut before = if view.training { 0.0 } else { s.slid_m };
        let mut follow = |log: &Vec<f64>| -> Vec<f64> {
            let from = before;
            before += if view.training { log.last().copied().unwrap_or(0.0) } else { 0.0 };
            log.iter().map(|x| from + x).collect()
        };
        let of_all: Vec<Vec<f64>> = of_logs.iter().map(&mut follow).collect();
        let swept = self.over(of_logs, s.distance_m, [SWEPT, LAW], 0.0);
        let kept = self.over(of_all, s.slid_m, [KEPT, KEPT_LAW], s.slid_m);
        swept.into_iter().chain(kept).collect()
    }

    fn remark(&self, contact: &ContactPart, place: usize) -> Option<String> {
        let mut forms = contact.fit(place).terms.iter().map(|term| &contact.terms[*term]);
        let own = forms.find(|term| term.effect == self.id())?;
        let kept = [KEPT, KEPT_LAW].contains(&own.form);
        kept.then(|| "it goes on from log to log, and the law is that of a run after those fitted".into())
    }
}

impl WearDrift {
    /// Columns and law over a distance whose largest value is this, m; so much has been slid when a run begins that is yet to
    /// come.
    fn over(&self, distance: Vec<Vec<f64>>, longest: f64, names: [&'static str; 2], begins_m: f64) -> Vec<ContactTerm> {
        let column = |bend| distance.iter().map(|log| saturating(log, longest, bend)).collect();
        let columns = BENDS.map(column).to_vec();
        let parameters = BENDS.map(|bend| Parameter::amplitude(format!("change_{bend}"), 1.0)).to_vec();
        let law = vec![Parameter::amplitude("change", 1.0), Parameter::logarithm("scale_m", 0.5 * longest, 1.5)];
        let starts = [0.05, 0.3, 3.0].map(|s: f64| [-0.05, 0.05].map(|c| vec![c, (s * longest).ln()])).concat();
        // The change over the longest distance is what is fitted.
        let values = move |p: &[f64]| {
            let scale = p[1].exp().clamp(1e-3, 1e6);
            [(p[0] / (scale * (1.0 - (-longest / scale).exp()))).clamp(-100.0, 100.0), scale]
        };
        let factor = |[rate, scale]: [f64; 2], x: f64| (1.0 + rate * scale * (1.0 - (-x / scale).exp())).max(0.05);
        let act = move |p: &[f64], change: &mut super::Change| {
            let values = values(p);
            let of = |x: &f64| factor(values, *x).ln();
            let column = distance.iter().map(|log| log.iter().map(of).collect()).collect();
            change.add_log_factor(&[column], &[1.0]);
        };
        let export = move |p: &[f64], numbers: &mut Numbers| {
            // What has been slid is in the friction that the run begins with, and in how fast it goes on to change.
            let [rate, scale] = values(p);
            let begins = factor([rate, scale], begins_m);
            numbers.a0 *= begins;
            numbers.a1 *= begins;
            let to_come = [rate * (-begins_m / scale).exp() / begins, scale];
            Law::<f64>::NAMES.iter().map(ToString::to_string).zip(to_come).collect()
        };
        let law = ContactTerm::any(self.id(), law, Starts::BestOf(starts, 2), act).as_law();
        vec![
            ContactTerm::factor(self.id(), names[0], columns, parameters),
            ContactTerm { form: names[1], ..law.exported(export) },
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::coordinates::{Coordinates, Scales};
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::ModelFile;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact::baseline::{KNOWN_WITHIN, baseline};
    use crate::identify::contact::change::Change;
    use crate::identify::contact::log::ContactLog;
    use model_core::extension::wear_drift::Distance;

    fn log(speed_rad_s: f64) -> ContactLog {
        const COUNT: usize = 2000;
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![speed_rad_s; COUNT]);
        log.set_signal(Signal::NormalForce, vec![80.0; COUNT]);
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()
    }

    fn law(logs: &[ContactLog], scales: &Scales, training: bool) -> ContactTerm {
        let coordinates: Vec<Coordinates> = logs.iter().map(|log| Coordinates::new(log, scales)).collect();
        let view =
            ContactView { logs, coordinates: &coordinates, scales, training, train_count: 2, block: true };
        WearDrift.contact(&view).into_iter().find(|term| term.form == KEPT_LAW).unwrap()
    }

    #[test]
    fn a_run_that_is_yet_to_come_begins_with_the_wear_of_those_before() {
        let (train, next) = ([log(5.0), log(8.0)], [log(3.0)]);
        let scales = Scales::new(&train);
        let p = [0.3, (0.4 * scales.slid_m).ln()];
        let log_factor = |term: &ContactTerm| {
            let mut change = Change::default();
            (term.act)(&p, &mut change);
            change.log_factor.unwrap()
        };
        let [fitted, held_out] = [(&train[..], true), (&next[..], false)]
            .map(|(logs, training)| log_factor(&law(logs, &scales, training)));
        // The second log goes on where the first one ended, and the next run where the second one did.
        let (first, second, third) = (&fitted[0], &fitted[1], &held_out[0]);
        assert!(first[0] < 0.01 && (second[0] - first[first.len() - 1]).abs() < 1e-3);
        assert!((third[0] - second[second.len() - 1]).abs() < 1e-3 && third[0] > 0.25);

        let before = baseline(&ModelFile::assumed(&[]).unwrap(), KNOWN_WITHIN).numbers;
        let mut numbers = before;
        let term = law(&train, &scales, true);
        let exported: Vec<f64> =
            (term.export.as_ref().unwrap())(&p, &mut numbers).into_iter().map(|(_, value)| value).collect();
        let core = Law::new(&[exported[0], exported[1]]).unwrap();
        let mut slid = Distance::default();
        slid.add(Coordinates::new(&next[0], &scales).distance_m.last().copied().unwrap());
        let by_core = numbers.a0 / before.a0 * core.factor(&slid);
        assert!((by_core.ln() - third[third.len() - 1]).abs() < 1e-9, "{by_core}");
        assert_eq!(numbers.a1 / before.a1, numbers.a0 / before.a0);
    }
}
