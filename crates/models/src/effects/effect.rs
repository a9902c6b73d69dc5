//! What an effect is.

use super::card::Card;
use super::evidence::Evidence;
use super::form::{Form, Scale};
use super::injection::{Injection, Setting};
use super::parameters::{EffectError, Parameters};

/// A cause that data may hide.
pub trait Effect: Send + Sync {
    /// What it is, in words.
    fn card(&self) -> &'static Card;

    /// How a simulation hides it, by parameters that its card has.
    ///
    /// # Errors
    /// [`EffectError`] if a parameter is missing or out of bounds, or the setting lacks what the effect needs.
    fn injection(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError>;

    /// The same by any parameters.
    ///
    /// # Errors
    /// Those of [`Effect::injection`], and one for a name that the card lacks.
    fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        parameters.require_known(self.card())?;
        self.injection(parameters, setting)
    }

    /// The forms that a search tries on a recording of this scale; none for effects that are detected in another way.
    fn forms(&self, _scale: &Scale) -> Vec<Form> {
        Vec::new()
    }

    /// Effects that a cause of this one may be in truth: where its form has gone, they would make the same response.
    fn stands_for(&self, _evidence: &Evidence<'_>) -> &'static [&'static str] {
        &[]
    }

    /// Effects that make the same force wherever this one is offered: nothing in effort and motion tells them apart.
    fn twins(&self) -> &'static [&'static str] {
        &[]
    }

    /// Its name.
    fn name(&self) -> &'static str {
        self.card().name
    }
}
