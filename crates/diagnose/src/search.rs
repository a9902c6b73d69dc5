//! Forward steps, each followed by a joint refinement, and a backward check.

use crate::hypotheses::{Cache, Ground, Hypothesis, Tried};
use crate::layout::Layout;
use crate::linear_fit::LinearFit;
use crate::optimise;
use crate::plant::{Base, Structure};
use crate::state::{Cause, Column, State, Tracks};
use crate::subject::{Subject, runs_away};
use crate::whittle::{Fit, Power, whitened_power};
use rayon::prelude::*;
use std::sync::Arc;

/// Penalised gain of log-likelihood from which a hypothesis is more than chance.
pub(crate) const ENOUGH: f64 = 6.0;
/// Smallest share of the whitened residual that a cause removes; what corrects all channels competes with the tolerances, which hide its share.
const SMALLEST_SHARE: f64 = 0.002;
/// What lies further behind the best on the grid is not refined.
const BEHIND: f64 = 60.0;
/// What gains less on its grid than this share of what it needs is not refined.
const PROMISING: f64 = 0.25;
/// Half of the 95 % quantile of χ² with one degree of freedom.
const AS_LIKELY: f64 = 1.92;
/// Knobs that differ by less than this share are of one valley.
const SAME: f64 = 0.05;
/// Rounds of joint refinement after a step.
const SWEEPS: usize = 2;

/// A hypothesis of the model, with its knobs.
#[derive(Clone)]
pub(crate) struct Chosen {
    pub hypothesis: usize,
    pub knobs: Vec<f64>,
}

/// A model fitted.
#[derive(Clone)]
pub(crate) struct Stand {
    pub state: State,
    pub base: Base,
    pub terms: Vec<Column>,
    /// For each chosen hypothesis the first of its terms and their number.
    pub spans: Vec<(usize, usize)>,
    pub fit: Fit,
    /// Log-likelihood of its free run, where its parameters are from that.
    pub run: Option<f64>,
}

/// Channels on a grid of blocks and frequencies: efforts and motions, and where the motion comes from.
#[derive(Clone, Copy)]
pub(crate) struct Channels<'a> {
    pub layout: &'a Arc<Layout>,
    pub cause: &'a Cause,
    pub effort: &'a Tracks,
    pub motion: &'a Tracks,
}

/// The columns of a model along some channels.
pub(crate) struct Assembly {
    pub state: State,
    pub base: Base,
    pub terms: Vec<Column>,
    /// For each chosen hypothesis the first of its terms and their number.
    pub spans: Vec<(usize, usize)>,
}

impl Stand {
    /// Columns of the baseline and then those of the causes.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.base.columns.iter().chain(&self.terms)
    }
}

/// A hypothesis as judged in a step.
#[derive(Clone)]
pub(crate) struct Judged {
    pub hypothesis: usize,
    pub tried: Tried,
    /// Log-likelihood above the model of the step.
    pub gain: f64,
    /// The gain less the price of its parameters.
    pub net: f64,
    /// Share of the whitened residual that it removes.
    pub share: f64,
}

/// One step of the search: everything that was tried, best first.
#[derive(Clone)]
pub(crate) struct Step {
    pub judged: Vec<Judged>,
}

/// The outcome of a search.
pub(crate) struct Found {
    pub chosen: Vec<Chosen>,
    pub stand: Stand,
    pub steps: Vec<Step>,
    /// For each chosen hypothesis the step that found it.
    pub step_of: Vec<usize>,
    /// Log-likelihood lost, net of the price, where the hypothesis is dropped.
    pub worth: Vec<f64>,
}

/// All of them but one.
pub(crate) fn but(chosen: &[Chosen], one: usize) -> Vec<Chosen> {
    chosen.iter().enumerate().filter(|(k, _)| *k != one).map(|(_, c)| c.clone()).collect()
}

impl Subject {
    /// The model of these hypotheses, fitted.
    pub fn stand(&self, chosen: &[Chosen], power: &Power, rounds: usize) -> Option<Stand> {
        self.stand_of(&self.structure, chosen, power, rounds)
    }

    /// The linear model with the matrices of a fit; what else there is, offsets and tolerances of the instruments, is fitted.
    pub fn stand_at(&self, fit: &LinearFit) -> Option<Stand> {
        self.stand_of(&Structure { given: fit.entries(), nominal: Vec::new(), ..self.structure.clone() }, &[], &self.start, 4)
    }

    /// The model of these hypotheses without anything that instruments may do within their tolerance.
    pub fn strict(&self, chosen: &[Chosen], power: &Power, rounds: usize) -> Option<Stand> {
        self.stand_of(&Structure { tolerances: false, ..self.structure.clone() }, chosen, power, rounds)
    }

    fn stand_of(&self, structure: &Structure, chosen: &[Chosen], power: &Power, rounds: usize) -> Option<Stand> {
        let Assembly { state, base, terms, spans } = self.assemble(structure, chosen, self.own());
        let ground = Ground { state: &state, cause: &self.cause, base: &base, terms: &terms, power };
        let fit = ground.fit(rounds)?;
        Some(Stand { state, base, terms, spans, fit, run: None })
    }

    /// Its own channels.
    pub fn own(&self) -> Channels<'_> {
        Channels { layout: &self.layout, cause: &self.cause, effort: &self.effort, motion: &self.motion }
    }

    /// The model of these hypotheses along channels.
    pub fn assemble(&self, structure: &Structure, chosen: &[Chosen], channels: Channels<'_>) -> Assembly {
        let transforms: Vec<_> =
            chosen.iter().filter(|c| self.hypotheses[c.hypothesis].corrects()).map(|c| self.hypotheses[c.hypothesis].transform(&c.knobs)).collect();
        let state = State::new(channels.layout, channels.effort, channels.motion, &self.centre, &transforms);
        let base = Base::new(&state, channels.cause, structure, self.arm(chosen));
        let mut terms = Vec::new();
        let mut spans = Vec::new();
        for c in chosen {
            let columns = if self.hypotheses[c.hypothesis].corrects() { vec![] } else { self.hypotheses[c.hypothesis].columns(&state, &c.knobs) };
            spans.push((terms.len(), columns.len()));
            terms.extend(columns);
        }
        Assembly { state, base, terms, spans }
    }

    /// What hypotheses are added to, in the noise that it leaves.
    pub fn ground<'a>(&'a self, stand: &'a Stand) -> Ground<'a> {
        Ground { state: &stand.state, cause: &self.cause, base: &stand.base, terms: &stand.terms, power: &stand.fit.power }
    }

    /// Tries every hypothesis on a model, in parallel; the order of the result does not depend on the threads.
    pub fn step(&self, stand: &Stand, taken: &[Chosen], cache: &Cache) -> Step {
        let ground = self.ground(stand);
        let level = stand.fit.log_likelihood;
        let net = |h: &Hypothesis, t: &Tried| t.fit.log_likelihood - level - self.price(h.form.cost());
        let open: Vec<usize> = (0..self.hypotheses.len())
            .filter(|i| taken.iter().all(|c| c.hypothesis != *i && !self.hypotheses[*i].repeats(&self.hypotheses[c.hypothesis])))
            .collect();
        let screened: Vec<(usize, Tried)> = open.par_iter().filter_map(|&i| ground.screen(&self.hypotheses, i, cache).map(|t| (i, t))).collect();
        let best = screened.iter().map(|(i, t)| net(&self.hypotheses[*i], t)).fold(f64::NEG_INFINITY, f64::max);
        let bar = best - (0.3 * best).max(BEHIND);
        let mut judged: Vec<Judged> = screened
            .par_iter()
            .filter_map(|(i, start)| {
                let h = &self.hypotheses[*i];
                let gain = start.fit.log_likelihood - level;
                let promising = gain >= PROMISING * (ENOUGH + self.price(h.form.cost())) && (net(h, start) >= bar || h.corrects());
                let tried = if promising { ground.refine(h, start, 28)? } else { start.clone() };
                self.judged(*i, tried, &stand.fit)
            })
            .collect();
        judged.sort_by(|a, b| b.net.total_cmp(&a.net).then(a.hypothesis.cmp(&b.hypothesis)));
        // Spectra of all but the leaders are no longer needed.
        judged.iter_mut().skip(1).for_each(|j| j.tried.fit.residual = Vec::new());
        Step { judged }
    }

    /// A hypothesis beside the fit without it; `None` where a knob rests at an end that tells of something else.
    fn judged(&self, hypothesis: usize, tried: Tried, without: &Fit) -> Option<Judged> {
        let form = &self.hypotheses[hypothesis].form;
        let gain = tried.fit.log_likelihood - without.log_likelihood;
        let share = 1.0 - whitened_power(&tried.fit.residual, &without.power) / whitened_power(&without.residual, &without.power);
        (!optimise::tells(&form.knobs, &tried.knobs)).then(|| Judged { hypothesis, gain, net: gain - self.price(form.cost()), share, tried })
    }

    /// Refines the knobs of each chosen hypothesis beside all others, in turns.
    fn sweep(&self, chosen: &mut [Chosen], mut stand: Stand) -> Option<Stand> {
        for _ in 0..SWEEPS {
            for q in 0..chosen.len() {
                let h = &self.hypotheses[chosen[q].hypothesis];
                if h.form.knobs.is_empty() {
                    continue;
                }
                let others = but(chosen, q);
                let ground_stand = self.stand(&others, &stand.fit.power, 1)?;
                let ground = Ground { power: &stand.fit.power, ..self.ground(&ground_stand) };
                let Some(start) = ground.evaluate(h, &chosen[q].knobs, 1) else { continue };
                let near = Hypothesis { effect: h.effect, form: around(h, &chosen[q].knobs) };
                if let Some(better) = ground.refine(&near, &start, 28) {
                    chosen[q].knobs = better.knobs;
                }
            }
            stand = self.stand(chosen, &stand.fit.power, 3)?;
            if chosen.len() == 1 {
                break;
            }
        }
        Some(stand)
    }

    /// The best of a hypothesis and the other forms of its effect at its place, from every point of their grids.
    fn leading(&self, stand: &Stand, lead: &Judged) -> Judged {
        let ground = self.ground(stand);
        let h = &self.hypotheses[lead.hypothesis];
        let starts: Vec<(usize, &Vec<f64>)> = (0..self.hypotheses.len())
            .filter(|i| self.hypotheses[*i].shares_a_site(h) && self.hypotheses[*i].bends())
            .flat_map(|i| self.hypotheses[i].form.grid.iter().map(move |knobs| (i, knobs)))
            .collect();
        let judged = |(i, knobs): &(usize, &Vec<f64>)| -> Option<Judged> {
            let h = &self.hypotheses[*i];
            self.judged(*i, ground.refine(h, &ground.evaluate(h, knobs, 1)?, 28)?, &stand.fit)
        };
        let found: Vec<Judged> = starts.par_iter().filter_map(judged).collect();
        found.into_iter().fold(lead.clone(), |best, next| if next.net > best.net { next } else { best })
    }

    /// The same model with other knobs, or with another form of one of its effects, that the data like as well: a likelihood ratio keeps them in a
    /// 95 % interval. `order` derivatives of the displacement were measured.
    pub fn as_likely(&self, chosen: &[Chosen], stand: &Stand, order: usize) -> Vec<(Vec<Chosen>, Stand)> {
        let mut out = Vec::new();
        for (q, c) in chosen.iter().enumerate() {
            let h = &self.hypotheses[c.hypothesis];
            // A form of more parameters fits as well as any that it holds: that is no rival.
            let rivals = |i: &usize| {
                let other = &self.hypotheses[*i];
                if *i == c.hypothesis { h.bends() } else { other.shares_a_site(h) && other.form.cost() <= h.form.cost() }
            };
            let forms: Vec<usize> = (0..self.hypotheses.len()).filter(rivals).collect();
            if forms.is_empty() {
                continue;
            }
            let others = but(chosen, q);
            let Some(rest) = self.stand(&others, &stand.fit.power, 1) else { continue };
            let ground = Ground { power: &stand.fit.power, ..self.ground(&rest) };
            let Some(best) = ground.evaluate(h, &c.knobs, 3) else { continue };
            // A free run judges anew what the balance of forces thinks possible, each valley once.
            let behind = if stand.run.is_some() { BEHIND } else { AS_LIKELY };
            for i in forms {
                let h = &self.hypotheses[i];
                let start = |knobs: &Vec<f64>| ground.evaluate(h, knobs, 1);
                let mut starts: Vec<Tried> = h.form.grid.par_iter().filter_map(start).collect();
                if !h.bends() {
                    starts = starts.into_iter().reduce(|a, b| if b.fit.log_likelihood > a.fit.log_likelihood { b } else { a }).into_iter().collect();
                }
                let mut found: Vec<Tried> = starts.par_iter().filter_map(|start| ground.refine(h, start, 28)).collect();
                found.retain(|t| t.fit.log_likelihood > best.fit.log_likelihood - behind && !optimise::tells(&h.form.knobs, &t.knobs));
                if stand.run.is_some() {
                    found.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
                    found.dedup_by(|a, b| a.knobs.iter().zip(&b.knobs).all(|(a, b)| (a - b).abs() <= SAME * b.abs()));
                    // Of another form the best valley: a free run is dear.
                    found.truncate(if i == c.hypothesis { found.len() } else { 1 });
                }
                out.par_extend(found.into_par_iter().filter_map(|t| {
                    let mut other = chosen.to_vec();
                    other[q] = Chosen { hypothesis: i, knobs: t.knobs };
                    let stand_there = self.stand(&other, &stand.fit.power, 3)?;
                    let Some(run) = stand.run else { return self.by_instruments(&other, &stand_there).or(Some((other, stand_there))) };
                    self.in_time(&other, &stand_there, order).filter(|(_, stand)| stand.run.is_some_and(|own| own > run - AS_LIKELY))
                }));
            }
        }
        out
    }

    /// The whole search, step by step; where it found several, once more from a correction of a channel alone, wherever its knobs are, if that is likelier than
    /// all of them: beside a channel that is far off a first step may end in another valley, and others fill it. Where the linear model ran away and one with
    /// causes does not, that is asked with the motion being what the record says it is.
    pub fn search(&mut self, most: usize, progress: &mut dyn FnMut(&str)) -> Option<Found> {
        let stand = self.stand(&[], &self.start, 4)?;
        let begun = Found { chosen: vec![], stand, steps: vec![], step_of: vec![], worth: vec![] };
        let found = self.search_from(begun, most, progress)?;
        if self.recorded.is_none() && found.chosen.len() < 2 {
            return Some(found);
        }
        let unclear = self.recorded.clone().map(|recorded| std::mem::replace(&mut self.cause, recorded));
        let mut again = self.anew(&found).and_then(|begun| self.search_from(begun, most, progress));
        if let Some(unclear) = unclear {
            self.cause = unclear;
            // All that is asked of it is asked as of the first, but for which causes there are, and their knobs.
            again = again.and_then(|again| {
                let stand = self.stand(&again.chosen, &again.stand.fit.power, 4)?;
                let worth = self.worths(&again.chosen, &stand);
                Some(Found { stand, worth, ..again })
            });
        }
        Some(again.filter(|again| self.net(again) > self.net(&found)).unwrap_or(found))
    }

    /// Log-likelihood of what was found, less the price of its hypotheses.
    pub fn net(&self, found: &Found) -> f64 {
        self.net_of(&found.chosen, &found.stand)
    }

    fn net_of(&self, chosen: &[Chosen], stand: &Stand) -> f64 {
        stand.fit.log_likelihood - chosen.iter().map(|c| self.price(self.hypotheses[c.hypothesis].form.cost())).sum::<f64>()
    }

    /// What a search begins with anew: the likeliest correction of a channel alone that does not run away. Where the linear model did, what was found may be it as
    /// well; else it has to be beaten.
    fn anew(&self, found: &Found) -> Option<Found> {
        let fitted = |chosen: Vec<Chosen>| {
            let stand = self.stand(&chosen, &found.stand.fit.power, 4).filter(|stand| !runs_away(&stand.state, &stand.fit))?;
            Some((self.net_of(&chosen, &stand), chosen, stand))
        };
        let corrects = (0..self.hypotheses.len()).filter(|i| self.hypotheses[*i].corrects());
        let alone = corrects.flat_map(|i| self.hypotheses[i].form.grid.iter().map(move |knobs| vec![Chosen { hypothesis: i, knobs: knobs.clone() }]));
        let itself = self.recorded.is_some().then(|| found.chosen.clone());
        let tried: Vec<_> = alone.chain(itself).collect::<Vec<_>>().into_par_iter().filter_map(fitted).collect();
        let (_, mut chosen, stand) = tried.into_iter().reduce(|best, next| if next.0 > best.0 { next } else { best })?;
        let stand = self.sweep(&mut chosen, stand)?;
        if self.recorded.is_none() && self.net_of(&chosen, &stand) <= self.net(found) {
            return None;
        }
        let step = |c: &Chosen| found.chosen.iter().position(|own| own.hypothesis == c.hypothesis).map_or(0, |at| found.step_of[at]);
        let step_of = chosen.iter().map(step).collect();
        Some(Found { chosen, stand, steps: found.steps.clone(), step_of, worth: vec![] })
    }

    fn search_from(&self, begun: Found, most: usize, progress: &mut dyn FnMut(&str)) -> Option<Found> {
        let Found { mut chosen, mut stand, mut steps, mut step_of, .. } = begun;
        let cache = Cache::new(&self.hypotheses);
        loop {
            progress(&format!("step {}: {} hypotheses", steps.len() + 1, self.hypotheses.len()));
            let mut step = self.step(&stand, &chosen, &cache);
            let lead = step.judged.first().map(|lead| self.leading(&stand, lead));
            if let Some(lead) = &lead {
                step.judged.retain(|j| j.hypothesis != lead.hypothesis);
                step.judged.insert(0, lead.clone());
            }
            let lead = lead.filter(|l| l.net > ENOUGH && (l.share > SMALLEST_SHARE || self.hypotheses[l.hypothesis].shares_a_tolerance()));
            let lead = lead.or_else(|| self.beyond_tolerance(&stand, &step.judged));
            steps.push(step);
            let Some(lead) = lead else { break };
            if chosen.len() >= most {
                break;
            }
            chosen.push(Chosen { hypothesis: lead.hypothesis, knobs: lead.tried.knobs });
            step_of.push(steps.len() - 1);
            let Some(next) = self.stand(&chosen, &stand.fit.power, 4) else {
                chosen.pop();
                step_of.pop();
                break;
            };
            let Some(refined) = self.sweep(&mut chosen, next) else { break };
            stand = refined;
        }
        let mut worth = self.worths(&chosen, &stand);
        while let Some(weak) = self.weakest(&chosen, &stand, &worth) {
            chosen.remove(weak);
            step_of.remove(weak);
            stand = self.stand(&chosen, &stand.fit.power, 4)?;
            worth = self.worths(&chosen, &stand);
        }
        Some(Found { chosen, stand, steps, step_of, worth })
    }

    /// The least worth of the chosen that is worth too little; not one without which the instruments would be beyond their tolerance.
    fn weakest(&self, chosen: &[Chosen], stand: &Stand, worth: &[f64]) -> Option<usize> {
        let needed = |q: usize| {
            let others = but(chosen, q);
            let of_it = |stand: Stand| stand.absorbed().iter().any(|a| a.beyond && a.is_of(&self.hypotheses[chosen[q].hypothesis]));
            self.hypotheses[chosen[q].hypothesis].corrects() && self.stand(&others, &stand.fit.power, 4).is_some_and(of_it)
        };
        let mut weak: Vec<usize> = (0..chosen.len()).filter(|&q| worth[q] <= ENOUGH).collect();
        weak.sort_by(|&a, &b| worth[a].total_cmp(&worth[b]));
        weak.into_iter().find(|&q| !needed(q))
    }

    fn worths(&self, chosen: &[Chosen], stand: &Stand) -> Vec<f64> {
        (0..chosen.len())
            .into_par_iter()
            .map(|q| {
                let others = but(chosen, q);
                let price = self.price(self.hypotheses[chosen[q].hypothesis].form.cost());
                self.stand(&others, &stand.fit.power, 4).map_or(f64::INFINITY, |s| stand.fit.log_likelihood - s.fit.log_likelihood - price)
            })
            .collect()
    }
}

/// The form with its knobs bound to a neighbourhood of where they are.
fn around(h: &Hypothesis, knobs: &[f64]) -> ndof_models::effects::Form {
    let mut form = h.form.clone();
    for (knob, &value) in form.knobs.iter_mut().zip(knobs) {
        knob.telling = false;
        let (lo, hi) = (knob.lo, knob.hi);
        if knob.log {
            knob.lo = lo.max(value / 2.0);
            knob.hi = hi.min(value * 2.0);
        } else {
            let reach = 0.25 * (hi - lo);
            knob.lo = lo.max(value - reach);
            knob.hi = hi.min(value + reach);
        }
    }
    form.grid = vec![knobs.to_vec()];
    form
}
