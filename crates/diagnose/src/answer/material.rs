//! What an answer is made from, and what all of its parts ask of that.

use crate::detectors::Findings;
use crate::generic::{Features, Gate, Shares};
use crate::hypotheses::Hypothesis;
use crate::judge::{Court, Errors};
use crate::linear_fit::LinearFit;
use crate::options::Options;
use crate::result::{Cause, Site};
use crate::samples::{Meaning, Samples};
use crate::search::{Chosen, Found, Stand};
use crate::subject::Subject;
use crate::unseen::Unseen;
use ndof_models::effects::Side;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A model with its final parameters, and what it leaves of the held-out part.
pub(crate) struct Fitted {
    pub chosen: Vec<Chosen>,
    pub stand: Stand,
    pub errors: Errors,
}

/// Models by the hypotheses that they are of.
pub(crate) type Models = RefCell<BTreeMap<Vec<usize>, Option<Rc<Fitted>>>>;

/// Everything that an answer is made from.
pub(crate) struct Answer<'a> {
    pub subject: &'a Subject,
    pub meaning: &'a Meaning,
    pub options: &'a Options,
    pub court: &'a Court,
    /// All trials from beginning to end, where causes are asked for what they add.
    pub whole: Option<&'a Court>,
    pub unseen: &'a Unseen<'a>,
    /// What was held out.
    pub held: &'a Samples,
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
    /// Those that were fitted so far.
    pub models: Models,
}

impl Answer<'_> {
    /// Errors of a model beside which the tones that were found are predicted.
    pub(super) fn errors(&self, chosen: &[Chosen], stand: &Stand) -> Errors {
        self.without_tones(self.court.errors(self.subject, chosen, stand))
    }

    /// The model of some of the chosen hypotheses, fitted to the balance of forces as that of all of them: its parameters by instruments, and in time
    /// where its free run is the more likely.
    pub(super) fn model(&self, members: &[usize]) -> Option<Rc<Fitted>> {
        let mut members = members.to_vec();
        members.sort_unstable();
        if let Some(known) = self.models.borrow().get(&members) {
            return known.clone();
        }
        let model = self.fitted(&members).map(Rc::new);
        self.models.borrow_mut().insert(members, model.clone());
        model
    }

    /// A chosen hypothesis, by its place among the chosen.
    pub(super) fn hypothesis(&self, place: usize) -> &Hypothesis {
        &self.subject.hypotheses[self.found.chosen[place].hypothesis]
    }

    /// Some of the chosen hypotheses.
    pub(super) fn chosen<'m>(&self, members: impl IntoIterator<Item = &'m usize>) -> Vec<Chosen> {
        members.into_iter().map(|q| self.found.chosen[*q].clone()).collect()
    }

    fn fitted(&self, members: &[usize]) -> Option<Fitted> {
        let (subject, found) = (self.subject, self.found);
        let chosen = self.chosen(members);
        let stand = if chosen.len() < found.chosen.len() { subject.stand(&chosen, &found.stand.fit.power, 3)? } else { found.stand.clone() };
        if chosen.is_empty() {
            return Some(Fitted { errors: self.errors(&chosen, &stand), chosen, stand });
        }
        // Weak instruments find anything: their parameters are taken where a free run is not the less likely with them.
        let in_time = |chosen: &[Chosen], stand: &Stand| subject.likelihood_in_time(chosen, stand, self.order());
        let own = in_time(&chosen, &stand);
        let by_instruments = subject.by_instruments(&chosen, &stand).filter(|(chosen, stand)| own.is_none_or(|own| in_time(chosen, stand) > Some(own)));
        let (chosen, stand) = by_instruments.unwrap_or((chosen, stand));
        let in_time = if self.court.windowed { None } else { subject.in_time(&chosen, &stand, self.order()) };
        let (chosen, stand) = in_time.unwrap_or((chosen, stand));
        Some(Fitted { errors: self.errors(&chosen, &stand), chosen, stand })
    }

    /// The model of some of the chosen hypotheses, fitted anew; without tolerances where a channel is corrected, as they would take the place of what
    /// does that.
    pub(super) fn refitted(&self, chosen: &[Chosen]) -> Option<Stand> {
        let (subject, power) = (self.subject, &self.found.stand.fit.power);
        if self.corrects() { subject.strict(chosen, power, 3) } else { subject.stand(chosen, power, 3) }
    }

    /// Whether a channel is corrected.
    pub(super) fn corrects(&self) -> bool {
        (0..self.found.chosen.len()).any(|place| self.hypothesis(place).corrects())
    }

    /// Errors of the model of some of the chosen hypotheses, fitted to the balance of forces alone: names rest on it.
    pub(super) fn errors_of_balance(&self, members: &[usize]) -> Option<Errors> {
        let mut members = members.to_vec();
        members.sort_unstable();
        let chosen = self.chosen(&members);
        Some(self.errors(&chosen, &self.refitted(&chosen)?))
    }

    /// Errors of the final model of some of the chosen hypotheses.
    pub(super) fn errors_of(&self, members: &[usize]) -> Option<Errors> {
        self.model(members).map(|model| model.errors.clone())
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
