//! A least-squares problem from two functions, for the crate `levenberg-marquardt`.

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{DMatrix, DVector, Dyn, Owned};

/// Residuals and their derivatives as functions of the parameters; `None` of either ends a search.
pub(crate) struct Problem<R, J> {
    /// The parameters: where a search begins, and afterwards where it ended.
    pub(crate) at: DVector<f64>,
    pub(crate) residuals: R,
    /// A row for each residual, a column for each parameter.
    pub(crate) jacobian: J,
}

impl<R, J> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<R, J>
where
    R: Fn(&DVector<f64>) -> Option<DVector<f64>>,
    J: Fn(&DVector<f64>) -> Option<DMatrix<f64>>,
{
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.at.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        (self.residuals)(&self.at)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        (self.jacobian)(&self.at)
    }
}
