//! Held-out judgement: errors of free runs, their gain and its interval.

use crate::free_run::Prediction;
use crate::layout::{FEWEST_BLOCKS, Layout};
use crate::linear::Symmetric;
use crate::movement;
use crate::result::Score;
use crate::samples::{Meaning, Samples};
use crate::search::{Chosen, Stand};
use crate::state::{State, Tracks};
use crate::subject::Subject;
use ndof_models::schedule::Splines;
use ndof_sysid::two_sided_t;
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// The held-out part on the grid of the search.
pub(crate) struct Court {
    layout: Arc<Layout>,
    effort: Tracks,
    motion: Tracks,
    order: usize,
    motion_imposed: bool,
    pub windowed: bool,
    /// The channels as they were measured.
    raw: State,
    /// The mean movement of each output in the part that was fitted.
    mean: Option<(Splines, Vec<Vec<f64>>)>,
}

/// What a model leaves of the held-out outputs.
#[derive(Clone, Debug)]
pub(crate) struct Errors {
    pub score: Score,
    /// Error over the output's standard deviation, `[output][time]` of all trials, scored samples only; `trials` stretches of one length.
    pub signed: Vec<Vec<f64>>,
    pub trials: usize,
    /// Prediction over the output's standard deviation, likewise.
    pub predicted: Vec<Vec<f64>>,
    /// Scored samples per second, where they follow each other without a gap within a trial.
    pub rate_hz: Option<f64>,
}

impl Court {
    pub fn new(samples: &Samples, meaning: &Meaning, subject: &Subject, restoring: bool) -> Self {
        let band = &subject.layout.frequency_hz;
        let axes = subject.layout.axes;
        let mut layout = Layout::new(samples.effort.len(), axes, samples.len(), samples.rate_hz, (0.0, band[band.len() - 1]));
        layout.start_s = samples.start_s.first().copied().unwrap_or(0.0);
        layout.time_s = subject.layout.time_s;
        let layout = Arc::new(layout.following(&samples.schedule));
        let windowed = !meaning.motion_imposed && !restoring;
        let (effort, motion) = (layout.tracks(&samples.effort), layout.tracks(&samples.motion));
        Court {
            raw: State::new(&layout, &effort, &motion, &subject.centre, &[]),
            mean: subject.layout.movement.as_ref().map(|movement| {
                let (tracks, order) = if meaning.motion_imposed { (&subject.effort, 0) } else { (&subject.motion, meaning.order) };
                let series = |axis: usize| tracks.iter().map(|t| subject.layout.filtered(&t[axis], |s| s.powi(order as i32), None)).collect::<Vec<_>>();
                let mean = |axis: usize| movement.coefficients(&series(axis).iter().map(Vec::as_slice).collect::<Vec<_>>());
                (movement.splines(), (0..axes).map(mean).collect())
            }),
            effort,
            motion,
            layout,
            order: meaning.order,
            motion_imposed: meaning.motion_imposed,
            windowed,
        }
    }

    /// Samples of a block as the search takes them: what is slower makes one differ from the next.
    pub fn block(&self) -> usize {
        self.layout.block
    }

    /// Rate of the held-out samples, and the time of the first of them since its recording began.
    pub fn clock(&self) -> (f64, f64) {
        (self.layout.rate_hz, self.layout.start_s)
    }

    /// Free runs of a model over the first `trials` held-out trials.
    pub fn predictions(&self, subject: &Subject, chosen: &[Chosen], stand: &Stand, trials: usize) -> Vec<Option<Prediction>> {
        let runner = subject.runner(chosen, stand);
        let raw = &self.raw;
        let state = if stand.state.transforms.is_empty() {
            raw.clone()
        } else {
            State::new(&self.layout, &self.effort, &self.motion, &subject.centre, &stand.state.transforms)
        };
        let predict = |t| runner.predict(raw, &state, t, self.order, self.motion_imposed, self.windowed).map(|p| self.about_movement(p, t));
        (0..trials.min(self.layout.trials)).map(predict).collect()
    }

    /// Effort with which a plant without causes would run as a model does with them, trial by trial at the rate of this part, `[trial][axis][time]`;
    /// empty where a motion is imposed or nothing brings the plant back.
    pub fn added(&self, subject: &Subject, chosen: &[Chosen], extended: &Stand, baseline: &Stand) -> Vec<Vec<Vec<f64>>> {
        if self.motion_imposed || self.windowed {
            return vec![];
        }
        let (runner, plant) = (subject.runner(chosen, extended), subject.runner(&[], baseline));
        let added: Option<Vec<_>> = (0..self.layout.trials).map(|t| runner.added_to(&plant, &self.raw, t)).collect();
        added.unwrap_or_default()
    }

    /// A prediction about the mean movement; samples without a phase are of no error.
    fn about_movement(&self, mut prediction: Prediction, trial: usize) -> Prediction {
        let Some((splines, means)) = &self.mean else { return prediction };
        let Prediction { measured, predicted, .. } = &mut prediction;
        for (series, mean) in measured.iter_mut().zip(means).chain(predicted.iter_mut().zip(means)) {
            for (value, phase) in series.iter_mut().zip(self.layout.schedule_of(trial)) {
                *value = if phase.is_finite() { *value - movement::at(*splines, mean, *phase) } else { 0.0 };
            }
        }
        prediction
    }

    /// Free-run errors of a model.
    pub fn errors(&self, subject: &Subject, chosen: &[Chosen], stand: &Stand) -> Errors {
        let n = self.layout.axes;
        let predictions = self.predictions(subject, chosen, stand, self.layout.trials);
        let of_output = |i: usize| -> Vec<(f64, f64)> {
            let of_trial = |p: &Prediction| -> Vec<(f64, f64)> {
                p.measured[i].iter().zip(&p.predicted[i]).zip(&p.scored).filter(|(_, scored)| **scored).map(|((m, p), _)| (*m, *p)).collect()
            };
            predictions.iter().flatten().flat_map(of_trial).collect()
        };
        let pairs: Vec<Vec<(f64, f64)>> = (0..n).map(of_output).collect();
        Errors { rate_hz: (!self.windowed).then_some(self.layout.rate_hz), ..Errors::new(&pairs, predictions.iter().flatten().count()) }
    }
}

impl Errors {
    /// From measured and predicted samples of each output, all trials one after the other; an output without a finite error has no score.
    pub fn new(pairs: &[Vec<(f64, f64)>], trials: usize) -> Self {
        let mut errors = Errors { score: Score::default(), signed: Vec::new(), predicted: Vec::new(), trials, rate_hz: None };
        for pairs in pairs {
            let mean_of = |value: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>() / pairs.len() as f64;
            let mean = mean_of(&|(measured, _)| *measured);
            let variance = mean_of(&|(measured, _)| (measured - mean).powi(2));
            let bias = mean_of(&|(measured, predicted)| measured - predicted);
            let power = mean_of(&|(measured, predicted)| (measured - predicted).powi(2));
            let good = power.is_finite() && variance > 0.0;
            errors.score.nrmse.push(good.then(|| (power / variance).sqrt()));
            errors.score.vaf_percent.push(good.then(|| 100.0 * (1.0 - (power - bias * bias) / variance)));
            errors.signed.push(pairs.iter().map(|(measured, predicted)| (measured - predicted) / variance.sqrt()).collect());
            errors.predicted.push(pairs.iter().map(|(_, predicted)| predicted / variance.sqrt()).collect());
        }
        errors
    }

    /// What is left once a tone is predicted too, its amplitude and phase in each trial and output its own; nothing where time has gaps.
    pub fn without_tone(&self, frequency_hz: f64) -> Option<Errors> {
        let turn = std::f64::consts::TAU * frequency_hz / self.rate_hz?;
        let mut out = self.clone();
        for (i, output) in out.signed.iter_mut().enumerate() {
            let per = (output.len() / self.trials.max(1)).max(1);
            for trial in output.chunks_exact_mut(per) {
                // Least squares of a constant, which stays, and of cosine and sine.
                let row = |k: usize| [1.0, (turn * k as f64).cos(), (turn * k as f64).sin()];
                let (mut normal, mut right) = (Symmetric::zeros(3), [0.0; 3]);
                for (k, e) in trial.iter().enumerate() {
                    let of = row(k);
                    for r in 0..3 {
                        (0..=r).for_each(|c| normal.add(r, c, of[r] * of[c]));
                        right[r] += of[r] * e;
                    }
                }
                let fit = normal.factor()?.solve(&right);
                trial.iter_mut().enumerate().for_each(|(k, e)| *e -= fit[1] * row(k)[1] + fit[2] * row(k)[2]);
            }
            let mean = output.iter().sum::<f64>() / output.len() as f64;
            let power = output.iter().map(|e| e * e).sum::<f64>() / output.len() as f64;
            out.score.nrmse[i] = Some(power.sqrt()).filter(|_| power.is_finite());
            out.score.vaf_percent[i] = Some(100.0 * (1.0 - (power - mean * mean))).filter(|v| v.is_finite());
        }
        Some(out)
    }

    /// Root of the error's power that is gone in another's beyond chance, of the output where it is most, as a share of its standard deviation: the lower end
    /// of Student's 95 % interval of the mean over blocks of so many samples, at least four a trial. A prediction worse than none errs by no more than that.
    ///
    /// Of what a limb does by itself the power differs from one stretch to the next by far more than from one model to another.
    pub fn removed_by(&self, other: &Errors, per: usize) -> f64 {
        self.gone_in(other, per, |both| least_mean(&both.iter().map(gone).collect::<Vec<_>>()))
    }

    /// Root of the error's power that is gone in another's, of the output where it is most, as a share of its standard deviation; nothing unless the ratio of the
    /// two is above one beyond chance: its logarithm, by Student's 95 % interval of the mean over blocks of so many samples, at least four a trial.
    ///
    /// Where a plant changes powers of blocks differ by orders of magnitude, and an interval of their differences says nothing.
    pub fn taken_by(&self, other: &Errors, per: usize) -> f64 {
        self.gone_in(other, per, |both| {
            let ratios: Vec<f64> = both.iter().map(|[before, after]| (before / after.max(f64::MIN_POSITIVE)).ln()).collect();
            if least_mean(&ratios) > 0.0 { both.iter().map(gone).sum::<f64>() / both.len() as f64 } else { 0.0 }
        })
    }

    /// Root of what is found to be gone of an output's power by that of each block, before and after; of the output where it is most.
    fn gone_in(&self, other: &Errors, per: usize, found: impl Fn(&[[f64; 2]]) -> f64) -> f64 {
        let of_output = |(before, after): (&Vec<f64>, &Vec<f64>)| {
            let power = found(&self.powers(before, per).zip(self.powers(after, per)).map(|(before, after)| [before, after]).collect::<Vec<_>>());
            if power.is_finite() { power.max(0.0).sqrt() } else { 0.0 }
        };
        self.signed.iter().zip(&other.signed).map(of_output).fold(0.0, f64::max)
    }

    /// The score with the errors of a stretch, from and to as shares of all of the time, as much less as they are there from one score to another.
    pub fn with_part(&self, [from, to]: [f64; 2], [before, after]: [&Score; 2]) -> Score {
        let power = |errors: &[f64]| errors.iter().map(|e| e * e).sum::<f64>();
        let one = |(k, signed): (usize, &Vec<f64>)| {
            let [from, to] = [from, to].map(|share| (share * signed.len() as f64).round() as usize);
            let less = before.nrmse[k].zip(after.nrmse[k]).map_or(0.0, |(before, after)| 1.0 - (after / before).powi(2));
            self.score.nrmse[k].map(|all| all * (1.0 - power(&signed[from..to]) / power(signed) * less).max(0.0).sqrt())
        };
        Score { nrmse: self.signed.iter().enumerate().map(one).collect(), ..Score::default() }
    }

    /// Whether an output is predicted worse than by nothing at all.
    pub fn is_worse_than_none(&self) -> bool {
        self.score.nrmse.iter().any(|e| e.is_none_or(|e| e > 1.0))
    }

    /// Whether an output is predicted worse than by nothing at all: such a model is not adequate, even where chance alone might have made it so. Where more is
    /// `expected` of what a limb does by itself, the lower end of Student's 95 % interval of the error's power over blocks of so many samples, at least four a
    /// trial, has to be beyond that, too.
    pub fn is_lost(&self, expected: &[Option<f64>], per: usize) -> bool {
        let errors = self.score.nrmse.iter().zip(&self.signed).enumerate();
        let beyond = |(i, (nrmse, signed)): (usize, (&Option<f64>, &Vec<f64>))| {
            let by_itself = expected.get(i).copied().flatten().filter(|by_itself| *by_itself > 1.0);
            let is_more = |by_itself: f64| least_mean(&self.powers(signed, per).collect::<Vec<_>>()) > by_itself * by_itself;
            nrmse.is_none_or(|e| e > 1.0 && by_itself.is_none_or(is_more))
        };
        errors.into_iter().any(beyond)
    }

    /// Power of an output's error in each block of so many samples, at least four a trial.
    fn powers<'a>(&self, errors: &'a [f64], per: usize) -> impl Iterator<Item = f64> + use<'a> {
        let trial = (errors.len() / self.trials.max(1)).max(1);
        let per = per.min(trial / FEWEST_BLOCKS).max(1);
        let power = |block: &[f64]| block.iter().map(|e| e * e).sum::<f64>() / block.len() as f64;
        errors.chunks_exact(trial).flat_map(move |trial| trial.chunks_exact(per).map(power))
    }

    /// Shares of each output's variance that its error and it itself have below a frequency, `[output]`; nothing where time has gaps.
    ///
    /// The error's share holds its mean, as the error does.
    pub fn slower_than(&self, below_hz: f64) -> Vec<[f64; 2]> {
        let Some(rate_hz) = self.rate_hz else { return vec![] };
        let of_output = |(error, predicted): (&Vec<f64>, &Vec<f64>)| {
            let measured: Vec<f64> = error.iter().zip(predicted).map(|(e, p)| e + p).collect();
            let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
            let centred: Vec<f64> = measured.iter().map(|m| m - mean).collect();
            let per = (error.len() / self.trials.max(1)).max(1);
            [error, &centred].map(|series| {
                let trials = series.chunks_exact(per);
                let count = trials.len().max(1) as f64;
                trials.map(|trial| slow_power(trial, below_hz / rate_hz)).sum::<f64>() / count
            })
        };
        self.signed.iter().zip(&self.predicted).map(of_output).collect()
    }

    /// rms difference of two predictions on the output where it is largest, as a share of the output's standard deviation; nothing where one of them is
    /// not finite.
    pub fn distance(&self, other: &Errors) -> Option<f64> {
        let one = |(a, b): (&Vec<f64>, &Vec<f64>)| (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len().max(1) as f64).sqrt();
        self.predicted.iter().zip(&other.predicted).map(one).try_fold(0.0, |most: f64, next| next.is_finite().then(|| most.max(next)))
    }

    /// Mean over all outputs of the error's variance, as a share of the output's.
    pub fn variance(&self) -> Option<f64> {
        let shares: Option<Vec<f64>> = self.score.vaf_percent.iter().map(|v| v.map(|v| 1.0 - v / 100.0)).collect();
        shares.map(|s| s.iter().sum::<f64>() / s.len() as f64)
    }

    /// Mean square by blocks of so many samples, the mean over all outputs.
    fn blocks(&self, per: usize) -> Vec<f64> {
        let of = |output: &Vec<f64>| -> Vec<f64> {
            let trials = output.chunks_exact((output.len() / self.trials.max(1)).max(1));
            trials.flat_map(|trial| trial.chunks_exact(per).map(|block| block.iter().map(|e| e * e).sum::<f64>() / per as f64)).collect()
        };
        let outputs: Vec<Vec<f64>> = self.signed.iter().map(of).collect();
        (0..outputs.first().map_or(0, Vec::len)).map(|k| outputs.iter().map(|blocks| blocks[k]).sum::<f64>() / outputs.len() as f64).collect()
    }

    /// Mean of the squared relative error over all outputs.
    pub fn mean(&self) -> Option<f64> {
        let squares: Option<Vec<f64>> = self.score.nrmse.iter().map(|e| e.map(|e| e * e)).collect();
        squares.map(|s| s.iter().sum::<f64>() / s.len() as f64)
    }
}

/// What remains at best: this share of the error of the best model.
#[derive(Clone, Copy)]
pub(crate) struct Floor<'a> {
    pub best: &'a Errors,
    pub share: f64,
}

/// Share of what the baseline leaves above the floor that a step removes, with its 95 % interval from blocks of time drawn anew. Shares of steps
/// that follow each other add up.
///
/// Every error is of the same stretches of time, the floor's too: noise that all models leave alike moves no share.
pub(crate) fn explained(
    [baseline, before, after]: [&Errors; 3],
    floor: Floor<'_>,
    block_s: f64,
    duration_s: f64,
    resamples: usize,
    seed: u64,
) -> (Option<f64>, Option<[f64; 2]>) {
    let all = [baseline, floor.best, before, after];
    let means: Option<Vec<f64>> = all.iter().map(|errors| errors.mean()).collect();
    let Some(means) = means else { return (None, None) };
    let share = |powers: &[f64]| {
        let (whole, least) = (powers[0], floor.share * powers[1]);
        if whole > least { ((powers[2] - powers[3]) / (whole - least)).clamp(-1.0, 1.0) } else { 0.0 }
    };
    let length = before.signed.first().map_or(0, Vec::len);
    let trials = before.trials.max(1);
    let blocks = ((duration_s / block_s / trials as f64).floor() as usize).max(2usize.div_ceil(trials));
    let per = length / trials / blocks;
    if per == 0 || all.iter().any(|errors| errors.trials != before.trials || errors.signed.iter().any(|e| e.len() != length)) {
        return (Some(share(&means)), None);
    }
    let blocks = all.map(|errors| errors.blocks(per));
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = blocks[0].len();
    let mut draws: Vec<f64> = (0..resamples)
        .map(|_| {
            let mut powers = [0.0; 4];
            for _ in 0..count {
                let k = random.random_range(0..count);
                powers.iter_mut().zip(&blocks).for_each(|(power, blocks)| *power += blocks[k] / count as f64);
            }
            share(&powers)
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    let at = |q: f64| draws[((q * (draws.len() - 1) as f64).round() as usize).min(draws.len() - 1)];
    // A step that leaves what the best model leaves is all there is to explain in every draw: that is no interval.
    (Some(share(&means)), (!draws.is_empty()).then(|| [at(0.025), at(0.975)]).filter(|[low, _]| *low < 1.0))
}

/// Power that is gone of a block; a prediction worse than none errs by no more than that.
fn gone([before, after]: &[f64; 2]) -> f64 {
    before.min(1.0) - after.min(1.0)
}

/// Lower end of Student's 95 % interval of a mean.
fn least_mean(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
    mean - two_sided_t(0.95, count - 1.0) * (variance / count).sqrt()
}

/// Mean square of what is slower than so many periods a sample, by the lines of the whole series.
fn slow_power(series: &[f64], below: f64) -> f64 {
    let count = series.len() as f64;
    let line = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / count;
        let sum: Complex64 = series.iter().enumerate().map(|(t, x)| *x * Complex64::cis(turn * t as f64)).sum();
        (if k == 0 { 1.0 } else { 2.0 }) * (sum / count).norm_sqr()
    };
    (0..).take_while(|k| (*k as f64) < below * count).map(line).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two trials of ten seconds: an error of a constant, a period of a sine and fifty of another, and an output that is fast alone.
    #[test]
    fn of_an_error_its_mean_and_what_is_slower_count() {
        let wave = |periods: f64, k: usize| (std::f64::consts::TAU * periods * k as f64 / 1000.0).sin();
        let error: Vec<f64> = (0..2000).map(|k| 0.1 + 0.3 * wave(1.0, k) + 0.2 * wave(50.0, k)).collect();
        let predicted: Vec<f64> = error.iter().enumerate().map(|(k, e)| 1.4 * wave(30.0, k) - e).collect();
        let errors = Errors { score: Score::default(), signed: vec![error], predicted: vec![predicted], trials: 2, rate_hz: Some(100.0) };
        let [[slow, of_output]] = errors.slower_than(0.15)[..] else { panic!("an output") };
        assert!((slow - (0.01 + 0.5 * 0.09)).abs() < 1e-12 && of_output.abs() < 1e-12, "{slow} {of_output}");
        assert!(Errors { rate_hz: None, ..errors }.slower_than(0.15).is_empty());
    }

    /// Errors that are somewhat larger from block to block of a second: 1.4 and 1.2 are worse than none, and where the limb's own force lets 1.3 expect, 1.4
    /// alone is lost. One block of four beyond 1.3 is chance, and no prediction that is worth anything.
    #[test]
    fn a_prediction_is_lost_beyond_what_the_limb_does_by_itself() {
        let of = |level: &dyn Fn(usize) -> f64| {
            let at = |k: usize| (level(k / 100) * (1.0 + 0.01 * (k / 100) as f64) * if k.is_multiple_of(2) { 1.0 } else { -1.0 }, 0.0);
            let errors: Vec<(f64, f64)> = (0..400).map(at).collect();
            let nrmse = (errors.iter().map(|(e, _)| e * e).sum::<f64>() / 400.0).sqrt();
            let (score, signed) = (Score { nrmse: vec![Some(nrmse)], ..Score::default() }, vec![errors.iter().map(|(e, _)| *e).collect()]);
            Errors { score, signed, predicted: vec![vec![0.0; 400]], trials: 1, rate_hz: Some(100.0) }
        };
        let told = |errors: &Errors| [errors.is_worse_than_none(), errors.is_lost(&[], 100), errors.is_lost(&[Some(1.3)], 100)];
        assert_eq!(told(&of(&|_| 1.4)), [true, true, true]);
        assert_eq!(told(&of(&|_| 1.2)), [true, true, false]);
        assert_eq!(told(&of(&|block| if block == 0 { 2.4 } else { 0.9 })), [true, true, false]);
        assert_eq!(told(&of(&|_| 0.9)), [false; 3]);
        // Nothing excuses a model that does not run.
        let none = Errors { score: Score { nrmse: vec![None], ..Score::default() }, ..of(&|_| 1.2) };
        assert_eq!(told(&none), [true; 3]);
    }

    /// An error of 0.5 that is 0.4 in every block of another model, and one that is more in one block and less in the next.
    #[test]
    fn what_differs_from_block_to_block_removes_nothing() {
        let of = |level: &dyn Fn(usize) -> f64| Errors {
            score: Score::default(),
            signed: vec![(0..1000).map(|k| level(k / 100) * if k % 2 == 0 { 1.0 } else { -1.0 }).collect()],
            predicted: vec![vec![0.0; 1000]],
            trials: 2,
            rate_hz: Some(100.0),
        };
        let before = of(&|_| 0.5);
        assert!((before.removed_by(&of(&|_| 0.4), 100) - 0.3).abs() < 1e-9);
        // One trial of one block is divided: a single number has no interval.
        let alone = |level: f64| Errors { trials: 1, ..of(&|_| level) };
        assert!((alone(0.5).removed_by(&alone(0.4), 1000) - 0.3).abs() < 1e-9);
        let by_chance = of(&|block| if block % 2 == 0 { 0.3 } else { 0.6 });
        let power = |errors: &Errors| errors.signed[0].iter().map(|e| e * e).sum::<f64>();
        assert!(power(&by_chance) < power(&before) && before.removed_by(&by_chance, 100) == 0.0);
        assert_eq!(before.removed_by(&before, 500), 0.0);
        // By ratio: an error that varies by far from block to block, and is a tenth of it in each, is gone.
        let varies = |times: f64| of(&move |block| times * 4_f64.powi(block as i32 % 4) / 64.0);
        assert_eq!(varies(1.0).removed_by(&varies(0.1), 100), 0.0);
        let gone = power(&varies(1.0)) - power(&varies(0.1));
        assert!((varies(1.0).taken_by(&varies(0.1), 100) - (gone / varies(1.0).signed[0].len() as f64).sqrt()).abs() < 1e-9);
        assert_eq!([before.taken_by(&by_chance, 100), before.taken_by(&before, 100)], [0.0; 2]);
    }

    /// Half of the time has three quarters of the error's power, and is left with a ninth of them.
    #[test]
    fn a_part_of_the_time_may_have_a_model_of_its_own() {
        let sample = |k: usize| (if k.is_multiple_of(2) { 1.0 } else { -1.0 }, 1.0 - if k < 1000 { 0.1 } else { 0.1 * 3_f64.sqrt() });
        let pairs: Vec<(f64, f64)> = (0..2000).map(sample).map(|(x, share)| (x, share * x)).collect();
        let errors = Errors::new(&[pairs], 1);
        let score = |nrmse: f64| Score { nrmse: vec![Some(nrmse)], ..Score::default() };
        let left = errors.with_part([0.5, 1.0], [&score(0.9), &score(0.3)]).nrmse[0].expect("an error");
        let whole = errors.score.nrmse[0].expect("an error");
        assert!((left / whole - (0.25_f64 + 0.75 / 9.0).sqrt()).abs() < 1e-9, "{left} of {whole}");
    }
}
