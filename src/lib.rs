#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

pub mod studies;

pub use ndof_analysis as analysis;
pub use ndof_devices as devices;
pub use ndof_diagnose as diagnose;
pub use ndof_io as io;
pub use ndof_joints as joints;
pub use ndof_models as models;
pub use ndof_report as report;
pub use ndof_signal as signal;
pub use ndof_study as study;
pub use ndof_sysid as sysid;

pub use ndof_analysis::{AnalysisError, Diagnose, Diagnosed, Estimate, Estimated, Fit, Fitted, HeldOut, MeasuredResponse, Question, Trial, Trials};
pub use ndof_study::{Design, Designed, StudyError};

/// The response of what was moved to the force on it, with coherences and confidence.
///
/// Roles follow from the channels: a command is a reference, a force an input, a displacement an output. With commands the estimate
/// is the derived one, which feedback does not bias. [`Estimate`] has every setting.
///
/// # Errors
/// [`AnalysisError`] if a role cannot be filled, trials differ or are too short, or inputs depend on each other.
///
/// ```
/// use ndof::Trial;
/// use ndof::signal::FilteredNoise;
///
/// let force = FilteredNoise { axes: 1, samples: 20_000, ..FilteredNoise::default() }.generate(1)?.remove(0); // N, at 500 Hz
/// let motion: Vec<f64> = force.iter().map(|f| f / 300.0).collect(); // a spring of 300 N/m
/// let trial = Trial::new(500.0).effort("x", force).displacement("x", motion)?;
/// let response = ndof::estimate([&trial])?;
/// assert!((response.result.direct.response.gain()[[0, 0, 5]] * 300.0 - 1.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn estimate<'a>(trials: impl IntoIterator<Item = &'a Trial>) -> Result<Estimated, AnalysisError> {
    Estimate::default().run(trials)
}

/// Asks what a simulation of these trials gets wrong, and why: inertia, damping and stiffness where no other baseline is given.
///
/// [`Question::run`] answers; [`Diagnose`] has every setting.
///
/// ```no_run
/// # fn example(trials: &[ndof::Trial]) -> Result<(), ndof::AnalysisError> {
/// let found = ndof::diagnose(trials).run()?;
/// for cause in &found.result.diagnosis.causes {
///     println!("{} at {}", cause.effect, cause.site.axis);
/// }
/// # Ok(())
/// # }
/// ```
pub fn diagnose<'a>(trials: impl IntoIterator<Item = &'a Trial>) -> Question<'a> {
    Question::new(trials)
}
