//! A confidence set that holds however weakly the references reach the inputs.

use crate::hermitian::Cholesky;
use crate::ports::Ports;
use crate::quantile::fisher;
use ndof_signal::CrossSpectra;
use num_complex::Complex64;

/// Whether a candidate row c of a response is compatible with the data at one frequency: with e = y − c u,
///
/// (n_e − q_r)/q_r · S_er S_rr⁻¹ S_re / S_ee·r ≤ F(2 q_r, 2 (n_e − q_r)).
///
/// Unlike the intervals of the derived estimate this is exact at any strength of the instrument; the set of compatible
/// rows may then be unbounded, as it should. `None` where the references are singular or too few averages are left.
///
/// Anderson & Rubin, Ann. Math. Stat. 20, 1949.
pub fn anderson_rubin(spectra: &CrossSpectra, ports: &Ports, f: usize, output: usize, candidate: &[Complex64], level: f64) -> Option<bool> {
    let (q, qr) = (ports.inputs.len(), ports.references.len());
    let freedom = spectra.effective_averages() - qr as f64;
    if qr == 0 || freedom <= 0.0 || candidate.len() != q {
        return None;
    }
    let channels: Vec<usize> = std::iter::once(ports.outputs[output]).chain(ports.inputs.iter().copied()).collect();
    let weight = |a: usize| if a == 0 { Complex64::from(1.0) } else { -candidate[a - 1] };
    let mut row: Vec<Complex64> = ports.references.iter().map(|&r| (0..=q).map(|a| weight(a) * spectra.at(f, channels[a], r)).sum()).collect();
    let total: Complex64 =
        (0..=q).flat_map(|a| (0..=q).map(move |b| (a, b))).map(|(a, b)| weight(a) * spectra.at(f, channels[a], channels[b]) * weight(b).conj()).sum();
    let mut reference = Cholesky::new(qr);
    if !reference.factor(|i, j| spectra.at(f, ports.references[i], ports.references[j])) {
        return None;
    }
    reference.whiten(&mut row);
    let explained: f64 = row.iter().map(|v| v.norm_sqr()).sum();
    Some(freedom / qr as f64 * explained <= fisher(level, qr, freedom) * (total.re - explained))
}
