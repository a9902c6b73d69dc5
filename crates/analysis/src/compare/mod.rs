//! Fits beside each other, with the significance of what differs.

mod reliability;
pub mod result;

use crate::error::AnalysisError;
use crate::fit::result::{FitResult, Parameter};
use crate::result::{Head, Warning, finite, number};
use reliability::reliability;
use result::{CompareResult, Difference, ParameterComparison};
use statrs::distribution::{ContinuousCDF, Normal};

/// The normal distribution's 97.5 % quantile.
const QUANTILE: f64 = 1.959_963_984_540_054;

/// Compares each fit with the first, parameter by parameter, those at the joints last.
///
/// z = (x_k − x_1)/√(σ_k² + σ_1²); p-values are adjusted over everything compared (Holm 1979). Of three fits or more the standard
/// deviation between them is the standard error of measurement (Weir 2005, J. Strength Cond. Res. 19:231).
///
/// # Errors
/// [`AnalysisError::NothingToCompare`] if there are fewer than two fits or they share no parameter.
pub fn compare_fits(fits: &[FitResult]) -> Result<CompareResult, AnalysisError> {
    let [first, rest @ ..] = fits else { return Err(AnalysisError::NothingToCompare) };
    let others: Vec<Vec<&Parameter>> = rest.iter().map(|fit| fit.all_parameters().collect()).collect();
    let mut parameters = Vec::new();
    let mut lone = Vec::new();
    for own in first.all_parameters() {
        let later: Option<Vec<&Parameter>> = others.iter().map(|fit| fit.iter().copied().find(|p| p.name == own.name && p.unit == own.unit)).collect();
        match later {
            Some(later) => parameters.push(compared(own, &later)),
            None => lone.push(own.name.clone()),
        }
    }
    if rest.is_empty() || parameters.is_empty() {
        return Err(AnalysisError::NothingToCompare);
    }
    holm(parameters.iter_mut().flat_map(|p| &mut p.differences).filter_map(|d| d.p_value.as_mut()).collect());
    let mut warnings = Vec::new();
    if !lone.is_empty() {
        let what = format!("not in every fit: {}", lone.join(", "));
        warnings.push(Warning::new("not-in-all", what, "fit all recordings with the same model, channels and kinematics"));
    }
    // Noise makes no two fits alike to the last digit.
    let same = |k: usize| (0..k).any(|j| parameters.iter().all(|p| p.values[k].is_some() && p.values[j] == p.values[k]));
    for k in (1..fits.len()).filter(|k| same(*k)) {
        let what = format!(
            "fit {} has the numbers of one before it, to the last digit: it is no second measurement, and no difference speaks for or against anything",
            k + 1
        );
        warnings.push(Warning::new("same-fit", what, "give the fit of another recording"));
    }
    Ok(CompareResult { head: Head::new(CompareResult::SCHEMA, "compare", warnings), fits: fits.len(), parameters, reliability: Vec::new() })
}

fn compared(own: &Parameter, later: &[&Parameter]) -> ParameterComparison {
    let values: Vec<Option<f64>> = std::iter::once(own.value).chain(later.iter().map(|p| p.value)).collect();
    let differences = later
        .iter()
        .map(|p| {
            let value = p.value.zip(own.value).map(|(b, a)| b - a);
            let std_error = p.std_error.zip(own.std_error).map(|(b, a)| b.hypot(a));
            let ends = value.zip(std_error).and_then(|(d, s)| finite([d - QUANTILE * s, d + QUANTILE * s]));
            let p_value = value.zip(std_error).and_then(|(d, s)| Normal::new(0.0, 1.0).ok().map(|normal| 2.0 * normal.sf((d / s).abs()))).and_then(number);
            Difference { value, std_error, ci95: ends, p_value }
        })
        .collect();
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    let sem = (known.len() >= 3).then(|| {
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        (known.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (known.len() - 1) as f64).sqrt()
    });
    ParameterComparison {
        name: own.name.clone(),
        unit: own.unit.clone(),
        values,
        ci95: std::iter::once(own.ci95).chain(later.iter().map(|p| p.ci95)).collect(),
        differences,
        standard_error_of_measurement: sem,
        minimal_detectable_change: sem.map(|sem| QUANTILE * std::f64::consts::SQRT_2 * sem),
    }
}

/// Compares `sessions` fits of each subject, given subject by subject: agreement of the sessions, and what changed.
///
/// # Errors
/// [`AnalysisError::Sessions`] unless the fits are whole subjects, at least two with at least two sessions each;
/// [`AnalysisError::NothingToCompare`] if they have no parameter in common.
pub fn compare_sessions(fits: &[FitResult], sessions: usize) -> Result<CompareResult, AnalysisError> {
    if sessions < 2 || !fits.len().is_multiple_of(sessions) || fits.len() < 2 * sessions {
        return Err(AnalysisError::Sessions { fits: fits.len(), sessions });
    }
    let mut result = compare_fits(fits)?;
    for p in &result.parameters {
        // A subject with a session that lacks the value is left out as a whole.
        let values: Vec<Vec<f64>> = p.values.chunks(sessions).filter_map(|subject| subject.iter().copied().collect()).collect();
        result.reliability.extend(reliability(&p.name, &p.unit, &values));
    }
    holm(result.reliability.iter_mut().flat_map(|r| &mut r.changes).filter_map(|change| change.p_value.as_mut()).collect());
    Ok(result)
}

/// Holm's adjustment.
fn holm(mut all: Vec<&mut f64>) {
    all.sort_by(|a, b| a.total_cmp(b));
    let count = all.len();
    let mut largest = 0.0_f64;
    for (k, p) in all.into_iter().enumerate() {
        largest = largest.max((*p * (count - k) as f64).min(1.0));
        *p = largest;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::FitCost;
    use crate::fit::result::{Matrices, MatrixErrors, Site};
    use crate::result::Matrix;

    fn fit(values: &[(&str, f64, f64)]) -> FitResult {
        let parameter = |&(name, value, std_error): &(&str, f64, f64)| Parameter {
            name: name.to_owned(),
            unit: "N/m".to_owned(),
            site: Site { side: "limb".to_owned(), axis: "x".to_owned() },
            value: Some(value),
            std_error: Some(std_error),
            ci95: Some([value - 2.0 * std_error, value + 2.0 * std_error]),
            identifiable: true,
        };
        let none = Matrix::from(ndarray::Array2::zeros((0, 0)));
        let std_error = MatrixErrors { M: none.clone(), B: none.clone(), K: none.clone() };
        FitResult {
            head: Head::new(FitResult::SCHEMA, "fit", Vec::new()),
            settings: None,
            model: String::new(),
            cost: FitCost::Weighted,
            estimate: String::new(),
            inputs: Vec::new(),
            reference_inputs: Vec::new(),
            outputs: Vec::new(),
            band_hz: [0.5, 8.0],
            band_because: None,
            frequencies: 1,
            between_samples: None,
            interval_width: ndof_models::Width::Covariance,
            chi2_reduced: None,
            parameters: values.iter().map(parameter).collect(),
            matrices: Matrices { M: none.clone(), B: none.clone(), K: none.clone(), std_error, delay_s: None },
            vaf: none,
            r2: None,
            symmetry: Vec::new(),
            joint: None,
            schedule: None,
            in_time: None,
            other_cost: None,
            comparison: Vec::new(),
        }
    }

    #[test]
    fn two_standard_errors_apart_and_adjusted_for_two_tests() {
        // z = 1.96·√2·σ/(√2 σ): p = 0.05, and with the other parameter equal (p = 1) Holm doubles it.
        let after = 100.0 + QUANTILE * 3.0 * std::f64::consts::SQRT_2;
        let found = compare_fits(&[fit(&[("K", 100.0, 3.0), ("B", 5.0, 1.0)]), fit(&[("K", after, 3.0), ("B", 5.0, 1.0)])]).expect("fits");
        let p = |k: usize| found.parameters[k].differences[0].p_value.expect("a number");
        assert!((p(0) - 0.10).abs() < 1e-9, "{}", p(0));
        assert_eq!(p(1), 1.0);
        assert_eq!(found.parameters[0].standard_error_of_measurement, None);
    }

    #[test]
    fn a_fit_beside_itself_is_told() {
        let of = |k: f64| fit(&[("K", k, 3.0), ("B", 5.0, 1.0)]);
        let codes = |found: CompareResult| found.head.warnings.into_iter().map(|w| w.code).collect::<Vec<_>>();
        assert_eq!(codes(compare_fits(&[of(100.0), of(101.0), of(100.0)]).expect("fits")), ["same-fit"]);
        assert!(codes(compare_fits(&[of(100.0), of(101.0)]).expect("fits")).is_empty());
    }

    #[test]
    fn of_three_sessions_the_scatter_is_the_error_of_measurement() {
        let sessions = [98.0, 100.0, 102.0].map(|k| fit(&[("K", k, 1.0)]));
        let found = compare_fits(&sessions).expect("fits");
        assert!((found.parameters[0].standard_error_of_measurement.expect("a number") - 2.0).abs() < 1e-12);
        assert!(matches!(compare_fits(&sessions[..1]), Err(AnalysisError::NothingToCompare)));
    }
}
