//! Axes whose effort and motion are counted in opposite directions.

use super::between::ODDS;
use super::evidence::Evidence;
use super::{Fit, Fitted, fit_to};
use crate::error::AnalysisError;
use crate::estimate::{Estimated, estimate_to_fit};
use crate::result::Warning;
use crate::trials::Trials;

/// The efforts that some axes of a fit, and not all of them, count against their motions: with these turned round no axis has an inertia, a damping or a
/// stiffness below zero, and what the model leaves is not less likely by odds of 1000. With a warning that says so.
///
/// Of F = M ẍ + B ẋ + K x a row whose effort is turned has all of its signs turned: that axis seems to push when it is moved. Where axes are coupled, no symmetric
/// matrices fit then; where they are not, nothing else shows it.
pub(super) fn opposed(estimated: &Estimated, settings: &Fit, fitted: &Fitted) -> Option<(Vec<String>, Warning)> {
    let negative = below_zero(fitted);
    let trials = &estimated.trials;
    let ports = &trials.roles.ports;
    let efforts = if trials.roles.natural_kind().is_effort_over_motion() { &ports.outputs } else { &ports.inputs };
    if !negative.contains(&true) || !negative.contains(&false) || efforts.len() != negative.len() {
        return None;
    }
    let turned: Vec<usize> = efforts.iter().zip(&negative).filter(|(_, negative)| **negative).map(|(effort, _)| *effort).collect();
    let names = trials.names(&turned);
    let asked = estimated.result.settings.clone();
    let again = turned_round(trials, &names).and_then(|trials| {
        let estimated = estimate_to_fit(&trials, &asked, settings)?;
        fit_to(&Evidence::of_recordings(&estimated, settings.band_hz)?, settings)
    });
    let again = again.ok()?;
    let [before, after] = [&fitted.fit, &again.fit];
    let doubt = 2.0 * ODDS.ln() * after.chi2_reduced.max(1.0);
    if below_zero(&again).contains(&true) || after.chi2 - before.chi2 > doubt {
        return None;
    }
    let warning = Warning::new(
        "force-sign",
        format!(
            "{} and the motion along it are counted in opposite directions: with the effort turned round no axis has an inertia, a damping or a stiffness below zero, and reduced chi² is {:.1} (from {:.1})",
            names.join(", "),
            after.chi2_reduced,
            before.chi2_reduced
        ),
        "turn the channel that was recorded the other way with `negate=CHANNEL`",
    );
    Some((names, warning))
}

/// For each axis, whether its own inertia, damping or stiffness is below zero by more than its interval.
fn below_zero(fitted: &Fitted) -> Vec<bool> {
    let highest: Vec<f64> = fitted.fit.parameters.iter().map(|parameter| parameter.ci95[1]).collect();
    let highest = fitted.model.matrices(&highest);
    let diagonals = [&highest.inertia, &highest.damping, &highest.stiffness];
    (0..highest.axes.len()).map(|i| diagonals.iter().any(|matrix| matrix[[i, i]] < 0.0)).collect()
}

/// Trials with these channels turned round.
pub(crate) fn turned_round(trials: &Trials, names: &[String]) -> Result<Trials, AnalysisError> {
    Ok(Trials { trials: trials.trials.iter().map(|trial| trial.negated(names)).collect::<Result<_, _>>()?, ..trials.clone() })
}
