//! Which channel is input, output and reference.

use serde::{Deserialize, Serialize};

/// Indices of the channels that an estimate relates.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ports {
    /// What was commanded from outside (r), uncorrelated with all noise; may be empty.
    pub references: Vec<usize>,
    /// What acts on the system (u), e.g. the measured force.
    pub inputs: Vec<usize>,
    /// What the system does (y), e.g. the displacement.
    pub outputs: Vec<usize>,
}

/// Why ports do not fit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum PortsError {
    /// No input.
    #[error("no input channel; name one with --input, or call it force_… or torque_…")]
    NoInput,
    /// No output.
    #[error("no output channel; name one with --output, or call it pos_… or angle_…")]
    NoOutput,
    /// An index is beyond the channels.
    #[error("channel index {index} was asked for, there are {channels} channels")]
    OutOfRange { index: usize, channels: usize },
    /// One channel has two roles.
    #[error("channel index {0} is used twice; a channel can be input, output or reference once")]
    UsedTwice(usize),
}

impl Ports {
    /// What drives: the references, or the inputs where there are none.
    pub fn drivers(&self) -> &[usize] {
        if self.references.is_empty() { &self.inputs } else { &self.references }
    }

    /// What answers to [`Ports::drivers`]: the outputs, and then the inputs where references drive.
    pub fn responders(&self) -> Vec<usize> {
        let inputs = if self.references.is_empty() { &[][..] } else { &self.inputs };
        self.outputs.iter().chain(inputs).copied().collect()
    }

    /// Checks the ports against a number of channels.
    ///
    /// # Errors
    /// [`PortsError`] if an input or output is missing, an index is too large, or a channel is used twice.
    pub fn validate(&self, channels: usize) -> Result<(), PortsError> {
        if self.inputs.is_empty() {
            return Err(PortsError::NoInput);
        }
        if self.outputs.is_empty() {
            return Err(PortsError::NoOutput);
        }
        let all: Vec<usize> = self.references.iter().chain(&self.inputs).chain(&self.outputs).copied().collect();
        for (i, &index) in all.iter().enumerate() {
            if index >= channels {
                return Err(PortsError::OutOfRange { index, channels });
            }
            if all[..i].contains(&index) {
                return Err(PortsError::UsedTwice(index));
            }
        }
        Ok(())
    }
}
