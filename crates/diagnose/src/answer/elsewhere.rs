//! Whether what is held out, or a part of it, is of another plant than what was fitted.

use super::material::Answer;
use crate::judge::{Court, Errors};
use crate::result::{AnotherPlant, Score};
use crate::search::{Chosen, Stand};
use crate::split::{Portion, portions};
use crate::unseen::Unseen;

/// A stretch of the held-out part that is of another plant.
pub(super) struct Elsewhere {
    /// What the result says of it.
    pub told: AnotherPlant,
    /// What is left of the whole held-out part where this stretch has a model of its own.
    pub floor: Score,
}

impl Answer<'_> {
    /// The held-out part if it is of another plant, or else its trial, half or quarter that is.
    pub(super) fn elsewhere(&self, model: (&[Chosen], &Stand), errors: &Errors) -> Option<Elsewhere> {
        if let Some([_, there]) = self.another(self.court, self.unseen, model) {
            return Some(Elsewhere::new("the held-out part".to_owned(), &there, there.score.clone()));
        }
        portions(self.held).into_iter().find_map(|Portion { samples, place, words }| {
            let court = Court::new(&samples, self.meaning, self.subject, !self.court.windowed);
            let unseen = Unseen::new(&samples, self.subject, &self.found.stand.fit.power, &self.findings.tones);
            let [before, there] = self.another(&court, &unseen, model)?;
            Some(Elsewhere::new(words, &there, errors.with_part(place, [&before.score, &there.score])))
        })
    }

    /// The errors of a model and of one with the matrices and factors of a stretch's own, where that is likelier and takes more than the tolerance off the free
    /// run's error, of the model as it is and as the balance of forces alone makes it.
    fn another(&self, court: &Court, unseen: &Unseen<'_>, (chosen, stand): (&[Chosen], &Stand)) -> Option<[Errors; 2]> {
        let own = unseen.refitted(chosen, stand)?;
        let alike = self.subject.stand(chosen, &self.found.stand.fit.power, 3)?;
        let [there, before, alike] = [&own, stand, &alike].map(|stand| self.without_tones(court.errors(self.subject, chosen, stand)));
        let gone = before.taken_by(&there, court.block()).min(alike.taken_by(&there, court.block()));
        (gone > self.options.tolerance).then_some([before, there])
    }
}

impl Elsewhere {
    fn new(stretch: String, there: &Errors, floor: Score) -> Self {
        Elsewhere { told: AnotherPlant { stretch, nrmse: there.score.nrmse.clone() }, floor }
    }

    pub fn sentence(&self) -> String {
        let most = self.told.nrmse.iter().flatten().fold(0.0, |most: f64, e| most.max(*e));
        format!(
            "{} is as of another plant than the part that was fitted: with the model's matrices and factors fitted to it, its free run errs by {:.1} % of the output (rms) at most; something changed in between, so that what was found is of the fitted part alone, or the form of the model is not the true one: look at the trials or stretches one by one",
            self.told.stretch,
            100.0 * most
        )
    }
}
