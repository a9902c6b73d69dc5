//! The part of the outputs that no model predicts: the residual force's power, carried to the output.

use crate::layout::Layout;
use crate::result::NoiseFloor;
use crate::search::Stand;
use crate::state::{Cause, Column, State, Through};
use crate::subject::Subject;
use crate::whittle::Power;
use ndof_linear::square;
use num_complex::Complex64;

/// Where the first line that counts begins: what is slower makes no line of a block.
pub(crate) fn slowest_hz(layout: &Layout) -> f64 {
    layout.frequency_hz[0] + 0.5 * layout.rate_hz / layout.block as f64
}

/// The floor of the part that was fitted.
pub(crate) fn floor(subject: &Subject, stand: &Stand, power: &Power, order: usize, from_hz: f64) -> NoiseFloor {
    let columns = stand.columns().zip(stand.fit.theta.iter().copied());
    let all: Vec<(&Column, f64)> = columns.chain(stand.base.held.iter().map(|(c, v)| (c, *v))).collect();
    NoiseFloor {
        nrmse: at_most_all(carried((&subject.layout, &subject.cause), &stand.state, &all, power, order, from_hz)),
        how: "power of the force that the best model found (named causes and a model without physics) leaves, carried to the output".to_owned(),
    }
}

/// A floor is no higher than what no prediction at all leaves.
pub(crate) fn at_most_all(nrmse: Vec<Option<f64>>) -> Vec<Option<f64>> {
    nrmse.into_iter().map(|e| e.map(|e| e.min(1.0))).collect()
}

/// rms of the unpredictable part over the output's, per output; beyond 1 where a hold answers what a limb does by itself.
///
/// Effort as output: √(Σ S / Σ S_FF). Motion as output: √(Σ [D⁻¹ S D⁻ᴴ] / Σ S_xx) over the band, from `from_hz` upward; D of columns with their values.
pub(crate) fn carried(
    (layout, cause): (&Layout, &Cause),
    state: &State,
    columns: &[(&Column, f64)],
    power: &Power,
    order: usize,
    from_hz: f64,
) -> Vec<Option<f64>> {
    let (n, lines) = (layout.axes, layout.lines());
    let mean = |spectrum: &[Complex64], k: usize| (0..layout.blocks()).map(|b| spectrum[b * lines + k].norm_sqr()).sum::<f64>() / layout.blocks() as f64;
    let mut noise = vec![0.0; n];
    let mut signal = vec![0.0; n];
    for k in (0..lines).filter(|&k| layout.frequency_hz[k] >= from_hz.max(layout.frequency_hz[0] + 1e-9)) {
        if matches!(cause, Cause::Motion) {
            for i in 0..n {
                noise[i] += power[i][k];
                signal[i] += mean(&state.effort_spectra[i], k);
            }
            continue;
        }
        let Some(compliance) = response(vec![Complex64::ZERO; n * n], columns.iter().copied(), k, n) else { continue };
        for i in 0..n {
            let rate = layout.sj[k].norm_sqr().powi(order as i32);
            noise[i] += rate * (0..n).map(|j| compliance[i * n + j].norm_sqr() * power[j][k]).sum::<f64>();
            signal[i] += mean(&state.kinematics[order][i], k);
        }
    }
    noise.iter().zip(&signal).map(|(n, s)| (*s > 0.0 && n.is_finite()).then(|| (n / s).sqrt())).collect()
}

/// What moves with a force at a line: the inverse of `dynamics` and what columns with their values add to it; `None` where there is none.
fn response<'a>(mut dynamics: Vec<Complex64>, columns: impl Iterator<Item = (&'a Column, f64)>, k: usize, n: usize) -> Option<Vec<Complex64>> {
    for (column, value) in columns.filter(|(column, _)| matches!(column.through, Through::Motion)) {
        column.action.iter().for_each(|(i, j, h)| dynamics[i * n + j] += h[k] * value);
    }
    square::inverse(&dynamics, n)
}

/// Share of the motion's power below 1.5 Hz that the residual force makes by itself, and its low over high power.
pub(crate) fn own_motion(subject: &Subject, stand: &Stand, power: &Power, axis: usize) -> (f64, f64, f64) {
    let layout = &subject.layout;
    let (n, lines) = (layout.axes, layout.lines());
    let unit = 1.0 / layout.time_s;
    let impedance = subject.cause.impedance();
    let mean = |spectrum: &[Complex64], k: usize| (0..layout.blocks()).map(|b| spectrum[b * lines + k].norm_sqr()).sum::<f64>() / layout.blocks() as f64;
    let (mut made, mut all) = (0.0, 0.0);
    for k in (0..lines).filter(|&k| (0.25 * unit..1.5 * unit).contains(&layout.frequency_hz[k])) {
        let held = impedance.map_or_else(|| vec![Complex64::ZERO; n * n], |z| z[k].clone());
        let Some(response) = response(held, stand.columns().zip(stand.fit.theta.iter().copied()), k, n) else { continue };
        made += (0..n).map(|j| response[axis * n + j].norm_sqr() * power[j][k]).sum::<f64>();
        all += mean(&stand.state.kinematics[0][axis], k);
    }
    let level = |lo: f64, hi: f64| {
        let values: Vec<f64> = (0..lines).filter(|&k| (lo * unit..hi * unit).contains(&layout.frequency_hz[k])).map(|k| power[axis][k]).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let df = layout.rate_hz / layout.block as f64;
    // One-sided: twice the sum of the two-sided density of unit-power windows times the bin's width.
    let rms = (2.0 * power[axis].iter().sum::<f64>() * df / layout.rate_hz).sqrt();
    (made / all.max(f64::MIN_POSITIVE), level(0.25, 1.5) / level(6.0, 12.0).max(f64::MIN_POSITIVE), rms)
}
