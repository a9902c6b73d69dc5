//! Inertia, damping and stiffness with force laws, fitted to trials in time.

use super::fitted::Fitted;
use super::motion_axes;
use super::result::Parameter;
use super::settings::Fit;
use super::sides::Sides;
use crate::error::AnalysisError;
use crate::result::{Number, Warning, number};
use crate::suggest::nearest;
use crate::trials::Trials;
use ndof_models::time::{Causality, Disturbance, FreeRunFit, Mechanism, Noise, TimeTrial, laws};
use serde::{Deserialize, Serialize};

/// Inertia, damping and stiffness with force laws: the model runs free from what was imposed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct InTime {
    /// The laws, each with its axis: `coulomb-friction:x`.
    pub laws: Vec<String>,
    /// What drives the run.
    pub imposed: Vec<String>,
    /// What it is compared with.
    pub outputs: Vec<String>,
    /// Where each axis has its zero: the mean of its motion over all trials. Places and gaps of laws count from there.
    pub origin: Vec<f64>,
    /// How long it runs, with an initial state of its own; null for whole trials.
    pub window_s: Number,
    /// All parameters, in the order matrices, offsets, laws; without intervals where a robot answers the limb's noise.
    pub parameters: Vec<Parameter>,
    /// rms(y − ŷ)/std(y) of each output.
    pub nrmse: Vec<Number>,
    /// 100 (1 − var(y − ŷ)/var(y)) of each output.
    pub vaf: Vec<Number>,
    /// Models that were fitted to the rest, on what they have not seen.
    pub held_out: HeldOutRun,
}

/// Free runs over a part that no fit saw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HeldOutRun {
    /// Which part.
    pub what: String,
    /// rms(y − ŷ)/std(y) of each output.
    pub nrmse: Vec<Number>,
    /// The same of the matrices alone.
    pub nrmse_without_laws: Vec<Number>,
}

/// Share of the trials, or of the only one, that is held out.
const HELD_OUT: f64 = 1.0 / 3.0;
/// Functions of the noise's past, and how long the first of them remembers: together 0.4 s, as a limb's own hum below 2 Hz asks for.
const NOISE_ORDER: usize = 16;
const NOISE_MEMORY_S: f64 = 0.025;
/// Without a spring a run drifts away; over so long it stays.
const WITHOUT_SPRING_S: f64 = 2.0;
/// Runge-Kutta steps a second at least, where a law asks for them.
const STEPS_HZ: f64 = 400.0;
/// A motion that is imposed is differentiated below this share of the Nyquist frequency at most.
const SMOOTHED: f64 = 0.8;
/// The record that the laws' own starts are for: rms of force and displacement.
const USUAL: [f64; 2] = [4.0, 0.008];

/// The fit in time, beginning at the one in frequency; nothing where no law is asked for.
pub(super) fn in_time(trials: &Trials, settings: &Fit, fitted: &Fitted) -> Result<Option<(InTime, Vec<Warning>)>, AnalysisError> {
    let Some(asked) = &settings.law else { return Ok(None) };
    let sides = Sides::of(trials, "`law`").map_err(|what| AnalysisError::Law { what })?;
    let alone = Mechanism::new(motion_axes(trials)).with_offset();
    let mechanism = asked.iter().try_fold(alone.clone(), place)?;
    let origin: Vec<f64> = sides.motions.iter().map(|c| trials.mean(*c)).collect();
    let motion: Vec<Vec<Vec<f64>>> = trials.trials.iter().map(|trial| about(sides.motion(trial, settings), &origin)).collect();
    let effort = |t: usize, c: usize| trials.trials[t].recording.channels()[c].samples.as_slice();
    let whole: Vec<TimeTrial<'_>> = (0..motion.len())
        .map(|t| TimeTrial {
            force: sides.efforts.iter().map(|c| effort(t, *c)).collect(),
            motion: motion[t].iter().map(Vec::as_slice).collect(),
            ..TimeTrial::default()
        })
        .collect();
    let run = settings_of(trials.sample_rate_hz(), &sides, &mechanism, fitted);
    let begin = baseline(&alone, fitted, &origin);
    let scale = scales(&whole);
    let starts = mechanism.starts(&begin).into_iter().map(|start| scaled(&mechanism, start, &scale)).collect::<Vec<_>>();
    let found = run.profiled(&mechanism, &whole, run.fit_from(&mechanism, &whole, &starts)?)?;
    let (seen, unseen, what) = split(trials, &whole);
    let held = |mechanism: &Mechanism, starts: &[Vec<f64>]| run.validate(mechanism, &run.fit_from(mechanism, &seen, starts)?.theta, &unseen);
    let (with, without) = (held(&mechanism, &starts)?, held(&alone, &[begin])?);
    let in_loop = !sides.commands.is_empty();
    let numbers = |values: &[f64]| values.iter().map(|v| number(*v)).collect::<Vec<Number>>();
    let warnings = (!found.reason.converged()).then(not_converged).into_iter().chain(in_loop.then(in_a_loop)).collect();
    let names = |indices: &[usize]| trials.names(indices);
    let (imposed, outputs) = if sides.imposed { (&sides.motions, &sides.efforts) } else { (&sides.efforts, &sides.motions) };
    let result = InTime {
        laws: mechanism.laws.iter().map(|placed| format!("{}:{}", placed.law.name(), mechanism.axes[placed.axis].name)).collect(),
        imposed: names(imposed),
        outputs: names(outputs),
        origin,
        window_s: run.window_s,
        parameters: found.parameters.iter().map(|p| told(p, in_loop)).collect(),
        nrmse: numbers(&found.score.nrmse),
        vaf: numbers(&found.score.vaf_percent),
        held_out: HeldOutRun { what, nrmse: numbers(&with.nrmse), nrmse_without_laws: numbers(&without.nrmse) },
    };
    Ok(Some((result, warnings)))
}

/// A parameter as it is told: in a loop the likelihood knows its noise and not its bias, so that no interval of it would hold.
fn told(parameter: &ndof_models::Parameter, in_loop: bool) -> Parameter {
    let whole = Parameter::from(parameter);
    if in_loop { Parameter { std_error: None, ci95: None, ..whole } } else { whole }
}

/// One more law, `NAME` on every axis or `NAME:AXIS` on one.
fn place(mechanism: Mechanism, asked: &String) -> Result<Mechanism, AnalysisError> {
    let refused = |what: String| AnalysisError::Law { what };
    let (name, axis) = asked.split_once(':').map_or((asked.as_str(), None), |(name, axis)| (name, Some(axis)));
    let law = laws::find(name).ok_or_else(|| {
        let all = laws::all();
        let meant = nearest(name, all.iter().map(|law| law.name())).map(|name| format!(" (did you mean \"{name}\"?)")).unwrap_or_default();
        refused(format!("unknown force law \"{name}\"{meant}; `ndof list laws` prints all"))
    })?;
    let names: Vec<&str> = mechanism.axes.iter().map(|axis| axis.name.as_str()).collect();
    let at = match axis {
        None => (0..names.len()).collect(),
        Some(axis) => {
            let found = names.iter().position(|name| *name == axis);
            vec![found.ok_or_else(|| refused(format!("`law` {asked}: there is no axis \"{axis}\"; the recordings have {}", names.join(", "))))?]
        }
    };
    Ok(at.into_iter().fold(mechanism, |mechanism, axis| mechanism.with_law(law.clone(), axis)))
}

/// Displacements from where each axis has its zero.
fn about(motion: Vec<Vec<f64>>, origin: &[f64]) -> Vec<Vec<f64>> {
    motion.into_iter().zip(origin).map(|(x, zero)| x.into_iter().map(|x| x - zero).collect()).collect()
}

/// How it is fitted: forces are imposed unless the motion is, and a limb that a law bends takes its own force for one.
fn settings_of(rate_hz: f64, sides: &Sides, mechanism: &Mechanism, fitted: &Fitted) -> FreeRunFit {
    let causality = if sides.imposed { Causality::MotionIn } else { Causality::ForceIn };
    let low_pass = sides.imposed.then(|| fitted.fit.band_hz[1].min(SMOOTHED * 0.5 * rate_hz));
    let stiffness = &fitted.matrices.stiffness;
    let spring = (0..stiffness.nrows()).all(|k| stiffness[[k, k]] > 0.0);
    FreeRunFit {
        causality,
        noise: Noise::Laguerre { order: NOISE_ORDER, memory: ((NOISE_MEMORY_S * rate_hz).round() as usize).max(1) },
        disturbance: if sides.imposed || mechanism.laws.is_empty() { Disturbance::Output } else { Disturbance::Force },
        window_s: (!spring && !sides.imposed).then_some(WITHOUT_SPRING_S),
        substeps: (STEPS_HZ / rate_hz).ceil().max(1.0) as usize,
        output_low_pass_hz: low_pass,
        motion_low_pass_hz: low_pass,
        ..FreeRunFit::new(rate_hz)
    }
}

/// Matrices of the fit in frequency in the mechanism's order, and the offset that holds each axis at its zero.
fn baseline(mechanism: &Mechanism, fitted: &Fitted, origin: &[f64]) -> Vec<f64> {
    let (m, n) = (&fitted.matrices, origin.len());
    let upper = |matrix: &ndarray::Array2<f64>| {
        (0..n).flat_map(|i| (i..n).map(move |j| (i, j))).map(|(i, j)| 0.5 * (matrix[[i, j]] + matrix[[j, i]])).collect::<Vec<f64>>()
    };
    let offset = (0..n).map(|k| fitted.mean_effort.get(k).copied().unwrap_or(0.0));
    let start: Vec<f64> = [&m.inertia, &m.damping, &m.stiffness].into_iter().flat_map(upper).chain(offset).collect();
    mechanism.parameters().iter().zip(start).map(|(p, value)| value.max(p.lower)).collect()
}

/// rms of force and of displacement along each axis.
fn scales(trials: &[TimeTrial<'_>]) -> Vec<[f64; 2]> {
    let rms = |channels: Vec<&[f64]>| {
        let count = channels.iter().map(|c| c.len()).sum::<usize>().max(1) as f64;
        let mean = channels.iter().flat_map(|c| c.iter()).sum::<f64>() / count;
        (channels.iter().flat_map(|c| c.iter()).map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt()
    };
    let axes = trials.first().map_or(0, |trial| trial.force.len());
    (0..axes).map(|k| [rms(trials.iter().map(|t| t.force[k]).collect()), rms(trials.iter().map(|t| t.motion[k]).collect())]).collect()
}

/// Starts of the laws for the forces and displacements of these recordings: each by the powers of effort and length in its unit.
fn scaled(mechanism: &Mechanism, mut start: Vec<f64>, scale: &[[f64; 2]]) -> Vec<f64> {
    let mut at = mechanism.baseline_parameters();
    for placed in &mechanism.laws {
        let [effort, length] = [0, 1].map(|k| scale[placed.axis][k] / USUAL[k]);
        for parameter in placed.law.parameters(mechanism.axes[placed.axis].rotational) {
            let [of_effort, of_length] = powers(&parameter.unit);
            start[at] = (start[at] * effort.powi(of_effort) * length.powi(of_length)).clamp(parameter.lower, parameter.upper);
            at += 1;
        }
    }
    start
}

/// Powers of effort (N, N m) and length (m, rad) in a unit as laws write it: `N s^2/m`, `N m/rad^3`, `rad/s`.
fn powers(unit: &str) -> [i32; 2] {
    let (above, below) = unit.split_once('/').unwrap_or((unit, ""));
    let (effort, rest) = match above.strip_prefix("N m").or_else(|| above.strip_prefix('N')) {
        Some(rest) => (1, rest),
        None => (0, above),
    };
    let power = |side: &str| -> i32 {
        let of = |factor: &str| match factor.split_once('^').unwrap_or((factor, "1")) {
            ("m" | "rad", power) => power.parse().unwrap_or(1),
            _ => 0,
        };
        side.split_whitespace().map(of).sum()
    };
    [effort, power(rest) - power(below)]
}

/// What is fitted where a part is held out, that part, and which it is: the last third of the trials, or of the only one.
fn split<'a>(trials: &Trials, whole: &[TimeTrial<'a>]) -> (Vec<TimeTrial<'a>>, Vec<TimeTrial<'a>>, String) {
    if let [only] = whole {
        let samples = only.force.first().map_or(0, |c| c.len());
        let at = samples - (HELD_OUT * samples as f64) as usize;
        let cut = |range: std::ops::Range<usize>| {
            let of = |channels: &[&'a [f64]]| channels.iter().map(|c| &c[range.clone()]).collect();
            vec![TimeTrial { force: of(&only.force), motion: of(&only.motion), ..TimeTrial::default() }]
        };
        let [from, to] = [at, samples].map(|k| k as f64 / trials.sample_rate_hz());
        return (cut(0..at), cut(at..samples), format!("{from:.1} to {to:.1} s"));
    }
    let held = (HELD_OUT * whole.len() as f64).ceil() as usize;
    let (seen, unseen) = whole.split_at(whole.len() - held);
    let files = trials.trials[seen.len()..].iter().map(|trial| trial.file.as_str()).collect::<Vec<_>>();
    (seen.to_vec(), unseen.to_vec(), files.join(", "))
}

fn not_converged() -> Warning {
    Warning::new(
        "in-time-not-converged",
        "the fit in time stopped at its limit of steps: its numbers are where it stood",
        "leave out a law that the data say nothing of, or give each law on its axis only",
    )
}

fn in_a_loop() -> Warning {
    Warning::new(
        "in-time-in-a-loop",
        "there is a command: a robot holds the limb and answers its noise, which the fit in time takes for part of what drives the limb: its numbers are biased by that, and have no intervals",
        "compare its matrices with those of the fit in frequency; a stronger perturbation makes the bias smaller",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_powers_of_effort_and_length() {
        for (unit, expected) in [
            ("N/m", [1, -1]),
            ("N m/rad", [1, -1]),
            ("N s^2/m", [1, -1]),
            ("N m/rad^3", [1, -3]),
            ("N", [1, 0]),
            ("N m", [1, 0]),
            ("m", [0, 1]),
            ("rad/s", [0, 1]),
            ("N s^order/m", [1, -1]),
            ("s", [0, 0]),
            ("1", [0, 0]),
            ("Hz", [0, 0]),
        ] {
            assert_eq!(powers(unit), expected, "{unit}");
        }
    }
}
