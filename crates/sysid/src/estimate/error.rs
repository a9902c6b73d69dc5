//! Why there is no estimate.

use crate::ports::PortsError;
use ndof_signal::{RecordingError, SpectraError, WelchError};

/// Why a response cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EstimateError {
    /// The ports do not fit the channels.
    #[error(transparent)]
    Ports(#[from] PortsError),
    /// Labels and ports differ in number.
    #[error("{labels} labels for {ports} {role} channels; give one label a channel")]
    Labels {
        /// Which of the ports.
        role: &'static str,
        /// How many labels there are.
        labels: usize,
        /// How many channels.
        ports: usize,
    },
    /// With so few averages coherence would be identically one and no error could be told.
    #[error(
        "{averages:.2} effective averages are too few to estimate {unknowns} input(s) with an error: more than {unknowns} are needed; take shorter segments (--nperseg), a longer recording, or more trials"
    )]
    TooFewAverages {
        /// Effective averages.
        averages: f64,
        /// Unknowns of one row of the response.
        unknowns: usize,
    },
    /// A channel that drives is constant.
    #[error("{role} \"{name}\" is constant: it drives nothing; leave it out with --{role}")]
    Silent {
        /// input or reference.
        role: &'static str,
        /// The channel.
        name: String,
    },
    /// Channels that drive are copies of each other, or linear combinations, at every frequency.
    #[error(
        "{role}s {} depend on each other at every frequency, so their effects cannot be told apart; leave one out with --{role}, or drive them by independent signals",
        names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(" and ")
    )]
    Dependent {
        /// input or reference.
        role: &'static str,
        /// The channels.
        names: Vec<String>,
    },
    /// The derived estimate needs as many references as inputs.
    #[error("{references} reference(s) cannot separate {inputs} input(s); name at least {inputs} commanded channels with --reference")]
    TooFewReferences {
        /// References.
        references: usize,
        /// Inputs.
        inputs: usize,
    },
    /// H2 needs a square system.
    #[error("H2 needs as many outputs as inputs, there are {outputs} and {inputs}; use h1 or hv")]
    NotSquare {
        /// Outputs.
        outputs: usize,
        /// Inputs.
        inputs: usize,
    },
    /// No recording was given.
    #[error("no recording to estimate from; give at least one trial")]
    NoTrial,
    /// A trial lacks a channel, or holds a NaN.
    #[error("trial {trial}: {source}")]
    Recording {
        /// Number of the trial, from 1.
        trial: usize,
        /// What is wrong.
        source: RecordingError,
    },
    /// A trial cannot be transformed.
    #[error("trial {trial}: {source}")]
    Welch {
        /// Number of the trial, from 1.
        trial: usize,
        /// What is wrong.
        source: WelchError,
    },
    /// Trials cannot be pooled.
    #[error(transparent)]
    Pool(#[from] SpectraError),
}
