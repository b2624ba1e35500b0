//! `viscous_film`: a force proportional to sliding speed and independent of normal force.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct ViscousFilm;

impl Effect for ViscousFilm {
    fn about(&self) -> About {
        About {
            id: "viscous_film",
            meaning: "a film drags in proportion to speed, whatever the load",
            experiment: "slide at 30, 60 and 120 rpm under 10 N and under 88 N",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        // As much as the usual friction at the usual speed.
        let radius = view.logs.first().map_or(1.0, |log| log.radius_m);
        let unit = view.scales.torque_nm / radius / view.scales.speed_m_s;
        let parameters = vec![Parameter::positive("coefficient", 0.5)];
        vec![ContactTerm::any(self.id(), parameters, Starts::At(vec![vec![0.0]]), move |p, change| {
            change.film_n_s_per_m += unit * p[0];
        })
        .exported(move |p, _| vec![("coefficient_n_s_per_m".into(), unit * p[0])])]
    }
}
