//! What a hypothesis changes in the contact's balance, whatever effect asked for it.

use super::ends::Ends;
use super::law::Ageing;
use super::problem::Numbers;
use crate::identify::table::Part;
use crate::identify::term::{Column, Parameter, Starts};

/// Changes to the contact and its sensor; several effects add up.
#[derive(Debug, Clone, Default)]
pub struct Change {
    /// ln of what friction is multiplied with, per log and point.
    pub log_factor: Option<Column>,
    /// What the friction channel's amplifier adds to the torque, N m, per log and point: drift of its zero, crosstalk.
    pub zero_nm: Option<Column>,
    /// What its gain has drifted by, relative, per log and point.
    pub gain: Option<Column>,
    /// ln of what the friction curve is multiplied with, over [`super::law::speeds`].
    pub log_curve: Option<Vec<f64>>,
    /// Force per slip speed whatever the load, N s/m.
    pub film_n_s_per_m: f64,
    /// Maxwell branches beside the series spring: stiffness, N/m, and relaxation time, s.
    pub branches: [(f64, f64); 3],
    /// Ageing of the contact.
    pub ageing: Option<Ageing>,
    /// How much later than the rig file says the friction channel is, s.
    pub late_s: f64,
    /// Mode of the sensor in place of the rig file's: Hz, damping ratio.
    pub mode: Option<(f64, f64)>,
    /// Stiffness and damping in series with the slip, in place of the baseline's: N/m, N s/m.
    pub block: Option<(f64, f64)>,
    /// Ends of the friction channel, N m.
    pub ends_nm: Option<Ends>,
    /// Upper end of the normal channel and the width over which it bends there, N.
    pub normal_end_n: Option<(f64, f64)>,
    /// Way of the root in place of the logged one, m, per log and point.
    pub root_m: Option<Column>,
}

impl Change {
    /// Whether it changes what the friction channel shows of a torque between the ends of its range.
    pub fn changes_friction_channel(&self) -> bool {
        let bends = self.ends_nm.is_some_and(|ends| ends.bend());
        bends || self.zero_nm.is_some() || self.gain.is_some() || self.late_s != 0.0 || self.mode.is_some()
    }

    /// Adds `size` times a column to the logarithm of friction.
    pub fn add_log_factor(&mut self, columns: &[Column], sizes: &[f64]) {
        add(&mut self.log_factor, columns, sizes);
    }

    /// Adds `size` times a column to the friction channel's zero, N m.
    pub fn add_zero(&mut self, columns: &[Column], sizes: &[f64]) {
        add(&mut self.zero_nm, columns, sizes);
    }

    /// Adds `size` times a column to the friction channel's gain.
    pub fn add_gain(&mut self, columns: &[Column], sizes: &[f64]) {
        add(&mut self.gain, columns, sizes);
    }
}

fn add(to: &mut Option<Column>, columns: &[Column], sizes: &[f64]) {
    let Some(first) = columns.first() else { return };
    let sum = to.get_or_insert_with(|| first.iter().map(|log| vec![0.0; log.len()]).collect());
    for (column, size) in columns.iter().zip(sizes).filter(|(_, size)| **size != 0.0) {
        for (sum, values) in sum.iter_mut().zip(column) {
            sum.iter_mut().zip(values).for_each(|(s, x)| *s += size * x);
        }
    }
}

/// A bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bridge {
    /// That of the friction torque.
    Friction,
    /// That of the normal force.
    Normal,
}

/// Columns in which a form is linear, and which all act through one slope, sample by sample: they change more slowly than the
/// contact answers.
pub enum Columns {
    /// Of the logarithm of friction.
    LogFactor(Vec<Column>),
    /// Of the friction channel's amplifier: of its zero (N m), and of what its gain has drifted by.
    Amplifier([Vec<Column>; 2]),
}

/// One form of an effect in the contact's balance.
pub struct ContactTerm {
    /// The effect's id.
    pub effect: &'static str,
    /// Which of its forms; empty where there is one.
    pub form: &'static str,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// Where its search starts.
    pub starts: Starts,
    /// Columns in which it is linear, where it has such.
    pub columns: Option<Columns>,
    /// Whether it is a law that can be exported: a law instead of columns.
    pub law: bool,
    /// The bridge that does the same within its class, where all that it does is an error of one.
    pub error_of: Option<Bridge>,
    /// What it is drawn over where it has a coordinate of its own: name with unit, all logs on end.
    pub coordinate: Option<(String, Vec<f64>)>,
    /// What it changes.
    pub act: Act,
    /// The core's parameters for fitted values; may change the baseline's numbers. `None` where the form is no law.
    pub export: Option<Export>,
}

/// Puts fitted values into a change.
pub type Act = Box<dyn Fn(&[f64], &mut Change) + Send + Sync>;

/// From fitted values to the core's parameters, names with units.
pub type Export = Box<dyn Fn(&[f64], &mut Numbers) -> Vec<(String, f64)> + Send + Sync>;

impl ContactTerm {
    /// Friction multiplied with e^(Σ size × column).
    pub fn factor(
        effect: &'static str,
        form: &'static str,
        columns: Vec<Column>,
        parameters: Vec<Parameter>,
    ) -> Self {
        let zero = vec![0.0; parameters.len()];
        let shared = columns.clone();
        Self {
            effect,
            form,
            parameters,
            starts: Starts::At(vec![zero]),
            columns: Some(Columns::LogFactor(columns)),
            law: false,
            error_of: None,
            coordinate: None,
            export: None,
            act: Box::new(move |sizes, change| change.add_log_factor(&shared, sizes)),
        }
    }

    /// The friction channel's amplifier has Σ size × column as its zero (N m), and as what its gain has drifted by: first the
    /// sizes of the zero's columns.
    pub fn amplifier(
        effect: &'static str,
        form: &'static str,
        [zero_nm, gain]: [Vec<Column>; 2],
        parameters: Vec<Parameter>,
    ) -> Self {
        let zero = vec![0.0; parameters.len()];
        Self {
            effect,
            form,
            parameters,
            starts: Starts::At(vec![zero]),
            columns: None,
            law: false,
            error_of: None,
            coordinate: None,
            export: None,
            act: Box::new(move |sizes, change| {
                let (zeros, gains) = sizes.split_at(zero_nm.len());
                change.add_zero(&zero_nm, zeros);
                change.add_gain(&gain, gains);
            }),
        }
    }

    /// As [`Self::amplifier`], the columns so slow that they move the slip by nothing to speak of.
    pub fn slow_amplifier(
        effect: &'static str,
        form: &'static str,
        columns: [Vec<Column>; 2],
        parameters: Vec<Parameter>,
    ) -> Self {
        let linear = Some(Columns::Amplifier(columns.clone()));
        Self { columns: linear, ..Self::amplifier(effect, form, columns, parameters) }
    }

    /// With the core's parameters for it.
    #[must_use]
    pub fn exported(
        mut self,
        export: impl Fn(&[f64], &mut Numbers) -> Vec<(String, f64)> + Send + Sync + 'static,
    ) -> Self {
        self.export = Some(Box::new(export));
        self
    }

    /// Drawn over this, name with unit, all logs on end.
    #[must_use]
    pub fn over(mut self, name: &str, values: Vec<f64>) -> Self {
        self.coordinate = Some((name.into(), values));
        self
    }

    /// As an error of a bridge, which is told beyond that one's class.
    #[must_use]
    pub fn as_error_of(mut self, bridge: Bridge) -> Self {
        self.error_of = Some(bridge);
        self
    }

    /// What it changes with these values.
    pub fn change(&self, values: &[f64]) -> Change {
        let mut change = Change::default();
        (self.act)(values, &mut change);
        change
    }

    /// Whether what it changes with these values is what a channel shows: that of friction, or all that the other one is taken
    /// for.
    pub fn changes_channel(&self, values: &[f64]) -> bool {
        self.heard_by() == Part::Pressure || self.change(values).changes_friction_channel()
    }

    /// The balance that hears of what it changes in a channel: that of the motor which bears what the bridge shows.
    pub fn heard_by(&self) -> Part {
        if self.error_of == Some(Bridge::Normal) { Part::Pressure } else { Part::Drive }
    }

    /// As a law that is fitted once another form of its effect leads.
    #[must_use]
    pub fn as_law(mut self) -> Self {
        self.law = true;
        self.form = "law";
        self
    }

    /// Any change.
    pub fn any(
        effect: &'static str,
        parameters: Vec<Parameter>,
        starts: Starts,
        act: impl Fn(&[f64], &mut Change) + Send + Sync + 'static,
    ) -> Self {
        Self {
            effect,
            form: "",
            parameters,
            starts,
            columns: None,
            law: false,
            error_of: None,
            coordinate: None,
            act: Box::new(act),
            export: None,
        }
    }
}
