//! Why there is no estimate.

use super::direct::Direct;
use crate::ports::PortsError;
use ndof_signal::{MultitaperError, PeriodicError, SpectraError, WelchError};

/// Smallest and largest variation of a channel: the squares of powers, of which coherences are made, are then still numbers.
pub(crate) const SMALLEST: f64 = 1e-60;
pub(crate) const LARGEST: f64 = 1e60;

/// Why a response cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum EstimateError {
    /// The ports do not fit the channels.
    #[error(transparent)]
    Ports(#[from] PortsError),
    /// Labels and ports differ in number.
    #[error("{labels} labels for {ports} {role} channels; give one label a channel")]
    Labels { role: &'static str, labels: usize, ports: usize },
    /// With so few averages coherence would be identically one and no error could be told.
    #[error(
        "{averages:.2} effective averages are too few to estimate {unknowns} input(s) with an error: more than {unknowns} are needed; take shorter segments (--nperseg), a longer recording, or more trials"
    )]
    TooFewAverages {
        averages: f64,
        /// Unknowns of one row of the response.
        unknowns: usize,
    },
    /// Numbers whose squares leave what a computer can hold.
    #[error("{role} \"{name}\" varies by {size:e}: between {:e} and {:e} powers can be computed; give the channel in another unit", SMALLEST, LARGEST)]
    Size {
        /// input, output or reference.
        role: &'static str,
        name: String,
        /// Its largest less its smallest value.
        size: f64,
    },
    /// A channel that drives is constant.
    #[error("{role} \"{name}\" is constant: it drives nothing; leave it out with --{role}")]
    Silent {
        /// input or reference.
        role: &'static str,
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
        names: Vec<String>,
    },
    /// The derived estimate needs as many references as inputs.
    #[error("{references} reference(s) cannot separate {inputs} input(s); name at least {inputs} commanded channels with --reference")]
    TooFewReferences { references: usize, inputs: usize },
    /// H2 needs a square system.
    #[error("H2 needs as many outputs as inputs, there are {outputs} and {inputs}; use h1 or hv")]
    NotSquare { outputs: usize, inputs: usize },
    /// Only spectra can be judged by where the noise is.
    #[error("{estimator:?} is defined on cross-spectra, {method} has none; use h1, or --method welch or multitaper")]
    NoSpectra { estimator: Direct, method: &'static str },
    /// No recording was given.
    #[error("no recording to estimate from; give at least one trial")]
    NoTrial,
    /// A trial cannot be transformed by Welch's method.
    #[error("trial {trial}: {source}")]
    Welch {
        /// Number of the trial, from 1.
        trial: usize,
        source: WelchError,
    },
    /// A trial cannot be transformed by the multitaper method.
    #[error("trial {trial}: {source}")]
    Multitaper {
        /// Number of the trial, from 1.
        trial: usize,
        source: MultitaperError,
    },
    /// A trial cannot be averaged over periods.
    #[error("trial {trial}: {source}")]
    Periodic {
        /// Number of the trial, from 1.
        trial: usize,
        source: PeriodicError,
    },
    /// A record has fewer spectral lines than a local fit needs.
    #[error("{lines} spectral lines are too few for a local fit over {needed}; record longer, or lower the half width or the order")]
    TooFewLines { lines: usize, needed: usize },
    /// A sample is not a number.
    #[error("trial {trial}: channel {channel} is not a finite number at sample {sample}; cut that stretch out or repair it")]
    NotFinite {
        /// Number of the trial, from 1.
        trial: usize,
        channel: usize,
        sample: usize,
    },
    /// No line of the references (or inputs) stands out of the noise.
    #[error("no line of \"{name}\" stands out of the noise; give the period of the excitation, or use another method")]
    NoLines { name: String },
    /// Trials cannot be pooled.
    #[error(transparent)]
    Pool(#[from] SpectraError),
}
