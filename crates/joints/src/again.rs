//! Whether torque is left that comes again with the motion, whatever its form.

use crate::blocks::BLOCKS;
use crate::held_out::Sum;
use crate::model::{Model, residual};
use crate::table::View;

/// What a joint lacks at one time, and where it is then.
struct Point {
    /// Trial and sample.
    when: [usize; 2],
    /// Angle and rate, each over its deviation.
    at: [f64; 2],
    left: f64,
}

/// What comes again of a joint's residual.
pub(crate) struct Again {
    /// Products of what is left at one time and at the next like it.
    products: Sum,
    /// How many.
    count: f64,
    /// Root of their mean (N m).
    pub rms: f64,
}

impl Again {
    /// Whether it is larger than this, beyond chance at this rate of false alarms.
    pub fn is_beyond(&self, size: f64, chance: f64) -> bool {
        let more = Sum { value: self.products.value - self.count * size * size, ..self.products };
        1.0 - more.positive() <= chance
    }
}

/// Noise does not know the motion: what is left where a joint has an angle and a rate, and where it next has nearly the same, is as often of one sign as of two. The
/// mean of such products is the power of what follows from angle and rate, of any form, or lasts (P. Durbin's difference estimates; A. J. Jones, New tools in non-linear
/// modelling and prediction, Comput. Manag. Sci. 1 (2004) 109).
///
/// Two times are no nearer to each other than a block of time, beyond which all intervals take noise as forgotten.
pub(crate) fn again(views: [&View<'_>; 2], model: &Model) -> Vec<Again> {
    let rests = views.map(|view| residual(view, model));
    let joint = |j: usize| {
        let scale = &views[0].scene.joints[j];
        let size = [scale.speed / (std::f64::consts::TAU * scale.pace_hz), scale.speed];
        let mut points = Vec::new();
        for (view, rest) in views.iter().zip(&rests) {
            for (piece, rest) in view.pieces.iter().zip(&rest.0) {
                let motion = &view.motions[piece.trial];
                let seen = piece.places.iter().zip(rest[j].iter().flatten()).filter(|(place, _)| motion.moves[j][**place]);
                points.extend(seen.map(|(&place, &left)| Point {
                    when: [piece.trial, place],
                    at: [motion.q[j][place] / size[0], motion.v[j][place] / size[1]],
                    left,
                }));
            }
        }
        points.sort_by_key(|point| point.when);
        of(&points)
    };
    (0..views[0].scene.joints.len()).map(joint).collect()
}

/// Of points in the order of their times.
fn of(points: &[Point]) -> Again {
    let block = points.len().div_ceil(BLOCKS).max(1);
    let products: Vec<f64> = nearest_later(points, block).into_iter().zip(points).filter_map(|(other, point)| Some(point.left * points[other?].left)).collect();
    let blocks: Vec<f64> = products.chunks(block).map(|block| block.iter().sum()).collect();
    let (sum, count) = (Sum::of(&blocks), products.len().max(1) as f64);
    Again { products: sum, count, rms: (sum.value / count).max(0.0).sqrt() }
}

/// For each point the nearest one at least so much later; each pair counts once, for two blocks would else scatter alike. In the order of their angles only those nearer
/// by angle alone are looked at.
fn nearest_later(points: &[Point], block: usize) -> Vec<Option<usize>> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| points[*a].at[0].total_cmp(&points[*b].at[0]));
    let mut found: Vec<Option<usize>> = vec![None; points.len()];
    for (place, &k) in order.iter().enumerate() {
        let own = points[k].at;
        let (mut best, mut least) = (None, f64::INFINITY);
        let mut look = |other: usize| {
            let across = (points[other].at[0] - own[0]).powi(2);
            let away = across + (points[other].at[1] - own[1]).powi(2);
            // The first in time of equals.
            if other >= k + block && (away < least || away == least && best.is_some_and(|best| other < best)) {
                (best, least) = (Some(other), away);
            }
            across <= least
        };
        // Each way until the angle alone is further off than what was found.
        order[place + 1..].iter().map_while(|other| look(*other).then_some(())).for_each(drop);
        order[..place].iter().rev().map_while(|other| look(*other).then_some(())).for_each(drop);
        found[k] = best;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn the_nearest_later_point_is_that_of_all_later_ones() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let points: Vec<Point> = (0..500).map(|_| Point { when: [0; 2], at: [0, 1].map(|_| rng.random_range(0..30) as f64), left: 0.0 }).collect();
        let away = |a: &Point, b: &Point| (0..2).map(|i| (a.at[i] - b.at[i]).powi(2)).sum::<f64>();
        let of_all = |k: usize| (k + 25..500).min_by(|a, b| away(&points[*a], &points[k]).total_cmp(&away(&points[*b], &points[k])));
        assert_eq!(nearest_later(&points, 25), (0..500).map(of_all).collect::<Vec<_>>());
    }

    /// Noise that knows nothing of the motion is of two signs as often as of one; a ripple over the angle is the same each time.
    #[test]
    fn a_ripple_comes_again_and_noise_does_not() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut log = |ripple: f64| -> Vec<Point> {
            let at = |k: usize| [(0.021 * k as f64).sin() + 0.3 * (0.05 * k as f64).cos(), (0.021 * k as f64).cos() - 0.7 * (0.05 * k as f64).sin()];
            let mut left = |q: f64| ripple * (24.0 * q).sin() + 12_f64.sqrt() * (rng.random::<f64>() - 0.5);
            (0..8000).map(|k| Point { when: [0, k], at: at(k), left: left(at(k)[0]) }).collect()
        };
        let (noise, ripple) = (of(&log(0.0)), of(&log(1.0)));
        assert!(!noise.is_beyond(0.0, 1e-3) && ripple.is_beyond(0.3, 1e-3), "{} {}", noise.rms, ripple.rms);
        // The mean square of a sine is a half; what the nearest place is off by takes some of it.
        assert!((0.5..0.75).contains(&ripple.rms), "{}", ripple.rms);
    }
}
