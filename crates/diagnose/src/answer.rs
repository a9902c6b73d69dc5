//! From a search to an answer: causes with their gains, what is minor, what is confusable, the verdict.

use crate::detectors;
use crate::diagnose::Findings;
use crate::floor;
use crate::free_run::WINDOW_S;
use crate::generic::{self, Gate, Shares};
use crate::judge::{self, Court, Errors};
use crate::options::Options;
use crate::plant::Role;
use crate::probability::Features;
use crate::result::{
    BandShare, Cause, CauseParameter, Confusable, Considered, Diagnosis, Discrepancy, Extended, Gain, Minor, Model, ModelParameter, Shift, Site, Split,
    TimeShare, Verdict,
};
use crate::samples::Meaning;
use crate::search::{Chosen, ENOUGH, Found, Stand};
use crate::subject::Subject;
use ndof_models::effects::{EFFECTS, Effect, Matrix, Side, Trace, Value};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Penalised gains closer than this do not tell two effects apart.
const CONFUSABLE: f64 = 3.0;
/// A cause whose gain is below this share of the first one's is minor.
const MINOR: f64 = 0.05;
/// Slow change of the residual that counts, in standard errors.
const VARIATION: f64 = 8.0;

/// Everything that an answer is made from.
pub(crate) struct Answer<'a> {
    pub subject: &'a Subject,
    pub meaning: &'a Meaning,
    pub options: &'a Options,
    pub court: &'a Court,
    pub baseline: &'a Stand,
    pub found: &'a Found,
    pub gate: &'a Gate,
    pub shares: Shares,
    pub findings: &'a Findings,
    /// Whether the effort was counted the other way than it was recorded.
    pub turned: bool,
}

/// Chosen hypotheses of one effect at one site.
struct Group {
    members: Vec<usize>,
    /// Net log-likelihood lost without it.
    worth: f64,
    /// Root of the power that it removes, as a share of the effort's rms.
    size: f64,
}

impl Answer<'_> {
    pub fn write(&self, mut split: Split) -> Diagnosis {
        let (subject, found) = (self.subject, self.found);
        if self.court.windowed {
            split.windows_s = Some(WINDOW_S * subject.layout.time_s.max(1.0));
        }
        let windows_hz = split.windows_s.map_or(0.0, |w| 1.0 / w);
        let noise_floor = floor::floor(subject, &found.stand, &self.gate.power, self.order(), windows_hz);
        let level = noise_floor.nrmse.iter().map(|f| f.map_or(0.0, |f| f * f)).sum::<f64>() / noise_floor.nrmse.len() as f64;
        let before = self.court.errors(subject, &[], self.baseline);
        let groups = self.groups();
        let top = groups.first().map_or(0.0, |g| g.worth);
        let (mut named, mut small) = (Vec::new(), Vec::new());
        let final_errors = self.court.errors(subject, &found.chosen, &found.stand);
        for group in groups {
            let tolerance = self.options.tolerance;
            let material = group.size > tolerance || (group.size > 0.4 * tolerance && self.removed(&group, &final_errors) > tolerance);
            if material && group.worth >= MINOR * top { named.push(group) } else { small.push(group) }
        }
        // What does not help on data that no fit saw is not named.
        while let Some(idle) = self.idle(&named) {
            small.push(named.remove(idle));
        }
        let laws = subject.laws(&found.chosen, &found.stand);
        let variation = detectors::variation(&found.stand, &detectors::residual(&found.stand, &laws));
        let excess = final_errors
            .score
            .nrmse
            .iter()
            .zip(&noise_floor.nrmse)
            .map(|(e, f)| e.map_or(1.0, |e| (e * e - f.unwrap_or(0.0).powi(2)).max(0.0).sqrt()))
            .fold(0.0, f64::max);
        let structured = self.gate.beyond > 20.0 && self.gate.beyond > 2.0 * self.gate.beyond_error;
        let unknown = structured && self.gate.size > self.options.tolerance && excess > self.options.tolerance;
        let varying = variation > VARIATION && !unknown;
        let ratio = if unknown { self.gate.beyond / (self.gate.beyond + self.gate.named.max(0.0)).max(1.0) } else { 0.0 };
        let limit = if ratio > 0.45 { 0.5 } else { 1.0 };
        let mut causes = Vec::new();
        let mut confusable = Vec::new();
        let mut kept: Vec<usize> = Vec::new();
        let mut last: Errors = before.clone();
        let mut weak = false;
        for group in named {
            kept.extend(&group.members);
            kept.sort_unstable();
            let chosen: Vec<Chosen> = kept.iter().map(|q| found.chosen[*q].clone()).collect();
            let after = match subject.stand(&chosen, &found.stand.fit.power, 3) {
                Some(stand) => self.court.errors(subject, &chosen, &stand),
                None => last.clone(),
            };
            let mut cause = self.cause(&group, &last, &after, level, limit, &mut confusable);
            // Seen in the balance of forces but not on held-out data: significant, and no cause to name.
            let little = cause.gain.explained_fraction.is_some_and(|share| share < 0.1);
            if little && cause.gain.explained_fraction_ci95.is_some_and(|[low, _]| low <= 0.0) {
                kept.retain(|q| !group.members.contains(q));
                small.push(group);
                continue;
            }
            // What helps little on held-out data while a large error stays cannot be sure.
            if little && excess > 5.0 * self.options.tolerance {
                cause.probability = cause.probability.min(0.6);
                weak = true;
            }
            causes.push(cause);
            last = after;
        }
        let all: Vec<Chosen> = kept.iter().map(|q| found.chosen[*q].clone()).collect();
        let refitted = if all.len() < found.chosen.len() { subject.stand(&all, &found.stand.fit.power, 3) } else { None };
        let extended = refitted.as_ref().unwrap_or(&found.stand);
        let extended_score = self.court.errors(subject, &all, extended).score;
        let unnamed = causes.is_empty();
        self.detected(&mut causes, &before, unnamed);
        if !unknown {
            self.own_force(&mut causes, &before);
        }
        let verdict = match (causes.is_empty(), unknown, varying) {
            (true, false, false) => Verdict::Adequate,
            (true, ..) => Verdict::Unexplained,
            (false, true, _) if ratio > 0.45 => Verdict::Unexplained,
            (false, true, _) if ratio > 0.23 => Verdict::PartlyExplained,
            (false, _, true) => Verdict::PartlyExplained,
            (false, ..) if weak => Verdict::PartlyExplained,
            (false, ..) => Verdict::Explained,
        };
        let mut notes = Vec::new();
        if self.turned {
            notes.push("inertia, damping and stiffness came out negative, so the effort was counted the other way round (force-sign)".to_owned());
        }
        if unknown {
            notes.push(format!(
                "a model without physics gains {:.0} of held-out log-likelihood beyond the named causes (they gain {:.0}); it removes {:.1} % of the effort's rms: something is missing that no known cause explains",
                self.gate.beyond, self.gate.named, 100.0 * self.gate.size
            ));
        }
        if varying {
            notes.push(format!("what remains changes slowly with time together with the motion (z = {variation:.1}): a stiffness or damping that varies in a way no known cause describes"));
        }
        let white = !unknown && !varying;
        Diagnosis {
            split,
            baseline: Model { model: "inertia-damping-stiffness".to_owned(), parameters: self.parameters(&[], self.baseline), held_out: before.score.clone() },
            discrepancy: self.discrepancy(&before, notes),
            noise_floor,
            verdict,
            extended: Extended {
                model: extended_name(&causes),
                parameters: self.parameters(&all, extended),
                held_out: extended_score,
                residual_white: white,
                parameter_shift: self.shift(&all, extended),
            },
            causes,
            considered: self.considered(),
            minor: small.iter().map(|g| self.minor(g)).collect(),
            confusable,
        }
    }

    fn order(&self) -> usize {
        if self.meaning.motion_imposed { 0 } else { self.meaning.order }
    }

    /// Chosen hypotheses of one effect, side and axis together, strongest first.
    fn groups(&self) -> Vec<Group> {
        let (subject, found) = (self.subject, self.found);
        let key = |q: usize| {
            let h = &subject.hypotheses[found.chosen[q].hypothesis];
            (h.effect.name(), h.form.side, h.form.axis)
        };
        let mut groups: Vec<Group> = Vec::new();
        for q in 0..found.chosen.len() {
            match groups.iter_mut().find(|g| key(g.members[0]) == key(q)) {
                Some(group) => group.members.push(q),
                None => groups.push(Group { members: vec![q], worth: found.worth[q], size: 0.0 }),
            }
        }
        for group in &mut groups {
            let rest: Vec<Chosen> = (0..found.chosen.len()).filter(|q| !group.members.contains(q)).map(|q| found.chosen[q].clone()).collect();
            if let Some(without) = subject.stand(&rest, &found.stand.fit.power, 4) {
                let price: f64 = group.members.iter().map(|q| subject.price(subject.hypotheses[found.chosen[*q].hypothesis].form.cost())).sum();
                group.worth = found.stand.fit.log_likelihood - without.fit.log_likelihood - price;
            }
            if let (Some(without), Some(with)) = (subject.strict(&rest, &found.stand.fit.power, 2), subject.strict(&found.chosen, &found.stand.fit.power, 2)) {
                group.size = generic::size(&without, &without.fit.residual, &with.fit.residual);
            }
        }
        groups.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        groups
    }

    /// The weakest of the groups without which the others predict the held-out part better.
    fn idle(&self, named: &[Group]) -> Option<usize> {
        let power = &self.found.stand.fit.power;
        let error = |without: Option<usize>| -> Option<f64> {
            let mut kept: Vec<usize> = named.iter().enumerate().filter(|(k, _)| Some(*k) != without).flat_map(|(_, g)| g.members.iter().copied()).collect();
            kept.sort_unstable();
            let chosen: Vec<Chosen> = kept.iter().map(|q| self.found.chosen[*q].clone()).collect();
            let stand = self.subject.stand(&chosen, power, 3)?;
            self.court.errors(self.subject, &chosen, &stand).variance()
        };
        let with = if named.is_empty() { 0.0 } else { error(None).unwrap_or(f64::INFINITY) };
        (0..named.len()).rev().find(|k| error(Some(*k)).is_some_and(|without| without < 0.97 * with))
    }

    /// Root of the held-out error's power that goes with a group, on the output where it is largest.
    fn removed(&self, group: &Group, with: &Errors) -> f64 {
        let rest: Vec<Chosen> = (0..self.found.chosen.len()).filter(|q| !group.members.contains(q)).map(|q| self.found.chosen[q].clone()).collect();
        let Some(without) = self.subject.strict(&rest, &self.found.stand.fit.power, 2) else { return 0.0 };
        let errors = self.court.errors(self.subject, &rest, &without);
        errors.score.nrmse.iter().zip(&with.score.nrmse).map(|(b, a)| b.zip(*a).map_or(0.0, |(b, a)| (b * b - a * a).max(0.0).sqrt())).fold(0.0, f64::max)
    }

    fn site(&self, side: Side, axis: Option<usize>) -> Site {
        Site { side: side.word().to_owned(), axis: axis.and_then(|a| self.meaning.axes.get(a)).cloned().unwrap_or_default() }
    }

    fn cause(&self, group: &Group, before: &Errors, after: &Errors, floor: f64, limit: f64, confusable: &mut Vec<Confusable>) -> Cause {
        let (subject, found) = (self.subject, self.found);
        let lead = group.members[0];
        let h = &subject.hypotheses[found.chosen[lead].hypothesis];
        let step = &found.steps[found.step_of[lead]];
        let best_of = |same: bool| {
            step.judged
                .iter()
                .filter(|j| (subject.hypotheses[j.hypothesis].effect.name() == h.effect.name()) == same)
                .map(|j| j.net)
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let (own, rival) = (best_of(true), best_of(false));
        let judged = step.judged.iter().find(|j| j.hypothesis == found.chosen[lead].hypothesis);
        let (gain, share) = judged.map_or((group.worth, 0.0), |j| (j.gain, j.share));
        let p_value = tail(2.0 * gain, h.form.cost(), step.judged.len());
        let mut near: Vec<&'static str> = Vec::new();
        for j in step.judged.iter().filter(|j| own - j.net < CONFUSABLE.max(0.01 * own.min(300.0)) && j.net > ENOUGH) {
            let other = subject.hypotheses[j.hypothesis].effect.name();
            if other != h.effect.name() && !near.contains(&other) {
                near.push(other);
            }
        }
        let card = h.effect.card();
        if !near.is_empty() {
            let effects = std::iter::once(card.name).chain(near.iter().copied()).map(str::to_owned).collect();
            confusable.push(Confusable { effects, next_experiment: card.next_experiment.to_owned() });
        }
        let features = Features::new(own, rival, self.gate.beyond, self.gate.named, self.gate.removed, share, group.size);
        let block_s = (2.0 * subject.layout.time_s).max(0.2);
        let (explained_fraction, explained_fraction_ci95) =
            judge::explained(before, after, floor, block_s, self.court.duration_s(), self.options.resamples, self.options.seed);
        let mut evidence = vec![
            format!(
                "{} ({}): it raises the log-likelihood by {gain:.0} with {} parameters, {:.0} after paying for them",
                card.what,
                h.form.label,
                h.form.cost(),
                group.worth
            ),
            format!("it removes {:.1} % of the whitened residual, {:.2} % of the effort's rms", 100.0 * share, 100.0 * group.size),
        ];
        if rival > f64::NEG_INFINITY
            && let Some(j) = step.judged.iter().find(|j| subject.hypotheses[j.hypothesis].effect.name() != h.effect.name())
        {
            evidence.push(format!(
                "the next other effect, {}, gains {:.0} after paying for its parameters",
                subject.hypotheses[j.hypothesis].effect.name(),
                j.net
            ));
        }
        Cause {
            effect: card.name.to_owned(),
            site: self.site(h.form.side, h.form.axis),
            parameters: subject.named(&found.chosen, &found.stand, lead),
            probability: features.probability().min(limit),
            p_value,
            gain: Gain {
                nrmse_before: before.score.nrmse.clone(),
                nrmse_after: after.score.nrmse.clone(),
                vaf_before: before.score.vaf_percent.clone(),
                vaf_after: after.score.vaf_percent.clone(),
                explained_fraction,
                explained_fraction_ci95,
                delta_bic: 2.0 * group.worth,
            },
            evidence,
        }
    }

    /// Causes that detectors found.
    fn detected(&self, causes: &mut Vec<Cause>, before: &Errors, _first: bool) {
        let quiet = |effect: &'static dyn Effect, axis: Option<usize>, parameters: Vec<(&'static str, Value)>, probability: f64, evidence: String| Cause {
            effect: effect.name().to_owned(),
            site: self.site(effect.card().sides[0], axis),
            parameters: parameters
                .into_iter()
                .map(|(name, value)| {
                    let card = effect.card().parameters.iter().find(|p| p.name == name);
                    let rotational = self.subject.scale.rotational;
                    CauseParameter {
                        name: if rotational { ndof_models::effects::rotational_name(name) } else { name.to_owned() },
                        unit: card.map_or("", |p| if rotational { p.rotational_unit } else { p.unit }).to_owned(),
                        value,
                        ci95: None,
                    }
                })
                .collect(),
            probability,
            p_value: 0.0,
            gain: Gain {
                nrmse_before: before.score.nrmse.clone(),
                nrmse_after: before.score.nrmse.clone(),
                vaf_before: before.score.vaf_percent.clone(),
                vaf_after: before.score.vaf_percent.clone(),
                explained_fraction: None,
                explained_fraction_ci95: None,
                delta_bic: 0.0,
            },
            evidence: vec![evidence],
        };
        for tone in &self.findings.tones {
            if let Some(effect) = traced(Trace::Tone) {
                causes.push(quiet(
                    effect,
                    Some(tone.axis),
                    vec![("frequency_hz", Value::Number(tone.frequency_hz)), ("amplitude_n", Value::Number(tone.amplitude))],
                    0.97,
                    format!("a line {:.0} times above its surroundings at {:.3} Hz, {:.1} % of the residual force's power; it was masked before anything else was tried", tone.height, tone.frequency_hz, 100.0 * tone.share),
                ));
            }
        }
        for burst in &self.findings.bursts {
            if let Some(effect) = traced(Trace::Burst) {
                causes.push(quiet(
                    effect,
                    Some(burst.axis),
                    vec![("time_s", Value::Number(burst.from_s)), ("impulse_n_s", Value::Number(burst.impulse))],
                    0.95,
                    format!(
                        "{:.0} % of the whitened residual lies between {:.2} and {:.2} s of trial {}; that stretch was left out of everything else",
                        100.0 * burst.share,
                        burst.from_s,
                        burst.to_s,
                        burst.trial + 1
                    ),
                ));
            }
        }
        for levels in &self.findings.levels {
            if let Some(effect) = traced(Trace::Levels) {
                let names = if levels.effort { &self.meaning.effort_names } else { &self.meaning.motion_names };
                let channel = names[levels.axis].clone();
                let evidence =
                    format!("every value of {channel} is a multiple of {:.3e}: rounding makes {:.1} % of its rms", levels.step, 100.0 * levels.share);
                causes.push(quiet(effect, None, vec![("step", Value::Number(levels.step)), ("channel", Value::Text(channel))], 0.98, evidence));
            }
        }
    }

    /// The force that the plant makes by itself, where it moves the plant visibly.
    fn own_force(&self, causes: &mut Vec<Cause>, before: &Errors) {
        let Some(effect) = traced(Trace::Noise) else { return };
        if self.meaning.motion_imposed {
            return;
        }
        for axis in 0..self.subject.layout.axes {
            let (share, tilt, rms) = floor::own_motion(self.subject, &self.found.stand, &self.gate.power, axis);
            if share > 0.15 && tilt > 5.0 {
                causes.push(Cause {
                    effect: effect.name().to_owned(),
                    site: self.site(effect.card().sides[0], Some(axis)),
                    parameters: vec![CauseParameter {
                        name: if self.subject.scale.rotational { "rms_nm".to_owned() } else { "rms_n".to_owned() },
                        unit: if self.subject.scale.rotational { "N m".to_owned() } else { "N".to_owned() },
                        value: Value::Number(rms),
                        ci95: Some([0.9 * rms, 1.1 * rms]),
                    }],
                    probability: (0.5 + share).min(0.95),
                    p_value: 0.0,
                    gain: Gain {
                        nrmse_before: before.score.nrmse.clone(),
                        nrmse_after: before.score.nrmse.clone(),
                        vaf_before: before.score.vaf_percent.clone(),
                        vaf_after: before.score.vaf_percent.clone(),
                        explained_fraction: None,
                        explained_fraction_ci95: None,
                        delta_bic: 0.0,
                    },
                    evidence: vec![format!("{:.0} % of the motion's power from 0.25 to 1.5 Hz (of a band to 12 Hz) comes from a force that the perturbation did not cause; below the band's middle it is {tilt:.0} times stronger than above", 100.0 * share)],
                });
            }
        }
    }

    fn parameters(&self, chosen: &[Chosen], stand: &Stand) -> Vec<ModelParameter> {
        let subject = self.subject;
        let n = subject.layout.axes;
        let units = if subject.scale.rotational { ["kg m^2", "N m s/rad", "N m/rad"] } else { ["kg", "N s/m", "N/m"] };
        let mut out = Vec::new();
        for ((letter, matrix), unit) in [("M", Matrix::Mass), ("B", Matrix::Damping), ("K", Matrix::Stiffness)].into_iter().zip(units) {
            if matrix == Matrix::Stiffness && !subject.structure.spring && subject.structure.given.iter().all(|e| e.0 != matrix) {
                continue;
            }
            let values = subject.matrix(chosen, stand, matrix);
            for (i, row) in values.iter().enumerate() {
                for (j, &value) in row.iter().enumerate() {
                    let column =
                        stand.base.roles.iter().position(|r| *r == Role::Entry(matrix, i, j) || (matrix == Matrix::Mass && *r == Role::Entry(matrix, j, i)));
                    let std_error = column.map(|c| stand.fit.covariance.at(c, c).sqrt().hypot(0.005 * value));
                    let axes = &self.meaning.axes;
                    let name = if n == 1 { letter.to_owned() } else { format!("{letter}_{}_{}", axes[i], axes[j]) };
                    out.push(ModelParameter { name, unit: unit.to_owned(), value, std_error });
                }
            }
        }
        out
    }

    fn shift(&self, chosen: &[Chosen], stand: &Stand) -> Vec<Shift> {
        if chosen.is_empty() {
            return Vec::new();
        }
        let before = self.parameters(&[], self.baseline);
        let after = self.parameters(chosen, stand);
        before
            .into_iter()
            .zip(after)
            .filter(|(b, a)| (b.value - a.value).abs() > 2.0 * b.std_error.unwrap_or(0.0).hypot(a.std_error.unwrap_or(0.0)) && b.value != a.value)
            .map(|(b, a)| Shift { name: b.name, unit: b.unit, before: b.value, after: a.value })
            .collect()
    }

    fn considered(&self) -> Vec<Considered> {
        let subject = self.subject;
        let Some(step) = self.found.steps.first() else { return Vec::new() };
        let mut seen: Vec<(&str, Side, Option<usize>)> = Vec::new();
        let mut out = Vec::new();
        let lead = step.judged.first().map_or(0.0, |j| j.net);
        for j in &step.judged {
            let h = &subject.hypotheses[j.hypothesis];
            let key = (h.effect.name(), h.form.side, h.form.axis);
            if seen.contains(&key) {
                continue;
            }
            seen.push(key);
            let named = self.found.chosen.iter().any(|c| {
                let k = &subject.hypotheses[c.hypothesis];
                (k.effect.name(), k.form.side, k.form.axis) == key
            });
            if named {
                continue;
            }
            let why_not = if j.net <= 0.0 {
                format!("it gains {:.1}, less than its {} parameters cost", j.gain, h.form.cost())
            } else if j.net <= ENOUGH {
                format!("it gains {:.1} after paying for its parameters; {ENOUGH} are needed", j.net)
            } else {
                format!("it gains {:.0}, the first cause {lead:.0}; with that one named it is no longer needed", j.net)
            };
            out.push(Considered {
                effect: h.effect.name().to_owned(),
                site: self.site(h.form.side, h.form.axis),
                explained_fraction: j.share.max(0.0),
                p_value: tail(2.0 * j.gain, h.form.cost(), step.judged.len()),
                why_not,
            });
        }
        out
    }

    fn minor(&self, group: &Group) -> Minor {
        let h = &self.subject.hypotheses[self.found.chosen[group.members[0]].hypothesis];
        Minor { effect: h.effect.name().to_owned(), site: self.site(h.form.side, h.form.axis), removed: group.size }
    }

    fn discrepancy(&self, before: &Errors, notes: Vec<String>) -> Discrepancy {
        let layout = &self.subject.layout;
        let lines = layout.lines();
        let unit = 1.0 / layout.time_s;
        let last = layout.frequency_hz[lines - 1];
        let edges = [0.0, unit, 3.5 * unit, 7.0 * unit, last + 1e-9];
        let mut by_band = Vec::new();
        for (i, e) in self.baseline.fit.residual.iter().enumerate() {
            let total: f64 = e.iter().map(|v| v.norm_sqr()).sum();
            for w in edges.windows(2) {
                let part: f64 = e.iter().enumerate().filter(|(k, _)| (w[0]..w[1]).contains(&layout.frequency_hz[k % lines])).map(|(_, v)| v.norm_sqr()).sum();
                by_band.push(BandShare { band_hz: [w[0], w[1].min(last)], output: self.output(i), share: part / total.max(f64::MIN_POSITIVE) });
            }
        }
        let mut by_time = Vec::new();
        for (i, errors) in before.relative.iter().enumerate() {
            let total: f64 = errors.iter().sum();
            let parts = 10usize.min(errors.len());
            for p in 0..parts {
                let (a, b) = (p * errors.len() / parts, (p + 1) * errors.len() / parts);
                let share = errors[a..b].iter().sum::<f64>() / total.max(f64::MIN_POSITIVE);
                let time_s = [a as f64 / layout.rate_hz, b as f64 / layout.rate_hz];
                by_time.push(TimeShare { time_s, output: self.output(i), share: if share.is_finite() { share } else { 0.0 } });
            }
        }
        let s = self.shares;
        Discrepancy { by_band, by_time, linear_share: s.linear, nonlinear_share: s.nonlinear, time_varying_share: s.varying, noise_share: s.noise, notes }
    }

    fn output(&self, i: usize) -> String {
        if self.meaning.motion_imposed { self.meaning.effort_names[i].clone() } else { self.meaning.motion_names[i].clone() }
    }
}

fn traced(trace: Trace) -> Option<&'static dyn Effect> {
    EFFECTS.iter().copied().find(|e| e.card().trace == trace)
}

/// Upper tail of χ² with `k` degrees of freedom, times the number of hypotheses (Holm's factor of the smallest).
fn tail(statistic: f64, k: usize, tried: usize) -> f64 {
    ChiSquared::new(k.max(1) as f64).map_or(1.0, |law| (law.sf(statistic.max(0.0)) * tried as f64).min(1.0))
}

fn extended_name(causes: &[Cause]) -> String {
    std::iter::once("inertia-damping-stiffness".to_owned()).chain(causes.iter().map(|c| c.effect.clone())).collect::<Vec<_>>().join(" + ")
}
