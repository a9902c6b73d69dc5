//! Names whose form has gone where another cause would make the same response: they are said, but not for sure.

use super::{Answer, UNSURE};
use crate::result::{Cause, Confusable};
use ndof_models::effects::{Value, find};

/// A loop that yields within this share of the displacement's standard deviation is as good as dry friction.
const NARROW: f64 = 0.12;
/// Shapes of a spring's force: any two of them on one axis make what a third is.
const SPRINGS: [&str; 4] = ["cubic-stiffness", "asymmetric-stiffness", "dead-zone", "end-stop"];
/// A gap of this many standard deviations of the displacement to either side is a spring that hardens.
const WIDE: f64 = 0.9;
/// A mode damped more than this does not swing: a reflex or a relaxation answers alike.
const DEAD: f64 = 0.25;
/// Forms that fit badly ask for helpers: of so many names at once the small ones are not sure.
const MANY: usize = 3;
/// Those of many that explain less than this share of the explainable error
const HELPER: f64 = 0.5;
/// are believed by no more than this.
const CROWD: f64 = 0.85;

fn number(cause: &Cause, name: &str) -> Option<f64> {
    cause.parameters.iter().find(|p| p.name.starts_with(name)).and_then(|p| if let Value::Number(x) = p.value { Some(x) } else { None })
}

impl Answer<'_> {
    /// The causes that each cause may stand for beside itself.
    fn stands_for(&self, cause: &Cause, causes: &[Cause]) -> Vec<&'static str> {
        let beside = |effect: &str| causes.iter().any(|c| c.effect == effect && c.site == cause.site);
        match cause.effect.as_str() {
            "hysteresis" if !beside("coulomb-friction") => {
                let axis = self.meaning.axes.iter().position(|a| *a == cause.site.axis).unwrap_or(0);
                let narrow = number(cause, "yield").is_some_and(|width| width < NARROW * self.subject.scale.position[axis]);
                if narrow { vec!["coulomb-friction"] } else { vec![] }
            }
            "extra-resonance" if number(cause, "damping_ratio").is_some_and(|z| z > DEAD) => vec!["reflex-delay", "viscoelastic"],
            spring if SPRINGS.contains(&spring) && SPRINGS.iter().any(|s| *s != spring && beside(s)) => {
                SPRINGS.iter().copied().filter(|s| *s != spring).collect()
            }
            "cubic-stiffness" if self.mostly_even(&cause.site.axis) => vec!["asymmetric-stiffness"],
            "dead-zone" => {
                let axis = self.meaning.axes.iter().position(|a| *a == cause.site.axis).unwrap_or(0);
                let wide = number(cause, "half_gap").is_some_and(|gap| gap > WIDE * self.subject.scale.position[axis]);
                if wide { vec!["cubic-stiffness"] } else { vec![] }
            }
            _ => vec![],
        }
    }

    /// Whether the cubic of an axis lies so far off its centre that its square does more than its cube, both without their straight-line part.
    fn mostly_even(&self, axis: &str) -> bool {
        let (subject, found) = (self.subject, self.found);
        found.chosen.iter().enumerate().any(|(q, c)| {
            let h = &subject.hypotheses[c.hypothesis];
            let Some(i) = h.form.axis.filter(|i| self.meaning.axes[*i] == axis && h.effect.name() == "cubic-stiffness") else { return false };
            let sigma = subject.scale.position[i];
            // Over a Gaussian x: the rms of x² is √2 σ² about its mean, that of x³ is √6 σ³ about its straight line.
            matches!(subject.coefficients(&found.stand, q), &[cube, square] if square.abs() * 2f64.sqrt() > cube.abs() * 6f64.sqrt() * sigma)
        })
    }

    /// Limits what is believed of such names; whether there are any.
    pub(super) fn stand_ins(&self, causes: &mut [Cause], confusable: &mut Vec<Confusable>) -> bool {
        let limit = |cause: &mut Cause, most: f64| {
            cause.at_most = cause.at_most.min(most);
            cause.probability = cause.probability.min(most);
        };
        let others: Vec<Vec<&'static str>> = causes.iter().map(|c| self.stands_for(c, causes)).collect();
        let mut any = false;
        for (cause, others) in causes.iter_mut().zip(others).filter(|(_, others)| !others.is_empty()) {
            limit(cause, UNSURE);
            any = true;
            let effects: Vec<String> = std::iter::once(cause.effect.as_str()).chain(others.iter().copied()).map(str::to_owned).collect();
            let same = |k: &Confusable| effects.iter().all(|e| k.effects.contains(e));
            if !confusable.iter().any(same) {
                let next_experiment = find(&cause.effect).map_or_else(String::new, |e| e.card().next_experiment.to_owned());
                confusable.push(Confusable { effects, next_experiment, predicted: vec![] });
            }
        }
        if causes.len() >= MANY {
            let helper = |c: &&mut Cause| c.gain.explained_fraction.is_none_or(|share| share < HELPER);
            causes.iter_mut().filter(helper).for_each(|cause| limit(cause, CROWD));
        }
        any
    }
}
