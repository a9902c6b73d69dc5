//! Effort and displacement of each axis, as fits in time take them.

use super::settings::Fit;
use crate::trials::{Trial, Trials};
use ndof_sysid::ResponseKind;

/// Effort and motion channels of each axis in pairs, and the commands where a robot pushes.
pub(super) struct Sides {
    pub efforts: Vec<usize>,
    pub motions: Vec<usize>,
    pub commands: Vec<usize>,
    /// Whether the motion is what was imposed.
    pub imposed: bool,
}

impl Sides {
    /// Of these trials, for `what`; in words why there are none.
    pub fn of(trials: &Trials, what: &str) -> Result<Self, String> {
        let (roles, ports) = (&trials.roles, &trials.roles.ports);
        let imposed = roles.natural_kind() == ResponseKind::DynamicStiffness;
        let (efforts, motions, orders) =
            if imposed { (&ports.outputs, &ports.inputs, &roles.input_motion) } else { (&ports.inputs, &ports.outputs, &roles.output_motion) };
        if roles.natural_kind() == ResponseKind::Transfer || orders.iter().any(|order| *order != Some(0)) || efforts.len() != motions.len() {
            return Err(format!("{what} needs one force (or torque) and one position (or angle) an axis; choose them with `input` and `output`"));
        }
        let commands = if imposed { Vec::new() } else { ports.references.clone() };
        Ok(Sides { efforts: efforts.clone(), motions: motions.clone(), commands, imposed })
    }

    /// The limb's displacement along each axis: what was measured, less what the force transducer gives under the force, x = d − f/k_f.
    pub fn motion(&self, trial: &Trial, settings: &Fit) -> Vec<Vec<f64>> {
        let samples = |index: &usize| &trial.recording.channels()[*index].samples;
        let give = settings.transducer_stiffness.map_or(0.0, |stiffness| 1.0 / stiffness);
        self.motions.iter().zip(&self.efforts).map(|(x, f)| samples(x).iter().zip(samples(f)).map(|(x, f)| x - give * f).collect()).collect()
    }
}
