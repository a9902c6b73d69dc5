//! What the named causes leave, and what that makes of the answer.

use super::elsewhere::Elsewhere;
use super::material::Answer;
use crate::detectors;
use crate::judge::Errors;
use crate::remains::remains;
use crate::result::{NoiseFloor, UNSURE, Verdict};
use crate::search::{Chosen, Stand};

/// Probability of a name beyond which as much is left unexplained: of 257 names, one in nine of these was right.
const GATED: f64 = 0.2;
/// Held-out log-likelihood of the generic model beyond the named causes from which their form is not the true one for sure.
const REMAINDER: f64 = 5.0;
/// Probability of a name whose form leaves such structure.
const IMPERFECT: f64 = 0.9;
/// Probability of a name where the model with all of them predicts the held-out part worse than no prediction.
const LOST: f64 = 0.5;
/// Share of the outputs' variance below which what a baseline misses is called little.
const LITTLE_MISSING: f64 = 0.1;
/// Slow change of the residual that counts, in standard errors.
const VARIATION: f64 = 8.0;

/// What the search could not name.
pub(super) struct Left {
    /// Held-out error of all that was found beyond the floor.
    pub excess: f64,
    /// Whether something is missing that no known cause explains.
    pub unknown: bool,
    /// Whether what a cause was found by is there, though the cause is not.
    nameless: bool,
    /// Whether structure is left at all; what is too small to matter still says that the form may not be the true one.
    remainder: bool,
    /// Slow change together with the motion, in standard errors.
    variation: f64,
    varying: bool,
    /// What no cause explains, beside what the named ones do.
    ratio: f64,
    /// Whether the baseline predicts worse than no prediction, and than what the limb does by itself makes it.
    adrift: bool,
    /// Forces whose sensors do not show all: the axis, and the share of the samples at their limits.
    clipped: Vec<(usize, f64)>,
    /// What the probability of any name may be at most.
    pub limit: f64,
}

impl Answer<'_> {
    /// A simulation that predicts worse than none at all is wrong, whatever the balance of forces says, but for what the limb does by itself: that a hold
    /// answers, so that no model foretells the motion from the force. This is the error of each output by that, if what a model leaves is no more.
    pub(super) fn by_itself(&self, (chosen, stand): (&[Chosen], &Stand), slowest_hz: f64) -> Vec<Option<f64>> {
        let expected = || self.unseen.expected(chosen, stand, self.order(), slowest_hz);
        if self.gate.sure() { vec![] } else { expected().unwrap_or_default() }
    }
}

impl Left {
    pub fn of(answer: &Answer<'_>, before: &Errors, all: &Errors, floor: &NoiseFloor, nameless: bool, by_itself: &[Option<f64>]) -> Self {
        let (gate, found) = (answer.gate, answer.found);
        let beyond: Vec<_> = (0..answer.subject.layout.trials).map(|trial| answer.subject.beyond(&found.chosen, &found.stand, trial)).collect();
        let rest = detectors::residual(&found.stand, &beyond);
        let variation = detectors::variation(&found.stand, &rest);
        let hiding = answer.findings.clipped.iter().filter(|clipped| clipped.hides(&answer.subject.layout, &rest));
        let clipped: Vec<(usize, f64)> = hiding.map(|clipped| (clipped.axis, clipped.share)).collect();
        let beyond = |(e, f): (&Option<f64>, &Option<f64>)| e.map_or(1.0, |e| (e * e - f.unwrap_or(0.0).powi(2)).max(0.0).sqrt());
        let excess = all.score.nrmse.iter().zip(&floor.nrmse).map(beyond).fold(0.0, f64::max);
        let sure = gate.sure();
        let unknown = sure && gate.beyond > 20.0 && gate.size > answer.options.tolerance && excess > answer.options.tolerance;
        let remainder = sure && gate.beyond > REMAINDER;
        let ratio = if unknown { gate.beyond / (gate.beyond + gate.named.max(0.0)).max(1.0) } else { 0.0 };
        let adrift = before.is_lost(by_itself, answer.court.block());
        // Of an error that is below the tolerance nothing that matters can vary.
        let matters = all.score.nrmse.iter().any(|e| e.is_none_or(|e| e > answer.options.tolerance));
        let varying = variation > VARIATION && !unknown && matters;
        let limit = match (ratio > 0.45, all.is_worse_than_none()) {
            (true, _) => GATED,
            (false, true) => LOST,
            // What a sensor does not show bends the matrices and looks like a law, and so does a stiffness that comes and goes.
            (false, false) if !clipped.is_empty() || varying => UNSURE,
            (false, false) if remainder => IMPERFECT,
            (false, false) => 1.0,
        };
        Left { excess, unknown, nameless, remainder, variation, varying, ratio, adrift, clipped, limit }
    }

    /// Whether what is left may be a force of the limb's own: one that comes and goes with the motion is none.
    pub fn may_be_its_own(&self) -> bool {
        !self.unknown && !self.varying
    }

    /// Whether nothing is left that a model could explain.
    pub fn white(&self) -> bool {
        !self.unknown && !self.nameless && !self.varying
    }

    /// `weak` where a name is not sure; `lost` where the model with its causes predicts worse than the limb's own force makes it; `elsewhere` where the
    /// held-out part is of another plant.
    pub fn verdict(&self, named: bool, weak: bool, lost: bool, elsewhere: bool) -> Verdict {
        match (named, self.unknown, self.varying || self.nameless || elsewhere) {
            (false, false, false) if !self.adrift && self.clipped.is_empty() => Verdict::Adequate,
            (false, ..) => Verdict::Unexplained,
            (true, true, _) if self.ratio > 0.45 => Verdict::Unexplained,
            (true, true, _) if self.ratio > 0.23 => Verdict::PartlyExplained,
            (true, _, true) => Verdict::PartlyExplained,
            (true, ..) if weak || lost || !self.clipped.is_empty() => Verdict::PartlyExplained,
            (true, ..) => Verdict::Explained,
        }
    }

    /// What the reader should know of it, in sentences; `level` is the floor's share of the outputs' variance.
    pub fn notes(&self, answer: &Answer<'_>, before: &Errors, level: f64, named: bool, elsewhere: Option<&Elsewhere>) -> Vec<String> {
        let gate = answer.gate;
        let mut notes = Vec::new();
        if answer.turned {
            notes.push("inertia, damping and stiffness came out negative, so the effort was counted the other way round (force-sign)".to_owned());
        }
        for (axis, share) in &self.clipped {
            let (name, share) = (&answer.meaning.effort_names[*axis], 100.0 * share);
            notes.push(format!(
                "{name} stands still at its limits in {share:.1} % of its samples, and more acts there than it shows: no model is adequate to what a sensor does not show"
            ));
        }
        for (axis, name) in answer.meaning.motion_names.iter().enumerate() {
            let stops: Vec<_> = answer.findings.frozen.iter().filter(|stop| stop.axis == axis).collect();
            if let Some(first) = stops.first() {
                notes.push(format!(
                    "{name} stands still {} time(s) while the motion goes on, first at {:.2} s of trial {}: its sensor stopped, and no model foretells that; cut these stretches out",
                    stops.len(),
                    first.from_s,
                    first.trial + 1
                ));
            }
        }
        if answer.still {
            let note =
                "the baseline is the one that balances the forces best, for no motion follows from what `fit` finds: its inertia may as well be below zero";
            notes.push(note.to_owned());
        }
        if self.unknown {
            notes.push(format!(
                "a model without physics gains {:.0} of held-out log-likelihood beyond the named causes (they gain {:.0}); it removes {:.1} % of the effort's rms: something is missing that no known cause explains",
                gate.beyond, gate.named, 100.0 * gate.size
            ));
            notes.extend(remains(answer.subject, &answer.found.stand, answer.features).map(|r| r.sentence(&answer.meaning.axes)));
        }
        // What the baseline could gain at most, of the outputs' variance.
        let missing = before.mean().map_or(1.0, |b| (b - level).max(0.0));
        if named && missing < LITTLE_MISSING {
            notes.push(format!("little is missing: at most {:.1} % of the outputs' held-out variance", 100.0 * missing));
        }
        if self.remainder && !self.unknown && named {
            notes.push(format!(
                "a model without physics gains {:.0} of held-out log-likelihood beyond the named causes, by a force that is too small to matter: their form may stand in for another",
                gate.beyond
            ));
        }
        let own = before.score.nrmse.iter().flatten().fold(0.0, |most: f64, e| most.max(*e));
        // More of an output's variance than the tolerance.
        if let Some(elsewhere) = elsewhere {
            notes.push(elsewhere.sentence());
        } else if !named && self.white() && !self.adrift && own > 1.0 {
            notes.push(format!(
                "the held-out part does not judge the model: there the limb moves more by its own force than by the input, and a hold keeps that motion small, so that the free run errs by {:.0} % of it, as that force lets expect; hold out another part",
                100.0 * own
            ));
        } else if !named && self.white() && !self.adrift && own * own > answer.options.tolerance {
            notes.push(format!(
                "{:.0} % of the held-out output (rms) is not foretold from the input, and follows from nothing that was tried: noise, or a force that the limb makes by itself",
                100.0 * own
            ));
        }
        if self.adrift {
            notes.push(
                "by itself the baseline does not predict the held-out part: its free run is worse than no prediction, or does not stay finite".to_owned(),
            );
        }
        if self.varying {
            notes.push(format!("what remains changes slowly with time together with the motion (z = {:.1}): a stiffness or damping that varies in a way no known cause describes", self.variation));
        }
        notes
    }
}
