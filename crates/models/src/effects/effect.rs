//! What an effect is.

use super::card::Card;
use super::evidence::Evidence;
use super::form::{Form, Scale};
use super::injection::{Injection, Setting};
use super::latency::Latency;
use super::parameters::{EffectError, Parameters};

/// A cause that data may hide: a card, which is a constant, and functions.
///
/// ```
/// use ndof_models::effects::{Card, Effect, EffectError, Injection, Parameters, Setting, Side, Trace};
///
/// const CARD: Card = Card {
///     name: "rider",
///     what: "a mass of 0.2 kg that rides along",
///     sides: &[Side::Limb],
///     parameters: &[],
///     signature: "the inertia is too large",
///     look_alikes: &["added-mass"],
///     next_experiment: "take it off",
///     equation: "f = m a",
///     source: "Newton's second law",
///     trace: Trace::Forms,
/// };
///
/// fn injection(_: &Parameters, _: &Setting) -> Result<Injection, EffectError> {
///     Ok(Injection::Mass(0.2))
/// }
///
/// static RIDER: Effect = Effect::new(&CARD, injection);
/// assert_eq!(RIDER.name(), "rider");
/// ```
#[derive(Clone, Copy)]
pub struct Effect {
    /// What it is, in words.
    pub card: &'static Card,
    /// How a simulation hides it, by parameters that its card has.
    pub injection: fn(&Parameters, &Setting) -> Result<Injection, EffectError>,
    /// The forms that a search tries on a recording of this scale; none for effects that are detected in another way.
    pub forms: fn(&Scale) -> Vec<Form>,
    /// Effects that a cause of this one may be in truth: where its form has gone, they would make the same response.
    pub stands_for: fn(&Evidence<'_>) -> &'static [&'static str],
    /// Effects that make the same force wherever this one is offered: nothing in effort and motion tells them apart.
    pub twins: &'static [&'static str],
    /// How late channels are by it; none for what delays nothing.
    pub latency: Option<Latency>,
}

impl Effect {
    /// An effect that can be hidden and that no search tries.
    pub const fn new(card: &'static Card, injection: fn(&Parameters, &Setting) -> Result<Injection, EffectError>) -> Self {
        Effect { card, injection, forms: |_| Vec::new(), stands_for: |_| &[], twins: &[], latency: None }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.card.name
    }

    /// The forms that a search tries on a recording of this scale.
    pub fn forms(&self, scale: &Scale) -> Vec<Form> {
        (self.forms)(scale)
    }

    /// Effects that a cause of this one may be in truth, by this evidence.
    pub fn stands_for(&self, evidence: &Evidence<'_>) -> &'static [&'static str] {
        (self.stands_for)(evidence)
    }

    /// How a simulation hides it.
    ///
    /// # Errors
    /// [`EffectError`] if a parameter is missing, out of bounds or none of the card's, or the setting lacks what the effect needs.
    pub fn inject(&self, parameters: &Parameters, setting: &Setting) -> Result<Injection, EffectError> {
        parameters.require_known(self.card)?;
        (self.injection)(parameters, setting)
    }
}
