//! What is fitted, found and told of the spectra.

use super::{At, DAMPING, Experiment, MASS, PLAIN, ROBOT, STIFFNESS, held, only, outline, outline_of};
use crate::band::excited;
use crate::detectors::{burst, residual, tone, variation};
use crate::floor::{floor, own_motion};
use crate::generic;
use crate::hypotheses::Cache;
use crate::layout::filter;
use crate::remains::remains;
use crate::robot;
use crate::search::{Chosen, Found, Stand, whitened_power};
use crate::state::{Cause, State, Transform};
use crate::subject::{Subject, find_band};
use crate::whittle::Likelihood;
use ndof_models::effects::{Action, Matrix};
use ndof_models::{ForceLaw, Motion};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::sync::Arc;

fn stand(subject: &Subject) -> Stand {
    subject.stand(&[], &subject.start, 4).unwrap()
}

fn found(subject: &Subject) -> Found {
    subject.search(3, &mut |_| {}).unwrap()
}

const DRY: fn(&At) -> [f64; 2] = |at| [2.0 * (at.v[0] / 0.002).tanh(), 0.0];
/// Twice as much at rest as in motion.
const STRIBECK: fn(&At) -> [f64; 2] = |at| [(1.0 + (-(at.v[0] / 0.02).powi(2)).exp()) * (at.v[0] / 0.001).tanh(), 0.0];
const CUBIC: fn(&At) -> [f64; 2] = |at| [4e5 * at.x[0].powi(3), 0.0];

#[test]
fn the_matrices_of_the_plant_come_back_and_the_noise_is_that_of_the_channel() {
    for (imposed, robot) in [(false, None), (true, None), (false, Some(true)), (false, Some(false))] {
        let experiment = Experiment { axes: 2, imposed, robot, ..PLAIN };
        let subject = experiment.subject(&[]);
        assert!(matches!((&subject.cause, imposed, robot), (Cause::Motion, true, _) | (Cause::Effort, false, None) | (Cause::Loop(_), false, Some(_))));
        assert!(subject.structure.spring && subject.polarity > 0.2);
        let stand = stand(&subject);
        for (matrix, truth) in [(Matrix::Mass, MASS), (Matrix::Damping, DAMPING), (Matrix::Stiffness, STIFFNESS)] {
            let got = subject.matrix(&[], &stand, matrix);
            for i in 0..2 {
                for j in 0..2 {
                    assert!((got[i][j] - truth[i][j]).abs() < 0.01 * truth[i][i], "{imposed} {robot:?} {matrix:?} {i} {j}: {got:?}");
                }
            }
        }
        // White noise of σ = 0.05 at 200 Hz, seen at 100 Hz through a window of unit power.
        for power in &stand.fit.power {
            let mean = power.iter().sum::<f64>() / power.len() as f64;
            assert!((mean / (0.05f64.powi(2) / 2.0) - 1.0).abs() < 0.3, "{imposed} {robot:?}: {mean}");
        }
        let power = &stand.fit.power;
        let (share, tilt, rms) = own_motion(&subject, &stand, power, 0);
        // Of σ² the share of the band in 100 Hz.
        assert!((rms / (0.05 * (6.0f64 / 100.0).sqrt()) - 1.0).abs() < 0.2 && share < 1e-2 && (0.3..3.0).contains(&tilt), "{share} {tilt} {rms}");
        let floors: Vec<Value> = (0..3).map(|order| json!(floor(&subject, &stand, power, order, 0.25 * order as f64))).collect();
        let covariance = stand.fit.covariance();
        held(
            &format!("fit-{imposed}-{}", robot.map_or("none".to_owned(), |r| r.to_string())),
            &json!({
                "theta": stand.fit.theta, "log_likelihood": stand.fit.log_likelihood, "floors": floors, "covariance": covariance.a, "polarity": subject.polarity,
                "power": stand.fit.power.iter().map(|p| outline(p)).collect::<Vec<_>>(), "residual": stand.fit.residual.iter().map(|e| outline_of(e)).collect::<Vec<_>>(),
                "own": (0..2).map(|axis| own_motion(&subject, &stand, power, axis)).collect::<Vec<_>>(),
                "scale": [subject.scale.position, subject.scale.centre, subject.scale.velocity, subject.scale.effort],
                "price": subject.price(3), "restores": subject.restores(&[], &stand),
            }),
        );
    }
}

#[test]
fn a_robot_is_known_from_what_it_was_told_to_do() {
    for unit in [true, false] {
        let experiment = Experiment { axes: 2, robot: Some(unit), ..PLAIN };
        let (samples, _) = experiment.samples();
        let subject = experiment.subject(&[]);
        let state = State::new(&subject.layout, &subject.effort, &subject.motion, &subject.centre, &[]);
        let robot = robot::fit(&state, &samples.reference, unit).unwrap();
        assert!(robot.rest < 1e-6, "{}", robot.rest);
        for (z, s) in robot.impedance.iter().zip(&subject.layout.sj) {
            let want = ROBOT[0] * s * s + ROBOT[1] * s + ROBOT[2];
            assert!(
                (z[0] - want).norm() < 0.02 * want.norm() && (z[3] - want).norm() < 0.02 * want.norm() && z[1].norm() < 0.02 * want.norm(),
                "{unit} {s}: {z:?}"
            );
        }
        // What lies between reference and effort: Z times the motion.
        let power = |v: &[Complex64]| v.iter().map(Complex64::norm_sqr).sum::<f64>();
        let part: f64 = (0..2)
            .map(|i| {
                let [x, v, a] = [0, 1, 2].map(|order| &state.kinematics[order][i]);
                let moved: Vec<Complex64> = (0..x.len()).map(|k| ROBOT[0] * a[k] + ROBOT[1] * v[k] + ROBOT[2] * x[k]).collect();
                power(&moved) / power(&state.effort_spectra[i]) / 2.0
            })
            .sum();
        assert!((robot.part / if unit { part } else { 1.0 } - 1.0).abs() < 0.02, "{unit}: {} {part}", robot.part);
        // A reference that wanders leaves a rest.
        let mut wandering = samples.reference.clone();
        for (i, x) in wandering.iter_mut().flatten().enumerate() {
            let size = if unit { 0.5 } else { 0.05 } * (i + 1) as f64;
            x.iter_mut().enumerate().for_each(|(k, x)| *x += size * (1e-4 * (k * k) as f64).sin());
        }
        let loose = robot::fit(&state, &wandering, unit).unwrap();
        assert!(loose.rest > 1e-6 && loose.rest < 1.0, "{}", loose.rest);
        held(&format!("robot-{unit}"), &json!([loose.rest, loose.part, outline_of(&loose.impedance.concat())]));
    }
}

#[test]
fn the_determinants_slope_is_its_difference_and_white_noise_has_its_likelihood() {
    for (imposed, robot, series) in [(false, None, false), (false, Some(true), true), (true, None, true)] {
        let subject = Experiment { axes: 2, imposed, robot, ..PLAIN }.subject(&[]);
        let action = Action::Series(Arc::new(|s, k| 1.0 / (k[0] + s * k[1])));
        let transforms = if series { vec![Transform { action, axis: None, knobs: vec![4e3, 30.0] }] } else { vec![] };
        let state = State::new(&subject.layout, &subject.effort, &subject.motion, &subject.centre, &transforms);
        let base = crate::plant::Base::new(&state, &subject.cause, &subject.structure);
        let columns: Vec<_> = base.columns.iter().collect();
        let likelihood = Likelihood::new(&state, &subject.cause, &base.held);
        let fit = likelihood.fit(&columns, &subject.start, 4, true).unwrap();
        // At the maximum of the likelihood at a fixed S no step to either side gains.
        let theta = fit.theta.clone();
        let blocks: Vec<usize> = (0..subject.layout.blocks()).collect();
        // The score of the blocks that were fitted is minus their likelihood, but for the priors.
        let score = likelihood.score(&columns, &fit, &[], &blocks).unwrap();
        let prior: f64 = columns.iter().zip(&theta).map(|(c, t)| 0.5 * 0.9 * c.precision * t * t).sum();
        assert!((score + fit.log_likelihood + prior).abs() < 1e-6 * score.abs(), "{score} {} {prior}", fit.log_likelihood);
        // Two halves make the whole, and free offsets only help.
        let halves: f64 = [&blocks[..2], &blocks[2..]].iter().map(|b| likelihood.score(&columns, &fit, &[], b).unwrap()).sum();
        assert!((halves - score).abs() < 1e-6 * score.abs());
        let offsets: Vec<usize> = (0..columns.len()).filter(|c| matches!(base.roles[*c], crate::plant::Role::Offset(..))).collect();
        let plain = likelihood.fit(&columns, &subject.start, 2, false).unwrap();
        let half = Likelihood { blocks: Some(&[0, 3]), ..Likelihood::new(&state, &subject.cause, &base.held) };
        let some = half.fit(&columns, &subject.start, 2, true).unwrap();
        // Offsets that are free where they were not fitted only help.
        let freed = half.score(&columns, &some, &offsets, &[1, 2]).unwrap();
        let gained = half.score(&columns, &some, &[], &[1, 2]).unwrap() - freed;
        assert!((1e-6..20.0).contains(&gained), "{gained}");
        held(
            &format!("likelihood-{imposed}-{series}"),
            &json!([
                score,
                freed,
                theta,
                fit.log_likelihood,
                plain.theta,
                plain.log_likelihood,
                some.theta,
                some.log_likelihood,
                whitened_power(&plain.residual, &fit.power)
            ]),
        );
    }
}

/// f = z, ż = 9 (x of so long ago - z), on the second axis.
struct Behind(f64);

impl ForceLaw for Behind {
    fn states(&self) -> usize {
        1
    }

    fn delay_s(&self) -> f64 {
        self.0
    }

    fn evaluate(&self, motion: &Motion<'_>, states: &[f64], force: &mut [f64], rates: &mut [f64]) {
        force[1] += states[0];
        rates[0] = 9.0 * (motion.delayed_position[1] + 0.1 * motion.delayed_velocity[1] - states[0]);
    }
}

#[test]
fn what_a_transform_does_to_a_channel_is_undone() {
    let subject = Experiment { axes: 2, ..PLAIN }.subject(&[]);
    let of = |action: Action, axis: Option<usize>, knobs: &[f64]| Transform { action, axis, knobs: knobs.to_vec() };
    let turn = |k: &[f64]| vec![vec![k[0].cos(), -k[0].sin()], vec![k[0].sin(), k[0].cos()]];
    let all = [
        of(Action::Effort(Arc::new(|s, k| (s * k[0]).exp())), None, &[0.02]),
        of(Action::Effort(Arc::new(|_, k| k[0].into())), Some(1), &[1.3]),
        of(Action::Motion(Arc::new(|s, k| 1.0 + s * k[0])), None, &[0.03]),
        of(Action::Series(Arc::new(|s, k| 1.0 / (k[0] + s * k[1]))), None, &[4e3, 30.0]),
        of(Action::Mix(Arc::new(turn)), None, &[0.1]),
        of(Action::Motion(Arc::new(|s, k| 1.0 + s * k[0])), None, &[0.02]),
        of(Action::Effort(Arc::new(|s, k| 1.0 + s * k[0])), Some(0), &[0.01]),
    ];
    let clip = of(Action::Clip, None, &[3.0]);
    let new = |t: &[Transform]| State::new(&subject.layout, &subject.effort, &subject.motion, &subject.centre, t);
    let raw = new(&[]);
    let spectra = |s: &State| -> Vec<Value> {
        let chain = [s.chain.effort.iter().flatten().copied().collect::<Vec<_>>(), s.chain.motion.clone(), s.chain.series.clone()];
        s.effort_spectra.iter().chain(s.kinematics.iter().flatten()).map(|v| json!(outline_of(v))).chain(chain.iter().map(|c| json!(outline_of(c)))).collect()
    };
    let mut rows = Vec::new();
    let mut grown = raw.clone();
    for (k, t) in all.iter().enumerate() {
        // One at a time, and one more on those before: what was built at once is the same.
        let one = raw.with(t);
        let (a, b) = (spectra(&one), spectra(&new(std::slice::from_ref(t))));
        assert_eq!(a, b);
        rows.push(json!(a));
        grown = grown.with(t);
        assert_eq!(spectra(&grown), spectra(&new(&all[..=k])));
        let series = |tracks: &crate::state::Tracks| -> Vec<Vec<f64>> { tracks[0].iter().map(|t| raw.layout.filtered(t, |_| Complex64::ONE, None)).collect() };
        let same = |found: &[Vec<f64>], want: &[Vec<f64>]| {
            for (a, b) in found.iter().zip(want) {
                let size = (b.iter().map(|x| x * x).sum::<f64>() / b.len() as f64).sqrt();
                let middle = b.len() / 5..b.len() * 4 / 5;
                assert!(a[middle.clone()].iter().zip(&b[middle]).all(|(a, b)| (a - b).abs() < 0.02 * size), "{k}");
            }
        };
        same(&one.uncorrect_effort(series(&one.effort)), &series(&raw.effort));
        same(&one.uncorrect_motion(series(&one.motion), 0, &series(&raw.effort)), &series(&raw.motion));
    }
    rows.push(json!(spectra(&grown)));
    let clipped = raw.with(&clip);
    rows.push(json!(spectra(&clipped)));
    let clipped = raw.layout.whole(&clipped.effort[0][0]);
    assert!(clipped.iter().all(|f| f.abs() < 3.5) && raw.layout.whole(&raw.effort[0][0]).iter().any(|f| f.abs() > 3.5));
    held("transforms", &json!(rows));
    // Entries with a weight are so many times those without.
    let column = |w: f64| raw.entries_column(Matrix::Damping, &[(1, 0, w)]);
    let (one, more) = (column(1.0), column(-2.5));
    assert_eq!((more.parts[0].0, more.action[0].0, more.action[0].1), (1, 1, 0));
    assert!(one.parts[0].1.iter().zip(more.parts[0].1.iter()).all(|(a, b)| *b == a * -2.5));
    assert!(one.action[0].2.iter().zip(more.action[0].2.iter()).zip(&raw.layout.sj).all(|((a, b), s)| *b == a * -2.5 && (a - s).norm() <= 1e-12 * s.norm()));
    // Hidden states at a sample are those at the end of the motion up to it.
    for law in [Behind(0.0), Behind(0.3)] {
        assert_eq!(raw.hidden(&law, 1, 0), [0.0]);
        let forces = raw.forces_of(&law, 1);
        let z: Vec<f64> = (1..50).map(|k| raw.hidden(&law, 1, 37 * k)[0]).collect();
        assert!(z.iter().enumerate().all(|(k, z)| (z - forces[1][37 * (k + 1)]).abs() < 1e-12) && z.iter().any(|z| z.abs() > 1e-3));
        assert_eq!(raw.forces(&law)[1], forces);
        held(&format!("hidden-{}", law.0), &json!(z));
    }
}

#[test]
fn a_line_a_knock_and_a_change_are_seen_where_they_are() {
    let still = Experiment { noise: 0.1, ..PLAIN };
    let subject = still.subject(&[]);
    let rest = stand(&subject);
    let e = residual(&rest, &[]);
    assert!(tone(&rest, &e).is_none() && burst(&rest, &e).is_none());
    let calm = variation(&rest, &e);
    assert!(calm.abs() < 8.0, "{calm}");

    let subject = Experiment { extra: |at| [0.4 * (TAU * 4.37 * at.t).sin(), 0.0], ..still }.subject(&[]);
    let sung = stand(&subject);
    let found = tone(&sung, &residual(&sung, &[])).unwrap();
    assert!((found.frequency_hz - 4.37).abs() < 0.03 && (found.amplitude - 0.4).abs() < 0.04 && found.share > 0.5, "{found:?}");

    let subject = Experiment { extra: |at| [if at.trial == 1 && (9.0..9.5).contains(&at.t) { 3.0 * (TAU * (at.t - 9.0)).sin() } else { 0.0 }, 0.0], ..still }
        .subject(&[]);
    let knocked = stand(&subject);
    let knock = burst(&knocked, &residual(&knocked, &[])).unwrap();
    // Half a sine of 3 N over 0.5 s resists: an impulse of 3 / π.
    assert!(knock.trial == 1 && knock.from_s < 9.1 && knock.to_s > 9.4 && knock.to_s - knock.from_s < 4.0, "{knock:?}");
    assert!((knock.impulse.abs() * std::f64::consts::PI / 3.0 - 1.0).abs() < 0.25, "{knock:?}");

    let subject = Experiment { extra: |at| [60.0 * (TAU * at.t / 24.0).sin() * at.x[0], 0.0], ..still }.subject(&[]);
    let changed = stand(&subject);
    let z = variation(&changed, &residual(&changed, &[]));
    assert!(z > 20.0, "{z}");
    let all = [&rest, &sung, &knocked, &changed].map(|s| residual(s, &[]).iter().flatten().map(|e| outline(e)).collect::<Vec<_>>());
    held(
        "detected",
        &json!([
            calm,
            z,
            all,
            [found.frequency_hz, found.amplitude, found.height, found.share],
            [knock.from_s, knock.to_s, knock.impulse, knock.share, knock.peak, knock.size]
        ]),
    );
}

#[test]
fn tones_bursts_and_changes_are_as_they_were_seen() {
    let (samples, meaning) = Experiment { axes: 2, ..PLAIN }.samples();
    let subject = Subject::new(&samples, &meaning, &crate::Options { band_hz: Some((0.4, 6.0)), ..only(&[]) }, None).unwrap();
    let mut still = stand(&subject);
    // A residual whose power rises with frequency, and one whose power does not.
    for (axis, power) in still.fit.power.iter_mut().enumerate() {
        power.iter_mut().enumerate().for_each(|(k, p)| *p = 1e-3 * (1.0 + (axis * k) as f64 / 9.0));
    }
    let samples = subject.layout.samples;
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut with = |f: &dyn Fn(usize, usize, f64) -> f64, noise: f64| -> Vec<Vec<Vec<f64>>> {
        let mut series = |trial: usize, axis: usize| -> Vec<f64> {
            (0..samples).map(|k| f(trial, axis, k as f64 / 100.0) + noise * random.sample::<f64, _>(StandardNormal)).collect()
        };
        (0..2).map(|trial| (0..2).map(|axis| series(trial, axis)).collect()).collect()
    };
    let mut rows = Vec::new();
    for (f, size, axis) in [
        (0.6, 0.3, 0),
        (0.9, 0.1, 0),
        (1.4, 0.3, 1),
        (2.5, 0.05, 0),
        (5.9, 0.02, 1),
        (8.0, 0.1, 0),
        (20.3, 0.1, 1),
        (35.4, 0.2, 0),
        (36.6, 0.2, 0),
        (44.0, 0.3, 1),
    ] {
        let e = with(&|_, a, t| if a == axis { size * (TAU * f * t).sin() } else { 0.0 }, 0.05);
        rows.push(json!(tone(&still, &e).map(|t| [t.axis as f64, t.frequency_hz, t.amplitude, t.height, t.share])));
    }
    // A resonance is broader than a line; a line that wanders is still one.
    for wander in [0.03, 0.2, 0.6, 0.8, 1.0, 1.2, 1.5, 1.8, 2.0, 3.0] {
        let e = with(&|trial, _, t| 0.5 * (TAU * 3.3 * t + wander * (0.9 * t + trial as f64).sin() + wander * (2.3 * t).sin()).sin(), 0.05);
        rows.push(json!(tone(&still, &e).map(|t| [t.axis as f64, t.frequency_hz, t.amplitude, t.height, t.share])));
    }
    for (damping, f) in [(0.001, 2.9), (0.002, 4.1), (0.004, 5.3), (0.008, 3.7), (0.02, 4.9), (0.05, 2.1)] {
        let w = TAU * f;
        let mut e = with(&|_, _, _| 0.0, 1.0);
        e.iter_mut().flatten().for_each(|x| *x = filter(x, 100.0, |s| 0.02 + 0.1 * w * w / (s * s + 2.0 * damping * w * s + w * w)));
        rows.push(json!(tone(&still, &e).map(|t| [t.axis as f64, t.frequency_hz, t.amplitude, t.height, t.share])));
    }
    for (from, length, size, axis) in [
        (8.0, 0.3, 1.0, 0),
        (8.0, 0.3, 1.0, 1),
        (12.0, 2.0, 1.0, 0),
        (12.0, 6.0, 1.0, 1),
        (2.0, 0.5, 2.0, 0),
        (21.0, 0.5, 2.0, 1),
        (15.0, 0.2, 0.3, 0),
        (14.0, 1.0, 0.6, 1),
    ] {
        let e =
            with(&|trial, a, t| if trial == 0 && a == axis && (from..from + length).contains(&t) { size * (TAU * 1.7 * (t - from)).sin() } else { 0.0 }, 0.05);
        rows.push(json!(burst(&still, &e).map(|b| [b.trial as f64, b.axis as f64, b.from_s, b.to_s, b.impulse, b.share, b.peak, b.size])));
    }
    // Twice, or in both trials, is no burst.
    let twice = |both: bool| {
        move |trial: usize, _: usize, t: f64| if (8.0..8.3).contains(&t) && (both || trial == 0) || trial == 0 && (14.0..14.3).contains(&t) { 2.0 } else { 0.0 }
    };
    assert!(burst(&still, &with(&twice(false), 0.05)).is_none() && burst(&still, &with(&twice(true), 0.05)).is_none());
    for size in [0.0, 10.0, 100.0] {
        let e = with(&|trial, axis, t| size * (TAU * t / 15.0).sin() * super::motion(trial, axis, t)[axis], 0.05);
        rows.push(json!([variation(&still, &e)]));
    }
    held("seen", &json!(rows));
}

#[test]
fn the_excited_band_ends_where_the_motion_does() {
    let mut rows = Vec::new();
    for (imposed, robot, order, axes, trials) in
        [(false, None, 0, 1, 2), (true, None, 0, 2, 1), (false, Some(true), 0, 2, 3), (false, None, 1, 1, 2), (true, None, 2, 1, 30)]
    {
        let (samples, meaning) = Experiment { imposed, robot, order, axes, trials: trials.min(3), noise: 0.3, ..PLAIN }.samples();
        let samples = samples.pick(&(0..trials).map(|t| t % 3.min(trials)).collect::<Vec<_>>());
        let (lo, hi) = find_band(&samples, &meaning);
        assert!((3.0..12.0).contains(&hi) && lo <= 0.03 * hi, "{imposed} {robot:?} {order}: {lo} {hi}");
        rows.push([lo, hi]);
    }
    // Noise that a reference makes up to a corner, and noise of its own, on one or two channels.
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut white = |n: usize| -> Vec<f64> { (0..n).map(|_| random.sample(StandardNormal)).collect() };
    for (q, (samples, trials, channels, corner, noise, order, imposed)) in [
        (3000, 1, 1, 3.0, 0.02, 0, false),
        (3000, 2, 2, 9.0, 0.3, 0, false),
        (3000, 1, 2, 4.0, 1.0, 1, true),
        (1000, 4, 1, 20.0, 0.1, 2, true),
        (3000, 2, 1, 30.0, 0.05, 0, true),
        (200, 1, 1, 8.0, 0.1, 0, false),
        (3000, 1, 1, 1.0, 3.0, 1, false),
        (640, 9, 2, 12.0, 0.5, 1, false),
        (3000, 2, 1, 45.0, 1e-3, 0, false),
        (3000, 2, 1, 80.0, 1e-3, 2, true),
    ]
    .into_iter()
    .enumerate()
    {
        let mut sets = [vec![], vec![], vec![]];
        for _ in 0..trials {
            let cause: Vec<Vec<f64>> = (0..channels).map(|_| filter(&white(samples), 100.0, |s| (-(s.im / TAU / corner).powi(6)).exp().into())).collect();
            let add = |x: Vec<f64>, w: Vec<f64>, size: f64| -> Vec<f64> { x.iter().zip(w).map(|(x, w)| x + size * w).collect() };
            let effort: Vec<Vec<f64>> =
                cause.iter().map(|c| add(filter(c, 100.0, |s| 1.0 / (1.0 + 0.02 * s)), white(samples), noise * (corner / 50.0).sqrt())).collect();
            let motion = effort.iter().map(|f| add(filter(f, 100.0, |s| s.powi(order) * 1e3 / (s * s + 8.0 * s + 400.0)), white(samples), 0.01)).collect();
            sets[0].push(effort);
            sets[1].push(cause);
            sets[2].push(motion);
        }
        let view: Vec<Vec<Vec<&[f64]>>> = sets.iter().map(|s: &Vec<Vec<Vec<f64>>>| s.iter().map(|t| t.iter().map(Vec::as_slice).collect()).collect()).collect();
        let (lo, hi) = excited(&view[0], &view[1], &view[2], (order as usize, imposed), 100.0);
        assert!(lo >= 0.0 && lo < hi && hi < 42.0, "{q}");
        rows.push([lo, hi]);
    }
    let (samples, meaning) = PLAIN.samples();
    let short = find_band(&samples.cut(0, 70), &meaning);
    rows.push([short.0, short.1]);
    let short = find_band(&samples.cut(0, 300), &meaning);
    rows.push([short.0, short.1]);
    held("bands", &json!(rows));
}

#[test]
fn what_no_cause_explains_is_removed_by_powers_products_and_loops() {
    for (name, axes, extra) in [
        ("dry", 1, DRY),
        ("few", 1, |at| [6e3 * at.x[0].powi(2), 0.0]),
        ("cross", 2, (|at| [4e3 * at.x[0] * at.x[1], 900.0 * at.x[1] * at.v[1]]) as fn(&At) -> [f64; 2]),
        ("time", 1, |at| [30.0 * (at.t / 24.0 - 0.5) * at.x[0], 0.0]),
    ] {
        let subject = Experiment { axes, extra, trials: if name == "few" { 1 } else { 2 }, ..PLAIN }.subject(&[]);
        let found = found(&subject);
        let features = generic::features(&subject, &found.stand.state);
        let gate = generic::gate(&subject, &found.stand, &found, &features);
        let shares = generic::shares(&subject, &found.stand, &features);
        assert!((gate.beyond > 20.0) == (name != "cross") && gate.named.abs() < 1e-6 && gate.removed > 0.3 && gate.size > 0.0, "{name}: {gate:?}");
        let sum = shares.linear + shares.nonlinear + shares.varying + shares.noise;
        assert!((sum - 1.0).abs() < 1e-9, "{shares:?}");
        assert!(if name == "time" { shares.varying > 0.3 } else { shares.nonlinear > 0.3 }, "{name}: {shares:?}");
        let r = remains(&subject, &found.stand, &features).unwrap();
        let columns: Vec<Value> = features
            .each()
            .map(|f| {
                json!([
                    f.axis,
                    format!("{:?}", f.family),
                    f.column.parts.iter().map(|p| outline_of(&p.1)[2]).collect::<Vec<_>>(),
                    f.column.action.iter().map(|a| outline_of(&a.2)[2..5].to_vec()).collect::<Vec<_>>()
                ])
            })
            .collect();
        // Two blocks cannot be split.
        let outside = generic::held_out(&subject, &found.stand, &features.all());
        assert_eq!(outside.is_none(), name == "few");
        held(
            &format!("generic-{name}"),
            &json!({
                "gate": [gate.beyond, gate.beyond_error, gate.named, gate.removed, gate.size], "power": gate.power.iter().map(|p| outline(p)).collect::<Vec<_>>(),
                "shares": [shares.linear, shares.nonlinear, shares.varying, shares.noise], "columns": columns, "outside": outside,
                "remains": [r.band_hz[0], r.band_hz[1], r.share], "homes": r.homes.iter().map(|h| json!([h.axis, format!("{:?}", h.family), h.share])).collect::<Vec<_>>(),
            }),
        );
    }
}

#[test]
fn a_search_names_what_is_there_and_its_numbers() {
    for (name, experiment, effects, first, truth) in [
        ("stribeck", Experiment { extra: STRIBECK, noise: 0.01, ..PLAIN }, &["coulomb-friction"][..], "coulomb-friction", ("", 0.0)),
        ("dry", Experiment { extra: DRY, ..PLAIN }, &["coulomb-friction", "cubic-stiffness"][..], "coulomb-friction", ("level_n", 2.0)),
        (
            "cubic",
            Experiment { extra: CUBIC, imposed: true, ..PLAIN },
            &["coulomb-friction", "cubic-stiffness", "measurement-delay"],
            "cubic-stiffness",
            ("", 0.0),
        ),
        ("late", Experiment { late_s: 0.012, ..PLAIN }, &["measurement-delay", "channel-filter", "coulomb-friction"], "measurement-delay", ("delay_s", 0.012)),
        (
            "turned",
            Experiment { axes: 2, robot: Some(true), extra: DRY, ..PLAIN },
            &["sensor-misalignment", "coulomb-friction"],
            "coulomb-friction",
            ("level_n", 2.0),
        ),
    ] {
        let subject = experiment.subject(effects);
        let found = found(&subject);
        let lead = subject.hypotheses[found.chosen[0].hypothesis].effect.name();
        assert_eq!(lead, first, "{name}");
        let named: Vec<Value> = (0..found.chosen.len()).map(|q| json!(subject.named(&found.chosen, &found.stand, q))).collect();
        for p in subject.named(&found.chosen, &found.stand, 0).iter().filter(|p| p.name == truth.0) {
            let ndof_models::effects::Value::Number(x) = p.value else { panic!("{p:?}") };
            assert!((x / truth.1 - 1.0).abs() < 0.05, "{p:?}");
        }
        let steps: Vec<Vec<Value>> = found
            .steps
            .iter()
            .map(|s| s.judged.iter().map(|j| json!([j.hypothesis, j.gain, j.net, j.share, j.tried.knobs, j.tried.coefficients])).collect())
            .collect();
        let strict = subject.strict(&found.chosen, &found.stand.fit.power, 2).unwrap();
        held(
            &format!("search-{name}"),
            &json!({ "steps": steps, "worth": found.worth, "knobs": found.chosen.iter().map(|c| json!([c.hypothesis, c.knobs])).collect::<Vec<_>>(), "named": named, "strict": strict.fit.theta, "theta": found.stand.fit.theta }),
        );
        // A second step on the same stand, from what is stored or not, finds the same.
        let cache = Cache::new(&subject.hypotheses);
        let again = subject.step(&stand(&subject), &[], &cache);
        assert_eq!(again.judged[0].hypothesis, found.steps[0].judged[0].hypothesis);
        let taken = [Chosen { hypothesis: again.judged[0].hypothesis, knobs: again.judged[0].tried.knobs.clone() }];
        assert!(subject.step(&stand(&subject), &taken, &cache).judged.iter().all(|j| j.hypothesis != taken[0].hypothesis));
    }
}

#[test]
fn a_plant_without_a_spring_has_none_and_a_turned_effort_a_negative_polarity() {
    // The extra force takes the spring away.
    let free = Experiment { extra: |at| [-STIFFNESS[0][0] * at.x[0] - STIFFNESS[0][1] * at.x[1], 0.0], imposed: true, ..PLAIN };
    let subject = free.subject(&[]);
    assert!(!subject.structure.spring, "{:?}", stand(&subject).fit.theta);
    assert!(!subject.restores(&[], &stand(&subject)));
    // One of 1 N/m brings 1.5 kg back well above 0.05 Hz.
    let soft = Experiment { extra: |at| [-119.0 * at.x[0], 0.0], imposed: true, noise: 1e-3, ..PLAIN }.subject(&[]);
    assert!(soft.structure.spring && soft.restores(&[], &stand(&soft)), "{:?}", stand(&soft).fit.theta);
    // From some stiffness on it is more than chance.
    let springs: Vec<bool> = [
        (|at| [-120.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 80.0 * at.x[1]]) as fn(&At) -> [f64; 2],
        |at| [-119.5 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 79.5 * at.x[1]],
        |at| [-119.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 79.0 * at.x[1]],
        |at| [-118.5 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 78.5 * at.x[1]],
        |at| [-118.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 78.0 * at.x[1]],
        |at| [-117.5 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 77.5 * at.x[1]],
        |at| [-117.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 77.0 * at.x[1]],
        |at| [-116.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 76.0 * at.x[1]],
        |at| [-114.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 74.0 * at.x[1]],
        |at| [-110.0 * at.x[0] - 15.0 * at.x[1], -5.0 * at.x[0] - 70.0 * at.x[1]],
    ]
    .map(|extra| Experiment { axes: 2, imposed: true, noise: 0.5, extra, ..PLAIN }.subject(&[]).structure.spring)
    .to_vec();
    assert!(springs.contains(&true) && springs.contains(&false), "{springs:?}");
    held("springs", &json!(springs));
    let (mut samples, meaning) = PLAIN.samples();
    let polarity = Subject::new(&samples, &meaning, &only(&[]), None).unwrap().polarity;
    samples.turn(false);
    let turned = Subject::new(&samples, &meaning, &only(&[]), None).unwrap().polarity;
    assert!(polarity > 0.2 && (turned + polarity).abs() < 1e-3 * polarity, "{polarity} {turned}");
    // A band that a recording is far too short for is refused.
    for hi in [0.1, 1e-3] {
        let narrow = crate::Options { band_hz: Some((0.0, hi)), ..only(&[]) };
        assert!(matches!(Subject::new(&samples.cut(0, 1000), &meaning, &narrow, None), Err(crate::DiagnoseError::NoBand { .. })), "{hi}");
    }
}
