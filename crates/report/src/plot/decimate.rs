//! Long traces, drawn with no more points than pixels can show.

/// Of each run of points in one pixel column: the lowest and the highest, in their order.
///
/// Points must ascend in x; the first and the last point are kept, so that the curve spans what it spanned.
pub(crate) fn min_max(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    let mut start = 0;
    for run in points.chunk_by(|a, b| a.0.floor() == b.0.floor()) {
        let end = start + run.len();
        let (mut low, mut high) = (start, start);
        for k in start..end {
            if points[k].1 < points[low].1 {
                low = k;
            }
            if points[k].1 > points[high].1 {
                high = k;
            }
        }
        let ends = [(start == 0).then_some(0), (end == points.len()).then_some(end - 1)];
        let mut indices: Vec<usize> = ends[0].into_iter().chain([low.min(high), low.max(high)]).chain(ends[1]).collect();
        indices.dedup();
        kept.extend(indices.into_iter().map(|k| points[k]));
        start = end;
    }
    kept
}

/// Of each pixel column: its middle, the lowest of the lower ends and the highest of the upper ends.
pub(crate) fn envelope(points: &[(f64, f64, f64)]) -> Vec<(f64, f64, f64)> {
    let mut kept = Vec::new();
    let mut seen = 0;
    for run in points.chunk_by(|a, b| a.0.floor() == b.0.floor()) {
        seen += run.len();
        let (first, last) = (run[0].0, run[run.len() - 1].0);
        let x = match (kept.is_empty(), seen == points.len()) {
            (true, _) => first,
            (false, true) => last,
            (false, false) => 0.5 * (first + last),
        };
        let low = run.iter().fold(f64::INFINITY, |low, point| low.min(point.1));
        let high = run.iter().fold(f64::NEG_INFINITY, |high, point| high.max(point.2));
        kept.push((x, low, high));
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(count: usize) -> Vec<(f64, f64)> {
        let mut state = 1u64;
        (0..count)
            .map(|k| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (k as f64 * 400.0 / count as f64, (state >> 40) as f64)
            })
            .collect()
    }

    #[test]
    fn every_column_keeps_its_extremes_and_the_trace_its_ends() {
        let points = noise(25_000);
        let kept = min_max(&points);
        assert!(kept.len() <= 2 * 400 + 2, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[points.len() - 1]));
        for column in 0..400 {
            let inside = |set: &[(f64, f64)], pick: fn(f64, f64) -> f64, from: f64| {
                set.iter().filter(|point| point.0.floor() as i32 == column).fold(from, |best, point| pick(best, point.1))
            };
            assert_eq!(inside(&points, f64::min, f64::INFINITY), inside(&kept, f64::min, f64::INFINITY));
            assert_eq!(inside(&points, f64::max, f64::NEG_INFINITY), inside(&kept, f64::max, f64::NEG_INFINITY));
        }
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0), "order is kept");
    }

    #[test]
    fn a_short_trace_is_kept_as_it_is() {
        let points = noise(100);
        assert_eq!(min_max(&points), points);
        assert!(min_max(&[]).is_empty());
    }

    #[test]
    fn a_band_keeps_its_widest_extent() {
        let band: Vec<_> = noise(10_000).into_iter().map(|(x, y)| (x, -y, y + 1.0)).collect();
        let kept = envelope(&band);
        assert!(kept.len() <= 401);
        let widest = |set: &[(f64, f64, f64)]| set.iter().fold((0.0f64, 0.0f64), |best, point| (best.0.min(point.1), best.1.max(point.2)));
        assert_eq!(widest(&band), widest(&kept));
    }
}
