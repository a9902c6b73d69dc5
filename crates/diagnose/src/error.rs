//! Why a recording cannot be diagnosed.

use ndof_signal::RecordingError;
use ndof_sysid::PortsError;

/// Why a recording cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// There is nothing to diagnose.
    #[error("no recording; give at least one")]
    NoTrial,
    /// The roles of the channels do not fit.
    #[error(transparent)]
    Ports(#[from] PortsError),
    /// A channel holds something that is no number.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The balance of forces needs as many efforts as motions.
    #[error("{inputs} inputs and {outputs} outputs; a balance of forces needs one effort for each motion: choose with --input and --output")]
    Unequal {
        /// Number of inputs.
        inputs: usize,
        /// Number of outputs.
        outputs: usize,
    },
    /// One side must be effort and the other motion.
    #[error(
        "inputs and outputs must be forces (or torques) on one side and displacements, velocities or accelerations on the other; check the units of the channels"
    )]
    NotEffortAndMotion,
    /// Displacement, velocity and acceleration side by side.
    #[error("the motion channels measure different things; give displacements only, velocities only or accelerations only")]
    MixedMotion,
    /// Trials of different sample rates.
    #[error("trial {trial} has {found} samples a second, the first has {expected}; resample it")]
    Rates {
        /// The trial, from 1.
        trial: usize,
        /// Rate of the first.
        expected: f64,
        /// Rate of this one.
        found: f64,
    },
    /// Too few samples.
    #[error("trial {trial} has {samples} samples; at least 200 are needed: record longer, or leave it out")]
    TooShort {
        /// The trial, from 1.
        trial: usize,
        /// Its length.
        samples: usize,
    },
    /// A channel that does not move.
    #[error("channel \"{channel}\" of trial {trial} is constant; is it connected?")]
    Constant {
        /// The trial, from 1.
        trial: usize,
        /// The channel.
        channel: String,
    },
    /// Too narrow a band.
    #[error("the band {lo} to {hi} Hz holds too few independent frequencies; record longer or widen it with --band")]
    NoBand {
        /// Lower edge.
        lo: f64,
        /// Upper edge.
        hi: f64,
    },
    /// The linear model could not be fitted at all.
    #[error("the linear baseline cannot be fitted; are two channels copies of each other?")]
    BaselineFailed,
    /// The robot's side cannot be seen.
    #[error(
        "a device in the baseline needs commanded forces, measured forces and displacements on every axis; choose them with --reference, --input and --output"
    )]
    NoRobotSide,
    /// The simulated robot could not be balanced at all.
    #[error("the simulated robot cannot be where the recording says that it was; check [posture], lengths and the position channels' origin")]
    RobotFailed,
    /// A held-out stretch that the recording does not have.
    #[error("the held-out stretch, {from_s} to {to_s} s, is not within the recording, which is {duration_s:.2} s long")]
    HeldOutBeyond {
        /// Where it begins.
        from_s: f64,
        /// Where it ends.
        to_s: f64,
        /// What there is.
        duration_s: f64,
    },
    /// The held-out part makes no sense.
    #[error("the held-out part leaves {estimation} trial(s) of {samples} samples to fit and {held_out} to judge by; both need 200 samples or more")]
    HeldOut {
        /// Trials to fit.
        estimation: usize,
        /// Samples of each.
        samples: usize,
        /// Trials held out.
        held_out: usize,
    },
    /// A baseline for another number of axes.
    #[error("the baseline's {matrix} is not {axes} × {axes}, one row for each output")]
    Baseline {
        /// Which matrix.
        matrix: &'static str,
        /// How many axes there are.
        axes: usize,
    },
}
