//! Why a joint log cannot be judged.

use ndof_diagnose::DiagnoseError;
use ndof_signal::RecordingError;

/// Why a joint log cannot be judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JointsError {
    /// There is nothing to judge.
    #[error("no recording; give at least one")]
    NoTrial,
    /// Channels and joints do not match.
    #[error(
        "the robot has {} moving joints ({}), the recording {torques} torques and {angles} angles; it needs torque_J and angle_J of each joint J, or as many in the order of the joints: choose with `input` and `output`, or the end of the chain with `tip`",
        joints.len(), joints.join(", ")
    )]
    Channels {
        /// The robot's joints.
        joints: Vec<String>,
        /// Torque channels.
        torques: usize,
        /// Angle channels.
        angles: usize,
    },
    /// Numbers that no robot makes.
    #[error(
        "recording {trial}: angle, speed or torque of \"{joint}\" is beyond all bounds; check the units, or cut out where it swings up with `stop` or `exclude`"
    )]
    OutOfBounds {
        /// Its number, from 1.
        trial: usize,
        /// The joint.
        joint: String,
    },
    /// A simulator's logs are not as many as the measured ones.
    #[error("{measured} measured recordings and {simulated} simulated ones; give one of the simulator for each, in the same order")]
    SimulatedCount {
        /// Measured recordings.
        measured: usize,
        /// Simulated ones.
        simulated: usize,
    },
    /// A simulator's log is not the measured one sample by sample.
    #[error(
        "recording {trial}: {} samples at {} Hz were measured and {} at {} Hz simulated; let the simulator log the same commands at the same times",
        measured.0, measured.1, simulated.0, simulated.1
    )]
    SimulatedForm {
        /// Its number, from 1.
        trial: usize,
        /// Samples and rate of the measured one.
        measured: (usize, f64),
        /// Of the simulated one.
        simulated: (usize, f64),
    },
    /// Nothing moves.
    #[error("no joint moves by more than the noise of its encoder; command a movement over a good part of each joint's range")]
    Still,
    /// Too little is left.
    #[error(
        "{kept} samples are left to fit and {held_out} to judge by, in a band up to {pass_hz:.2} Hz and without the ends of the log; it takes {} and {}: record longer, or hold out another stretch",
        needed[0],
        needed[1]
    )]
    TooShort {
        /// Samples that are fitted.
        kept: usize,
        /// Samples that are held out.
        held_out: usize,
        /// Upper edge of the band.
        pass_hz: f64,
        /// How many it takes of each.
        needed: [usize; 2],
    },
    /// Trials of different rates.
    #[error("trial {trial} has {found} samples a second, the first has {expected}; resample it")]
    Rates {
        /// The trial, from 1.
        trial: usize,
        /// Rate of the first.
        expected: f64,
        /// Rate of this one.
        found: f64,
    },
    /// A channel holds something that is no number.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// What is held out makes no sense.
    #[error(transparent)]
    HeldOut(#[from] DiagnoseError),
}
