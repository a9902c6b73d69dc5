//! The noise of each joint's torque: what columns or a model leave of it.

use crate::causes::Form;
use crate::logged::Logged;
use crate::model::{Model, residual};
use crate::noise::Whitener;
use crate::scene::deviation;
use crate::search::Solved;
use crate::table::{Series, Table, View};
use rayon::prelude::*;
use std::sync::Arc;

/// The noise that all columns together leave of each torque, its deviation, and the samples that it is known by; weighed by the noise itself, which
/// takes a second pass.
pub(crate) fn noise_of(view: &View<'_>, forms: &[Form]) -> (Vec<Whitener>, Vec<f64>, Vec<f64>) {
    let (columns, _) = Table::distinct(forms);
    let series = view.series(&columns);
    let missing = view.missing(&Logged::as_it_is(view.scene.joints.len()));
    let mut noise = view.noise.clone();
    let (mut floor, mut left) = (vec![0.0; noise.len()], vec![0.0; noise.len()]);
    for _ in 0..2 {
        let (rest, own) = rest_of(&series, &missing, &noise);
        (noise, left) = noise_in(view, &rest, &own);
        floor = deviations(&rest, &own).into_iter().enumerate().map(|(j, floor)| floor / view.moving(j).sqrt()).collect();
    }
    (noise, floor, left)
}

/// The noise that a model leaves of each torque, and the samples that it is known by.
pub(crate) fn noise_beside(view: &View<'_>, model: &Model) -> (Vec<Whitener>, Vec<f64>) {
    let mut own = vec![0.0; view.noise.len()];
    for form in &model.forms {
        for series in view.series(&form.columns) {
            share_out(&series, &mut own);
        }
    }
    noise_in(view, &residual(view, model), &own)
}

/// The noise of what was left by so many factors of each joint, and the samples that it is known by.
fn noise_in(view: &View<'_>, rest: &Series, own: &[f64]) -> (Vec<Whitener>, Vec<f64>) {
    let mut noise = whiteners(rest, own);
    for (j, noise) in noise.iter_mut().enumerate() {
        // What is not compared at rest is no sign of little noise.
        noise.deviation /= view.moving(j).sqrt();
        if noise.deviation.is_nan() || noise.deviation <= 0.0 {
            // It never moves in what is fitted: nothing is known of its noise.
            *noise = Whitener::plain(view.scene.joints[j].torque);
        }
    }
    let left = own.iter().enumerate().map(|(j, own)| rest.of_joint(j).len() as f64 - own).collect();
    (noise, left)
}

/// Adds the factor of a column to the joints that feel it, each an equal part.
fn share_out(series: &Series, own: &mut [f64]) {
    let felt: Vec<usize> = (0..own.len()).filter(|j| series.0.iter().any(|p| p[*j].is_some())).collect();
    felt.iter().for_each(|j| own[*j] += 1.0 / felt.len() as f64);
}

/// Share of a joint's samples that may be given factors where its noise is asked for: more, and what they leave says little of it.
const FITTED_SHARE: f64 = 0.25;

/// What columns leave of the missing torques, and how many factors each joint has been given; those that explain most where there are too many.
fn rest_of(series: &[Arc<Series>], missing: &Series, noise: &[Whitener]) -> (Series, Vec<f64>) {
    let white: Vec<Arc<Series>> = series.par_iter().map(|s| Arc::new(s.whitened(noise))).collect();
    let table = Table::new(vec![], &white, &missing.whitened(noise));
    let most: Vec<f64> = (0..noise.len()).map(|j| FITTED_SHARE * missing.of_joint(j).len() as f64).collect();
    let mut own = vec![0.0; noise.len()];
    let solved = Solved::greedy(&table, |k| {
        let mut more = own.clone();
        share_out(&series[k], &mut more);
        let may = more.iter().zip(&own).zip(&most).all(|((more, own), most)| more == own || more <= most);
        if may {
            own = more;
        }
        may
    });
    let mut rest = missing.clone();
    for (k, factor) in solved.kept.iter().zip(solved.factors()) {
        rest.add(-factor, &series[*k]);
    }
    (rest, own)
}

/// The noise of each joint; its deviation is that of so many samples less the factors that were fitted to them.
fn whiteners(rest: &Series, own: &[f64]) -> Vec<Whitener> {
    own.iter()
        .enumerate()
        .map(|(j, own)| {
            let stretches: Vec<&[f64]> = rest.0.iter().filter_map(|p| p[j].as_deref()).collect();
            let n: usize = stretches.iter().map(|x| x.len()).sum();
            let mut noise = Whitener::of(&stretches);
            noise.deviation *= (n as f64 / (n as f64 - own).max(0.1 * n as f64)).sqrt();
            noise
        })
        .collect()
}

fn deviations(rest: &Series, own: &[f64]) -> Vec<f64> {
    own.iter()
        .enumerate()
        .map(|(j, own)| {
            let all = rest.of_joint(j);
            deviation(&all) * (all.len() as f64 / (all.len() as f64 - own).max(0.1 * all.len() as f64)).sqrt()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// With as many columns as samples nothing would be left, and noise of one would look like none.
    #[test]
    fn noise_is_not_what_as_many_columns_as_samples_leave() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut random = |_| 12_f64.sqrt() * (rng.random::<f64>() - 0.5);
        let mut column = || Series(vec![vec![Some((0..60).map(&mut random).collect())]]);
        let (missing, columns) = (column(), (0..80).map(|_| Arc::new(column())).collect::<Vec<_>>());
        let (rest, own) = rest_of(&columns, &missing, &[Whitener::plain(1.0)]);
        assert!(own[0] <= 15.0, "{own:?}");
        // Those that explain most by chance take more than their share.
        let found = deviations(&rest, &own)[0];
        assert!((0.4..1.2).contains(&found), "{found}");
    }
}
