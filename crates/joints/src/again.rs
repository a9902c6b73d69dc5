//! Whether torque is left that comes again with the motion, whatever its form.

use crate::blocks::BLOCKS;
use crate::held_out::Sum;
use crate::model::{Model, residual};
use crate::table::View;

/// What a joint lacks at one time, and where it is then.
struct Point {
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
                points.extend(seen.map(|(&place, &left)| Point { at: [motion.q[j][place] / size[0], motion.v[j][place] / size[1]], left }));
            }
        }
        of(&points)
    };
    (0..views[0].scene.joints.len()).map(joint).collect()
}

/// Of points in the order of their times.
fn of(points: &[Point]) -> Again {
    let block = points.len().div_ceil(BLOCKS).max(1);
    let product = |(k, point): (usize, &Point)| {
        let away = |other: &Point| (0..2).map(|i| (other.at[i] - point.at[i]).powi(2)).sum::<f64>();
        // Each pair once: two blocks would else scatter alike.
        let later = points.get(k + block..)?;
        later.iter().min_by(|a, b| away(a).total_cmp(&away(b))).map(|other| point.left * other.left)
    };
    let products: Vec<f64> = points.iter().enumerate().filter_map(product).collect();
    let blocks: Vec<f64> = products.chunks(block).map(|block| block.iter().sum()).collect();
    let (sum, count) = (Sum::of(&blocks), products.len().max(1) as f64);
    Again { products: sum, count, rms: (sum.value / count).max(0.0).sqrt() }
}
