//! How much of the deviation from the mean movement a model foretells where it has not seen the data.

use super::ScheduleError;
use super::design::{Layout, Rows};
use super::moments::{Columns, Normal, Products};
use super::noise::whitened;
use super::penalised::penalised;
use ndarray::Array2;
use std::collections::BTreeMap;

/// Parts that blocks are dealt into, one after the other; each is held out once.
const FOLDS: usize = 5;

/// Rows and their whitened form, summed by folds.
pub(super) struct Folds {
    plain: Vec<Products>,
    white: Vec<Products>,
    all_plain: Products,
    all_white: Products,
}

impl Folds {
    /// `None` where there are fewer than two blocks.
    pub(super) fn new(rows: &Rows, autoregression: &[f64]) -> Option<Self> {
        let order: BTreeMap<usize, usize> = rows.block.iter().map(|b| (*b, 0)).collect();
        let order: BTreeMap<usize, usize> = order.into_keys().enumerate().map(|(k, b)| (b, k)).collect();
        let folds = FOLDS.min(order.len());
        if folds < 2 {
            return None;
        }
        let fold = |block: usize| order.get(&block).map_or(0, |k| k % folds);
        let white = whitened(rows, autoregression);
        Some(Folds {
            plain: Products::folds(rows, folds, fold),
            white: Products::folds(&white, folds, fold),
            all_plain: Products::of(rows),
            all_white: Products::of(&white),
        })
    }

    pub(super) fn count(&self) -> usize {
        self.plain.len()
    }

    /// 1 − Σ (y − ŷ)²/Σ (y − ȳ)² over all folds, each foretold by a fit to the others; ȳ is the others' mean over the schedule. The weights
    /// of the penalties are found anew each time, from `weights` on.
    pub(super) fn share(&self, layout: &Layout, columns: &Columns, output: usize, roughness: &Array2<f64>, weights: &[f64]) -> Result<f64, ScheduleError> {
        let (mut left, mut whole) = (0.0, 0.0);
        for (plain, white) in self.plain.iter().zip(&self.white) {
            let train = |columns: &[Vec<usize>], groups: &[usize], all: &Products, part: &Products| {
                let normal = Normal::new(&all.without(part), layout, columns, output)?;
                let start = (!groups.is_empty()).then_some(weights);
                penalised(&normal, columns.len(), groups, roughness, start).map(|fit| fit.beta)
            };
            let beta = train(&columns.summed, &columns.groups, &self.all_white, white)?;
            left += Normal::measured(plain, layout, &columns.summed, output).left(&beta);
            let mean = train(&[], &[], &self.all_plain, plain)?;
            whole += Normal::measured(plain, layout, &[], output).left(&mean);
        }
        Ok(1.0 - left / whole)
    }
}
