//! What an answer is made from, and what all of its parts ask of that.

use crate::detectors::Findings;
use crate::generic::{Features, Gate, Shares};
use crate::judge::{Court, Errors};
use crate::linear_fit::LinearFit;
use crate::options::Options;
use crate::result::{Cause, Site};
use crate::samples::Meaning;
use crate::search::{Chosen, Found, Stand};
use crate::subject::Subject;
use crate::unseen::Unseen;
use ndof_models::effects::Side;

/// Probability of a name that helps little on held-out data while a large error stays.
pub(super) const UNSURE: f64 = 0.6;

/// Everything that an answer is made from.
pub(crate) struct Answer<'a> {
    pub subject: &'a Subject,
    pub meaning: &'a Meaning,
    pub options: &'a Options,
    pub court: &'a Court,
    /// All trials from beginning to end, where causes are asked for what they add.
    pub whole: Option<&'a Court>,
    pub unseen: &'a Unseen<'a>,
    pub baseline: &'a Stand,
    /// The fit that the baseline's matrices are from, if it is one.
    pub linear: Option<&'a LinearFit>,
    pub found: &'a Found,
    pub gate: &'a Gate,
    pub features: &'a Features,
    pub shares: Shares,
    pub findings: &'a Findings,
    /// Whether the effort was counted the other way than it was recorded.
    pub turned: bool,
    /// No motion follows from what `fit` found.
    pub still: bool,
}

impl Answer<'_> {
    /// Errors of a model beside which the tones that were found are predicted.
    pub(super) fn errors(&self, chosen: &[Chosen], stand: &Stand) -> Errors {
        self.without_tones(self.court.errors(self.subject, chosen, stand))
    }

    /// Errors of the model of some of the chosen hypotheses, fitted to the balance of forces as that of all of them.
    pub(super) fn errors_of(&self, members: &[usize]) -> Option<Errors> {
        let mut members = members.to_vec();
        members.sort_unstable();
        let chosen: Vec<Chosen> = members.iter().map(|q| self.found.chosen[*q].clone()).collect();
        Some(self.errors(&chosen, &self.subject.stand(&chosen, &self.found.stand.fit.power, 3)?))
    }

    pub(super) fn without_tones(&self, errors: Errors) -> Errors {
        self.findings.tones.iter().fold(errors, |errors, tone| errors.without_tone(tone.frequency_hz).unwrap_or(errors))
    }

    pub(super) fn is_geometry(&self, cause: &Cause) -> bool {
        self.subject.hypotheses.iter().any(|h| h.effect.name() == cause.effect && h.arm().is_some())
    }

    pub(super) fn order(&self) -> usize {
        if self.meaning.motion_imposed { 0 } else { self.meaning.order }
    }

    pub(super) fn site(&self, side: Side, axis: Option<usize>) -> Site {
        Site { side: side.word().to_owned(), axis: axis.and_then(|a| self.meaning.axes.get(a)).cloned().unwrap_or_default() }
    }
}
