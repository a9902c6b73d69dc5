//! What the page is told of a study.

use ndarray::Array2;
use ndof_analysis::diagnose::result::DiagnosisResult;
use ndof_analysis::estimate::result::EstimateResult;
use ndof_analysis::{ComparedParameter, model_response};
use ndof_models::InertiaDampingStiffness;
use ndof_study::file::{HiddenEffect, StudyFile};
use ndof_study::{StudyError, StudyOutcome, run_study};
use ndof_sysid::FrequencyResponse;
use serde::Serialize;

/// A response without uncertainty, `[output][input][frequency]` on the estimate's grid.
#[derive(Serialize)]
struct Curve {
    re: Vec<Vec<Vec<f64>>>,
    im: Vec<Vec<Vec<f64>>>,
}

/// A parameter, what was simulated and what was found.
#[derive(Serialize)]
struct Row {
    name: String,
    unit: String,
    truth: Option<f64>,
    value: Option<f64>,
    ci95: Option<[f64; 2]>,
}

/// A study's results as far as the page shows them.
#[derive(Serialize)]
pub struct Answer {
    estimate: EstimateResult,
    /// The fitted model.
    fitted: Curve,
    /// The limb's linear part as it was simulated.
    simulated: Option<Curve>,
    table: Vec<Row>,
    diagnosis: Option<DiagnosisResult>,
    /// What the study drew and hid.
    hidden: Vec<HiddenEffect>,
}

/// Runs the study in `text`.
///
/// # Errors
/// [`StudyError`] with the line of what cannot be read, or from the step that failed.
pub fn answer(text: &str) -> Result<Answer, StudyError> {
    let study = StudyFile::parse(text, "the study")?;
    let outcome = run_study(&study, None, None, &|_, _, _| ())?;
    let table = outcome.table();
    let StudyOutcome { simulated, estimated, fitted, diagnosed, hidden, .. } = outcome;
    let grid = &estimated.result.frequency_hz;
    let [low, high] = [grid.first(), grid.last()].map(|f| f.copied().unwrap_or_default());
    let like = estimated.best().band(low, high);
    let truth = simulated.as_ref().map(|simulated| {
        let square = |rows: &[Vec<f64>]| Array2::from_shape_fn((rows.len(), rows.len()), |(i, j)| rows[i][j]);
        let limb = &simulated.truth.endpoint;
        InertiaDampingStiffness { axes: fitted.matrices.axes.clone(), inertia: square(&limb.M), damping: square(&limb.B), stiffness: square(&limb.K) }
    });
    Ok(Answer {
        fitted: curve(&model_response(&fitted.matrices, &like)),
        simulated: truth.map(|limb| curve(&model_response(&limb, &like))),
        table: table.into_iter().map(row).collect(),
        estimate: estimated.result,
        diagnosis: diagnosed.map(|diagnosed| diagnosed.result),
        hidden,
    })
}

fn row(parameter: ComparedParameter) -> Row {
    let ComparedParameter { name, unit, truth, value, ci95, identifiable } = parameter;
    Row { name, unit, truth, value: value.filter(|_| identifiable), ci95: ci95.filter(|_| identifiable) }
}

fn curve(response: &FrequencyResponse) -> Curve {
    let (outputs, inputs) = response.shape();
    let part = |of: fn(&num_complex::Complex64) -> f64| {
        let along = |p: usize, q: usize| (0..response.len()).map(|f| of(&response.value[[f, p, q]])).collect();
        (0..outputs).map(|p| (0..inputs).map(|q| along(p, q)).collect()).collect()
    };
    Curve { re: part(|v| v.re), im: part(|v| v.im) }
}
