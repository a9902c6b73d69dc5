//! The robot's impedance as the motion feels it, from commanded and measured effort.

use crate::linear::{Symmetric, inner};
use crate::state::State;
use num_complex::Complex64;

/// The linear robot between reference and effort: effort = gain reference - Z motion.
pub(crate) struct Robot {
    /// Z per bin, rows of n × n.
    pub impedance: Vec<Vec<Complex64>>,
    /// Share of the effort's power that the linear robot does not explain.
    pub rest: f64,
    /// Power of what lies between reference and effort, as a share of the effort's; 1 where the reference is no effort.
    pub part: f64,
}

/// Fits the robot by least squares; the noise of the limb does not bias it, because effort and motion are both measured.
///
/// A reference that is itself an effort enters with gain 1 (`unit`), any other with a free gain, rate and offset.
pub(crate) fn fit(state: &State, references: &[Vec<Vec<f64>>], unit: bool) -> Option<Robot> {
    let layout = &state.layout;
    let n = layout.axes;
    let channels = references.first()?.len();
    let spectra = |power: i32| -> Vec<Vec<Complex64>> {
        (0..channels)
            .map(|c| {
                let trials: Vec<Vec<f64>> = references.iter().map(|trial| layout.filtered(&layout.track(&trial[c]), |s| s.powi(power), None)).collect();
                layout.spectra(trials.iter().map(Vec::as_slice))
            })
            .collect()
    };
    let r = spectra(0);
    let rates = if unit { vec![] } else { spectra(1) };
    let ones = vec![1.0; layout.samples];
    let mut impedance = vec![vec![Complex64::ZERO; n * n]; layout.lines()];
    let (mut rest, mut part) = (0.0, 0.0);
    for i in 0..n {
        let y: Vec<Complex64> =
            if unit { r[i].iter().zip(state.effort_spectra[i].iter()).map(|(r, f)| f - r).collect() } else { state.effort_spectra[i].to_vec() };
        let mut columns: Vec<Vec<Complex64>> = (0..3 * n).map(|q| state.kinematics[q % 3][q / 3].iter().map(|v| -v).collect()).collect();
        if !unit {
            columns.extend(r.iter().chain(&rates).cloned());
        }
        columns.extend((0..layout.trials).map(|trial| layout.in_trial(trial, &ones)));
        let gram = Symmetric::of(columns.len(), |p, q| inner(&columns[p], &columns[q]));
        let rhs: Vec<f64> = columns.iter().map(|c| inner(c, &y)).collect();
        let theta = gram.factor()?.solve(&rhs);
        part += if unit { inner(&y, &y) / inner(&state.effort_spectra[i], &state.effort_spectra[i]).max(f64::MIN_POSITIVE) / n as f64 } else { 1.0 / n as f64 };
        let mut e = y;
        for (column, value) in columns.iter().zip(&theta) {
            e.iter_mut().zip(column).for_each(|(e, c)| *e -= c * value);
        }
        rest += inner(&e, &e) / inner(&state.effort_spectra[i], &state.effort_spectra[i]).max(f64::MIN_POSITIVE) / n as f64;
        for (matrix, &s) in impedance.iter_mut().zip(&layout.sj) {
            for j in 0..n {
                matrix[i * n + j] = (0..3).map(|order| s.powi(order) * theta[3 * j + order as usize]).sum();
            }
        }
    }
    Some(Robot { impedance, rest, part })
}
