//! Whether torque is left that follows from angle and rate, whatever its form.

use crate::column::Column;
use crate::held_out::{Sum, losses};
use crate::model::{Model, residual};
use crate::search::Solved;
use crate::table::{Series, Table, View};

/// Highest order of the products of Legendre polynomials.
const ORDER: usize = 5;

/// What a model without physics gains beside a model.
pub(crate) struct Left {
    /// Log-likelihood of the held-out part, of each joint.
    pub gains: Vec<Sum>,
    /// What it removes of each torque's power, as a root (N m).
    pub removed: Vec<f64>,
}

/// The columns of one joint.
fn columns(joint: usize) -> Vec<Column> {
    let pairs = (0..=ORDER).flat_map(|angle| (0..=ORDER - angle).map(move |speed| (angle, speed)));
    pairs.filter(|pair| *pair != (0, 0)).map(|(angle, speed)| Column::Smooth { joint, angle, speed }).collect()
}

/// Fits the residual of a model by polynomials of each joint's own angle and rate, and looks what they predict of the part that no fit saw.
///
/// Each factor has a prior of the size that all of them together leave by chance: a ridge of as many units of noise as there are samples for each.
pub(crate) fn left(fitted: &View<'_>, held: &View<'_>, model: &Model) -> Left {
    let (seen, unseen) = (residual(fitted, model), residual(held, model));
    let (mut gains, mut removed) = (Vec::new(), Vec::new());
    for j in 0..fitted.noise.len() {
        let alone = |s: &Series| Series(s.0.iter().map(|p| p.iter().enumerate().map(|(i, x)| x.clone().filter(|_| i == j)).collect()).collect());
        let own = columns(j);
        let white = fitted.white(&own);
        let mut table = Table::new(vec![], &white, &alone(&seen).whitened(&fitted.noise));
        for k in 0..own.len() {
            table.gram[[k, k]] *= 1.0 + own.len() as f64 / table.samples.max(1) as f64;
        }
        let all: Vec<usize> = (0..own.len()).collect();
        let factors = Solved::default().with(&table, &all).of(&all);
        let mut explained = alone(&unseen);
        let before = explained.clone();
        for (series, factor) in held.series(&own).iter().zip(&factors) {
            explained.add(-factor, series);
        }
        let (a, b) = (losses(held, &before), losses(held, &explained));
        gains.push(Sum::of(&a.iter().zip(&b).map(|(a, b)| a - b).collect::<Vec<_>>()));
        let power = |s: &Series| s.dot(s) / s.count().max(1) as f64;
        removed.push((power(&before) - power(&explained)).max(0.0).sqrt());
    }
    Left { gains, removed }
}
