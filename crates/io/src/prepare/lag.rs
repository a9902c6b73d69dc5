//! The lag between two samplings of one signal, from coarse to fine.

/// The largest drift between two clocks that is looked for, relative; crystals differ by some 1e-5.
pub(super) const MAX_DRIFT: f64 = 1e-3;

/// Samples that the coarsest comparison keeps, so that all lags can be tried.
const COARSE: usize = 4096;

/// The least overlap, as a share of the shorter signal.
const MIN_OVERLAP: f64 = 0.25;

/// Stretches whose own lags show the drift.
const STRETCHES: usize = 8;

/// Lags around the last level's that the next finer one tries.
const NEAR: isize = 4;

/// Where sample `k` of the first lies in the second: at `offset + (1 + drift) k`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    pub offset: f64,
    pub drift: f64,
}

/// Pearson's correlation of two signals of one length; NaN where one is constant.
pub(super) fn correlation(x: &[f64], y: &[f64]) -> f64 {
    let n = x.len() as f64;
    let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        let (dx, dy) = (x - mx, y - my);
        xx += dx * dx;
        yy += dy * dy;
        xy += dx * dy;
    }
    xy / (xx * yy).sqrt()
}

/// Offset and drift of `y` against `x`, right to about a sample; [`None`] if there is no lag at which they correlate.
pub(super) fn clock(x: &[f64], y: &[f64]) -> Option<Clock> {
    let longest = x.len().max(y.len());
    let mut block = 1;
    while longest / block > COARSE {
        block *= 2;
    }
    let (cx, cy) = (means(x, block), means(y, block));
    let all = (1 - cx.len() as isize)..(cy.len() as isize);
    let mut lag = best(&cx, &cy, all)?;
    while block > 1 {
        block /= 2;
        let (cx, cy) = (means(x, block), means(y, block));
        lag = best(&cx, &cy, 2 * lag - NEAR..2 * lag + NEAR + 1)?;
    }
    Some(drift(x, y, lag).unwrap_or(Clock { offset: lag as f64, drift: 0.0 }))
}

/// A line through the lags of stretches of the overlap.
fn drift(x: &[f64], y: &[f64], lag: isize) -> Option<Clock> {
    let (from, to) = overlap(x.len(), y.len(), lag);
    let stretch = (to - from) / STRETCHES;
    if stretch < 16 {
        return None;
    }
    let reach = (MAX_DRIFT * (to - from) as f64).ceil() as isize + 1;
    let mut points = Vec::with_capacity(STRETCHES);
    for s in 0..STRETCHES {
        let start = from + s * stretch;
        let part = &x[start..start + stretch];
        let shift = lag + start as isize;
        let tried = (-reach..=reach).filter_map(|d| {
            let at = usize::try_from(shift + d).ok()?;
            Some((d, correlation(part, y.get(at..at + stretch)?)))
        });
        if let Some((d, r)) = tried.filter(|(_, r)| !r.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1))
            && r > 0.5
        {
            points.push((start as f64 + 0.5 * stretch as f64, (lag + d) as f64));
        }
    }
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let (mk, ml) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = points.iter().map(|p| (p.0 - mk).powi(2)).sum();
    let drift = points.iter().map(|p| (p.0 - mk) * (p.1 - ml)).sum::<f64>() / spread;
    Some(Clock { offset: ml - drift * mk, drift })
}

/// The samples of the first that have a partner `lag` samples on in the second.
fn overlap(x: usize, y: usize, lag: isize) -> (usize, usize) {
    let from = (-lag).max(0) as usize;
    let to = (y as isize - lag).clamp(0, x as isize) as usize;
    (from.min(to), to)
}

/// The lag of the highest correlation among those with enough overlap.
fn best(x: &[f64], y: &[f64], lags: std::ops::Range<isize>) -> Option<isize> {
    let least = (MIN_OVERLAP * x.len().min(y.len()) as f64).max(8.0) as usize;
    let scored = lags.filter_map(|lag| {
        let (from, to) = overlap(x.len(), y.len(), lag);
        (to - from >= least).then(|| {
            let start = (from as isize + lag) as usize;
            (lag, correlation(&x[from..to], &y[start..start + to - from]))
        })
    });
    scored.filter(|(_, r)| !r.is_nan()).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(lag, _)| lag)
}

/// Means over blocks: a low-pass with fewer samples.
fn means(x: &[f64], block: usize) -> Vec<f64> {
    x.chunks_exact(block).map(|c| c.iter().sum::<f64>() / block as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_of_whole_samples_is_found_exactly() {
        // A sequence without repetition: the fractional parts of multiples of the golden ratio's square roots.
        let x: Vec<f64> = (0..20_000).map(|k| ((k * k) as f64 * 0.618_033_988_75).fract() + (k as f64 * 0.01).sin()).collect();
        for lag in [-3000isize, -1, 0, 17, 5000] {
            let y: Vec<f64> = (0..15_000).map(|k| usize::try_from(k - lag).ok().and_then(|i| x.get(i)).copied().unwrap_or(0.5)).collect();
            let found = clock(&x, &y).unwrap();
            assert!((found.offset - lag as f64).abs() < 1e-9 && found.drift.abs() < 1e-12, "{lag}: {found:?}");
        }
    }

    #[test]
    fn constants_have_no_lag() {
        assert_eq!(clock(&[1.0; 100], &[1.0; 100]), None);
        assert_eq!(clock(&[], &[]), None);
    }
}
