//! What the pictures of an answer are drawn from.

use crate::answer::Answer;
use crate::held_out::predicted;
use crate::logged::Logged;
use crate::model::{Model, residual};
use crate::table::Series;
use ndof_diagnose::Pictures;
use ndof_models::robot::Robot;

/// Torques of the first held-out stretch, logged and predicted; and what is missing at each joint over its speed and angle.
pub(crate) fn draw(answer: &Answer<'_>) -> Pictures {
    let file = &Model::file(answer.joints());
    let (scene, held, fitted) = (answer.scene, answer.held, answer.fitted);
    let piece = &held.pieces[0];
    let range = piece.places.first().copied().unwrap_or(0)..piece.places.last().map_or(0, |p| p + 1);
    let cut = |torques: Vec<Vec<f64>>| -> Vec<Vec<f64>> { torques.into_iter().map(|t| t[range.clone()].to_vec()).collect() };
    // All that was fitted of its first trial.
    let trial = fitted.pieces[0].trial;
    let own: Vec<usize> = (0..fitted.pieces.len()).filter(|p| fitted.pieces[*p].trial == trial).collect();
    let places: Vec<usize> = own.iter().flat_map(|p| fitted.pieces[*p].places.iter().copied()).collect();
    let of = |series: &Series, j: usize| -> Vec<f64> { own.iter().flat_map(|p| series.0[*p][j].iter().flatten().copied()).collect() };
    let at = |series: &[Vec<f64>]| -> Vec<Vec<f64>> { series.iter().map(|x| places.iter().map(|p| x[*p]).collect()).collect() };
    let rest = residual(fitted, answer.model);
    // What a joint's own causes explain, apart from what bodies and channels do.
    let mut explained = vec![vec![0.0; places.len()]; answer.joints()];
    for (form, factors) in answer.model.forms.iter().zip(&answer.model.factors).filter(|(form, _)| form.cause.card.side == "joint") {
        for (series, factor) in fitted.series(&form.columns).iter().zip(factors) {
            if let Some(j) = form.joint {
                explained[j].iter_mut().zip(of(series, j)).for_each(|(e, x)| *e += factor * x);
            }
        }
    }
    let missing = explained.iter().enumerate().map(|(j, e)| of(&rest, j).into_iter().zip(e).map(|(r, e)| r + e).collect()).collect();
    let motion = &fitted.motions[trial];
    Pictures {
        sample_rate_hz: scene.rate_hz,
        start_s: answer.trials[piece.trial].start_s() + range.start as f64 / scene.rate_hz,
        band_hz: [0.0, held.band.pass_hz],
        outputs: answer.ports.inputs.iter().map(|i| answer.trials[0].channels()[*i].name.clone()).collect(),
        output_unit: "N m",
        measured: cut(held.motions[piece.trial].torque.clone()),
        baseline: cut(predicted(held, file, piece.trial)),
        extended: cut(predicted(held, answer.model, piece.trial)),
        axes: scene.chain.joints().names.clone(),
        units: ["rad", "rad/s", "N m"],
        position: at(&motion.q),
        velocity: at(&motion.v),
        missing,
        explained,
        added: if motion.beyond.is_empty() { vec![] } else { added(answer, file) },
    }
}

/// Torque that a simulator would have to be given along every whole trial, `[trial][joint][sample]`: less resistance where a cause adds some. What is
/// wrong with a channel is none.
fn added(answer: &Answer<'_>, file: &Model) -> Vec<Vec<Vec<f64>>> {
    let mut felt = answer.model.clone();
    felt.logged = Logged { tilt: felt.logged.tilt, ..Logged::as_it_is(answer.joints()) };
    (felt.forms, felt.factors) = felt.forms.into_iter().zip(felt.factors).filter(|(form, _)| form.cause.card.side != "sensor").unzip();
    let trial = |t| {
        let (own, more) = (predicted(answer.held, file, t), predicted(answer.held, &felt, t));
        own.into_iter().zip(more).map(|(own, more)| own.into_iter().zip(more).map(|(own, more)| own - more).collect()).collect()
    };
    (0..answer.trials.len()).map(trial).collect()
}
