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
