//! What an answer gives to be drawn.

use super::material::Answer;
use crate::detectors;
use crate::pictures::Pictures;
use crate::search::{Chosen, Stand};

impl Answer<'_> {
    pub(super) fn pictures(&self, chosen: &[Chosen], extended: &Stand) -> Pictures {
        let (subject, court, meaning) = (self.subject, self.court, self.meaning);
        let first = |chosen: &[Chosen], stand: &Stand| court.predictions(subject, chosen, stand, 1).into_iter().flatten().next();
        let (before, after) = (first(&[], self.baseline), first(chosen, extended));
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
            added: self.whole.map(|whole| whole.added(subject, chosen, extended, self.baseline)).unwrap_or_default(),
        }
    }
}
