//! What the contact says that its channels show too much, for the motor that bears what the bridge shows.
//!
//! An error of the friction channel is no torque of M2, one of the normal channel no torque of M1. What another balance hears
//! of it is the contact's posterior: the error itself, and along each direction in which the contact leaves it open what a
//! deviation makes of it.

use nalgebra::DMatrix;

use super::balance::Alternative;
use super::law_form::LAW_FORM;
use super::table::Part;
use super::term::Parameter;

/// An error of a channel by log and point, N m or N.
pub type ChannelError = Vec<Vec<f64>>;

/// What is heard of an effect.
pub struct Heard {
    /// Its id.
    pub effect: &'static str,
    /// What the channel shows too much.
    pub error: ChannelError,
    /// What one deviation of the contact's own uncertainty adds to it, by direction.
    pub open: Vec<ChannelError>,
}

/// Where an effect stands in the contact: a set, and what that leaves open of the effect's values.
pub struct Teller {
    /// Its id.
    pub effect: &'static str,
    /// The balance that hears of it.
    pub heard_by: Part,
    /// Place of the best set that has it.
    pub place: usize,
    /// Its values there.
    pub values: Vec<f64>,
    /// Lower triangle of their covariance; no columns where the set is out of the question, or nothing is to be left open.
    pub open: DMatrix<f64>,
}

impl Teller {
    /// What a law that takes the effect's values makes of them.
    pub fn tell(&self, error_at: impl Fn(&[f64]) -> Option<ChannelError>) -> Option<Heard> {
        let error = error_at(&self.values)?;
        let moved = |direction: usize| {
            let values: Vec<f64> =
                self.values.iter().enumerate().map(|(i, value)| value + self.open[(i, direction)]).collect();
            let moved = error_at(&values)?;
            let differs = |(moved, error): (&Vec<f64>, &Vec<f64>)| {
                moved.iter().zip(error).map(|(a, b)| a - b).collect()
            };
            Some(moved.iter().zip(&error).map(differs).collect())
        };
        let open = (0..self.open.ncols()).filter_map(moved).collect();
        Some(Heard { effect: self.effect, error, open })
    }
}

impl Heard {
    /// As a form of a balance whose response has `response` of such an error: as large as the contact says to what a law's form is
    /// known to, and to what the contact leaves open.
    pub fn form(&self, response: impl Fn(&ChannelError) -> Vec<f64>) -> Alternative {
        let bears_less = |error: &ChannelError| -> Vec<f64> { response(error).iter().map(|e| -e).collect() };
        let known = |name: String, sd: f64| Parameter { amplitude: false, ..Parameter::amplitude(name, sd) };
        let open = (1..=self.open.len()).map(|at| known(format!("told_open_{at}"), 1.0));
        Alternative {
            form: "as the contact tells it".into(),
            response: Some(response(&self.error)),
            told: true,
            ..Alternative::columns(
                self.effect,
                std::iter::once(known("told_too_small".into(), LAW_FORM)).chain(open).collect(),
                std::iter::once(&self.error).chain(&self.open).map(bears_less).collect(),
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_along_each_direction_is_what_the_contact_leaves_open() {
        // Two values of covariance [[4, 2], [2, 2]], and an error that is their ramp and their step.
        let teller = Teller {
            effect: "channel",
            heard_by: Part::Pressure,
            place: 0,
            values: vec![3.0, -1.0],
            open: DMatrix::from_row_slice(2, 2, &[2.0, 0.0, 1.0, 1.0]),
        };
        let error_at =
            |values: &[f64]| Some(vec![vec![0.0, values[1]], vec![values[0], values[0] + values[1]]]);
        let heard = teller.tell(error_at).expect("it has one");
        assert_eq!(heard.error, [[0.0, -1.0], [3.0, 2.0]]);
        assert_eq!(heard.open, [[[0.0, 1.0], [2.0, 3.0]], [[0.0, 1.0], [0.0, 1.0]]]);
        assert!(teller.tell(|_| None).is_none());
    }
}
