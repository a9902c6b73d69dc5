//! Forces that commands deliver on the simulated device.

use super::Device;
use crate::Progress;
use crate::error::StudyError;
use ndof_analysis::in_order;
use ndof_devices::{Averaging, Experiment, Extras, Sensors, simulate_trial};
use ndof_signal::Recording;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The effort channels of a recording.
pub(crate) fn forces_of(recording: &Recording) -> Vec<Vec<f64>> {
    let efforts = recording.channels().iter().filter(|c| c.name.starts_with("force_") || c.name.starts_with("torque_"));
    efforts.map(|c| c.samples.clone()).collect()
}

/// Forces on the limb as the device's transducer shows them, `[trial][axis][sample]`, what the experiment discards left out.
pub(crate) fn simulated(experiment: &Experiment, commanded: &[Vec<Vec<f64>>], progress: &Progress<'_>) -> Result<Vec<Vec<Vec<f64>>>, StudyError> {
    let done = AtomicUsize::new(0);
    let forces = |(trial, signals): (usize, &Vec<Vec<f64>>)| {
        let recording = simulate_trial(experiment, signals, &Extras::default(), trial)?;
        progress("simulate", done.fetch_add(1, Ordering::Relaxed) + 1, commanded.len());
        Ok(forces_of(&recording))
    };
    in_order(commanded.par_iter().enumerate().map(forces).collect())
}

/// Commands of an experiment's whole length to the forces on its limb over all of it, less the mean force: an ideal transducer,
/// a limb without force of its own, and the robot with its friction.
pub(crate) fn delivery(experiment: &Experiment) -> Result<Box<Device<'static>>, StudyError> {
    let (discarded, recorded) = experiment.samples();
    let whole = Experiment {
        duration_s: (discarded + recorded) as f64 / experiment.sample_rate_hz,
        discard_s: 0.0,
        limb: experiment.limb.clone().silent(),
        sensors: Sensors { force_noise_rms: Some(0.0), force_quantum: Some(0.0), averaging: Averaging::Interval, ..experiment.sensors.clone() },
        ..experiment.clone()
    };
    let mean = experiment.build()?.limb.mean_force().to_vec();
    Ok(Box::new(move |commanded: &[Vec<f64>]| {
        let mut forces = forces_of(&simulate_trial(&whole, commanded, &Extras::default(), 0)?);
        forces.iter_mut().zip(&mean).for_each(|(force, mean)| force.iter_mut().for_each(|sample| *sample -= mean));
        Ok(forces)
    }))
}
