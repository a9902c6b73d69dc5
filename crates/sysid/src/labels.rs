//! What the channels of an estimate are called, and what their quotient means.

use crate::ports::Ports;
use crate::response::ResponseKind;
use ndof_signal::{Quantity, Recording};
use serde::{Deserialize, Serialize};

/// Names of the ports' channels, in the order of [`Ports`], and the physical meaning of outputs over inputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Labels {
    /// One a reference.
    pub references: Vec<String>,
    /// One an input.
    pub inputs: Vec<String>,
    /// One an output.
    pub outputs: Vec<String>,
    /// Outputs over inputs.
    pub kind: ResponseKind,
}

impl Labels {
    /// Names and meaning from a recording's channels and their units.
    ///
    /// # Panics
    /// If `ports` point beyond the recording's channels; see [`Ports::validate`].
    pub fn of(recording: &Recording, ports: &Ports) -> Self {
        let channels = recording.channels();
        let names = |indices: &[usize]| indices.iter().map(|&i| channels[i].name.clone()).collect();
        let all = |indices: &[usize], quantity: Quantity| indices.iter().all(|&i| channels[i].unit.quantity() == quantity);
        let (effort, displacement, velocity) = (Quantity::Effort, Quantity::Displacement, Quantity::Velocity);
        let kind = if all(&ports.inputs, effort) && all(&ports.outputs, displacement) {
            ResponseKind::Compliance
        } else if all(&ports.inputs, displacement) && all(&ports.outputs, effort) {
            ResponseKind::DynamicStiffness
        } else if all(&ports.inputs, velocity) && all(&ports.outputs, effort) {
            ResponseKind::Impedance
        } else if all(&ports.inputs, effort) && all(&ports.outputs, velocity) {
            ResponseKind::Admittance
        } else {
            ResponseKind::Transfer
        };
        Labels { references: names(&ports.references), inputs: names(&ports.inputs), outputs: names(&ports.outputs), kind }
    }

    /// Labels `r1…`, `u1…`, `y1…` for spectra whose channels have no names.
    pub fn numbered(ports: &Ports, kind: ResponseKind) -> Self {
        let names = |letter: &str, n: usize| (1..=n).map(|i| format!("{letter}{i}")).collect();
        Labels { references: names("r", ports.references.len()), inputs: names("u", ports.inputs.len()), outputs: names("y", ports.outputs.len()), kind }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndof_signal::{Channel, Unit};

    #[test]
    fn the_units_of_all_channels_say_what_outputs_over_inputs_are() {
        let quantities = [Quantity::Effort, Quantity::Effort, Quantity::Displacement, Quantity::Displacement, Quantity::Velocity, Quantity::Velocity];
        let channels = quantities.iter().enumerate().map(|(k, quantity)| Channel::new(format!("c{k}"), Unit::si(*quantity, false), vec![0.0; 4])).collect();
        let recording = Recording::new(1.0, channels).expect("equal lengths");
        for (inputs, outputs, kind) in [
            ([0, 1], [2, 3], ResponseKind::Compliance),
            ([2, 3], [0, 1], ResponseKind::DynamicStiffness),
            ([4, 5], [0, 1], ResponseKind::Impedance),
            ([0, 1], [4, 5], ResponseKind::Admittance),
            // One that does not fit is enough.
            ([0, 4], [2, 3], ResponseKind::Transfer),
            ([0, 1], [2, 5], ResponseKind::Transfer),
            ([2, 4], [0, 1], ResponseKind::Transfer),
            ([2, 3], [0, 4], ResponseKind::Transfer),
            ([4, 5], [0, 2], ResponseKind::Transfer),
            ([4, 0], [1, 1], ResponseKind::Transfer),
            ([2, 3], [4, 5], ResponseKind::Transfer),
        ] {
            let ports = Ports { references: vec![], inputs: inputs.to_vec(), outputs: outputs.to_vec() };
            assert_eq!(Labels::of(&recording, &ports).kind, kind, "{inputs:?} {outputs:?}");
        }
    }
}
