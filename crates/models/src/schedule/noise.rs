//! Coloured errors: an autoregression takes out of each row what the rows before say of it.

use super::design::Rows;
use crate::time::noise::{Colour, add_moments, coefficients, whiten};
use faer::Mat;

/// The highest order that is tried: ten rows are five periods of the band's upper end.
const HIGHEST: usize = 10;

/// Coefficients of e_t = Σ a_k e_{t−k} + white, their number by Akaike's criterion, as one too many costs less than errors that
/// stay coloured; `residual` follows `rows`.
pub(super) fn autoregression(rows: &Rows, residual: &[f64]) -> Vec<f64> {
    let mut moments = Mat::zeros(HIGHEST + 1, HIGHEST + 1);
    for stretch in &rows.stretches {
        add_moments(&mut moments, 0.0, residual[stretch.clone()].iter().map(|e| vec![*e]), 1);
    }
    let count = residual.len() as f64;
    let power = moments[(HIGHEST, HIGHEST)];
    let of_order = |order: usize| {
        let index = |k: usize| if k < order { k } else { HIGHEST };
        let own = Mat::from_fn(order + 1, order + 1, |i, j| moments[(index(i), index(j))]);
        let a = coefficients(&own);
        let left = power - a.iter().enumerate().map(|(k, a)| a * own[(order, k)]).sum::<f64>();
        (count * left.ln() + 2.0 * order as f64, a)
    };
    let tried = (0..=HIGHEST).map(of_order).filter(|(criterion, _)| criterion.is_finite());
    tried.min_by(|a, b| a.0.total_cmp(&b.0)).map_or_else(Vec::new, |(_, a)| a)
}

/// The rows whitened by an autoregression; the first of each stretch, whose past is not known, are left out.
pub(super) fn whitened(rows: &Rows, autoregression: &[f64]) -> Rows {
    let order = autoregression.len();
    let colour = Colour { pole: 0.0, coefficients: autoregression.to_vec() };
    let mut out = Rows { width: rows.width, values: Vec::with_capacity(rows.values.len()), stretches: Vec::new(), block: Vec::new() };
    for stretch in &rows.stretches {
        let mut own = rows.values[stretch.start * rows.width..stretch.end * rows.width].to_vec();
        whiten(&mut own, rows.width, std::slice::from_ref(&colour));
        let kept = order.min(stretch.len());
        let begun = out.block.len();
        out.values.extend_from_slice(&own[kept * rows.width..]);
        out.block.extend_from_slice(&rows.block[stretch.start + kept..stretch.end]);
        out.stretches.push(begun..out.block.len());
    }
    out
}
