//! What a fit has to say against itself.

use super::between::ODDS;
use super::evidence::Evidence;
use crate::result::Warning;
use ndof_models::physical::is_of_no_body;
use ndof_models::{Axis, Parameter, SeriesCompliance};

/// Above this reduced χ² the model is wrong by more than the covariance's own uncertainty.
const MISFIT: f64 = 2.0;

/// What is known of the evidence, and what the fitted numbers say.
pub(super) fn warnings(evidence: &Evidence<'_>, fit: &ndof_models::Fit, baseline: &ndof_models::Fit) -> Vec<Warning> {
    let mut warnings = evidence.warnings.clone();
    // Of other frequencies than those that were fitted nothing is to be known here.
    if let Some(k) = warnings.iter().position(|warning| warning.code == "weak-instrument") {
        warnings.splice(k..=k, evidence.weakness(fit.band_hz));
    }
    warnings.extend(force_sign(baseline));
    let unknown: Vec<&str> = fit.parameters.iter().filter(|p| !p.identifiable).map(|p| p.name.as_str()).collect();
    if !unknown.is_empty() {
        // Intervals that a misfit makes wide become narrow by another model, and not by more data.
        let (beside, action) = if fit.chi2_reduced > MISFIT && evidence.errors_known() {
            (" beside a misfit as large as this one", "fit a model without that misfit first: `compare`, or ask `ndof diagnose` what this one lacks")
        } else {
            ("", "record longer or excite the axis more strongly or over a wider band, or fix the parameter")
        };
        warnings.push(Warning::new("not-identifiable", format!("the data say next to nothing about {}{beside}", unknown.join(", ")), action));
    }
    if fit.chi2_reduced > MISFIT && evidence.errors_known() {
        let width = fit.covariance_scale.sqrt();
        warnings.push(Warning::new(
            "model-misfit",
            format!(
                "reduced chi² is {:.1}: the model leaves more than noise; its intervals are on average {width:.1} times as wide as noise would make them",
                fit.chi2_reduced
            ),
            "fit a narrower band with `band`, or ask `ndof diagnose` what the model lacks",
        ));
    }
    // What one axis does to itself: of a body at rest none is below zero.
    let negative: Vec<&str> = baseline.parameters.iter().filter(|p| !p.site.contains(',') && p.ci95[1] < 0.0).map(|p| p.name.as_str()).collect();
    if !negative.is_empty() && !warnings.iter().any(|warning| warning.code == "force-sign") {
        warnings.push(Warning::new(
            "negative-diagonal",
            format!("{} below zero by more than the interval: this band, a sign or the model is wrong, and the number is not to be used", negative.join(", ")),
            "look at the response with `report`, fit another band with `band`, or ask `ndof diagnose` what the model lacks",
        ));
    }
    warnings
}

/// A compliance in series beyond doubt, which explains more than it leaves of a misfit and moves a number out of its interval. Whether it is one is not for
/// the data to say: the fit's intervals then hold the values with it and without it.
pub(super) fn unknown_mount(fit: &mut ndof_models::Fit, mount: &SeriesCompliance, axes: &[Axis]) -> Option<Warning> {
    let with = ndof_models::Fit { chi2: fit.chi2 - mount.chi2_less, ..fit.clone() };
    let least = if with.misfits() { with.chi2 - with.degrees_of_freedom } else { 0.0 };
    let doubt = 2.0 * ODDS.ln() * (with.chi2 / with.degrees_of_freedom).max(1.0);
    if mount.chi2_less < doubt.max(least) || axes.iter().any(|axis| axis.rotational != axes[0].rotational) {
        return None;
    }
    let moves = |(p, with): &(&Parameter, &f64)| (*with - p.value).abs() / (0.5 * (p.ci95[1] - p.ci95[0]));
    let most = fit.parameters.iter().zip(&mount.theta).filter(|p| p.0.identifiable).max_by(|a, b| moves(a).total_cmp(&moves(b)))?;
    let unit = if axes[0].rotational { "N m/rad" } else { "N/m" };
    // χ² falls by (c / its standard error)².
    let share = fit.interval_quantile * ((with.chi2 / with.degrees_of_freedom).max(1.0) / mount.chi2_less).sqrt();
    let [low, k, high] = [1.0 + share, 1.0, 1.0 - share].map(|share| 1.0 / (share * mount.compliance));
    if moves(&most) <= 1.0 {
        return None;
    }
    let (name, change) = (&most.0.name, 100.0 * (most.1 / most.0.value - 1.0));
    let warning = Warning::new(
        "unknown-mount",
        format!(
            "the motion holds what a mount of {k:.1e} {unit} ({low:.1e} … {high:.1e}) between limb and robot would add: with it {name} changes by {change:.1} %; intervals hold the values with it and without it"
        ),
        "give `transducer-stiffness` as the data sheet of the transducer or handle has it; if nothing there gives way, ask `ndof diagnose` what the model lacks",
    );
    let apart: Vec<f64> = mount.theta.iter().zip(&fit.theta).map(|(with, without)| with - without).collect();
    fit.add_covariance(|r, c| apart[r] * apart[c]);
    Some(warning)
}

/// A limb that along every axis has an inertia below zero, beyond its interval or with damping and stiffness, is a transducer that reads the reaction; unless turned
/// round it would be no body's, as that of motions in each other's place is.
fn force_sign(baseline: &ndof_models::Fit) -> Option<Warning> {
    let own = |site: &str| baseline.parameters.iter().filter(move |p| p.site == site).collect::<Vec<&Parameter>>();
    let turned = |inertia: &&Parameter| inertia.value < 0.0 && (inertia.ci95[1] < 0.0 || own(&inertia.site).iter().all(|p| p.value < 0.0));
    let inertias: Vec<&Parameter> = baseline.parameters.iter().filter(|p| p.name.starts_with('M') && !p.site.contains(',')).collect();
    let turned_most = |axis: &str| inertias.iter().find(|p| p.site == axis).map_or(f64::INFINITY, |p| -p.ci95[0]);
    let between =
        |p: &Parameter| p.site.split_once(',').filter(|_| p.name.starts_with('M')).is_some_and(|(a, b)| is_of_no_body(p.ci95, [a, b].map(turned_most)));
    let negative = !inertias.is_empty() && inertias.iter().all(turned);
    (negative && !baseline.parameters.iter().any(between)).then(|| {
        Warning::new(
            "force-sign",
            "the fitted inertia is below zero along every axis: the force channels seem to hold the reaction, not the force on the limb",
            "turn them with `negate=CHANNEL` if that is how they were recorded",
        )
    })
}
