//! A simulation that is known by what it logged at the same commands.

use super::joints::of_channels;
use crate::error::AnalysisError;
use crate::estimate::{Estimate, estimate};
use crate::fit::{Fit, fit};
use crate::trials::{RoleNames, Trial, Trials, Trim};
use ndarray::Array2;
use ndof_diagnose::{Baseline, Part, Status};
use ndof_joints::alike;
use ndof_models::InertiaDampingStiffness;
use ndof_signal::{Quantity, RESOLVED, Recording, Warning, derivatives};

/// How far beyond the fitted band the simulator's own force is kept: what a low-pass takes below its corner ends well above the band.
const BEYOND: f64 = 4.0;

/// What a simulator's log says of it.
pub(super) struct Simulator {
    /// Its inertia, damping and stiffness, each of which may be wrong.
    pub baseline: Baseline,
    /// What was measured, with the force that its other effects need along its own motion taken off.
    pub measured: Vec<Recording>,
    /// The names of effort and displacement along each axis.
    pub pairs: Vec<[String; 2]>,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
}

impl Simulator {
    /// The force that a simulator with the linear response Z = M s² + B s + K needs for the measured motion x is F_s + Z (x − x_s), where F_s and x_s are
    /// what it logged: exact for a linear one, and for any other where the two motions are alike. What was measured is right if its force is that;
    /// with F' = F − (F_s − Z x_s) the balance is F' = Z x.
    ///
    /// # Errors
    /// [`AnalysisError`] if the recordings are not the measured ones sample by sample, or no inertia, damping and stiffness can be fitted.
    pub fn new(trials: &Trials, simulated: &Trials, band_hz: Option<[f64; 2]>, tolerance: f64) -> Result<Self, AnalysisError> {
        let (inputs, outputs) = (trials.names(&trials.roles.ports.inputs), trials.names(&trials.roles.ports.outputs));
        let pairs = pairs(trials)?;
        let own = of_channels(simulated, &[inputs.clone(), outputs.clone()].concat())?;
        let mut measured: Vec<Recording> = trials.trials.iter().map(|trial| trial.recording.clone()).collect();
        alike(&measured, &own)?;
        let own = own.into_iter().zip(&*simulated.trials).map(|(recording, trial)| Trial::of(trial.file.clone(), recording)).collect();
        let own = Trials::simulated(own, &RoleNames { inputs: Some(inputs), outputs: Some(outputs), ..RoleNames::default() }, &Trim::default())?;
        let fitted = fit(&estimate(&own, &Estimate::default())?, &Fit { band_hz, ..Fit::default() })?;
        let corner_hz = (BEYOND * fitted.result.band_hz[1]).min(RESOLVED * own.sample_rate_hz() / 2.0);
        let mut powers = Powers::default();
        for (recording, simulated) in measured.iter_mut().zip(&*own.trials) {
            let efforts = |corner_hz| efforts(&simulated.recording, &pairs, &fitted.matrices, corner_hz);
            // What is beyond the band, such as the noise of a simulated sensor, changes no answer.
            powers.add(recording, &simulated.recording, &pairs, &efforts(fitted.result.band_hz[1])?)?;
            let efforts = efforts(corner_hz)?;
            let mut channels = recording.channels().to_vec();
            for ([effort, _], [_, beyond]) in pairs.iter().zip(&efforts) {
                channels.iter_mut().filter(|c| c.name == *effort).for_each(|c| c.samples.iter_mut().zip(beyond).for_each(|(f, b)| *f -= b));
            }
            let made =
                Recording::new(recording.sample_rate_hz(), channels).map_err(|source| AnalysisError::Recording { file: "the recording".to_owned(), source })?;
            *recording = made.starting_at(recording.start_s());
        }
        Ok(Simulator { baseline: nominal(&fitted.matrices), measured, pairs, warnings: powers.warning(tolerance).into_iter().collect() })
    }
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

/// A simulator's effort along each axis, and what it is beyond M ẍ + B ẋ + K x along its own motion; below the corner.
fn efforts(simulated: &Recording, pairs: &[[String; 2]], own: &InertiaDampingStiffness, corner_hz: f64) -> Result<Vec<[Vec<f64>; 2]>, AnalysisError> {
    let series = |name: &str| -> Result<[Vec<f64>; 3], AnalysisError> { Ok(derivatives(samples(simulated, name)?, simulated.sample_rate_hz(), corner_hz)) };
    let motions = pairs.iter().map(|[_, motion]| series(motion)).collect::<Result<Vec<_>, _>>()?;
    let mut out = Vec::new();
    for (i, [effort, _]) in pairs.iter().enumerate() {
        let [effort, ..] = series(effort)?;
        let mut rest = effort.clone();
        for (j, [x, v, a]) in motions.iter().enumerate() {
            let (m, b, k) = (own.inertia[[i, j]], own.damping[[i, j]], own.stiffness[[i, j]]);
            rest.iter_mut().zip(x.iter().zip(v).zip(a)).for_each(|(f, ((x, v), a))| *f -= m * a + b * v + k * x);
        }
        out.push([effort, rest]);
    }
    Ok(out)
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
            let power = |x: &mut dyn Iterator<Item = f64>| {
                let (n, sum, squares) = x.fold((0.0, 0.0, 0.0), |(n, sum, squares), x| (n + 1.0, sum + x, squares + x * x));
                squares - sum * sum / f64::max(n, 1.0)
            };
            let (x, own) = (samples(measured, motion)?, samples(simulated, motion)?);
            let more = [
                power(&mut beyond.iter().copied()),
                power(&mut effort.iter().copied()),
                power(&mut x.iter().zip(own).map(|(x, own)| x - own)),
                power(&mut x.iter().copied()),
            ];
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
                "{:.0} % of the simulator's own effort is beyond inertia, damping and stiffness, and its motion is {:.0} % of the measured one away from it: \
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
    let part =
        |matrix: &Array2<f64>| Some(Part { value: matrix.rows().into_iter().map(|row| row.to_vec()).collect(), status: Status::Nominal, symmetric: true });
    Baseline { mass: part(&own.inertia), damping: part(&own.damping), stiffness: part(&own.stiffness) }
}
