//! What a user may ask of a diagnosis.

/// Which part of the recordings the fit does not see.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum HeldOut {
    /// Of several trials the last third, of one the last 30 % of its time.
    #[default]
    Auto,
    /// The trials with these indices.
    Trials(Vec<usize>),
    /// From the first to the second time of every trial, in seconds since its first sample.
    Time(f64, f64),
}

/// Settings of a diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The band that is analysed; found from the data where it is not given.
    pub band_hz: Option<(f64, f64)>,
    /// What is held out.
    pub held_out: HeldOut,
    /// Size of a discrepancy that does not matter, as a share of the signal's standard deviation.
    pub tolerance: f64,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// At most so many causes are named.
    pub most_causes: usize,
    /// Resamples of the bootstrap.
    pub resamples: usize,
    /// Effects that are not tried.
    pub without: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Options { band_hz: None, held_out: HeldOut::Auto, tolerance: 0.01, seed: 0, most_causes: 4, resamples: 400, without: Vec::new() }
    }
}
