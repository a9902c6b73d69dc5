//! What pre-compensation by a wrong model of the limb does: to the coherence of the delivered forces, and to the estimates.

pub mod result;

use crate::Progress;
use crate::analysed::{COMMAND, analysed, fitted};
use crate::cases::relative_error;
use crate::command::forces_of;
use crate::design::result::CoherenceSize;
use crate::design::{Lens, with_limb};
use crate::error::{StudyError, meaning};
use crate::file::{SensitivitySection, StudyFile};
use crate::sensitivity::result::{SensitivityResult, SensitivityRow, SimulatedSensitivity};
use crate::simulate::{Simulated, simulate_behind};
use ndarray::Array2;
use ndof_analysis::result::Head;
use ndof_analysis::{Estimated, Trial, Trials};
use ndof_devices::{Experiment, Impedance, Linearised, linearise};
use ndof_signal::{CrossSpectra, ExcitationError, Kernel, input_coherence_at};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Below this the robot's hold couples the forces (Palazzolo et al. 2007) (Hz).
const LOW_HZ: f64 = 2.0;
/// Distance of the frequencies that are looked at (Hz).
const STEP_HZ: f64 = 0.125;
/// Corners of the box of all parameters that are tried; all of them where there are no more.
const CORNERS: usize = 512;

/// A limb as the compensation believes it to be.
struct Belief {
    name: String,
    /// `None`: no compensation.
    limb: Option<Impedance>,
    /// Whether it is worth a simulation.
    simulate: bool,
}

/// Coherence of delivered forces over frequency.
struct Curve {
    max: f64,
    mean: f64,
    max_low: f64,
    values: Vec<f64>,
}

/// The table of sensitivity of a study's experiment.
///
/// The designed forces are independent and white. Commands T_model⁻¹ F deliver T T_model⁻¹ F, whose coherence follows from the
/// two linear models alone, without the scatter of a sample. Rows with a simulation pool the study's trials on the
/// device itself and fit the limb from the direct and from the derived estimate.
pub(crate) fn sensitivity(
    study: &StudyFile,
    section: &SensitivitySection,
    seed: Option<u64>,
    progress: &Progress<'_>,
) -> Result<SensitivityResult, StudyError> {
    let experiment = study.experiment.experiment();
    let truth = linearise(&experiment)?;
    let [low, high] = section.band_hz;
    let hz: Vec<f64> = (0..=((high - low) / STEP_HZ).max(0.0) as usize).map(|k| low + k as f64 * STEP_HZ).collect();
    if high <= low || low <= 0.0 {
        return Err(ExcitationError::EmptyBand { low_hz: low, high_hz: high }.into());
    }
    let delivery: Vec<Array2<Complex64>> = hz.iter().filter_map(|&hz| Some(truth.sampled_responses(hz)?.0)).collect();
    let axes = experiment.axes()?;
    let beliefs = beliefs(&truth.limb, section.spread, &axes);
    let mut rows = Vec::with_capacity(beliefs.len() + 1);
    let (mut curves, total) = (Vec::new(), beliefs.len());
    for (k, belief) in beliefs.iter().enumerate() {
        let model = belief.limb.clone().map(|limb| with_limb(&experiment, |_| limb)).transpose()?;
        let curve = curve(&hz, &delivery, model.as_ref());
        let simulated = if belief.simulate && section.simulate { Some(simulated(study, seed, model.as_ref(), section, &truth)?) } else { None };
        curves.push((belief.name.clone(), curve.values.clone()));
        rows.push(row(&belief.name, &curve, simulated));
        progress("sensitivity", k + 1, total);
    }
    let (worst, tried, envelope) = corners(&experiment, &truth, section.spread, &hz, &delivery)?;
    rows.push(row(&format!("worst of {tried} corners, every entry \u{b1}{} %", percent(section.spread)), &worst, None));
    Ok(SensitivityResult {
        head: Head::new(SensitivityResult::SCHEMA, COMMAND, Vec::new()),
        spread: section.spread,
        band_hz: section.band_hz,
        low_band_hz: [low, LOW_HZ],
        rows,
        frequency_hz: hz,
        curves: curves.into_iter().filter(|(name, _)| name == EXACT || name == NONE).collect(),
        envelope,
    })
}

const EXACT: &str = "nominal arm";
const NONE: &str = "none";

fn percent(share: f64) -> f64 {
    (1000.0 * share).round() / 10.0
}

/// What the compensation may believe: the truth, nothing, an isotropic limb, matrices and entries off by the spread.
fn beliefs(limb: &Impedance, spread: f64, axes: &[String]) -> Vec<Belief> {
    let n = axes.len();
    let mut all =
        vec![Belief { name: NONE.to_owned(), limb: None, simulate: true }, Belief { name: EXACT.to_owned(), limb: Some(limb.clone()), simulate: true }];
    let mean = |m: &Array2<f64>| Array2::from_diag_elem(n, m.diag().sum() / n as f64);
    let isotropic = Impedance { inertia: mean(&limb.inertia), damping: mean(&limb.damping), stiffness: mean(&limb.stiffness) };
    all.push(Belief { name: "isotropic arm of the same mean".to_owned(), limb: Some(isotropic), simulate: true });
    for factors in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0]] {
        for sign in [-1.0, 1.0] {
            let names: String = ["M", "B", "K"].iter().zip(factors).filter(|(_, f)| *f > 0.0).map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
            let scaled = |m: &Array2<f64>, factor: f64| m * (1.0 + sign * spread * factor);
            let limb = Impedance {
                inertia: scaled(&limb.inertia, factors[0]),
                damping: scaled(&limb.damping, factors[1]),
                stiffness: scaled(&limb.stiffness, factors[2]),
            };
            all.push(Belief { name: format!("{names} {}{} %", if sign > 0.0 { "+" } else { "\u{2212}" }, percent(spread)), limb: Some(limb), simulate: true });
        }
    }
    for (k, (i, j)) in entries(n).into_iter().enumerate() {
        for sign in [-1.0, 1.0] {
            let mut signs = vec![0.0; 3 * n * (n + 1) / 2];
            signs[k] = sign;
            let matrix = ["M", "B", "K"][k / (n * (n + 1) / 2)];
            let name = format!("{matrix}_{}_{} {}{} %", axes[i], axes[j], if sign > 0.0 { "+" } else { "\u{2212}" }, percent(spread));
            all.push(Belief { name, limb: Some(moved(limb, spread, &signs)), simulate: false });
        }
    }
    all
}

/// Rows and columns of the entries of M, then B, then K, upper triangles.
fn entries(n: usize) -> Vec<(usize, usize)> {
    (0..3).flat_map(|_| (0..n).flat_map(move |i| (i..n).map(move |j| (i, j)))).collect()
}

/// The limb with each entry changed by `spread` times its sign.
fn moved(limb: &Impedance, spread: f64, signs: &[f64]) -> Impedance {
    let mut limb = limb.clone();
    let n = limb.inertia.nrows();
    let each = n * (n + 1) / 2;
    for (k, (i, j)) in entries(n).into_iter().enumerate() {
        let matrix = match k / each {
            0 => &mut limb.inertia,
            1 => &mut limb.damping,
            _ => &mut limb.stiffness,
        };
        let value = matrix[[i, j]] * (1.0 + spread * signs[k]);
        matrix[[i, j]] = value;
        matrix[[j, i]] = value;
    }
    limb
}

/// Coherence of T T_model⁻¹ F for independent white F.
fn curve(hz: &[f64], delivery: &[Array2<Complex64>], model: Option<&Linearised>) -> Curve {
    let n = delivery.first().map_or(0, Array2::nrows);
    let spectra: Vec<Array2<Complex64>> = hz
        .par_iter()
        .zip(delivery)
        .map(|(&hz, t)| {
            let passed = model.and_then(|m| m.precompensation(hz)).map_or_else(|| t.clone(), |inverse| t.dot(&inverse));
            passed.dot(&passed.t().mapv(|v| v.conj()))
        })
        .collect();
    let lower = (0..n).flat_map(|a| (0..=a).map(move |b| (a, b))).flat_map(|(a, b)| spectra.iter().map(move |s| s[[a, b]])).collect();
    let spectra = CrossSpectra::from_parts(n, 2.0 * hz.last().copied().unwrap_or(1.0), hz.to_vec(), lower, 1.0, 1, STEP_HZ, Kernel::default());
    let each: Vec<Vec<f64>> = (0..hz.len()).map(|f| input_coherence_at(&spectra, f)).collect();
    let values: Vec<f64> = each.iter().map(|axes| axes.iter().copied().fold(0.0, f64::max)).collect();
    let largest = |keep: &dyn Fn(f64) -> bool| values.iter().zip(hz).filter(|(_, hz)| keep(**hz)).map(|(v, _)| *v).fold(0.0, f64::max);
    Curve { max: largest(&|_| true), mean: each.iter().flatten().sum::<f64>() / (each.len() * n).max(1) as f64, max_low: largest(&|hz| hz <= LOW_HZ), values }
}

/// The worst corner of the box of all entries, how many make a limb, and the largest coherence of any at each frequency.
fn corners(
    experiment: &Experiment,
    truth: &Linearised,
    spread: f64,
    hz: &[f64],
    delivery: &[Array2<Complex64>],
) -> Result<(Curve, usize, Vec<f64>), StudyError> {
    let count = entries(truth.limb.inertia.nrows()).len();
    let all = count < usize::BITS as usize && (1_usize << count) <= CORNERS;
    let curves: Vec<Curve> = (0..if all { 1 << count } else { CORNERS })
        .into_par_iter()
        .filter_map(|corner| {
            let mut rng = ChaCha8Rng::seed_from_u64(corner as u64);
            let signs: Vec<f64> = (0..count).map(|k| if if all { (corner >> k) & 1 == 1 } else { rng.random() } { 1.0 } else { -1.0 }).collect();
            // A corner whose inertia is none is no limb.
            let model = with_limb(experiment, |limb| moved(&limb, spread, &signs)).ok()?;
            Some(curve(hz, delivery, Some(&model)))
        })
        .collect();
    let tried = curves.len();
    let envelope = (0..hz.len()).map(|f| curves.iter().map(|c| c.values[f]).fold(0.0, f64::max)).collect();
    let worst = curves.into_iter().max_by(|a, b| a.max.total_cmp(&b.max));
    let worst = worst.ok_or_else(|| meaning("[sensitivity]", format!("spread = {spread}: no limb is left; take a smaller one")))?;
    Ok((worst, tried, envelope))
}

/// The study's trials behind a compensation by `model`, and what the estimates make of them.
fn simulated(
    study: &StudyFile,
    seed: Option<u64>,
    model: Option<&Linearised>,
    section: &SensitivitySection,
    truth: &Linearised,
) -> Result<SimulatedSensitivity, StudyError> {
    let mut file = study.experiment.clone();
    file.seed = seed.unwrap_or(file.seed);
    file.excitation.precompensate = false;
    let Simulated { recordings, .. } = simulate_behind(&file, model, &|_, _, _| ())?;
    let forces: Vec<Vec<Vec<f64>>> = recordings.iter().map(forces_of).collect();
    let samples = forces.first().and_then(|trial: &Vec<Vec<f64>>| trial.first()).map_or(0, Vec::len);
    let [low, high] = section.band_hz;
    let pooled = Lens::welch(samples).look(&forces, file.sample_rate_hz, (low, high))?.pooled;
    let variance = |force: &Vec<f64>| {
        let mean = force.iter().sum::<f64>() / force.len().max(1) as f64;
        force.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / force.len().max(1) as f64
    };
    let variances: Vec<f64> = forces.iter().flatten().map(variance).collect();
    let trials = Trials::of(&Trial::numbered("trial", recordings))?;
    let (estimated, derived) = analysed(&trials, &study.estimate, &study.fit)?;
    let mut direct_only: Estimated = estimated;
    direct_only.estimates.derived = None;
    direct_only.derived = None;
    let direct = fitted(&direct_only, &study.fit)?;
    Ok(SimulatedSensitivity {
        coherence: CoherenceSize { max: pooled.max, mean: pooled.mean },
        force_rms: (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt(),
        direct: relative_error(&direct, &truth.limb),
        derived: relative_error(&derived, &truth.limb),
    })
}

fn row(model: &str, curve: &Curve, simulated: Option<SimulatedSensitivity>) -> SensitivityRow {
    SensitivityRow { model: model.to_owned(), coherence: CoherenceSize { max: curve.max, mean: curve.mean }, coherence_low_max: curve.max_low, simulated }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_devices::{Controller, DeviceConfig, EndpointLinearConfig, LimbConfig, PerAxis};

    fn experiment(kp: f64) -> Experiment {
        let limb = LimbConfig::EndpointLinear(EndpointLinearConfig {
            M: vec![vec![2.1, -0.55], vec![-0.55, 1.9]],
            B: vec![vec![11.0, -2.0], vec![-2.0, 15.0]],
            K: vec![vec![300.0, -60.0], vec![-60.0, 520.0]],
            ..EndpointLinearConfig::default()
        });
        let controller = Controller { kp: Some(PerAxis::All(kp)), ..Controller::default() };
        Experiment { controller, ..Experiment::new(DeviceConfig::named("mit-manus"), limb) }
    }

    #[test]
    fn the_exact_model_leaves_no_coherence_and_a_wrong_one_some() {
        let experiment = experiment(400.0);
        let truth = linearise(&experiment).expect("linear");
        let hz = [0.25, 0.5, 1.0, 2.0, 5.0, 15.0];
        let delivery: Vec<_> = hz.iter().map(|&hz| truth.sampled_responses(hz).expect("T").0).collect();
        let of = |limb: Option<Impedance>| {
            let model = limb.map(|limb| with_limb(&experiment, |_| limb).expect("a limb"));
            curve(&hz, &delivery, model.as_ref())
        };
        let (none, exact) = (of(None), of(Some(truth.limb.clone())));
        let softer = |by: f64| of(Some(Impedance { stiffness: &truth.limb.stiffness * by, damping: &truth.limb.damping * by, ..truth.limb.clone() }));
        // T T⁻¹ = I to the round-off of two inversions of a matrix with the transducer's stiffness in it.
        assert!(exact.max < 1e-9, "{}", exact.max);
        // What a wrong belief leaves grows with its error; it may exceed what no compensation at all leaves.
        assert!(1e-3 < softer(0.9).max && softer(0.9).max < softer(0.7).max && none.max > 1e-3, "{} {} {}", softer(0.9).max, softer(0.7).max, none.max);
    }

    #[test]
    fn every_entry_is_moved_once_and_stays_symmetric() {
        let limb = linearise(&experiment(100.0)).expect("linear").limb;
        let all = beliefs(&limb, 0.3, &["x".to_owned(), "y".to_owned()]);
        // Nothing, the truth, isotropic, five groups and nine entries, down and up.
        assert_eq!(all.len(), 3 + 10 + 18);
        let belief = all.iter().find(|b| b.name == "B_x_y +30 %").and_then(|b| b.limb.as_ref()).expect("listed");
        assert!((belief.damping[[0, 1]] / limb.damping[[0, 1]] - 1.3).abs() < 1e-12);
        assert_eq!(belief.damping[[0, 1]], belief.damping[[1, 0]]);
        assert_eq!((&belief.inertia, &belief.stiffness), (&limb.inertia, &limb.stiffness));
    }
}
