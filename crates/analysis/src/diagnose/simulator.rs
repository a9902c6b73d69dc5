//! A simulation that is known by what it logged at the same commands.

use super::joints::of_channels;
use crate::error::AnalysisError;
use crate::estimate::{Estimate, estimate};
use crate::fit::{Fit, fit};
use crate::trials::{RoleNames, Trial, Trials, Trim, axis_of};
use ndarray::Array2;
use ndof_diagnose::{Baseline, Cause, Options, Part, diagnose_with_pictures, force_along};
use ndof_joints::alike;
use ndof_models::effects::{Injection, Parameters, Setting, Trace, find};
use ndof_models::{ForceLaw, InertiaDampingStiffness};
use ndof_signal::{Quantity, RESOLVED, Recording, Warning, derivatives};
use std::sync::Arc;

/// How far beyond the fitted band the simulator's own force is kept: what a low-pass takes below its corner ends well above the band.
const BEYOND: f64 = 4.0;

/// What a simulator's log says of it.
pub(super) struct Simulator {
    /// Its inertia, damping and stiffness, each of which may be wrong.
    pub baseline: Baseline,
    /// Its own forces beyond these.
    pub known: Vec<Arc<dyn ForceLaw>>,
    /// What was measured, with the force that all else of it needs along its own motion taken off.
    pub measured: Vec<Recording>,
    /// The names of effort and displacement along each axis.
    pub pairs: Vec<[String; 2]>,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
}

impl Simulator {
    /// The force that a simulator with the linear response Z = M s² + B s + K and forces g of its own needs for the measured motion x is
    /// F_s + Z (x − x_s) + g(x) − g(x_s), where F_s and x_s are what it logged: exact for what Z and g say, and for all else where the two motions are
    /// alike. What was measured is right if its force is that; with F' = F − (F_s − Z x_s − g(x_s)) the balance is F' = Z x + g(x).
    pub fn new(trials: &Trials, simulated: &Trials, options: &Options) -> Result<Self, AnalysisError> {
        let (inputs, outputs) = (trials.names(&trials.roles.ports.inputs), trials.names(&trials.roles.ports.outputs));
        let pairs = pairs(trials)?;
        let own = of_channels(simulated, &[inputs.clone(), outputs.clone()].concat())?;
        let mut measured: Vec<Recording> = trials.trials.iter().map(|trial| trial.recording.clone()).collect();
        alike(&measured, &own)?;
        let own = own.into_iter().zip(&*simulated.trials).map(|(recording, trial)| Trial::of(trial.file.clone(), recording)).collect();
        let own = Trials::simulated(own, &RoleNames { inputs: Some(inputs), outputs: Some(outputs), ..RoleNames::default() }, &Trim::default())?;
        let band_hz = options.band_hz.map(|(low, high)| [low, high]);
        let fitted = fit(&estimate(&own, &Estimate::default())?, &Fit { band_hz, ..Fit::default() })?;
        let top_hz = fitted.result.band_hz[1];
        let linear = Response { matrices: fitted.matrices, laws: vec![], corner_hz: corner(top_hz, own.sample_rate_hz()) };
        let left = |response: &Response| -> Result<f64, AnalysisError> {
            let rest = |trial: &Trial| Ok(response.efforts(&trial.recording, &pairs, top_hz)?.iter().map(|[_, rest]| power(rest.iter().copied())).sum::<f64>());
            own.trials.iter().map(rest).sum()
        };
        let response = match Response::told(&own, &pairs, &linear.matrices, options) {
            Some(told) if left(&told)? < left(&linear)? => told,
            _ => linear,
        };
        let mut powers = Powers::default();
        for (recording, simulated) in measured.iter_mut().zip(&*own.trials) {
            // What is beyond the band, such as the noise of a simulated sensor, changes no answer.
            powers.add(recording, &simulated.recording, &pairs, &response.efforts(&simulated.recording, &pairs, top_hz)?)?;
            let beyond = response.efforts(&simulated.recording, &pairs, response.corner_hz)?;
            let mut channels = recording.channels().to_vec();
            for ([effort, _], [_, beyond]) in pairs.iter().zip(&beyond) {
                channels.iter_mut().filter(|c| c.name == *effort).for_each(|c| c.samples.iter_mut().zip(beyond).for_each(|(f, b)| *f -= b));
            }
            let wrap = |source| AnalysisError::Recording { file: "the recording".to_owned(), source };
            *recording = recording.with_channels(channels).map_err(wrap)?;
        }
        let warnings = powers.warning(options.tolerance).into_iter().collect();
        Ok(Simulator { baseline: nominal(&response.matrices), known: response.laws, measured, pairs, warnings })
    }
}

/// What a simulator does with a motion, as its own log tells it: inertia, damping and stiffness, and laws beyond them.
struct Response {
    matrices: InertiaDampingStiffness,
    laws: Vec<Arc<dyn ForceLaw>>,
    /// Motions are taken below it.
    corner_hz: f64,
}

/// How far beyond a band forces and motions are kept.
fn corner(top_hz: f64, rate_hz: f64) -> f64 {
    (BEYOND * top_hz).min(RESOLVED * rate_hz / 2.0)
}

impl Response {
    /// By a diagnosis of the log itself; `None` where nothing beyond the matrices is named, or it is no force that acts along any motion.
    fn told(own: &Trials, pairs: &[[String; 2]], near: &InertiaDampingStiffness, options: &Options) -> Option<Self> {
        let recordings: Vec<Recording> = own.trials.iter().map(|trial| trial.recording.clone()).collect();
        let asked = Options { added: false, plan: false, linear: None, ..options.clone() };
        let (found, pictures) = diagnose_with_pictures(&recordings, &own.roles.ports, &asked, None, &mut |_| {}).ok()?;
        let axes: Vec<&str> = pairs.iter().map(|[_, motion]| axis_of(motion)).collect();
        let name = |letter: &str, i: usize, j: usize| if axes.len() == 1 { letter.to_owned() } else { format!("{letter}_{}_{}", axes[i], axes[j]) };
        let entry = |letter: &str, (i, j): (usize, usize)| found.extended.parameters.iter().find(|p| p.name == name(letter, i, j)).map_or(0.0, |p| p.value);
        let matrix = |letter: &str| Array2::from_shape_fn((axes.len(), axes.len()), |place| entry(letter, place));
        let matrices = InertiaDampingStiffness { axes: near.axes.clone(), inertia: matrix("M"), damping: matrix("B"), stiffness: matrix("K") };
        let rows = |matrix: &Array2<f64>| matrix.rows().into_iter().map(|row| row.to_vec()).collect::<Vec<_>>();
        let law = |cause: &Cause| -> Option<Arc<dyn ForceLaw>> {
            let setting = Setting {
                axes: axes.len(),
                axis: axes.iter().position(|axis| *axis == cause.site.axis),
                mass: rows(&matrices.inertia),
                stiffness: rows(&matrices.stiffness),
                duration_s: recordings[0].len() as f64 / own.sample_rate_hz(),
                sample_rate_hz: own.sample_rate_hz(),
                seed: 0,
            };
            let parameters = Parameters(cause.parameters.iter().map(|p| (p.name.clone(), p.value.clone())).collect());
            match find(&cause.effect)?.inject(&parameters, &setting).ok()? {
                Injection::Force(law) if law.delay_s() == 0.0 => Some(law.into()),
                _ => None,
            }
        };
        // A noise, a line or a burst is a force of its own time, not one of the motion.
        let of_motion = |cause: &&Cause| find(&cause.effect).is_some_and(|effect| effect.card.trace == Trace::Forms);
        let laws: Vec<_> = found.causes.iter().filter(of_motion).map(law).collect::<Option<_>>()?;
        (!laws.is_empty()).then(|| Response { matrices, laws, corner_hz: corner(pictures.band_hz[1], own.sample_rate_hz()) })
    }

    /// The forces of the laws along a motion, `[axis][time]`; displacements are taken from their mean, as a diagnosis takes them.
    fn forces(&self, motions: &[[Vec<f64>; 3]], rate_hz: f64) -> Vec<Vec<f64>> {
        let about_mean = |x: &Vec<f64>| {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            x.iter().map(|x| x - mean).collect::<Vec<f64>>()
        };
        let (x, v): (Vec<_>, Vec<_>) = motions.iter().map(|[x, v, _]| (about_mean(x), v.clone())).unzip();
        let mut out = vec![vec![0.0; x[0].len()]; x.len()];
        for force in self.laws.iter().map(|law| force_along(law.as_ref(), rate_hz, &x, &v)) {
            out.iter_mut().flatten().zip(force.iter().flatten()).for_each(|(sum, f)| *sum += f);
        }
        out
    }

    /// A simulator's effort along each axis, and what it is beyond matrices and laws along its own motion; below a frequency.
    fn efforts(&self, simulated: &Recording, pairs: &[[String; 2]], top_hz: f64) -> Result<Vec<[Vec<f64>; 2]>, AnalysisError> {
        let rate_hz = simulated.sample_rate_hz();
        let motions = self.motions(simulated, pairs)?;
        let laws = self.forces(&motions, rate_hz);
        let below = |series: &[f64]| derivatives(series, rate_hz, top_hz)[0].clone();
        let mut out = Vec::new();
        for (i, ([effort, _], law)) in pairs.iter().zip(&laws).enumerate() {
            let [effort, ..] = derivatives(samples(simulated, effort)?, rate_hz, self.corner_hz);
            let mut rest: Vec<f64> = effort.iter().zip(law).map(|(f, g)| f - g).collect();
            for (j, [x, v, a]) in motions.iter().enumerate() {
                let (m, b, k) = (self.matrices.inertia[[i, j]], self.matrices.damping[[i, j]], self.matrices.stiffness[[i, j]]);
                rest.iter_mut().zip(x.iter().zip(v).zip(a)).for_each(|(f, ((x, v), a))| *f -= m * a + b * v + k * x);
            }
            out.push(if top_hz < self.corner_hz { [below(&effort), below(&rest)] } else { [effort, rest] });
        }
        Ok(out)
    }

    /// Displacement, velocity and acceleration along each axis.
    fn motions(&self, recording: &Recording, pairs: &[[String; 2]]) -> Result<Vec<[Vec<f64>; 3]>, AnalysisError> {
        pairs.iter().map(|[_, motion]| Ok(derivatives(samples(recording, motion)?, recording.sample_rate_hz(), self.corner_hz))).collect()
    }
}

/// Σ (x − mean)².
fn power(series: impl Iterator<Item = f64>) -> f64 {
    let (n, sum, squares) = series.fold((0.0, 0.0, 0.0), |(n, sum, squares), x| (n + 1.0, sum + x, squares + x * x));
    squares - sum * sum / f64::max(n, 1.0)
}

/// The names of effort and displacement along each axis.
fn pairs(trials: &Trials) -> Result<Vec<[String; 2]>, AnalysisError> {
    let ports = &trials.roles.ports;
    let (inputs, outputs) = (trials.channels(&ports.inputs), trials.channels(&ports.outputs));
    let pair = |(input, output): (&&ndof_signal::Channel, &&ndof_signal::Channel)| match (input.unit.quantity(), output.unit.quantity()) {
        (Quantity::Effort, Quantity::Displacement) => Some([input.name.clone(), output.name.clone()]),
        (Quantity::Displacement, Quantity::Effort) => Some([output.name.clone(), input.name.clone()]),
        _ => None,
    };
    let found: Option<Vec<_>> = inputs.iter().zip(&outputs).map(pair).collect();
    found.filter(|_| inputs.len() == outputs.len()).ok_or_else(|| AnalysisError::Meaning {
        file: "`simulated`".to_owned(),
        what: "it takes an effort and a displacement on every axis; choose them with `input` and `output`, or give the `robot` whose joints were logged"
            .to_owned(),
    })
}

fn samples<'a>(recording: &'a Recording, name: &str) -> Result<&'a [f64], AnalysisError> {
    let wrap = |source| AnalysisError::Recording { file: "the recording".to_owned(), source };
    Ok(&recording.channel(name).map_err(wrap)?.samples)
}

/// How much of a simulator's effort is not linear, and how far its motion is from what was measured, summed over all trials; axis by axis.
#[derive(Default)]
struct Powers {
    of: Vec<[f64; 4]>,
}

impl Powers {
    fn add(&mut self, measured: &Recording, simulated: &Recording, pairs: &[[String; 2]], efforts: &[[Vec<f64>; 2]]) -> Result<(), AnalysisError> {
        self.of.resize(pairs.len(), [0.0; 4]);
        for (([_, motion], [effort, beyond]), of) in pairs.iter().zip(efforts).zip(&mut self.of) {
            let (x, own) = (samples(measured, motion)?, samples(simulated, motion)?);
            let more =
                [power(beyond.iter().copied()), power(effort.iter().copied()), power(x.iter().zip(own).map(|(x, own)| x - own)), power(x.iter().copied())];
            of.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
        Ok(())
    }

    /// The error of a response that is linear grows as the product of the two shares.
    fn warning(&self, tolerance: f64) -> Option<Warning> {
        let shares = |[beyond, effort, apart, moved]: &[f64; 4]| [(beyond / effort).sqrt(), (apart / moved).sqrt()];
        let [curved, apart] = self.of.iter().map(shares).max_by(|a, b| (a[0] * a[1]).total_cmp(&(b[0] * b[1])))?;
        (curved * apart > tolerance).then(|| {
            let message = format!(
                "{:.0} % of the simulator's own effort is beyond inertia, damping, stiffness and what its own log names, and its motion is {:.0} % of the measured one away from it: \
                 how its force changes on that way is known to first order only, and intervals do not know of that",
                100.0 * curved,
                100.0 * apart
            );
            Warning::new("simulator-not-linear", message, "if it is a robot's, give its file with `robot`; or correct what is named first, and simulate anew")
        })
    }
}

/// Matrices that a diagnosis may call wrong.
fn nominal(own: &InertiaDampingStiffness) -> Baseline {
    let part = |matrix| Some(Part::nominal(matrix));
    Baseline { mass: part(&own.inertia), damping: part(&own.damping), stiffness: part(&own.stiffness) }
}
