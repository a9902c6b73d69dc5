//! Can the fitted limb give off energy?

use super::{Derived, symmetric_eigen};
use crate::{Fit, InertiaDampingStiffnessModel};
use serde::{Deserialize, Serialize};

/// Whether M, B and K are those of a passive system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Passivity {
    /// Least eigenvalue of the symmetric part of M, B and K.
    pub least_eigenvalue: [Derived; 3],
    /// No least eigenvalue is negative beyond its interval.
    pub passive: bool,
    /// One sentence for each violation.
    pub violations: Vec<String>,
}

/// Tests a fit for passivity: M s² + B s + K gives off no energy if and only if the symmetric parts of M, B and K have
/// no negative eigenvalue and M and K are symmetric; the second part is what
/// [`symmetry_test`](super::symmetry_test) tests. An eigenvalue counts as negative if its whole interval is.
/// `None` if a matrix is not finite.
pub fn passivity(model: &InertiaDampingStiffnessModel, fit: &Fit) -> Option<Passivity> {
    let matrices = model.matrices(&fit.theta);
    let per = model.entries().len();
    let mut least = Vec::with_capacity(3);
    for (m, matrix) in [&matrices.inertia, &matrices.damping, &matrices.stiffness].into_iter().enumerate() {
        let (values, vectors) = symmetric_eigen(matrix)?;
        let n = values.len();
        let mut gradient = vec![0.0; fit.theta.len()];
        for k in 0..per {
            let mut unit = vec![0.0; per];
            unit[k] = 1.0;
            let slope = model.matrix(&unit);
            gradient[m * per + k] = (0..n * n).map(|e| vectors[[e / n, 0]] * slope[[e / n, e % n]] * vectors[[e % n, 0]]).sum();
        }
        least.push(Derived::new(*values.first()?, &gradient, &fit.covariance, fit.interval_quantile));
    }
    let meanings = [
        "M has a negative eigenvalue: the force channel is most likely that of the reaction; turn it with --negate",
        "B has a negative eigenvalue: the limb feeds energy in (reflex, voluntary reaction), or the force channel is late",
        "K has a negative eigenvalue: the posture is unstable in that direction, or a mean force and gravity are not accounted for",
    ];
    let violations: Vec<String> = least
        .iter()
        .zip(meanings)
        .filter(|(d, _)| d.ci95[1] < 0.0)
        .map(|(d, text)| format!("{text} (least eigenvalue {:.4} to {:.4})", d.ci95[0], d.ci95[1]))
        .collect();
    let least_eigenvalue = <[Derived; 3]>::try_from(least).ok()?;
    Some(Passivity { least_eigenvalue, passive: violations.is_empty(), violations })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, ParametricModel, StopReason, Symmetry, physical::symmetry_test};
    use ndarray::Array2;

    fn fit(model: &InertiaDampingStiffnessModel, theta: Vec<f64>) -> Fit {
        let n = theta.len();
        Fit {
            model: model.name().to_owned(),
            parameters: Vec::new(),
            theta,
            covariance: Array2::eye(n) * 1e-2,
            width: crate::Width::Covariance,
            covariance_scale: 1.0,
            interval_quantile: 2.0,
            band_hz: [0.5, 8.0],
            bins: 100,
            chi2: 1.0,
            degrees_of_freedom: 1.0,
            chi2_reduced: 1.0,
            condition: 1.0,
            reason: StopReason::CostConverged,
            iterations: 1,
        }
    }

    #[test]
    fn a_reaction_force_shows_as_negative_inertia_with_the_remedy() {
        let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Symmetric);
        let found = passivity(&model, &fit(&model, vec![-2.0, 0.0, -1.9, 10.0, 0.0, 12.0, 300.0, 0.0, 500.0])).expect("finite");
        assert!(!found.passive && found.violations.len() == 1 && found.violations[0].contains("--negate"));
        assert!((found.least_eigenvalue[0].std_error - 0.1).abs() < 1e-12);
    }

    #[test]
    fn curl_in_stiffness_is_told_from_a_symmetric_inertia() {
        let model = InertiaDampingStiffnessModel::new(vec![Axis::linear("x"), Axis::linear("y")], Symmetry::Free);
        let tests = symmetry_test(&model, &fit(&model, vec![2.0, 0.1, 0.1, 1.9, 10.0, 0.2, 0.1, 12.0, 300.0, 5.0, 4.0, 500.0]));
        assert!(tests[0].p_value > 0.5 && tests[2].p_value < 1e-4, "{tests:?}");
        // Half the difference of two independent entries of variance 0.01: variance 0.005.
        assert!((tests[2].antisymmetric[0].half_difference.std_error - 0.005f64.sqrt()).abs() < 1e-12);
        // (0.5)²/0.005 = 50 on one degree of freedom.
        assert!((tests[2].p_value / 1.537e-12 - 1.0).abs() < 0.01, "{}", tests[2].p_value);
    }
}
