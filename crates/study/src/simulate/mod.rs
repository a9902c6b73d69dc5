//! An experiment's file to recordings and the truth behind them.

mod drawn;
mod hide;

pub(crate) use drawn::draw_hidden;
use hide::{hide, mix};

use crate::Progress;
use crate::command::{Command, Commands, Through, delivery};
use crate::error::StudyError;
use crate::file::ExperimentFile;
use ndarray::Array2;
use ndof_analysis::in_order;
use ndof_analysis::result::VERSION;
use ndof_devices::{Impedance, Linearised, linearise, simulate_trial};
use ndof_models::Axis;
use ndof_signal::Recording;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What was simulated: no command reads it, so that an analysis cannot look.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Truth {
    /// `ndof/truth/1`.
    pub schema: String,
    /// The version that wrote it.
    pub ndof_version: String,
    /// The experiment as it was understood, with the keys of its file.
    #[cfg_attr(feature = "schema", schemars(with = "serde_json::Map<String, serde_json::Value>"))]
    pub experiment: ExperimentFile,
    /// Names of the endpoint's axes.
    pub axes: Vec<String>,
    /// Limb at the endpoint, about its posture.
    pub endpoint: Matrices,
    /// Names of the joints and the limb in them, where it has joints.
    pub joint: Option<JointTruth>,
    /// Seeds of the commanded perturbations, trial by trial; none where they were replayed.
    pub excitation_seeds: Vec<u64>,
}

/// Inertia, damping and stiffness, rows by columns.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[expect(non_snake_case, reason = "the field's own symbols")]
pub struct Matrices {
    /// Inertia.
    pub M: Vec<Vec<f64>>,
    /// Damping.
    pub B: Vec<Vec<f64>>,
    /// Stiffness.
    pub K: Vec<Vec<f64>>,
}

/// The limb in its joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct JointTruth {
    /// Names of the joints.
    pub axes: Vec<String>,
    /// Its matrices.
    #[serde(flatten)]
    pub matrices: Matrices,
}

/// Recordings with the truth behind them.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// One a trial.
    pub recordings: Vec<Recording>,
    /// What was simulated.
    pub truth: Truth,
    /// Robot, hold, transducer and limb as a linear model.
    pub linear: Linearised,
    /// The endpoint at the posture, axis by axis.
    pub rest: Vec<f64>,
    /// Whether the limb's matrices change as it moves.
    pub moves: bool,
}

impl From<&Impedance> for Matrices {
    fn from(limb: &Impedance) -> Self {
        let rows = |matrix: &Array2<f64>| matrix.rows().into_iter().map(|row| row.to_vec()).collect();
        Matrices { M: rows(&limb.inertia), B: rows(&limb.damping), K: rows(&limb.stiffness) }
    }
}

/// Simulates every trial of an experiment; the same seed gives the same bytes on any number of threads.
///
/// # Errors
/// [`StudyError`] if parts do not fit or the motion diverges.
pub fn simulate(file: &ExperimentFile, progress: &Progress<'_>) -> Result<Simulated, StudyError> {
    simulate_behind(file, None, progress)
}

/// The same with the inverse of `model` before the commands, in place of the experiment's own.
pub(crate) fn simulate_behind(file: &ExperimentFile, model: Option<&Linearised>, progress: &Progress<'_>) -> Result<Simulated, StudyError> {
    let experiment = file.experiment();
    let linear = linearise(&experiment)?;
    let bench = experiment.build()?;
    let axes: Vec<Axis> = bench.device.robot.axes().to_vec();
    let rest = bench.rest_endpoint();
    let (discarded, recorded) = experiment.samples();
    let samples = discarded + recorded;
    let names: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
    let model = model.or(file.excitation.precompensate.then_some(&linear));
    let compensation = model.map(|model| Through::compensation(model, samples));
    let device = delivery(&experiment)?;
    let maker = Commands {
        excitation: &file.excitation,
        axes: &names,
        samples,
        lead: discarded,
        // Seeds of experiments were always chosen over the whole length; the same file keeps giving the same bytes.
        unseen: 0,
        sample_rate_hz: file.sample_rate_hz,
        seed: file.seed,
        compensation: compensation.as_ref(),
        device: Some(&*device),
        judge: None,
    };
    let mut commands: Vec<Command> = Vec::with_capacity(file.trials);
    for trial in 0..file.trials {
        commands.push(maker.trial(trial)?);
        progress("design", trial + 1, file.trials);
    }
    let done = std::sync::atomic::AtomicUsize::new(0);
    let recordings = commands
        .par_iter()
        .enumerate()
        .map(|(trial, command)| {
            let hidden = hide(file, &axes, &linear.limb, trial)?;
            let mut recording = simulate_trial(&hidden.experiment, &command.signals, &hidden.extras, trial)?;
            for matrix in &hidden.mixing {
                recording = mix(&recording, matrix)?;
            }
            progress("simulate", done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, file.trials);
            Ok(recording)
        })
        .collect();
    let recordings = in_order::<_, StudyError>(recordings)?;
    let joints = file.limb.joint_names();
    let truth = Truth {
        schema: "ndof/truth/1".to_owned(),
        ndof_version: VERSION.to_owned(),
        experiment: ExperimentFile { schema: Some(ExperimentFile::SCHEMA.to_owned()), ..file.clone() },
        axes: names,
        endpoint: Matrices::from(&linear.limb),
        joint: linear.limb_joints.as_ref().map(|(limb, _)| JointTruth { axes: joints, matrices: Matrices::from(limb) }),
        excitation_seeds: commands.iter().filter_map(|command| command.seed).collect(),
    };
    Ok(Simulated { recordings, truth, linear, rest, moves: bench.limb.moving().is_some() })
}

impl Truth {
    /// The simulated value of the parameter called `K_x_y` (`K` for one axis), at the endpoint or at the joints.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        let joint = self.joint.as_ref().map(|joint| (&joint.axes, &joint.matrices));
        std::iter::once((&self.axes, &self.endpoint)).chain(joint).find_map(|(axes, matrices)| {
            let (matrix, entry) = name.split_at_checked(1)?;
            let matrix = match matrix {
                "M" => &matrices.M,
                "B" => &matrices.B,
                "K" => &matrices.K,
                _ => return None,
            };
            let n = axes.len();
            let index = (0..n * n).find(|k| entry == format!("_{}_{}", axes[k / n], axes[k % n]) || (n == 1 && entry.is_empty()))?;
            Some(matrix[index / n][index % n])
        })
    }
}
