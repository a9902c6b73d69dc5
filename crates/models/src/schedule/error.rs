//! Why a scheduled fit is not possible.

/// Why inertia, damping and stiffness over a schedule cannot be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "a message says what its fields are")]
pub enum ScheduleError {
    /// Channels that do not belong together.
    #[error("{efforts} efforts and {motions} motions over {samples} samples; give one effort and one displacement an axis, all of one length")]
    Shape { efforts: usize, motions: usize, samples: usize },
    /// A gap.
    #[error("a channel holds what is no number; cut the gap out first")]
    NotFinite,
    /// Derivatives need room above the band.
    #[error("a band to {high_hz} Hz at {rate_hz} samples a second leaves no room for derivatives; take a `band` to {most_hz} Hz at most")]
    Band { high_hz: f64, rate_hz: f64, most_hz: f64 },
    /// Too few data for so many splines.
    #[error("{rows} independent samples for {needed} unknowns; record longer, take a wider `band`, or fewer `knots`")]
    TooShort { rows: usize, needed: usize },
    /// The motion does not tell the matrices apart.
    #[error(
        "the motion does not tell inertia, damping and stiffness apart at every place of the schedule; perturb every axis throughout, or take fewer `knots`"
    )]
    Undetermined,
}
