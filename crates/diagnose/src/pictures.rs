//! What pictures of a diagnosis are drawn from.

/// Samples that show what numbers say: free runs over the first held-out trial, and the missing effort over the state of the
/// first trial that was fitted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// Rate of the runs (Hz).
    pub sample_rate_hz: f64,
    /// Time of their first sample since the recording began.
    pub start_s: f64,
    /// The analysed band (Hz).
    pub band_hz: [f64; 2],
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Their unit.
    pub output_unit: &'static str,
    /// Measured outputs in the analysed band, `[output][time]`.
    pub measured: Vec<Vec<f64>>,
    /// The baseline's free run; NaN where it diverges, empty where there is none.
    pub baseline: Vec<Vec<f64>>,
    /// The extended model's.
    pub extended: Vec<Vec<f64>>,
    /// Names of the axes of what follows.
    pub axes: Vec<String>,
    /// Units of displacement, velocity and effort.
    pub units: [&'static str; 3],
    /// Displacement from the mean, `[axis][time]`.
    pub position: Vec<Vec<f64>>,
    /// Velocity.
    pub velocity: Vec<Vec<f64>>,
    /// Effort that the matrices of the extended model leave over.
    pub missing: Vec<Vec<f64>>,
    /// Effort of the named causes that act as one.
    pub explained: Vec<Vec<f64>>,
    /// Effort along the extended model's run of each whole trial with which the baseline would run alike, `[trial][axis][time]`, at [`Pictures::sample_rate_hz`];
    /// empty unless it was asked for with [`Options::added`](crate::Options::added), or where nothing runs by itself.
    pub added: Vec<Vec<Vec<f64>>>,
}
