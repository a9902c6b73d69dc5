//! From a search to an answer: causes with their gains, what is minor, what is confusable, the verdict.

mod cause;
mod describe;
mod detected;
mod groups;
mod stand_in;

pub(crate) use cause::tail;

use crate::detectors;
use crate::diagnose::Findings;
use crate::floor;
use crate::free_run::WINDOW_S;
use crate::generic::{Features, Gate, Shares};
use crate::judge::{Court, Errors};
use crate::options::Options;
use crate::pictures::Pictures;
use crate::remains::remains;
use crate::result::{Cause, Diagnosis, Extended, Model, ModelParameter, NoiseFloor, Score, Site, Split, Verdict};
use crate::samples::Meaning;
use crate::search::{Chosen, Found, Stand};
use crate::subject::Subject;
use groups::Group;
use ndof_models::effects::Side;

/// Probability of a name that helps little on held-out data while a large error stays.
const UNSURE: f64 = 0.6;
/// Probability of a name beyond which as much is left unexplained: of 257 names, one in nine of these was right.
const GATED: f64 = 0.2;
/// Held-out log-likelihood of the generic model beyond the named causes from which their form is not the true one for sure.
const REMAINDER: f64 = 5.0;
/// Probability of a name whose form leaves such structure.
const IMPERFECT: f64 = 0.9;
/// Probability of a name where neither the baseline nor the extended model predicts the held-out part.
const LOST: f64 = 0.5;
/// Share of the explainable error below which a cause cannot be sure while a large error stays.
const LITTLE: f64 = 0.25;
/// Share of the outputs' variance below which what a baseline misses is called little.
const LITTLE_MISSING: f64 = 0.1;
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
    pub features: &'a Features,
    pub shares: Shares,
    pub findings: &'a Findings,
    /// Whether the effort was counted the other way than it was recorded.
    pub turned: bool,
}

impl Answer<'_> {
    pub fn write(&self, mut split: Split) -> (Diagnosis, Pictures) {
        let (subject, found) = (self.subject, self.found);
        if self.court.windowed {
            split.windows_s = Some(WINDOW_S * subject.layout.time_s.max(1.0));
        }
        let windows_hz = split.windows_s.map_or(0.0, |w| 1.0 / w);
        let mut noise_floor = floor::floor(subject, &found.stand, &self.gate.power, self.order(), windows_hz);
        let before = self.court.errors(subject, &[], self.baseline);
        let quiet = self.without_tones(before.clone());
        let groups = self.groups();
        let top = (groups.first().map_or(0.0, |g| g.worth), groups.iter().map(|g| g.size).fold(0.0, f64::max));
        let (mut named, mut small) = (Vec::new(), Vec::new());
        let final_errors = self.errors(&found.chosen, &found.stand);
        // What a model has reached is no less than what remains at best.
        noise_floor.below(&before.score);
        noise_floor.below(&final_errors.score);
        let level = noise_floor.nrmse.iter().map(|f| f.map_or(0.0, |f| f * f)).sum::<f64>() / noise_floor.nrmse.len() as f64;
        for group in groups {
            match self.immaterial(&group, top) {
                Some(why) => small.push((group, why)),
                None => named.push(group),
            }
        }
        // What makes the prediction of data that no fit saw worse is not named.
        while let Some(idle) = self.idle(&named) {
            small.push((named.remove(idle), "without it the free run over the held-out part is better".to_owned()));
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
        // Structure that is too small to matter still says that the form may not be the true one.
        let remainder = self.gate.beyond > REMAINDER && self.gate.beyond > 2.0 * self.gate.beyond_error;
        let varying = variation > VARIATION && !unknown;
        let ratio = if unknown { self.gate.beyond / (self.gate.beyond + self.gate.named.max(0.0)).max(1.0) } else { 0.0 };
        // A simulation that predicts worse than none at all is wrong, whatever the balance of forces says.
        let lost = |score: &Score| score.nrmse.iter().any(|e| e.is_none_or(|e| e > 1.0));
        let adrift = lost(&before.score);
        let limit = match (ratio > 0.45, adrift && lost(&final_errors.score)) {
            (true, _) => GATED,
            (false, true) => LOST,
            (false, false) if remainder => IMPERFECT,
            (false, false) => 1.0,
        };
        let mut confusable = Vec::new();
        let mut kept: Vec<usize> = Vec::new();
        let mut causes = self.tones(&before, &quiet, level, limit);
        let mut last: Errors = quiet;
        let mut weak = false;
        while let Some((k, after)) = self.next(&named, &kept, &last) {
            let group = named.remove(k);
            kept.extend(&group.members);
            let mut cause = self.cause(&group, [&before, &last, &after], level, limit, &mut confusable);
            let of_the_rest = last.mean().zip(after.mean()).is_some_and(|(last, after)| last - after < LITTLE * (last - level));
            // What helps little on held-out data while a large error stays cannot be sure.
            if of_the_rest && excess > 5.0 * self.options.tolerance {
                cause.at_most = cause.at_most.min(UNSURE);
                cause.probability = cause.probability.min(UNSURE);
                weak = true;
            }
            causes.push(cause);
            last = after;
        }
        kept.sort_unstable();
        // What explains most comes first; what was detected and explains nothing that can be predicted, last.
        causes.sort_by(|a, b| b.gain.explained_fraction.unwrap_or(f64::NEG_INFINITY).total_cmp(&a.gain.explained_fraction.unwrap_or(f64::NEG_INFINITY)));
        weak |= self.stand_ins(&mut causes, &mut confusable);
        let all: Vec<Chosen> = kept.iter().map(|q| found.chosen[*q].clone()).collect();
        let refitted = if all.len() < found.chosen.len() { subject.stand(&all, &found.stand.fit.power, 3) } else { None };
        let mut extended = refitted.as_ref().unwrap_or(&found.stand);
        if all.is_empty() {
            extended = self.baseline;
        }
        let extended_score = self.errors(&all, extended).score;
        self.detected(&mut causes, &before, limit);
        if !unknown {
            self.own_force(&mut causes, &before);
        }
        let verdict = match (causes.is_empty(), unknown, varying) {
            (true, false, false) if !adrift => Verdict::Adequate,
            (true, ..) => Verdict::Unexplained,
            (false, true, _) if ratio > 0.45 => Verdict::Unexplained,
            (false, true, _) if ratio > 0.23 => Verdict::PartlyExplained,
            (false, _, true) => Verdict::PartlyExplained,
            (false, ..) if weak || lost(&extended_score) => Verdict::PartlyExplained,
            (false, ..) => Verdict::Explained,
        };
        noise_floor.below(&extended_score);
        causes.iter().for_each(|cause| noise_floor.below(&Score { nrmse: cause.gain.nrmse_after.clone(), ..Score::default() }));
        if verdict == Verdict::Adequate {
            noise_floor = NoiseFloor::of_the_rest(&extended_score);
        }
        let mut notes = Vec::new();
        if self.turned {
            notes.push("inertia, damping and stiffness came out negative, so the effort was counted the other way round (force-sign)".to_owned());
        }
        if unknown {
            notes.push(format!(
                "a model without physics gains {:.0} of held-out log-likelihood beyond the named causes (they gain {:.0}); it removes {:.1} % of the effort's rms: something is missing that no known cause explains",
                self.gate.beyond, self.gate.named, 100.0 * self.gate.size
            ));
            notes.extend(remains(subject, &found.stand, self.features).map(|r| r.sentence(&self.meaning.axes)));
        }
        // What the baseline could gain at most, of the outputs' variance.
        let missing = before.variance().map_or(1.0, |b| (b - level).max(0.0));
        if !causes.is_empty() && missing < LITTLE_MISSING {
            notes.push(format!("little is missing: at most {:.1} % of the outputs' held-out variance", 100.0 * missing));
        }
        if remainder && !unknown && !causes.is_empty() {
            notes.push(format!(
                "a model without physics gains {:.0} of held-out log-likelihood beyond the named causes, by a force that is too small to matter: their form may stand in for another",
                self.gate.beyond
            ));
        }
        if adrift {
            notes.push(
                "by itself the baseline does not predict the held-out part: its free run is worse than no prediction, or does not stay finite".to_owned(),
            );
        }
        if varying {
            notes.push(format!("what remains changes slowly with time together with the motion (z = {variation:.1}): a stiffness or damping that varies in a way no known cause describes"));
        }
        let white = !unknown && !varying;
        let (own, with_causes) = (self.parameters(&[], self.baseline), self.parameters(&all, extended));
        notes.extend(below_zero("baseline", &own));
        notes.extend(below_zero("extended model", &with_causes));
        let pictures = Pictures::new(self, &all, extended);
        let diagnosis = Diagnosis {
            split,
            baseline: Model { model: "inertia-damping-stiffness".to_owned(), parameters: own, held_out: before.score.clone() },
            discrepancy: self.discrepancy(&before, notes),
            noise_floor,
            verdict,
            extended: Extended {
                model: extended_name(&causes),
                parameters: with_causes,
                held_out: extended_score,
                residual_white: white,
                parameter_shift: self.shift(&all, extended),
            },
            causes,
            considered: self.considered(),
            minor: small.iter().map(|(group, why)| self.minor(group, why)).collect(),
            confusable,
        };
        (diagnosis, pictures)
    }

    /// Errors of a model beside which the tones that were found are predicted.
    fn errors(&self, chosen: &[Chosen], stand: &Stand) -> Errors {
        self.without_tones(self.court.errors(self.subject, chosen, stand))
    }

    fn without_tones(&self, errors: Errors) -> Errors {
        self.findings.tones.iter().fold(errors, |errors, tone| errors.without_tone(tone.frequency_hz).unwrap_or(errors))
    }

    /// Of the groups that are left, the one that leaves least beside those that are kept, with what it leaves.
    fn next(&self, named: &[Group], kept: &[usize], last: &Errors) -> Option<(usize, Errors)> {
        let with = |group: &Group| -> Errors {
            let mut members: Vec<usize> = kept.iter().chain(&group.members).copied().collect();
            members.sort_unstable();
            let chosen: Vec<Chosen> = members.iter().map(|q| self.found.chosen[*q].clone()).collect();
            self.subject.stand(&chosen, &self.found.stand.fit.power, 3).map_or_else(|| last.clone(), |stand| self.errors(&chosen, &stand))
        };
        let size = |errors: &Errors| errors.mean().unwrap_or(f64::INFINITY);
        let tried = named.iter().map(with).enumerate();
        tried.reduce(|best, other| if size(&other.1) < size(&best.1) { other } else { best })
    }

    fn order(&self) -> usize {
        if self.meaning.motion_imposed { 0 } else { self.meaning.order }
    }

    fn site(&self, side: Side, axis: Option<usize>) -> Site {
        Site { side: side.word().to_owned(), axis: axis.and_then(|a| self.meaning.axes.get(a)).cloned().unwrap_or_default() }
    }
}

/// What to think of inertias and stiffnesses that no body has.
fn below_zero(model: &str, parameters: &[ModelParameter]) -> Option<String> {
    let names: Vec<&str> = parameters.iter().filter(|p| p.flag.is_some()).map(|p| p.name.as_str()).collect();
    let verb = if names.len() == 1 { "is" } else { "are" };
    (!names.is_empty()).then(|| format!("{} of the {model} {verb} below zero beyond doubt: a sign, the band or the model is wrong there", names.join(", ")))
}

fn extended_name(causes: &[Cause]) -> String {
    std::iter::once("inertia-damping-stiffness".to_owned()).chain(causes.iter().map(|c| c.effect.clone())).collect::<Vec<_>>().join(" + ")
}
