//! What models are worth on the part that no fit saw: the log-likelihood of its balance of forces, line by line.
//!
//! Laws follow the measured motion there. A free run follows its own: a limb's own force that dithers a friction is missing in it, so that it goes
//! elsewhere even with the true law, and most of its error is what this force does at the resonance. A difference of log-likelihoods,
//!
//! Δ = 0.9 Σ over blocks and lines of [Δ(-|e|²/S) + 2 Δ ln |det G|],
//!
//! has one noise S, that of what all causes together leave in the part that was fitted. Two models whose residuals lie δ apart gain Δ with a variance
//! of 1.8 φ Σ |δ|² / S, for the noise is Gaussian and of this spectrum, but for its size φ, that of what all causes leave here.

use crate::detectors::Tone;
use crate::floor;
use crate::hypotheses::Ground;
use crate::layout::Layout;
use crate::linear::dot;
use crate::result::NoiseFloor;
use crate::samples::Samples;
use crate::search::{Assembly, Channels, Chosen, ENOUGH, Stand};
use crate::state::{Cause, Column, Tracks};
use crate::subject::Subject;
use crate::whittle::{INDEPENDENCE, Likelihood, Power};
use num_complex::Complex64;
use std::sync::Arc;

/// Lines to each side of a tone that tell what there is without it.
const AROUND: usize = 10;

/// The part that no fit saw.
pub(crate) struct Unseen<'a> {
    subject: &'a Subject,
    layout: Arc<Layout>,
    cause: Cause,
    effort: Tracks,
    motion: Tracks,
    power: Power,
    /// Whether a line is not a tone's.
    counts: Vec<bool>,
}

/// What a model leaves of the unseen part.
#[derive(Clone, Debug)]
pub(crate) struct Rest {
    /// Residual over √S: real and imaginary parts of the lines that count.
    whitened: Vec<f64>,
    /// Log-likelihood, but for what is the same for all models.
    pub log_likelihood: f64,
}

impl<'a> Unseen<'a> {
    /// The part of these samples, `power` being what the best model leaves on the lines of the subject.
    pub fn new(samples: &Samples, subject: &'a Subject, power: &Power, tones: &[Tone]) -> Self {
        let lines = &subject.layout.frequency_hz;
        let band_hz = (lines[0], lines[lines.len() - 1]);
        let mut layout = Layout::new(samples.effort.len(), subject.layout.axes, samples.len(), samples.rate_hz, band_hz);
        layout.start_s = samples.start_s.first().copied().unwrap_or(0.0);
        layout.time_s = subject.layout.time_s;
        let layout = Arc::new(layout.following(&samples.schedule).about_movement(subject.layout.movement.as_ref().map(|m| m.splines())));
        let cause = match &subject.cause {
            Cause::Loop(z) => {
                let entries = z.first().map_or(0, Vec::len);
                let at = |q: usize| between(lines, &z.iter().map(|z| z[q]).collect::<Vec<_>>(), &layout.frequency_hz);
                let columns: Vec<Vec<Complex64>> = (0..entries).map(at).collect();
                Cause::Loop(Arc::new((0..layout.lines()).map(|k| columns.iter().map(|c| c[k]).collect()).collect()))
            }
            other => other.clone(),
        };
        let power = power.iter().map(|s| between(lines, s, &layout.frequency_hz)).collect();
        let counts = layout.frequency_hz.iter().map(|f| tones.iter().all(|tone| !reaches(tone, *f, &layout))).collect();
        Unseen { subject, effort: layout.tracks(&samples.effort), motion: layout.tracks(&samples.motion), cause, power, counts, layout }
    }

    /// A model's columns along this part, and their values but for what each trial has of its own.
    fn assembled(&self, chosen: &[Chosen], stand: &Stand) -> Option<(Assembly, Vec<f64>)> {
        let channels = Channels { layout: &self.layout, cause: &self.cause, effort: &self.effort, motion: &self.motion };
        let assembly = self.subject.assemble(&stand.base.structure, chosen, channels);
        let mut fitted = stand.base.roles.iter().zip(&stand.fit.theta).filter(|(role, _)| !role.of_a_trial()).map(|(_, value)| *value);
        let mut theta: Vec<f64> = assembly.base.roles.iter().map(|role| if role.of_a_trial() { Some(0.0) } else { fitted.next() }).collect::<Option<_>>()?;
        theta.extend(&stand.fit.theta[stand.base.columns.len()..]);
        (assembly.columns().count() == theta.len()).then_some((assembly, theta))
    }

    /// Residual over √S by equation, and ln |det G| of each line.
    fn left(&self, chosen: &[Chosen], stand: &Stand) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
        let (assembly, theta) = self.assembled(chosen, stand)?;
        self.left_of(&assembly, &theta)
    }

    fn left_of(&self, assembly: &Assembly, theta: &[f64]) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
        let free: Vec<usize> = assembly.base.roles.iter().enumerate().filter(|(_, role)| role.of_a_trial()).map(|(k, _)| k).collect();
        Likelihood::new(&assembly.state, &self.cause, &assembly.base.held).left(&assembly.columns().collect::<Vec<_>>(), theta, &self.power, &free)
    }

    /// What remains at best of this part: the power of the force that a model leaves in it, carried to the output from `from_hz` upward. A limb does not
    /// move by itself as much in one trial as in the next.
    pub fn floor(&self, chosen: &[Chosen], stand: &Stand, order: usize, from_hz: f64) -> Option<NoiseFloor> {
        let (assembly, theta) = self.assembled(chosen, stand)?;
        let (residual, _) = self.left_of(&assembly, &theta)?;
        let (lines, blocks) = (self.layout.lines(), self.layout.blocks());
        let of_equation = |(of, own): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            let here = |k: usize| (0..blocks).map(|b| 2 * (b * lines + k)).map(|q| own[q].powi(2) + own[q + 1].powi(2)).sum::<f64>() / blocks as f64;
            // Where a tone is the lines around it tell, as they did where the model was fitted.
            of.iter().enumerate().map(|(k, s)| if self.counts[k] { s * here(k) } else { *s }).collect()
        };
        let power = self.power.iter().zip(&residual).map(of_equation).collect();
        let nrmse = floor::at_most_all(self.carried(&assembly, &theta, &power, order, from_hz));
        Some(NoiseFloor { nrmse, how: "power of the force that the best model found leaves in the held-out part, carried to the output".to_owned() })
    }

    /// The error here, over the output's rms, of a model that leaves the force that it left where it was fitted, if that is the limb's own. In a hold it may be
    /// more than the output, which the hold keeps small.
    pub fn expected(&self, chosen: &[Chosen], stand: &Stand, order: usize, from_hz: f64) -> Option<Vec<Option<f64>>> {
        let (assembly, theta) = self.assembled(chosen, stand)?;
        let lines = &self.subject.layout.frequency_hz;
        let power = stand.fit.power.iter().map(|s| between(lines, s, &self.layout.frequency_hz)).collect();
        Some(self.carried(&assembly, &theta, &power, order, from_hz))
    }

    fn carried(&self, assembly: &Assembly, theta: &[f64], power: &Power, order: usize, from_hz: f64) -> Vec<Option<f64>> {
        let held = assembly.base.held.iter().map(|(column, value)| (column, *value));
        let columns: Vec<(&Column, f64)> = assembly.columns().zip(theta.iter().copied()).chain(held).collect();
        floor::carried((&self.layout, &self.cause), &assembly.state, &columns, power, order, from_hz)
    }

    /// What is slower makes no line here.
    pub fn slowest_hz(&self) -> f64 {
        floor::slowest_hz(&self.layout)
    }

    /// What a model leaves there; nothing where its balance has no likelihood.
    pub fn rest(&self, chosen: &[Chosen], stand: &Stand) -> Option<Rest> {
        self.left(chosen, stand).map(|left| self.rest_of(&left))
    }

    fn rest_of(&self, (residual, log_det): &(Vec<Vec<f64>>, Vec<f64>)) -> Rest {
        let lines = self.layout.lines();
        let counted =
            |e: &Vec<f64>| -> Vec<f64> { e.chunks_exact(2).enumerate().filter(|(k, _)| self.counts[k % lines]).flat_map(|(_, e)| [e[0], e[1]]).collect() };
        let whitened: Vec<f64> = residual.iter().flat_map(counted).collect();
        let logs: f64 = log_det.iter().zip(&self.counts).filter(|(_, counts)| **counts).map(|(log, _)| log).sum();
        let log_likelihood = INDEPENDENCE * (2.0 * logs * self.layout.blocks() as f64 - dot(&whitened, &whitened));
        Rest { whitened, log_likelihood }
    }

    /// A model with its matrices and factors fitted to this part, where that is likelier beyond chance: then this part is of another plant than the one that
    /// was fitted.
    pub fn refitted(&self, chosen: &[Chosen], stand: &Stand) -> Option<Stand> {
        // About a mean movement a model is one of the trials that it was fitted to.
        if self.subject.layout.movement.is_some() {
            return None;
        }
        let channels = Channels { layout: &self.layout, cause: &self.cause, effort: &self.effort, motion: &self.motion };
        let assembly = self.subject.assemble(&self.subject.structure, chosen, channels);
        let ground = Ground { state: &assembly.state, cause: &self.cause, base: &assembly.base, terms: &assembly.terms, power: &self.power };
        let mut fit = ground.fit(3)?;
        let own = self.rest_of(&self.left_of(&assembly, &fit.theta)?);
        let columns = assembly.columns().count() - assembly.base.roles.iter().filter(|role| role.of_a_trial()).count();
        let gain = own.log_likelihood - self.rest(chosen, stand)?.log_likelihood;
        if gain <= own.size() * (self.subject.price(columns) + ENOUGH) {
            return None;
        }
        // A free run shares offsets out among the trials that were fitted.
        let share = self.subject.layout.trials as f64 / self.layout.trials as f64;
        assembly.base.roles.iter().zip(&mut fit.theta).filter(|(role, _)| role.of_a_trial()).for_each(|(_, value)| *value *= share);
        let Assembly { state, base, terms, spans } = assembly;
        Some(Stand { state, base, terms, spans, fit, run: None })
    }

    /// Log-likelihood that a tone takes beyond what the lines around it have, beside a model; nothing where it has no line in the band.
    pub fn tone(&self, tone: &Tone, chosen: &[Chosen], stand: &Stand) -> Option<f64> {
        let lines = self.layout.lines();
        let its: Vec<usize> = (0..lines).filter(|k| reaches(tone, self.layout.frequency_hz[*k], &self.layout)).collect();
        let (first, last) = (*its.first()?, *its.last()?);
        let around: Vec<usize> = (first.saturating_sub(AROUND)..(last + 1 + AROUND).min(lines)).filter(|k| self.counts[*k]).collect();
        let (residual, _) = self.left(chosen, stand)?;
        let mean = |block: &[f64], of: &[usize]| of.iter().map(|k| block[2 * k].powi(2) + block[2 * k + 1].powi(2)).sum::<f64>() / of.len() as f64;
        let taken = |block: &[f64]| its.len() as f64 * (mean(block, &its) - mean(block, &around));
        (!around.is_empty()).then(|| INDEPENDENCE * residual[tone.axis].chunks_exact(2 * lines).map(taken).sum::<f64>())
    }

    /// Share of the complex numbers that the fit had which this part has.
    pub fn share(&self) -> f64 {
        self.layout.size() as f64 / self.subject.layout.size() as f64
    }
}

/// Models beside the best one.
impl Rest {
    /// Power of the noise here over that where the model was fitted.
    fn size(&self) -> f64 {
        dot(&self.whitened, &self.whitened) / (0.5 * self.whitened.len() as f64)
    }

    /// Standard deviation of Σ c Δ over pairs of models, this one being the best.
    fn deviation(&self, pairs: &[(f64, [&Rest; 2])]) -> f64 {
        let size = self.size();
        let apart =
            (0..self.whitened.len()).map(|k| pairs.iter().map(|(c, [from, to])| c * (from.whitened[k] - to.whitened[k])).sum::<f64>().powi(2)).sum::<f64>();
        (2.0 * INDEPENDENCE * size * apart).sqrt()
    }

    /// Log-likelihood gained from one model to another, with its 95 % interval, this one being the best.
    pub fn gain(&self, before: &Rest, after: &Rest) -> (f64, [f64; 2]) {
        let gain = after.log_likelihood - before.log_likelihood;
        let half = 1.96 * self.deviation(&[(1.0, [before, after])]);
        (gain, [gain - half, gain + half])
    }

    /// A gain as a share of all there is between a baseline and this model, and `more` beyond that, with its 95 % interval: nothing where there may be
    /// nothing to share.
    pub fn fraction(&self, [baseline, before, after]: [&Rest; 3], more: f64) -> (Option<f64>, Option<[f64; 2]>) {
        let (known, [low, _]) = self.gain(baseline, self);
        let whole = known + more;
        if low + more <= 0.0 {
            return (None, None);
        }
        let share = (after.log_likelihood - before.log_likelihood) / whole;
        let half = 1.96 * self.deviation(&[(1.0, [before, after]), (-share, [baseline, self])]) / whole;
        (Some(share), (half > 0.0).then_some([share - half, share + half]))
    }
}

/// Whether a tone reaches a frequency, as it did where it was masked.
fn reaches(tone: &Tone, frequency_hz: f64, layout: &Layout) -> bool {
    (frequency_hz - tone.frequency_hz).abs() < crate::detectors::TONE_REACH / layout.time_s
}

/// Values between the frequencies that they are known at.
fn between<T: Copy + std::ops::Add<Output = T> + std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>>(
    known: &[f64],
    values: &[T],
    wanted: &[f64],
) -> Vec<T> {
    let spacing = known[1] - known[0];
    let at = |f: &f64| {
        let place = ((f - known[0]) / spacing).clamp(0.0, (known.len() - 1) as f64);
        let below = (place as usize).min(known.len() - 2);
        values[below] + (values[below + 1] - values[below]) * (place - below as f64)
    };
    wanted.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn rest(whitened: Vec<f64>) -> Rest {
        Rest { log_likelihood: -INDEPENDENCE * dot(&whitened, &whitened), whitened }
    }

    /// Noise of power φ a line, and the same where a model misses δ.
    fn pair(random: &mut ChaCha8Rng, phi: f64, missed: &[f64]) -> [Rest; 2] {
        let noise: Vec<f64> = missed.iter().map(|_| (0.5 * phi).sqrt() * random.sample::<f64, _>(StandardNormal)).collect();
        [rest(noise.iter().zip(missed).map(|(e, d)| e + d).collect()), rest(noise)]
    }

    #[test]
    fn the_interval_of_a_gain_holds_what_noise_of_any_size_makes_of_it() {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        // Slow: a few lines have all of it.
        let missed: Vec<f64> = (0..200).map(|k| if k < 4 { 1.5 } else { 0.02 }).collect();
        let expected = INDEPENDENCE * dot(&missed, &missed);
        let draws = 4000;
        for phi in [0.5, 1.0, 3.0] {
            let holds = |[before, after]: [Rest; 2]| {
                let (_, [low, high]) = after.gain(&before, &after);
                (low..high).contains(&expected)
            };
            let held = (0..draws).filter(|_| holds(pair(&mut random, phi, &missed))).count() as f64 / f64::from(draws);
            // Lines that are independent vary less than those of a taper: 1.96 / √0.9 deviations hold 96.1 %, less 0.3 % for φ from 100 lines.
            assert!((held - 0.96).abs() < 4.0 * (0.96 * 0.04 / f64::from(draws)).sqrt(), "{held} at {phi}");
        }
    }

    #[test]
    fn shares_of_steps_add_up_and_the_whole_has_no_interval() {
        let mut random = ChaCha8Rng::seed_from_u64(8);
        let missed: Vec<f64> = (0..200).map(|k| if k % 3 == 0 { 1.0 } else { 0.3 }).collect();
        let [baseline, best] = pair(&mut random, 1.0, &missed);
        let between = rest(best.whitened.iter().zip(&missed).enumerate().map(|(k, (e, d))| e + if k % 3 == 0 { 0.0 } else { *d }).collect());
        let (first, interval) = best.fraction([&baseline, &baseline, &between], 0.0);
        let (second, _) = best.fraction([&baseline, &between, &best], 0.0);
        assert!((first.expect("a share") + second.expect("a share") - 1.0).abs() < 1e-12);
        assert!(interval.is_some_and(|[low, high]| low < first.unwrap_or(0.0) && high > first.unwrap_or(1.0)));
        assert_eq!(best.fraction([&baseline, &baseline, &best], 0.0), (Some(1.0), None));
        assert_eq!(best.fraction([&best, &best, &best], 0.0), (None, None), "nothing to share");
    }
}
