//! The noise of each joint's torque: what columns or a model leave of it.

use crate::causes::Form;
use crate::logged::Logged;
use crate::model::{Model, residual};
use crate::noise::Whitener;
use crate::search::Solved;
use crate::table::{Series, Table, View};
use ndof_signal::deviation;
use rayon::prelude::*;
use std::sync::Arc;

/// What no column explains of a joint's torque.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Floor {
    /// Its deviation while the joint moves.
    pub deviation: f64,
    /// Samples that it is known by, less the factors that were fitted to them.
    pub samples: f64,
}

/// The noise that all columns together leave of each torque, the floor that it is, and the samples that it is known by; weighed by the noise itself, which
/// takes a second pass.
pub(crate) fn noise_of(view: &View<'_>, forms: &[Form]) -> (Vec<Whitener>, Vec<Floor>, Vec<f64>) {
    // A form of several shapes has many columns for the one that it settles to: so many take noise, and say nothing of it.
    let plain: Vec<Form> = forms.iter().filter(|form| form.shape.len() < 2).cloned().collect();
    let (columns, _) = Table::distinct(&plain);
    let series = view.series(&columns);
    let missing = view.missing(&Logged::as_it_is(view.scene.joints.len()));
    let mut noise = view.noise.clone();
    let (mut deviation, mut left) = (vec![0.0; noise.len()], vec![0.0; noise.len()]);
    let moved = moved(view);
    for _ in 0..2 {
        let (rest, own) = rest_of(&series, &missing, &noise, &moved);
        (noise, left) = noise_in(view, &rest, &own);
        deviation = deviations(&rest, &own, &moved).into_iter().enumerate().map(|(j, floor)| floor / view.moving(j).sqrt()).collect();
    }
    let floor = deviation.iter().zip(&left).map(|(deviation, samples)| Floor { deviation: *deviation, samples: *samples }).collect();
    (noise, floor, left)
}

/// The noise that a model leaves of each torque, and the samples that it is known by.
pub(crate) fn noise_beside(view: &View<'_>, model: &Model) -> (Vec<Whitener>, Vec<f64>) {
    let (mut own, moved) = (vec![0.0; view.noise.len()], moved(view));
    for form in &model.forms {
        for series in view.series(&form.columns) {
            share_out(&series, &moved, &mut own);
        }
    }
    noise_in(view, &residual(view, model), &own)
}

/// The noise of what was left by so many factors of each joint, and the samples that it is known by.
fn noise_in(view: &View<'_>, rest: &Series, own: &[f64]) -> (Vec<Whitener>, Vec<f64>) {
    let moved = moved(view);
    let mut noise = whiteners(rest, own, &moved);
    for (j, noise) in noise.iter_mut().enumerate() {
        // What is not compared at rest is no sign of little noise.
        noise.deviation /= view.moving(j).sqrt();
        if noise.deviation.is_nan() || noise.deviation <= 0.0 {
            // It never moves in what is fitted: nothing is known of its noise.
            *noise = Whitener::plain(view.scene.joints[j].torque);
        }
    }
    let left = own.iter().zip(&moved).map(|(own, moved)| moved - own).collect();
    (noise, left)
}

/// Of each joint the samples in which it moves: at rest nothing is compared, and there are no more to fit or to know noise by.
fn moved(view: &View<'_>) -> Vec<f64> {
    (0..view.noise.len()).map(|j| view.moved(j) as f64).collect()
}

/// Adds the factor of a column to the joints that feel it, to each the part that it has of the samples.
fn share_out(series: &Series, moved: &[f64], own: &mut [f64]) {
    let felt: Vec<usize> = (0..own.len()).filter(|j| series.0.iter().any(|p| p[*j].is_some())).collect();
    let all: f64 = felt.iter().map(|j| moved[*j]).sum();
    felt.iter().filter(|j| moved[**j] > 0.0).for_each(|j| own[*j] += moved[*j] / all);
}

/// Share of a joint's samples that may be given factors where its noise is asked for: more, and what they leave says little of it.
const FITTED_SHARE: f64 = 0.25;

/// What columns leave of the missing torques, and how many factors each joint has been given; those that explain most where there are too many.
fn rest_of(series: &[Arc<Series>], missing: &Series, noise: &[Whitener], moved: &[f64]) -> (Series, Vec<f64>) {
    let white: Vec<Arc<Series>> = series.par_iter().map(|s| Arc::new(s.whitened(noise))).collect();
    let table = Table::new(vec![], &white, &missing.whitened(noise));
    let most: Vec<f64> = moved.iter().map(|moved| FITTED_SHARE * moved).collect();
    let mut own = vec![0.0; noise.len()];
    let solved = Solved::greedy(&table, |k| {
        let mut more = own.clone();
        share_out(&series[k], moved, &mut more);
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
fn whiteners(rest: &Series, own: &[f64], moved: &[f64]) -> Vec<Whitener> {
    let of = |j: usize| {
        let stretches: Vec<&[f64]> = rest.0.iter().filter_map(|p| p[j].as_deref()).collect();
        let mut noise = Whitener::of(&stretches);
        noise.deviation *= widened(own[j], moved[j]);
        noise
    };
    (0..own.len()).map(of).collect()
}

fn deviations(rest: &Series, own: &[f64], moved: &[f64]) -> Vec<f64> {
    (0..own.len()).map(|j| deviation(&rest.of_joint(j)) * widened(own[j], moved[j])).collect()
}

/// How many times as large noise is as what so many factors leave of so many samples of it.
fn widened(own: f64, moved: f64) -> f64 {
    if moved > 0.0 { (moved / (moved - own).max(0.1 * moved)).sqrt() } else { 1.0 }
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
        let (rest, own) = rest_of(&columns, &missing, &[Whitener::plain(1.0)], &[60.0]);
        assert!(own[0] <= 15.0, "{own:?}");
        // Those that explain most by chance take more than their share.
        let found = deviations(&rest, &own, &[60.0])[0];
        assert!((0.4..1.2).contains(&found), "{found}");
    }
}
