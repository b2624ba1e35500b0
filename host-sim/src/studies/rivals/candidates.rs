//! The models that compete: every kind of the registry, with what a fit may move.

use model_core::friction::{FrictionParameters, ModelKind};

/// A model with its free parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Name in tables.
    pub name: String,
    /// The numbers with which it plays the rubber, and starts as a fit.
    pub typical: FrictionParameters<f64>,
    /// Free parameters: place among the values, and range.
    pub free: Vec<(usize, f64, f64)>,
    /// Further starts of a fit: changes of the typical numbers.
    pub other_starts: Vec<Vec<(&'static str, f64)>>,
}

impl Candidate {
    fn new(kind: ModelKind) -> Self {
        let free = kind.parameters().iter().enumerate();
        let free = free.filter_map(|(k, spec)| spec.search.map(|(low, high)| (k, low, high))).collect();
        let has = |name: &str| kind.parameters().iter().any(|spec| spec.name == name);
        let mut typical = FrictionParameters::typical(kind);
        let mut other_starts = Vec::new();
        // Bristles that stand for the rubber are as soft as it; a fit may also want them stiff.
        if has("sigma0_n_per_m") && !has("k_u_n_per_m") {
            typical = typical.with("sigma0_n_per_m", 3e4);
            other_starts.push(vec![("sigma0_n_per_m", 1e6)]);
        }
        if has("c_u_n_s_per_m") {
            let now = typical.get("c_u_n_s_per_m").unwrap_or(1.0);
            let damped = ("c_u_n_s_per_m", if now < 50.0 { 150.0 } else { 20.0 });
            other_starts.push(vec![damped]);
            // A block that relaxes contains the one that does not, with hardly any branch.
            let branch =
                [("k_1_n_per_m", 1e3), ("branch_ratio", 0.01)].into_iter().find(|(name, _)| has(name));
            other_starts.extend(branch.map(|weak| vec![damped, weak]));
        }
        Self { name: kind.name().into(), typical, free, other_starts }
    }

    /// The same with a parameter freed that fits usually leave alone.
    fn freed(self, name: &str, at: &'static str, value: f64, low: f64, high: f64) -> Self {
        let place = self.typical.kind().parameters().iter().position(|spec| spec.name == at);
        let mut free = self.free;
        free.extend(place.map(|place| (place, low, high)));
        Self { name: name.into(), typical: self.typical.with(at, value), free, ..self }
    }
}

/// All candidates. The fold of the modified model is left out: where it differs it never settles.
#[must_use]
pub fn all() -> Vec<Candidate> {
    let kinds = ModelKind::ALL.iter().filter(|kind| **kind != ModelKind::ModifiedLugreFold);
    let mut candidates: Vec<Candidate> = kinds.map(|kind| Candidate::new(*kind)).collect();
    candidates.push(Candidate::new(ModelKind::Lugre).freed(
        "lugre, σ1 free",
        "sigma1_n_s_per_m",
        160.0,
        1.0,
        3000.0,
    ));
    candidates
}
