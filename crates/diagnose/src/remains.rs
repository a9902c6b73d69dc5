//! Where lives what no known cause explains: on which axis, in which band, and as a function of what.

use crate::generic::{Family, Features};
use crate::search::Stand;
use crate::state::Column;
use crate::subject::Subject;
use crate::whittle::{Fit, Likelihood, Power};
use num_complex::Complex64;

/// A family that makes less than this share of the gain of all is not spoken of.
const SPOKEN: f64 = 0.25;

/// One family on one axis, and the share of the generic model's gain of log-likelihood that it has by itself.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Home {
    pub axis: usize,
    pub family: Family,
    pub share: f64,
}

/// Where what the generic model removes lives.
#[derive(Clone, Debug, Default)]
pub(crate) struct Remains {
    /// The families that alone make most of its gain, the largest first.
    pub homes: Vec<Home>,
    /// The part of the analysed band with most of what is removed, and its share.
    pub band_hz: [f64; 2],
    pub share: f64,
}

impl Family {
    /// "a function of …".
    pub fn words(self) -> &'static str {
        match self {
            Family::Lag => "linear dynamics beyond inertia, damping and stiffness",
            Family::Spring => "a force that depends on the displacement",
            Family::Damper => "a force that depends on the velocity",
            Family::Mixed => "a damping that changes with the displacement",
            Family::Loop => "a force that depends on where the displacement came from",
            Family::Cross => "products with the other axes, as geometry makes them",
            Family::Time => "a force that changes slowly with time",
        }
    }
}

impl Remains {
    /// One sentence, with the axes by these names.
    pub fn sentence(&self, axes: &[String]) -> String {
        let mut out = format!("it lives mostly from {:.2} to {:.2} Hz ({:.0} % of it)", self.band_hz[0], self.band_hz[1], 100.0 * self.share);
        let homes: Vec<String> = self
            .homes
            .iter()
            .map(|home| {
                let on = axes.get(home.axis).filter(|_| axes.len() > 1).map_or_else(String::new, |axis| format!("on {axis} "));
                format!("{on}{} ({:.0} % by itself)", home.family.words(), 100.0 * home.share)
            })
            .collect();
        if !homes.is_empty() {
            out.push_str(&format!("; what does most of it is {}", homes.join(", and ")));
        }
        out
    }
}

/// Takes what the generic model gains on a stand apart.
pub(crate) fn remains(subject: &Subject, stand: &Stand, features: &Features) -> Option<Remains> {
    let fit = |extra: &[&Column]| -> Option<Fit> {
        let columns: Vec<&Column> = stand.columns().chain(extra.iter().copied()).collect();
        Likelihood::new(&stand.state, &subject.cause, &stand.base.held).fit(&columns, &stand.fit.power, 2, true)
    };
    let whole = fit(&features.all())?;
    let level = stand.fit.log_likelihood;
    let gain = whole.log_likelihood - level;
    if gain.is_nan() || gain <= 0.0 {
        return None;
    }
    let mut kinds: Vec<(usize, Family)> = Vec::new();
    for f in features.each() {
        if !kinds.contains(&(f.axis, f.family)) {
            kinds.push((f.axis, f.family));
        }
    }
    let mut homes: Vec<Home> = kinds
        .into_iter()
        .filter_map(|(axis, family)| {
            let own: Vec<&Column> = features.each().filter(|f| (f.axis, f.family) == (axis, family)).map(|f| &f.column).collect();
            let share = (fit(&own)?.log_likelihood - level - subject.price(own.len())) / gain;
            Some(Home { axis, family, share })
        })
        .filter(|home| home.share > SPOKEN)
        .collect();
    homes.sort_by(|a, b| b.share.total_cmp(&a.share));
    let (band_hz, share) = densest(subject, &stand.fit.residual, &whole.residual, &stand.fit.power);
    Some(Remains { homes, band_hz, share })
}

/// The part of the band where most of the whitened power is removed, and its share of all that is.
fn densest(subject: &Subject, before: &[Vec<Complex64>], after: &[Vec<Complex64>], power: &Power) -> ([f64; 2], f64) {
    let layout = &subject.layout;
    let lines = layout.lines();
    let last = layout.frequency_hz[lines - 1];
    let removed = |lo: f64, hi: f64| -> f64 {
        let inside = |k: &usize| (lo..hi).contains(&layout.frequency_hz[*k]);
        let one = |i: usize, q: usize| (before[i][q].norm_sqr() - after[i][q].norm_sqr()) / power[i][q % lines];
        (0..before.len()).flat_map(|i| (0..before[i].len()).filter(|q| inside(&(q % lines))).map(move |q| (i, q))).map(|(i, q)| one(i, q)).sum()
    };
    let edges = [0.0, last / 12.0, last / 3.5, last / 1.8, last * (1.0 + 1e-9)];
    let total = removed(edges[0], edges[4]);
    let parts = edges.windows(2).map(|w| ([w[0], w[1].min(last)], removed(w[0], w[1]) / total));
    parts.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(([0.0, last], 1.0))
}
