//! `bridge_drift`: zero or gain of a bridge drifts with time.

use model_core::extension::bridge_drift::BridgeDrift as Law;

use super::coordinates::saturating;
use super::{About, ContactView, DriveView, Effect, NormalLoadView};
use crate::identify::balance::Alternative;
use crate::identify::contact::change::{Bridge, ContactTerm};
use crate::identify::term::{Column, Parameter};

/// The effect.
pub(super) struct BridgeDrift;

/// Bends of a drift that settles, in shares of the longest log: warming up, and steady.
const BENDS: [f64; 3] = [0.1, 0.3, 10.0];
/// Half periods in the longest log up to which a drift's wandering is told: what changes faster is none.
const WANDERING: usize = 4;

/// Share of all of it by which a gain drifts, deviation of the prior, where a zero may drift by all: a foil's factor by a percent in
/// 100 K, an amplifier's by less; a tenth is a bridge that is coming loose.
const GAIN: f64 = 0.1;

/// What a drift does over time, given as a share of the longest log, and from nothing where a log begins.
#[derive(Debug, Clone, Copy)]
enum Course {
    /// It settles: a sum of exponentials.
    Settles,
    /// It wanders: a random walk by its largest parts, which are a straight line and sines that stand for its way back
    /// (Karhunen and Loève's of the Wiener process and of its bridge).
    Wanders,
}

impl Course {
    const ALL: [Self; 2] = [Self::Settles, Self::Wanders];

    /// The name of its form, of those for the two.
    fn form(self, [settles, wanders]: [&'static str; 2]) -> &'static str {
        match self {
            Self::Settles => settles,
            Self::Wanders => wanders,
        }
    }

    /// Its parts: names and largest values.
    fn parts(self) -> Vec<(String, f64)> {
        match self {
            Self::Settles => BENDS.map(|bend| (bend.to_string(), 1.0)).into(),
            Self::Wanders => {
                let of_bridge = |n: usize| std::f64::consts::SQRT_2 / (std::f64::consts::PI * n as f64);
                let sines = (1..=WANDERING).map(|n| (format!("wanders_{n}"), of_bridge(n)));
                std::iter::once(("steady".into(), 1.0)).chain(sines).collect()
            }
        }
    }

    /// Part number `part` over time.
    fn part(self, part: usize, time: &[f64]) -> Vec<f64> {
        match self {
            Self::Settles => saturating(time, 1.0, BENDS[part]),
            Self::Wanders if part == 0 => time.to_vec(),
            Self::Wanders => time.iter().map(|t| (std::f64::consts::PI * part as f64 * t).sin()).collect(),
        }
    }

    /// The parameters of its parts, for a zero and for a gain: a zero may drift by all of what a bridge usually shows, which is
    /// `size`.
    fn parameters(self, of: &str, kinds: [&str; 2], size: f64) -> Vec<Parameter> {
        let named = |(kind, size): (&str, f64)| {
            let part = |(name, share)| Parameter::amplitude(format!("{of}_{kind}_{name}"), share * size);
            self.parts().into_iter().map(part).collect::<Vec<_>>()
        };
        kinds.into_iter().zip([size, GAIN * size]).flat_map(named).collect()
    }

    /// Its columns, for a zero and for a gain: `column` makes one of what a part does over time.
    fn columns<C>(self, column: impl Fn(&dyn Fn(&[f64]) -> Vec<f64>, bool) -> C) -> [Vec<C>; 2] {
        [false, true].map(|gain| {
            let parts = 0..self.parts().len();
            parts.map(|part| column(&|time: &[f64]| self.part(part, time), gain)).collect()
        })
    }
}

/// A zero that wanders in each log by itself, from wherever it stands when the log begins: a random walk is another one each time.
struct OwnWalk;

impl OwnWalk {
    /// Names and largest values of its parts in one log.
    fn parts() -> Vec<(String, f64)> {
        std::iter::once(("begin".to_string(), 1.0)).chain(Course::Wanders.parts()).collect()
    }

    /// Part number `part` over time.
    fn part(part: usize, time: &[f64]) -> Vec<f64> {
        part.checked_sub(1).map_or_else(|| vec![1.0; time.len()], |part| Course::Wanders.part(part, time))
    }

    /// The parameters of all parts in so many logs.
    fn parameters(zero: &str, logs: usize, size: f64) -> Vec<Parameter> {
        let of_log = |log: usize| {
            let named = move |(name, share)| Parameter::amplitude(format!("{zero}_{name}_log{}", log + 1), share * size);
            Self::parts().into_iter().map(named)
        };
        (0..logs).flat_map(of_log).collect()
    }

    /// The columns of all parts in so many logs: `column` makes one of a log's place and of what a part does there over time.
    fn columns<C>(logs: usize, column: impl Fn(usize, &dyn Fn(&[f64]) -> Vec<f64>) -> C) -> Vec<C> {
        let pairs = (0..logs).flat_map(|log| (0..Self::parts().len()).map(move |part| (log, part)));
        pairs.map(|(log, part)| column(log, &|time: &[f64]| Self::part(part, time))).collect()
    }
}

/// A column in one log alone, or in none.
fn in_log_alone(mut column: Column, log: Option<usize>) -> Column {
    let others = column.iter_mut().enumerate().filter(|(at, _)| Some(*at) != log);
    others.for_each(|(_, values)| values.fill(0.0));
    column
}

/// Time, s, as if each log began where the one before it ends.
fn log_after_log<'t>(logs: impl Iterator<Item = &'t [f64]>) -> Vec<f64> {
    let mut begins = 0.0;
    let mut all = Vec::new();
    for time_s in logs {
        let first = time_s.first().copied().unwrap_or(0.0);
        all.extend(time_s.iter().map(|t| begins + t - first));
        begins = all.last().copied().unwrap_or(begins);
    }
    all
}

/// The core's drift, which has one settling time: least squares on the sum of the columns over the log.
fn export(course: Course, p: &[f64], bridge: &str, time_s: f64, zero: f64) -> Vec<(String, f64)> {
    const POINTS: usize = 100;
    let times: [f64; POINTS] = std::array::from_fn(|i| (i + 1) as f64 / POINTS as f64);
    let [zeros, gains] = [0, 1].map(|kind| {
        let count = p.len() / 2;
        let mut sum = vec![0.0; POINTS];
        for (part, size) in p[kind * count..][..count].iter().enumerate() {
            sum.iter_mut().zip(course.part(part, &times)).for_each(|(sum, x)| *sum += size * x);
        }
        sum
    });
    let mut best = (f64::INFINITY, 0.0, 0.0, 0.0);
    for i in 0..40 {
        // From steady to settled in a fiftieth of the log.
        let rate = if i == 0 { 0.0 } else { 0.2 * 1.15f64.powi(i) };
        let shape = |t: f64| if rate == 0.0 { t } else { (1.0 - (-rate * t).exp()) / rate };
        let all = || times.iter().zip(zeros.iter().zip(&gains)).map(|(t, (zero, gain))| (shape(*t), zero, gain));
        let (mut ss, mut z, mut g) = (1e-12, 0.0, 0.0);
        for (shape, zero, gain) in all() {
            (ss, z, g) = (ss + shape * shape, z + shape * zero, g + shape * gain);
        }
        let (z, g) = (z / ss, g / ss);
        let off: f64 =
            all().map(|(shape, zero, gain)| (zero - z * shape).powi(2) + (gain - g * shape).powi(2)).sum();
        if off < best.0 {
            best = (off, rate, z, g);
        }
    }
    let (_, rate, z, g) = best;
    // A factor of friction of the normal channel's drift: a load that is shown too small makes friction look larger.
    let sign = if bridge == "normal" { -1.0 } else { 1.0 };
    let (zero_rate, gain_rate) = (sign * z * zero / time_s, sign * g / time_s);
    let value = |name: &str| match (name, bridge) {
        ("friction_zero_nm_per_s", "friction") | ("normal_zero_n_per_s", "normal") => zero_rate,
        ("friction_gain_per_s", "friction") | ("normal_gain_per_s", "normal") => gain_rate,
        ("settling_per_s", _) => rate / time_s,
        _ => 0.0,
    };
    Law::<f64>::NAMES.iter().map(|name| ((*name).to_string(), value(name))).collect()
}

impl Effect for BridgeDrift {
    fn about(&self) -> About {
        About {
            id: "bridge_drift",
            meaning: "zero or gain of a bridge drifts with time",
            experiment: "log both bridges unloaded and with a known weight for ten minutes after switching on",
        }
    }

    fn is_like_a_bridges_error(&self) -> bool {
        true
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let s = view.scales;
        let (s_time, s_torque, s_load) = (s.time_s, s.torque_nm, s.load_n);
        let over_time = |course: &dyn Fn(&[f64]) -> Vec<f64>, of: &dyn Fn(usize, usize) -> f64| -> Column {
            let column = |(at, c): (usize, &super::Coordinates)| {
                course(&c.time).iter().enumerate().map(|(i, x)| x * of(at, i)).collect()
            };
            view.coordinates.iter().enumerate().map(column).collect()
        };
        let load_share = |at: usize, i: usize| s.load_n / view.logs[at].load_n[i].max(0.06 * s.load_n);
        let of_course = |course: Course| {
            let friction = course.columns(|part, gain| {
                let size = if gain { 1.0 } else { s.torque_nm };
                over_time(part, &|_, _| size)
            });
            // An error of the load is a factor of friction the other way.
            let normal =
                course.columns(|part, gain| over_time(part, &|at, i| if gain { 1.0 } else { load_share(at, i) }));
            let named = |bridge: &str| course.parameters(bridge, ["zero", "gain"], 1.0);
            [
                ContactTerm::slow_amplifier(self.id(), course.form(["friction", "friction wanders"]), friction, named("friction"))
                    .as_error_of(Bridge::Friction)
                    .exported(move |p, _| export(course, p, "friction", s_time, s_torque)),
                ContactTerm::factor(self.id(), course.form(["normal", "normal wanders"]), normal.concat(), named("normal"))
                    .as_error_of(Bridge::Normal)
                    .exported(move |p, _| export(course, p, "normal", s_time, s_load)),
            ]
        };
        let of_log = |only: usize, part: &dyn Fn(&[f64]) -> Vec<f64>, of: &dyn Fn(usize, usize) -> f64| -> Column {
            // Of another log than those of the training nothing is known.
            in_log_alone(over_time(part, of), view.training.then_some(only))
        };
        let forms = Course::ALL.into_iter().flat_map(of_course);
        if view.train_count < 2 {
            return forms.collect();
        }
        let walk = |bridge: &str| OwnWalk::parameters(&format!("{bridge}_zero"), view.train_count, 1.0);
        let friction = OwnWalk::columns(view.train_count, |log, part| of_log(log, part, &|_, _| s.torque_nm));
        let normal = OwnWalk::columns(view.train_count, |log, part| of_log(log, part, &load_share));
        let apart = [
            ContactTerm::slow_amplifier(self.id(), "friction wanders in each log", [friction, Vec::new()], walk("friction"))
                .as_error_of(Bridge::Friction),
            ContactTerm::factor(self.id(), "normal wanders in each log", normal, walk("normal")).as_error_of(Bridge::Normal),
        ];
        let log_after_log = log_after_log(view.logs.iter().map(|log| log.grid.time_s.as_slice()));
        forms.chain(apart.map(|term| term.over("time, log after log, s", log_after_log.clone()))).collect()
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        if s.load_n <= 0.0 {
            return Vec::new();
        }
        let over_time = |course: &dyn Fn(&[f64]) -> Vec<f64>, with_force: bool| {
            let of = |log: &super::DriveLog| {
                let time: Vec<f64> = log.grid.time_s.iter().map(|t| t / s.time_s).collect();
                let friction = log.friction.clone().unwrap_or_else(|| vec![0.0; log.len()]);
                let size = |i: usize| if with_force { friction[i] / s.effort } else { 1.0 };
                let drift: Vec<f64> = course(&time).iter().enumerate().map(|(i, d)| d * size(i)).collect();
                log.filtered(&drift)
            };
            view.logs.iter().map(of).collect::<Vec<_>>()
        };
        let mut forms = self.alternatives("friction", s.effort, &over_time);
        forms.extend(self.own_walk("friction", s.effort, view.logs.len(), &over_time));
        forms
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let over_time = |course: &dyn Fn(&[f64]) -> Vec<f64>, with_load: bool| {
            let of = |log: &super::NormalLoadLog| {
                let time: Vec<f64> = log.time_s.iter().map(|t| t / s.time_s).collect();
                let load = |i: usize| if with_load { log.filtered_n[i] / s.load_n } else { 1.0 };
                course(&time).iter().enumerate().map(|(i, d)| -d * load(i)).collect::<Vec<f64>>()
            };
            view.logs.iter().map(of).collect::<Vec<_>>()
        };
        // A walk of each log would take up what the lever's friction leaves.
        self.alternatives("normal", s.torque_nm, &over_time)
    }
}

/// What a part of a drift over time does in the rows of each log, as a zero or as a gain.
type OverTime<'a> = &'a dyn Fn(&dyn Fn(&[f64]) -> Vec<f64>, bool) -> Column;

impl BridgeDrift {
    /// A form of a balance that is linear in its parts: one of the courses, or the walk of each log.
    fn alternative(&self, form: String, parameters: Vec<Parameter>, columns: Vec<Vec<f64>>) -> Alternative {
        Alternative { form, log_prior: -((Course::ALL.len() + 1) as f64).ln(), ..Alternative::columns(self.id(), parameters, columns) }
    }

    /// Each course as a form; `over_time` makes of a part what it does in each log.
    fn alternatives(
        &self,
        bridge: &str,
        size_nm: f64,
        over_time: OverTime<'_>,
    ) -> Vec<Alternative> {
        let of_course = |course: Course| {
            let parameters = course.parameters(bridge, ["zero_nm", "gain_nm"], size_nm);
            let columns = course.columns(|part, gain| over_time(part, gain).concat()).concat();
            let form = format!("{bridge}, {}", course.form(["settling", "wandering"]));
            self.alternative(form, parameters, columns)
        };
        Course::ALL.into_iter().map(of_course).collect()
    }

    /// A zero that walks in each of some logs by itself; in one log it is the course that wanders.
    fn own_walk(
        &self,
        bridge: &str,
        size_nm: f64,
        logs: usize,
        over_time: OverTime<'_>,
    ) -> Option<Alternative> {
        let of_log = |log: usize, part: &dyn Fn(&[f64]) -> Vec<f64>| {
            in_log_alone(over_time(part, false), Some(log)).concat()
        };
        (logs > 1).then(|| {
            let parameters = OwnWalk::parameters(&format!("{bridge}_zero_nm"), logs, size_nm);
            let form = format!("{bridge}, wandering in each log");
            self.alternative(form, parameters, OwnWalk::columns(logs, of_log))
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::DVector;

    use super::*;
    use crate::identify::linear;

    /// What a course leaves of a drift, relative to it.
    fn left(course: Course, drift: &dyn Fn(f64) -> f64) -> f64 {
        const POINTS: usize = 400;
        let time: Vec<f64> = (0..POINTS).map(|i| i as f64 / POINTS as f64).collect();
        let drift: Vec<f64> = time.iter().map(|t| drift(*t)).collect();
        let columns: Vec<Vec<f64>> = (0..course.parts().len()).map(|part| course.part(part, &time)).collect();
        let (h, g) = linear::normal_equations(&columns, &[1.0; POINTS], &drift);
        let p: DVector<f64> = linear::factor(&h).solve(&g);
        let all: f64 = drift.iter().map(|x| x * x).sum();
        ((all - p.dot(&g)) / all).max(0.0).sqrt()
    }

    #[test]
    fn one_course_settles_and_the_other_turns_back() {
        let settles = |t: f64| 1.0 - (-t / 0.05).exp();
        let [settling, wandering] = Course::ALL.map(|course| left(course, &settles));
        assert!(settling < 0.05 && wandering > 2.0 * settling, "{settling} {wandering}");
        // A room that warms and cools one and a half times in the log.
        let turns_back = |t: f64| (1.5 * TAU * t + 0.7).sin() - 0.7f64.sin();
        let [settling, wandering] = Course::ALL.map(|course| left(course, &turns_back));
        assert!(wandering < 0.05 && settling > 0.3, "{settling} {wandering}");
    }

    #[test]
    fn a_walk_of_each_log_has_columns_of_its_own() {
        let time = [vec![0.0, 0.5, 1.0], vec![0.0, 0.25]];
        let columns = OwnWalk::columns(2, |log, part| (log, part(&time[log])));
        let parameters = OwnWalk::parameters("friction_zero_nm", 2, 3.0);
        assert_eq!((columns.len(), parameters.len()), (12, 12));
        assert_eq!((&columns[0], &columns[7]), (&(0, vec![1.0; 3]), &(1, time[1].clone())));
        assert_eq!(parameters[7].name, "friction_zero_nm_steady_log2");
        let column = vec![vec![1.0], vec![2.0, 3.0]];
        assert_eq!(in_log_alone(column.clone(), Some(1)), [vec![0.0], vec![2.0, 3.0]]);
        assert_eq!(in_log_alone(column, None), [vec![0.0], vec![0.0; 2]]);
        // A sine stands for no more than the walk's way back.
        assert_eq!((parameters[7].sd, parameters[8].sd < 2.0), (3.0, true));
    }

    #[test]
    fn logs_follow_each_other_in_time_whenever_they_were_taken() {
        let logs = [vec![5.0, 5.5, 6.0], Vec::new(), vec![0.0, 0.25]];
        let time_s = log_after_log(logs.iter().map(Vec::as_slice));
        assert_eq!(time_s, [0.0, 0.5, 1.0, 1.0, 1.25]);
    }

    #[test]
    fn a_steady_drift_is_the_cores_whichever_course_told_it() {
        for course in Course::ALL {
            let count = course.parts().len();
            let mut p = vec![0.0; 2 * count];
            // The last exponential is nearly straight.
            let steady = if matches!(course, Course::Wanders) { 0 } else { count - 1 };
            p[steady] = 1.0;
            p[count + steady] = 0.5;
            let exported = export(course, &p, "friction", 20.0, 3.0);
            let value = |name: &str| exported.iter().find(|(other, _)| other == name).map(|found| found.1);
            let near = |found: Option<f64>, rate: f64| found.is_some_and(|found| (found / rate - 1.0).abs() < 0.1);
            assert!(near(value("friction_zero_nm_per_s"), 3.0 / 20.0), "{exported:?}");
            assert!(near(value("friction_gain_per_s"), 0.5 / 20.0), "{exported:?}");
            assert_eq!(value("normal_zero_n_per_s"), Some(0.0));
        }
    }
}
