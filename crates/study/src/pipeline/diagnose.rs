//! Trials in, diagnosis out.

use crate::error::StudyError;
use crate::file::{BaselineFile, Status};
use crate::result::VERSION;
use crate::result::diagnosis::{DiagnosisResult, SCHEMA};
use crate::trials::Trials;
use ndarray::Array2;
use ndof_devices::{Controller, DeviceConfig, Experiment, LimbConfig, Posture, Sensors, linearise};
use ndof_diagnose::{Baseline, HeldOut, Options, Part};
use ndof_signal::Recording;

/// What is held out, as a user says it.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum HoldOut {
    /// Of several files the last third, of one the last 30 % of its time.
    #[default]
    Auto,
    /// These files.
    Files(Vec<String>),
    /// This stretch of every file.
    Time(f64, f64),
}

/// How to diagnose.
#[derive(Clone, Debug, PartialEq)]
pub struct DiagnoseSettings {
    /// The band that is analysed; found from the data where it is not given.
    pub band_hz: Option<(f64, f64)>,
    /// What is held out.
    pub held_out: HoldOut,
    /// Size of a discrepancy that does not matter.
    pub tolerance: f64,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Effects that are not tried.
    pub without: Vec<String>,
    /// The simulation that is judged.
    pub baseline: Option<BaselineFile>,
}

impl Default for DiagnoseSettings {
    fn default() -> Self {
        let options = Options::default();
        DiagnoseSettings { band_hz: None, held_out: HoldOut::Auto, tolerance: options.tolerance, seed: options.seed, without: Vec::new(), baseline: None }
    }
}

/// Says what the baseline gets wrong, and why.
///
/// # Errors
/// [`StudyError`] if the channels do not make a balance of forces, the recording is too short, or the baseline does not fit.
pub fn diagnose(trials: &Trials, settings: &DiagnoseSettings, command: &str, progress: &mut dyn FnMut(&str)) -> Result<DiagnosisResult, StudyError> {
    let held_out = match &settings.held_out {
        HoldOut::Auto => HeldOut::Auto,
        HoldOut::Time(from, to) => HeldOut::Time(*from, *to),
        HoldOut::Files(files) => HeldOut::Trials((0..trials.trials.len()).filter(|&k| files.contains(&trials.trials[k].file)).collect()),
    };
    let options = Options {
        band_hz: settings.band_hz,
        held_out,
        tolerance: settings.tolerance,
        seed: settings.seed,
        without: settings.without.clone(),
        ..Options::default()
    };
    let baseline = settings.baseline.as_ref().map(baseline).transpose()?;
    let recordings: Vec<Recording> = trials.trials.iter().map(|trial| trial.recording.clone()).collect();
    let ports = &trials.roles.ports;
    let found = ndof_diagnose::diagnose(&recordings, ports, &options, baseline.as_ref(), progress)?;
    // Through JSON, where a number that does not exist becomes null.
    let diagnosis = serde_json::to_value(&found).and_then(serde_json::from_value)?;
    Ok(DiagnosisResult {
        schema: SCHEMA.to_owned(),
        ndof_version: VERSION.to_owned(),
        command: command.to_owned(),
        warnings: trials.warnings.clone(),
        inputs: trials.names(&ports.inputs),
        outputs: trials.names(&ports.outputs),
        diagnosis,
    })
}

/// The matrices of a baseline file, those of its limb as nominal values; what it does not give is fitted.
fn baseline(file: &BaselineFile) -> Result<Baseline, StudyError> {
    file.check("the baseline")?;
    let limb = match (&file.device, &file.limb) {
        (Some(device), Some(limb)) => Some(linearise(&held(device, limb, &file.posture))?.limb),
        _ => None,
    };
    let part = |name: &str, simulated: Option<&Array2<f64>>| {
        let written = file.parameters.get(name).map(|parameter| Part {
            value: parameter.value.rows(),
            status: match parameter.status {
                Status::Fixed => ndof_diagnose::Status::Fixed,
                Status::Nominal => ndof_diagnose::Status::Nominal,
                Status::Free => ndof_diagnose::Status::Free,
            },
            symmetric: parameter.symmetric,
        });
        let nominal = |matrix: &Array2<f64>| Part {
            value: matrix.rows().into_iter().map(|row| row.to_vec()).collect(),
            status: ndof_diagnose::Status::Nominal,
            symmetric: true,
        };
        written.or_else(|| simulated.map(nominal))
    };
    let limb = limb.as_ref();
    Ok(Baseline {
        mass: part("M", limb.map(|limb| &limb.inertia)),
        damping: part("B", limb.map(|limb| &limb.damping)),
        stiffness: part("K", limb.map(|limb| &limb.stiffness)),
    })
}

/// An experiment that only holds the limb at its posture: enough to linearise it.
fn held(device: &DeviceConfig, limb: &LimbConfig, posture: &Posture) -> Experiment {
    Experiment {
        seed: 1,
        trials: 1,
        duration_s: 1.0,
        sample_rate_hz: 500.0,
        discard_s: 0.0,
        device: device.clone(),
        limb: limb.clone(),
        posture: posture.clone(),
        controller: Controller::default(),
        sensors: Sensors::default(),
    }
}
