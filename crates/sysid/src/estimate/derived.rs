//! The derived (joint input-output, instrumental-variable) estimate, unbiased under feedback.

use super::derived_batch::{Batch, Results};
use super::judged::Judged;
use super::{Coherence, EstimateError, check};
use crate::filling::Filling;
use crate::labels::Labels;
use crate::lanes::{Batches, LANES};
use crate::ports::Ports;
use crate::response::{FrequencyResponse, ResponseKind};
use crate::uncertainty::Uncertainty;
use ndarray::{Array2, Array3, Axis, Slice};
use ndof_signal::CrossSpectra;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Both halves of a derived estimate: what the reference does to outputs and inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToReference {
    /// R = S_yr S_rr⁻¹, `[f][p][q_r]`.
    pub r: FrequencyResponse,
    /// T = S_ur S_rr⁻¹, `[f][q][q_r]`.
    pub t: FrequencyResponse,
    /// Multiple coherence of the references with each output, `[f][p]`: the quality of R.
    pub output_coherence: Array2<f64>,
    /// Multiple coherence of the references with each input, `[f][q]`: the quality of T.
    pub input_coherence: Array2<f64>,
}

/// Outputs over inputs by way of the references, with everything that says how far to trust it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DerivedEstimate {
    /// C = R T⁻¹ with covariance.
    pub response: FrequencyResponse,
    /// R and T.
    pub to_reference: ToReference,
    /// With the paper's assumption that the output noise is that of the direct estimate: optimistic under feedback.
    pub coherence_paper: Coherence,
    /// With the noise of the equation that was solved, and the part of the inputs that the references caused.
    pub coherence_iv: Coherence,
    /// Smallest eigenvalue of N^(−½) S^c_uu N^(−½) (n_e − q_r)/q_r, N = S_uu − S^c_uu (Cragg & Donald 1993), `[f]`; for more
    /// than two inputs to a few per cent.
    pub instrument_strength: Vec<f64>,
    /// Whether at this frequency that strength is below [`WEAK_INSTRUMENT`](super::WEAK_INSTRUMENT), `[f]`; no input alone is moved less.
    pub weak_instrument: Vec<bool>,
    /// Indices of bins without an estimate (0 Hz after mean removal is not listed).
    pub singular_bins: Vec<usize>,
}

impl DerivedEstimate {
    /// From C, R and T and what was judged beside them.
    pub(super) fn new(response: FrequencyResponse, [r, t]: [FrequencyResponse; 2], judged: Judged, singular_bins: Vec<usize>) -> Self {
        let flat = |array: Filling<f64>| array.finish().remove_axis(Axis(1));
        let coherence =
            |[ordinary, partial, multiple]: [Filling<f64>; 3]| Coherence { ordinary: ordinary.finish(), partial: partial.finish(), multiple: flat(multiple) };
        DerivedEstimate {
            response,
            to_reference: ToReference { r, t, output_coherence: flat(judged.output_coherence), input_coherence: flat(judged.input_coherence) },
            coherence_paper: coherence(judged.paper),
            coherence_iv: coherence(judged.iv),
            instrument_strength: judged.instrument_strength,
            weak_instrument: judged.weak_instrument,
            singular_bins,
        }
    }
}

/// The derived estimate from cross-spectra, for at least as many references as inputs.
///
/// C = R T⁻¹ = S_yr S_ur⁻¹; with more references than inputs two-stage least squares,
/// C = S_yr S_rr⁻¹ S_ru (S^c_uu)⁻¹, S^c_uu = S_ur S_rr⁻¹ S_ru. With A = [I, −C] and Σ the spectrum of [y; u] that the
/// references do not explain, S_εε = A Σ Aᴴ / (1 + tr((S^c_uu)⁻¹ Σ_uu)/(n_e − q_r)) and
/// Cov(vec C) = (S^c_uu)⁻ᵀ ⊗ S_εε / (n_e − q_r). The divisor takes out what the error of C itself adds to the residual: to second order
/// E[A Σ Aᴴ] = S_εε + E[δC Σ_uu δCᴴ], with and without feedback.
///
/// # Errors
/// [`EstimateError`] if ports and labels do not fit, there are fewer references than inputs, not more effective
/// averages than references, or references depend on each other at every frequency.
///
/// References: Palazzolo et al., IEEE TNSRE 15(1), 2007; Pintelon & Schoukens, System Identification, 2nd ed. 2012,
/// ch. 2.
///
/// ```
/// use ndof_signal::Welch;
/// use ndof_sysid::{Direct, Labels, Ports, ResponseKind, derived, direct};
/// use rand::{RngExt, SeedableRng};
///
/// // y = C (u + w), u = r - Z y with C = Z = 0.5: a hold that answers a limb which moves by itself, twice as strongly as the command.
/// let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
/// let r: Vec<f64> = (0..20_000).map(|_| rng.random_range(-1.0..1.0)).collect();
/// let y: Vec<f64> = r.iter().map(|r| 0.4 * (r + rng.random_range(-2.0..2.0))).collect();
/// let u: Vec<f64> = r.iter().zip(&y).map(|(r, y)| r - 0.5 * y).collect();
///
/// let spectra = Welch::new(256).spectra(100.0, &[&r, &u, &y])?;
/// let ports = Ports { references: vec![0], inputs: vec![1], outputs: vec![2] };
/// let labels = Labels::numbered(&ports, ResponseKind::Compliance);
/// let mean = |value: &ndarray::Array3<num_complex::Complex64>| value.iter().filter(|v| v.is_finite()).map(|v| v.re).sum::<f64>() / 128.0;
/// assert!((mean(&derived(&spectra, &ports, &labels)?.response.value) - 0.5).abs() < 0.05);
/// assert!(mean(&direct(&spectra, &ports, &labels, Direct::H1)?.response.value) < 0.1, "the direct estimate is biased");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn derived(spectra: &CrossSpectra, ports: &Ports, labels: &Labels) -> Result<DerivedEstimate, EstimateError> {
    check::ports(spectra, ports, labels)?;
    let (p, q, qr, bins) = (ports.outputs.len(), ports.inputs.len(), ports.references.len(), spectra.frequency_hz().len());
    if qr < q {
        return Err(EstimateError::TooFewReferences { references: qr, inputs: q });
    }
    let averages = spectra.effective_averages();
    let freedom = check::degrees_of_freedom(averages, qr)?;
    let mut out = Results::new(bins, (p, q, qr));
    let first = usize::from(spectra.mean_removed());
    out.skip(first);
    let mut batches = Batches::new(spectra, ports.references.iter().chain(&ports.inputs).chain(&ports.outputs).copied().collect());
    let mut batch = Batch::new(p, q, qr, freedom);
    for f in (first..bins).step_by(LANES) {
        let count = LANES.min(bins - f);
        batch.solve(batches.load(f, count), count, &mut out);
    }
    check::not_all_singular(spectra, &ports.references, &labels.references, "reference", &out.singular_bins)?;

    let wrap = |value: Filling<Complex64>, noise: Array3<Complex64>, inverse, kind, inputs: &[String], outputs: &[String]| FrequencyResponse {
        frequency_hz: spectra.frequency_hz().to_vec(),
        inputs: inputs.to_vec(),
        outputs: outputs.to_vec(),
        kind,
        value: value.finish(),
        uncertainty: Some(Uncertainty::of_spectra(spectra, noise, inverse, freedom)),
    };
    let reference_inverse = out.reference_inverse.finish();
    let unexplained = out.unexplained.finish();
    let [of_outputs, of_inputs] = [(0, p), (p, p + q)].map(|part| part_of(&unexplained, part));
    let r = wrap(out.r, of_outputs, reference_inverse.clone(), ResponseKind::Transfer, &labels.references, &labels.outputs);
    let t = wrap(out.t, of_inputs, reference_inverse, ResponseKind::Transfer, &labels.references, &labels.inputs);
    let mut response = wrap(out.value, out.noise.finish(), out.input_inverse.finish(), labels.kind, &labels.inputs, &labels.outputs);
    if let Some(u) = &mut response.uncertainty {
        u.unexplained = Some(unexplained);
    }
    Ok(DerivedEstimate::new(response, [r, t], out.judged, out.singular_bins))
}

/// What is unexplained of some responders, of that of all.
pub(super) fn part_of(unexplained: &Array3<Complex64>, (from, to): (usize, usize)) -> Array3<Complex64> {
    let part = Slice::from(from..to);
    unexplained.slice_axis(Axis(1), part).slice_axis(Axis(2), part).to_owned()
}
