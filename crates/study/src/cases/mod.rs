//! All cases of a study, and what they show beside each other.

pub mod result;

use crate::Progress;
use crate::analysed::COMMAND;
use crate::cases::result::{BandAgreement, Case, Compared, Ellipse, LowBand, MatrixNumbers, Parameter, Setting, Step, StudyResult};
use crate::error::StudyError;
use crate::file::{ReportSection, StepsSection, StudyDocument, StudyFile};
use crate::run::{StudyOutcome, run_study};
use ndarray::{Array2, Array3, Axis as Dimension};
use ndof_analysis::result::{Head, Number, Warning, finite, number};
use ndof_analysis::{AnalysisError, Estimated, Fitted, Trial};
use ndof_devices::{Impedance, Linearised};
use ndof_models::{agreement, physical};
use ndof_sysid::{FrequencyResponse, ResponseKind};
use num_complex::Complex64;

/// Runs every case of a study; one without a name where it has none, or where recordings take the place of the simulation.
///
/// # Errors
/// [`StudyError`] from the step that failed.
pub fn run_cases(
    study: &StudyFile,
    recordings: Option<Vec<Trial>>,
    seed: Option<u64>,
    progress: &Progress<'_>,
) -> Result<Vec<(String, StudyOutcome)>, StudyError> {
    if recordings.is_some() {
        return Ok(vec![(String::new(), run_study(study, recordings, seed, progress)?)]);
    }
    let cases = study.each_case()?;
    let count = cases.len();
    let mut outcomes = Vec::with_capacity(count);
    for (k, (name, case)) in cases.into_iter().enumerate() {
        outcomes.push((name, run_study(&case, None, seed, progress)?));
        if count > 1 {
            progress("cases", k + 1, count);
        }
    }
    Ok(outcomes)
}

/// What the cases of a study show beside the truth and beside each other.
///
/// # Errors
/// [`StudyError`] if a response cannot be compared.
pub fn study_result<E>(study: &StudyDocument<E>, outcomes: &[(String, StudyOutcome)]) -> Result<StudyResult, StudyError> {
    let cases = outcomes.iter().map(|(name, outcome)| case(study, name, outcome)).collect::<Result<Vec<_>, StudyError>>()?;
    let mut warnings: Vec<Warning> = Vec::new();
    for warning in outcomes.iter().flat_map(|(_, outcome)| &outcome.fitted.result.head.warnings) {
        if !warnings.iter().any(|w| w.code == warning.code) {
            warnings.push(warning.clone());
        }
    }
    let steps = study.report.steps.iter().flat_map(|section| steps(section, &cases)).collect();
    Ok(StudyResult { head: Head::new(StudyResult::SCHEMA, COMMAND, warnings), cases, steps })
}

fn case<E>(study: &StudyDocument<E>, name: &str, outcome: &StudyOutcome) -> Result<Case, StudyError> {
    let trials = &outcome.trials;
    let displacement = displacement(outcome);
    let first = (study.estimate.name.clone().unwrap_or_else(|| outcome.estimated.result.method.name.clone()), &outcome.estimated, &outcome.fitted);
    let settings = std::iter::once(first)
        .chain(outcome.also.iter().map(|(name, estimated, fitted)| (name.clone(), estimated, fitted)))
        .map(|(name, estimated, fitted)| setting(&study.report, name, estimated, fitted, outcome))
        .collect::<Result<Vec<_>, StudyError>>()?;
    Ok(Case {
        name: name.to_owned(),
        trials: trials.trials.len(),
        axes: outcome.fitted.matrices.axes.iter().map(|axis| axis.name.clone()).collect(),
        distance: number(displacement.iter().map(|d| d * d).sum::<f64>().sqrt()),
        displacement: displacement.into_iter().map(number).collect(),
        settings,
    })
}

/// Mean over the last quarter of all trials of the outputs, from the posture; empty where that is not known.
fn displacement(outcome: &StudyOutcome) -> Vec<f64> {
    let Some(simulated) = &outcome.simulated else { return Vec::new() };
    let tail = |samples: &[f64]| {
        let late = &samples[samples.len() - (samples.len() / 4).max(1)..];
        late.iter().sum::<f64>() / late.len() as f64
    };
    let trials = &outcome.trials;
    let mean = |output: usize| trials.trials.iter().map(|trial| tail(&trial.recording.channels()[output].samples)).sum::<f64>() / trials.trials.len() as f64;
    trials.roles.ports.outputs.iter().zip(&simulated.rest).map(|(&output, rest)| mean(output) - rest).collect()
}

fn setting(report: &ReportSection, name: String, estimated: &Estimated, fitted: &Fitted, outcome: &StudyOutcome) -> Result<Setting, StudyError> {
    let truth = outcome.constants();
    let parameters = fitted
        .table(|name| truth?.truth.parameter(name))
        .into_iter()
        .map(|p| Parameter {
            std_error: fitted.fit.parameter(&p.name).and_then(|found| number(found.std_error)),
            holds: p.truth.zip(p.ci95).map(|(truth, [low, high])| (low..=high).contains(&truth)),
            name: p.name,
            unit: p.unit,
            truth: p.truth,
            value: p.value,
            ci95: p.ci95,
        })
        .collect();
    let method = &estimated.result.method;
    Ok(Setting {
        name,
        method: method.name.clone(),
        segments_per_trial: (method.name == "welch").then(|| method.segments / outcome.trials.trials.len().max(1)),
        effective_averages: number(method.effective_averages),
        parameters,
        relative_error: truth.map(|s| relative_error(fitted, &s.linear.limb)),
        agreement: truth.map_or(Ok(Vec::new()), |s| agreements(&report.bands_hz, estimated, &s.linear))?,
        ellipse: ellipse(fitted, truth.map(|s| &s.linear.limb.stiffness)),
        low_band: low_band(report.low_band_hz, estimated, truth.map(|s| &s.linear)),
    })
}

/// ‖X̂ − X‖/‖X‖ of the fitted matrices.
pub(crate) fn relative_error(fitted: &Fitted, truth: &Impedance) -> MatrixNumbers {
    let norm = |a: &Array2<f64>| a.iter().map(|v| v * v).sum::<f64>().sqrt();
    let error = |found: &Array2<f64>, truth: &Array2<f64>| if found.dim() == truth.dim() { number(norm(&(found - truth)) / norm(truth)) } else { None };
    let found = &fitted.matrices;
    MatrixNumbers { M: error(&found.inertia, &truth.inertia), B: error(&found.damping, &truth.damping), K: error(&found.stiffness, &truth.stiffness) }
}

/// The compliance of the linearised plant with its transducer on the grid of `like`; NaN where it has none or sizes differ.
fn plant(linear: &Linearised, like: &FrequencyResponse) -> FrequencyResponse {
    let mut value = Array3::from_elem(like.value.dim(), Complex64::new(f64::NAN, f64::NAN));
    for (f, &hz) in like.frequency_hz.iter().enumerate() {
        if let Some(compliance) = linear.compliance_with_transducer(hz).filter(|c| c.dim() == like.shape()) {
            value.index_axis_mut(Dimension(0), f).assign(&compliance);
        }
    }
    FrequencyResponse { value, kind: ResponseKind::Compliance, uncertainty: None, ..like.clone() }
}

/// The frequencies of a band without 0 Hz.
fn above_zero(response: &FrequencyResponse, band_hz: [f64; 2]) -> Vec<usize> {
    response.within(band_hz).into_iter().filter(|&f| response.frequency_hz[f] > 0.0).collect()
}

fn agreements(bands_hz: &[[f64; 2]], estimated: &Estimated, linear: &Linearised) -> Result<Vec<BandAgreement>, StudyError> {
    let direct = &estimated.estimates.direct;
    let derived = estimated.estimates.derived.as_ref();
    let mut estimates = vec![("direct", &direct.response, &direct.coherence.partial)];
    estimates.extend(derived.map(|d| ("derived", &d.response, &d.coherence_paper.partial)));
    let mut out = Vec::new();
    for (name, response, partial) in estimates {
        let plant = plant(linear, response);
        // The stiffness has the plant's zeros off the diagonal; its standard error is that of the response that is shown.
        let stiffness = response.to_kind(ResponseKind::DynamicStiffness).map_err(AnalysisError::from)?;
        let (p, q) = response.shape();
        for &band in bands_hz {
            let agreed = agreement(response, &plant, partial, band).map_err(AnalysisError::from)?;
            let used = above_zero(response, band);
            let mean = |of: &dyn Fn(usize, usize, usize) -> f64| -> Vec<Vec<Number>> {
                let element = |i: usize, j: usize| {
                    let values: Vec<f64> = used.iter().map(|&f| of(f, i, j)).filter(|v| v.is_finite()).collect();
                    number(values.iter().sum::<f64>() / values.len() as f64)
                };
                (0..p).map(|i| (0..q).map(|j| element(i, j)).collect()).collect()
            };
            out.push(BandAgreement {
                estimate: name.to_owned(),
                band_hz: band,
                vaf: agreed.vaf_percent.iter().map(|row| row.iter().map(|v| v.and_then(number)).collect()).collect(),
                r2: agreed.r2.and_then(number),
                partial_coherence: mean(&|f, i, j| partial[[f, i, j]]),
                relative_error: mean(&|f, i, j| (stiffness.variance(f, i, j) / 2.0).sqrt() / stiffness.value[[f, i, j]].norm()),
            });
        }
    }
    Ok(out)
}

/// The largest anisotropy (λ₁ − λ₂)/(λ₁ + λ₂) that counts as a circle.
const CIRCLE: f64 = 1e-6;

fn ellipse(fitted: &Fitted, truth: Option<&Array2<f64>>) -> Option<Ellipse> {
    let (fit, k) = (&fitted.fit, &fitted.matrices.stiffness);
    let [x, y] = fitted.matrices.axes.as_slice() else { return None };
    if x.rotational || y.rotational {
        return None;
    }
    let places: Vec<usize> = fit.parameters.iter().enumerate().filter(|(_, p)| p.name.starts_with("K_")).map(|(index, _)| index).collect();
    let symmetric = places.len() == 3;
    let covariance = Array2::from_shape_fn((places.len(), places.len()), |(i, j)| fit.covariance[[places[i], places[j]]]);
    let found = physical::ellipse(k, &physical::unit_matrices(symmetric), &covariance, fit.interval_quantile)?;
    let simulated = truth.and_then(|truth| physical::ellipse(truth, &[], &Array2::zeros((0, 0)), 0.0));
    let compared = |truth: Option<f64>, value: f64, ci95: [f64; 2]| Compared { truth: truth.and_then(number), value: number(value), ci95: finite(ci95) };
    let round = simulated.as_ref().is_some_and(|s| (s.major.value - s.minor.value) < CIRCLE * (s.major.value + s.minor.value));
    let orientation = || {
        let value = found.orientation_rad.value;
        // The direction nearest to the truth of the two that an ellipse has.
        let truth = simulated.as_ref().map(|s| s.orientation_rad.value);
        let turns = truth.map_or(0.0, |t| ((t - value) / std::f64::consts::PI).round() * std::f64::consts::PI);
        let degrees = |v: f64| (v + turns).to_degrees();
        compared(truth.map(f64::to_degrees), degrees(value), found.orientation_rad.ci95.map(degrees))
    };
    Some(Ellipse {
        major: compared(simulated.as_ref().map(|s| s.major.value), found.major.value, found.major.ci95),
        minor: compared(simulated.as_ref().map(|s| s.minor.value), found.minor.value, found.minor.ci95),
        orientation_deg: (!round).then(orientation),
        axis_ratio: compared(simulated.as_ref().map(|s| s.shape.value), found.shape.value, axis_ratio_interval(k, &covariance, symmetric)),
    })
}

/// The axis ratio (1 + a)/(1 − a) over the 95 % region of the anisotropy vector a = (K_xx − K_yy, 2 K_xy)/(K_xx + K_yy): unlike an
/// interval about the estimate, which is above 1 even of a circle, it reaches 1 where the data allow a circle.
fn axis_ratio_interval(k: &Array2<f64>, covariance: &Array2<f64>, symmetric: bool) -> [f64; 2] {
    /// 95 % quantile of χ² with two degrees of freedom.
    const CHI2_95: f64 = 5.991_464_547_107_979;
    let trace = k[[0, 0]] + k[[1, 1]];
    let a = [(k[[0, 0]] - k[[1, 1]]) / trace, (k[[0, 1]] + k[[1, 0]]) / trace];
    // Rows: ∂a/∂K_xx, (K_xy, K_yx), K_yy.
    let cross = if symmetric { vec![[0.0, 2.0 / trace]] } else { vec![[0.0, 1.0 / trace]; 2] };
    let mut gradient = vec![[(1.0 - a[0]) / trace, -a[1] / trace]];
    gradient.extend(cross);
    gradient.push([(-1.0 - a[0]) / trace, -a[1] / trace]);
    let of = |r: usize, s: usize| -> f64 {
        (0..gradient.len()).flat_map(|i| (0..gradient.len()).map(move |j| (i, j))).map(|(i, j)| gradient[i][r] * covariance[[i, j]] * gradient[j][s]).sum()
    };
    let (p, q, r) = (of(0, 0), of(0, 1), of(1, 1));
    let determinant = p * r - q * q;
    if !(determinant > 0.0 && p > 0.0) {
        return [f64::NAN; 2];
    }
    let ratio = |length: f64| if length < 1.0 { (1.0 + length) / (1.0 - length) } else { f64::INFINITY };
    // The region's rim: a + √χ² L (cos, sin) with L Lᵀ the covariance.
    let (l11, l21, l22) = (p.sqrt(), q / p.sqrt(), (determinant / p).sqrt());
    let rim = (0..720).map(|step| {
        let (sine, cosine) = (f64::from(step) * std::f64::consts::PI / 360.0).sin_cos();
        (a[0] + CHI2_95.sqrt() * l11 * cosine).hypot(a[1] + CHI2_95.sqrt() * (l21 * cosine + l22 * sine))
    });
    let (low, high) = rim.fold((f64::INFINITY, 0.0_f64), |(low, high), length| (low.min(length), high.max(length)));
    let circle = (r * a[0] * a[0] - 2.0 * q * a[0] * a[1] + p * a[1] * a[1]) / determinant <= CHI2_95;
    [if circle { 1.0 } else { ratio(low) }, ratio(high)]
}

fn low_band(band_hz: [f64; 2], estimated: &Estimated, linear: Option<&Linearised>) -> LowBand {
    let direct = &estimated.estimates.direct;
    let response = &direct.response;
    let used = above_zero(response, band_hz);
    let inputs = direct.input_coherence.dim().1;
    let between = |f: usize| (0..inputs).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| direct.input_coherence[[f, i, j]]).fold(f64::NAN, f64::max);
    let coherences: Vec<f64> = used.iter().map(|&f| between(f)).filter(|c| c.is_finite()).collect();
    let error = |response: &FrequencyResponse| {
        let plant = plant(linear?, response);
        let (mut off, mut size) = (0.0, 0.0);
        for &f in &used {
            let (found, truth) = (response.at(f), plant.at(f));
            let here: f64 = (&found - &truth).iter().map(Complex64::norm_sqr).sum();
            if here.is_finite() {
                off += here;
                size += truth.iter().map(Complex64::norm_sqr).sum::<f64>();
            }
        }
        number((off / size).sqrt())
    };
    LowBand {
        band_hz,
        input_coherence_mean: number(coherences.iter().sum::<f64>() / coherences.len() as f64),
        input_coherence_max: number(coherences.iter().copied().fold(f64::NAN, f64::max)),
        significance_95: number(direct.significance_95.ordinary),
        direct_error: error(response),
        derived_error: estimated.estimates.derived.as_ref().and_then(|d| error(&d.response)),
    }
}

/// The change of a parameter from each case to the next, setting by setting; estimates of different cases are independent.
fn steps(section: &StepsSection, cases: &[Case]) -> Vec<Step> {
    let parameter = section.parameter.as_str();
    let row: Vec<&Case> = section.cases.iter().filter_map(|name| cases.iter().find(|case| case.name == *name)).collect();
    let mut out = Vec::new();
    for pair in row.windows(2) {
        for (before, after) in pair[0].settings.iter().zip(&pair[1].settings) {
            let find = |setting: &Setting| setting.parameters.iter().find(|p| p.name == parameter).cloned();
            let (Some(a), Some(b)) = (find(before), find(after)) else { continue };
            let difference = |a: Number, b: Number| a.zip(b).map(|(a, b)| b - a);
            let value = difference(a.value, b.value);
            let std_error = a.std_error.zip(b.std_error).map(|(a, b)| a.hypot(b));
            // The wider of both intervals' quantiles.
            let quantile = |p: &Parameter| p.ci95.zip(p.std_error).map_or(f64::NAN, |([low, high], error)| (high - low) / (2.0 * error));
            let half = std_error.map(|error| error * quantile(&a).max(quantile(&b)));
            out.push(Step {
                from: pair[0].name.clone(),
                to: pair[1].name.clone(),
                setting: before.name.clone(),
                parameter: parameter.to_owned(),
                unit: a.unit.clone(),
                change: Compared { truth: difference(a.truth, b.truth), value, ci95: value.zip(half).and_then(|(v, h)| finite([v - h, v + h])) },
                z: value.zip(std_error).and_then(|(v, e)| number(v / e)),
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{arr2, array};
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    #[test]
    fn the_interval_of_a_circle_s_axis_ratio_reaches_one_as_often_as_it_says() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let covariance = Array2::from_diag(&array![4.0, 2.0, 9.0]);
        let (draws, mut circles, mut holds) = (2000, 0, 0);
        for _ in 0..draws {
            let mut noise = |sd: f64| sd * rng.sample::<f64, _>(StandardNormal);
            let (a, b, c) = (noise(2.0), noise(2f64.sqrt()), noise(3.0));
            circles += usize::from(axis_ratio_interval(&arr2(&[[300.0 + a, b], [b, 300.0 + c]]), &covariance, true)[0] == 1.0);
            let [low, high] = axis_ratio_interval(&arr2(&[[400.0 + a, b], [b, 200.0 + c]]), &covariance, true);
            holds += usize::from((low..=high).contains(&2.0));
        }
        // 95 % of 2000 with four binomial standard deviations; of the ellipse the region's projection covers more.
        let (share, held) = (circles as f64 / f64::from(draws), holds as f64 / f64::from(draws));
        assert!((share - 0.95).abs() < 4.0 * (0.05 * 0.95 / f64::from(draws)).sqrt() && held > 0.95, "{share} {held}");
    }
}
