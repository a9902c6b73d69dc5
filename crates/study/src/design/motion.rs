//! What a perturbation does to a person, before anyone is shaken.

use super::limbs::{LooseLimb, with_limb};
use super::specification::Limits;
use crate::design::result::Motion;
use crate::error::StudyError;
use ndarray::Array2;
use ndof_devices::{Experiment, Impedance};
use ndof_signal::{ExpectedMotion, expected_motion};
use num_complex::Complex64;
use rayon::prelude::*;

/// A soft limb has this share of the nominal stiffness and damping, a stiff one its inverse.
const SOFT: f64 = 0.5;
/// Above this a limb's motion is that of a mass against which the perturbation has next to no power (Hz).
const HIGHEST_HZ: f64 = 60.0;

/// Motion of a soft and a stiff limb under the commands themselves, no robot between.
pub(super) fn loose(commands: &[Vec<Vec<f64>>], limbs: &[LooseLimb; 2], axes: &[String], sample_rate_hz: f64) -> Result<Vec<Motion>, StudyError> {
    let mut out = Vec::new();
    for (limb, name) in limbs.iter().zip(["soft", "stiff"]) {
        out.extend(of(commands, axes, sample_rate_hz, name, |hz| limb.compliance(hz, axes.len()))?);
    }
    Ok(out)
}

/// Motion of the experiment's limb at half of its stiffness and damping, as it is, and at twice of them, under robot and hold.
pub(super) fn held(commands: &[Vec<Vec<f64>>], experiment: &Experiment, axes: &[String]) -> Result<Vec<Motion>, StudyError> {
    let fs = experiment.sample_rate_hz;
    let samples = commands.first().and_then(|trial| trial.first()).map_or(1, Vec::len).max(1);
    // `expected_motion` lengthens the record by its own length.
    let step_hz = fs / (2 * samples) as f64;
    let count = (HIGHEST_HZ.min(fs / 2.0) / step_hz) as usize + 1;
    let none = || Array2::zeros((axes.len(), axes.len()));
    let mut out = Vec::new();
    for (factor, name) in [(SOFT, "soft"), (1.0, "nominal"), (1.0 / SOFT, "stiff")] {
        let linear = with_limb(experiment, |limb| Impedance { damping: limb.damping * factor, stiffness: limb.stiffness * factor, ..limb })?;
        let table: Vec<Array2<Complex64>> =
            (0..count).into_par_iter().map(|k| linear.sampled_responses(k as f64 * step_hz).map_or_else(none, |(_, motion)| motion)).collect();
        let at = |hz: f64| table.get((hz / step_hz).round() as usize).cloned().unwrap_or_else(none);
        out.extend(of(commands, axes, fs, name, at)?);
    }
    Ok(out)
}

/// The largest over the trials, axis by axis.
fn of(
    commands: &[Vec<Vec<f64>>],
    axes: &[String],
    sample_rate_hz: f64,
    limb: &str,
    compliance: impl Fn(f64) -> Array2<Complex64>,
) -> Result<Vec<Motion>, StudyError> {
    let found = commands.iter().map(|trial| expected_motion(trial, sample_rate_hz, &compliance)).collect::<Result<Vec<Vec<ExpectedMotion>>, _>>()?;
    let largest = |axis: usize, value: &dyn Fn(&ExpectedMotion) -> f64| found.iter().map(|trial| value(&trial[axis])).fold(0.0, f64::max);
    let motion = |(axis, name): (usize, &String)| Motion {
        limb: limb.to_owned(),
        axis: name.clone(),
        displacement_rms: largest(axis, &|m| m.displacement_rms),
        displacement_peak: largest(axis, &|m| m.displacement_peak),
        velocity_peak: largest(axis, &|m| m.velocity_peak),
    };
    Ok(axes.iter().enumerate().map(motion).collect())
}

/// Refuses what would move a limb further or faster than the limits allow, naming the worst.
pub(super) fn refuse(motion: &[Motion], limits: &Limits) -> Result<(), StudyError> {
    let both = |m: &Motion| [("displacement", m.displacement_peak, limits.displacement), ("velocity", m.velocity_peak, limits.velocity)];
    let asked = motion.iter().flat_map(|m| both(m).map(|(what, value, limit)| (m, what, value, limit)));
    let passed = asked.filter_map(|(m, what, value, limit)| Some((m, what, value, limit?))).filter(|(.., value, limit)| value > limit);
    match passed.max_by(|a, b| (a.2 / a.3).total_cmp(&(b.2 / b.3))) {
        None => Ok(()),
        Some((m, what, value, limit)) => Err(StudyError::Motion { limb: m.limb.clone(), axis: m.axis.clone(), what, value, limit }),
    }
}
