//! The linear model of an experiment with another limb in it.

use crate::error::StudyError;
use ndof_devices::{EndpointLinear, Experiment, Impedance, Linearised};

/// The linear model with the limb's matrices changed.
///
/// # Errors
/// [`StudyError::Device`] if the experiment cannot be built or the changed inertia is none.
pub(crate) fn with_limb(experiment: &Experiment, change: impl FnOnce(Impedance) -> Impedance) -> Result<Linearised, StudyError> {
    let bench = experiment.build()?;
    let changed = change(bench.limb.linearised());
    let axes = changed.inertia.nrows();
    let limb = EndpointLinear::from_matrices(changed, vec![0.0; axes])?;
    Ok(Linearised::new(bench.device.robot.as_ref(), &limb, bench.device.transducer, bench.hold, &bench.rest)?)
}
