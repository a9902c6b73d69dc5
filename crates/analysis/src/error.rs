//! What can go wrong between files and results.

use crate::suggest::{did_you_mean, nearest};
use ndof_signal::RecordingError;
use ndof_sysid::{EstimateError, ResponseError};

/// Why a job could not be done: what is wrong, where, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum AnalysisError {
    /// A file that people write is not understood.
    #[error("{file}:{line}: {what}")]
    File {
        file: String,
        /// Line, from 1.
        line: usize,
        what: String,
    },
    /// A file that people write is understood and makes no sense.
    #[error("{file}: {what}")]
    Meaning { file: String, what: String },
    /// Models cannot be compared where the sizes of the errors are unknown.
    #[error(
        "{file} says nothing of the size of its errors, and without it models cannot be compared; add columns std_OUT_IN, or coherence_OUT_IN with a line `# averages: N`"
    )]
    ErrorsUnknown { file: String },
    /// Nothing is held between samples, or it does not matter.
    #[error(
        "`hold` is for recordings of forces that move positions or velocities; leave it out for a response from a file, for imposed motion and for accelerations"
    )]
    Hold,
    /// Ticks without what is held from one to the next.
    #[error(
        "a `hold` of read-after or read-before is for a command (`reference`) in the unit of the efforts, one an effort, that moves the limb with what holds it: here is none; leave `hold` out"
    )]
    Ticks,
    /// Several motions that would add up.
    #[error(
        "{inputs} are more imposed motions than {outputs} are efforts: efforts add up along an axis, motions do not; leave inputs out with `input`, or measure an effort for each"
    )]
    SumsOfMotion { inputs: String, outputs: String },
    /// A robot's joints cannot be judged.
    #[error(transparent)]
    Joints(#[from] ndof_joints::JointsError),
    /// The paper's cost has no impedance to look at.
    #[error("the paper's cost is that of an impedance, which has one effort for each motion; leave inputs out with `input`, or leave `cost` out")]
    PaperSums,
    /// A file cannot be read.
    #[error("{file}: cannot be read: {}", no_file(source))]
    Read { file: String, source: std::io::Error },
    /// No channel of that name.
    #[error("{file}: no channel \"{name}\"{}; the recording has: {}", did_you_mean(suggestion.as_deref()), available.join(", "))]
    NoChannel { file: String, name: String, suggestion: Option<String>, available: Vec<String> },
    /// No input could be told from the names.
    #[error(
        "{file}: no input channel among {}; name it with `input`, or call it force_… or torque_… (or pos_… or angle_… as the input of a position-controlled robot, with `input`)",
        available.join(", ")
    )]
    NoInput { file: String, available: Vec<String> },
    /// No output could be told from the names.
    #[error("{file}: no output channel among {}; name it with `output`, or call it pos_… or angle_…", available.join(", "))]
    NoOutput { file: String, available: Vec<String> },
    /// A channel has two roles.
    #[error("{file}: channel \"{name}\" is used twice among references, inputs and outputs; give each channel one role with `reference`, `input` and `output`")]
    TwoRoles { file: String, name: String },
    /// A channel that is called a force or a motion, in a unit of neither.
    #[error(
        "{file}: channel \"{name}\" is used as {role}, but its unit \"{unit}\" is not {}; correct it in the header, or give it with `channels={channels}` (with the right unit){}",
        if *current { "one of a force or motion" } else { "known" },
        if *current { "; a motor's current is that once it is multiplied by its constant and gear, as by a [transform] in a file for `channels`" } else { "" }
    )]
    UnknownUnit {
        file: String,
        name: String,
        /// input or output.
        role: &'static str,
        unit: String,
        /// All such channels with units that they may have, as `channels` takes them.
        channels: String,
        /// Whether it is a unit of electric current.
        current: bool,
    },
    /// Trials differ in what must agree.
    #[error("{file}: {what} is {found}, in {first} it is {expected}; give only trials of one experiment together")]
    TrialMismatch { file: String, what: &'static str, found: String, first: String, expected: String },
    /// Nothing is left after trimming.
    #[error("{file}: nothing is left of its {from_s} to {to_s} s after `start`, `stop` and `exclude`; widen them")]
    NothingLeft { file: String, from_s: f64, to_s: f64 },
    /// A recording does not hold what is asked of it.
    #[error("{file}: {source}")]
    Recording { file: String, source: RecordingError },
    /// The response cannot be estimated.
    #[error("{file}: {source}")]
    Estimate { file: String, source: EstimateError },
    /// Nothing repeats.
    #[error("channel \"{channel}\" does not repeat itself, so there is no period to average over; give it with `period`, or choose another `method`")]
    NoPeriod { channel: String },
    /// Rejection of segments by a method that has none.
    #[error("`robust` leaves out wrecked segments, and `method={method}` has none; take `method=welch`")]
    NoSegments { method: String },
    /// A stream by a method that needs the whole record.
    #[error("`method={method}` needs whole recordings, and `stream` reads them piece by piece; take `method=welch`")]
    NoStream { method: String },
    /// A sliding window that no recording fills.
    #[error("a window of {window_s} s is longer than the longest recording, {longest_s:.3} s; give a shorter `sliding`")]
    LongWindow { window_s: f64, longest_s: f64 },
    /// A sliding window without length.
    #[error("a window of {window_s} s that slides by {step_s} s; give `sliding` and `sliding_step` as seconds above zero")]
    Sliding { window_s: f64, step_s: f64 },
    /// Fewer than two fits, or nothing in common.
    #[error("nothing to compare: give at least two fits of the same model, channels and units")]
    NothingToCompare,
    /// Fits that are not whole subjects.
    #[error("{fits} fits are not subjects of {sessions} sessions each; give at least two subjects, all sessions of one after the other")]
    Sessions { fits: usize, sessions: usize },
    /// A band without frequencies.
    #[error("no frequency of the grid (0 to {nyquist_hz} Hz) lies in the band {low_hz}-{high_hz} Hz; widen `band`")]
    EmptyBand { low_hz: f64, high_hz: f64, nyquist_hz: f64 },
    /// More than a machine holds.
    #[error("{what}")]
    TooLarge { what: String },
    /// No recording at all.
    #[error("no recording; give at least one file")]
    NoRecording,
    /// A recording cannot be read or written.
    #[error(transparent)]
    Io(#[from] ndof_io::IoError),
    /// No model of that name.
    #[error("no model \"{name}\"{}; there is {available}", did_you_mean(suggestion.as_deref()))]
    UnknownModel { name: String, suggestion: Option<String>, available: String },
    /// A sensor that says one thing only.
    #[error("{file}: channel \"{name}\" is {value} throughout; check the sensor and its cable, or choose the channels with `input` and `output`")]
    Constant { file: String, name: String, value: f64 },
    /// One recording given twice.
    #[error("{file} holds the same samples as {first}; give each recording once: twice the same data is no more evidence")]
    SameTrial { file: String, first: String },
    /// Effort and motion of one axis that do not belong together.
    #[error(
        "{file}: {effort} and {motion} are paired, but one turns and the other does not; correct the unit with `channels`, or carry one over to the other by its lever arm"
    )]
    TurnAndShift { file: String, effort: String, motion: String },
    /// A block twice in one model.
    #[error("model \"{name}\" has {block} twice, which no data tell apart; name it once")]
    RepeatedBlock { name: String, block: String },
    /// Segments of which no frequency is seen.
    #[error("segments of {nperseg} samples see no frequency; take {least} samples or more with `nperseg`")]
    ShortSegment { nperseg: usize, least: usize },
    /// The last seconds, if only they count, never give an estimate.
    #[error("the last {last_s} s are too few for an estimate from segments of {segment_s} s; take more with `last`, or shorter segments with `nperseg`")]
    ShortLast { last_s: f64, segment_s: f64 },
    /// A schedule that the settings or the recordings do not allow.
    #[error("{what}")]
    Schedule { what: String },
    /// Matrices over a schedule that the data do not determine.
    #[error("over the schedule: {0}")]
    Scheduled(#[from] ndof_models::schedule::ScheduleError),
    /// A force law that the settings or the recordings do not allow.
    #[error("{what}")]
    Law { what: String },
    /// A fit in time that is not possible.
    #[error("in time: {0}")]
    FreeRun(#[from] ndof_models::time::FreeRunError),
    /// The fit is not possible.
    #[error("fitting: {0}")]
    Fit(#[from] ndof_models::FitError),
    /// The kinematics make no sense.
    #[error("kinematics: {0}")]
    Kinematics(#[from] ndof_models::KinematicsError),
    /// The impedance cannot be projected.
    #[error("projecting to the joints: {0}")]
    Projection(#[from] ndof_models::ProjectionError),
    /// The diagnosis is not possible.
    #[error("diagnosing: {0}")]
    Diagnose(#[from] ndof_diagnose::DiagnoseError),
    /// The simulation is not possible.
    #[error("simulating: {0}")]
    Device(#[from] ndof_devices::DeviceError),
    /// A response cannot be converted.
    #[error(transparent)]
    Response(#[from] ResponseError),
}

impl AnalysisError {
    /// The error for a channel that `file` does not have, with the nearest of those that it has.
    pub fn no_channel(file: &str, name: &str, available: Vec<String>) -> Self {
        AnalysisError::NoChannel { file: file.to_owned(), name: name.to_owned(), suggestion: nearest(name, available.iter().map(String::as_str)), available }
    }
}

fn no_file(source: &std::io::Error) -> String {
    match source.kind() {
        std::io::ErrorKind::NotFound => "there is no such file; check the path".to_owned(),
        std::io::ErrorKind::IsADirectory => "it is a folder; name a file".to_owned(),
        _ => format!("{source}; check the path"),
    }
}

/// All of what threads have done side by side, or the error of the first that has one, whichever was met first.
pub fn in_order<T, E>(each: Vec<Result<T, E>>) -> Result<Vec<T>, E> {
    each.into_iter().collect()
}
