//! What pictures of a diagnosis are drawn from.

use crate::answer::Answer;
use crate::detectors;
use crate::search::{Chosen, Stand};

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

impl Pictures {
    pub(crate) fn new(answer: &Answer<'_>, chosen: &[Chosen], extended: &Stand) -> Self {
        let (subject, court, meaning) = (answer.subject, answer.court, answer.meaning);
        let first = |chosen: &[Chosen], stand: &Stand| court.predictions(subject, chosen, stand, 1).into_iter().flatten().next();
        let (before, after) = (first(&[], answer.baseline), first(chosen, extended));
        let measured = before.as_ref().or(after.as_ref()).map(|p| p.measured.clone()).unwrap_or_default();
        let state = &extended.state;
        let n = state.layout.axes;
        let apart = |interleaved: &[f64]| -> Vec<Vec<f64>> { (0..n).map(|i| interleaved.iter().skip(i).step_by(n).copied().collect()).collect() };
        let explained = subject.beyond(chosen, extended, 0);
        let (sample_rate_hz, start_s) = court.clock();
        let units = if meaning.rotational { ["rad", "rad/s", "rad/s²", "N m"] } else { ["m", "m/s", "m/s²", "N"] };
        let bins = &subject.layout.frequency_hz;
        Pictures {
            sample_rate_hz,
            start_s,
            band_hz: [bins[0], bins[bins.len() - 1]],
            outputs: if meaning.motion_imposed { meaning.effort_names.clone() } else { meaning.motion_names.clone() },
            output_unit: units[if meaning.motion_imposed { 3 } else { meaning.order.min(2) }],
            measured,
            baseline: before.map(|p| p.predicted).unwrap_or_default(),
            extended: after.map(|p| p.predicted).unwrap_or_default(),
            axes: meaning.axes.clone(),
            units: [units[0], units[1], units[3]],
            position: apart(&state.law_x[0]),
            velocity: apart(&state.law_v[0]),
            missing: detectors::residual(extended, &[]).into_iter().next().unwrap_or_default(),
            explained,
            added: answer.whole.map(|whole| whole.added(subject, chosen, extended, answer.baseline)).unwrap_or_default(),
        }
    }
}
