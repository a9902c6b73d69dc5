//! What is left of a joint's torque that is no noise.

use crate::answer::Answer;
use crate::model::residual;
use ndof_models::robot::Robot;
use ndof_signal::rms;
use statrs::distribution::{ContinuousCDF, FisherSnedecor, Normal};

/// Torque that is left of a joint (N m), and how it shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Remains {
    /// Polynomials of its angle and speed predict it.
    Follows(f64),
    /// It lasts, or comes again with the motion, whatever its form.
    ComesAgain(f64),
    /// What was held out misses so much more than what all causes together leave of what was fitted.
    More(f64),
    /// The joint moves in what was held out alone: nothing says how much of it is noise.
    Unfitted(f64),
}

/// Standard errors beyond which a variance is no longer that of the noise, by the normal law.
const BEYOND: f64 = 4.0;

impl Answer<'_> {
    /// Of a joint, if it matters.
    pub fn remains(&self, j: usize) -> Option<Remains> {
        let (gain, removed, again, matters) =
            (&self.left.gains[j], self.left.removed[j], self.comes_again(j), self.options.tolerance * self.scene.joints[j].torque);
        if gain.ci95()[0] > 0.0 && removed > matters {
            return Some(Remains::Follows(removed));
        }
        if again > 0.0 {
            return Some(Remains::ComesAgain(again));
        }
        self.more(j, matters)
    }

    /// What the held-out part misses beyond the noise of the fitted one: by Fisher's law, both variances being known from as many samples as blocks of the noise's memory hold.
    fn more(&self, j: usize, matters: f64) -> Option<Remains> {
        let floor = &self.searched.floor[j];
        let memory = (1 + self.held.noise[j].coefficients.len()) as f64;
        let [held, fitted] = [self.held.moved(j) as f64, floor.samples].map(|samples| samples / memory);
        let error = rms(&residual(self.held, self.model).of_joint(j)).powi(2) / self.held.moving(j);
        if self.held.moved(j) == 0 {
            return None;
        }
        if self.fitted.moved(j) == 0 {
            return Some(error.sqrt()).filter(|error| *error > matters).map(Remains::Unfitted);
        }
        let (more, ratio) = ((error - floor.deviation.powi(2)).max(0.0).sqrt(), error / floor.deviation.powi(2).max(f64::MIN_POSITIVE));
        // Beyond this ratio the tail is zero to the last bit, and the law's own quotients overflow.
        let chance = FisherSnedecor::new(held.max(1.0), fitted.max(1.0)).map_or(1.0, |law| law.sf(ratio.min(1e100)));
        (chance < Normal::standard().sf(BEYOND) && more > matters).then_some(Remains::More(more))
    }

    /// The same in words.
    pub fn what_remains(&self, j: usize) -> Option<String> {
        let (name, unit) = (&self.scene.chain.joints().names[j], self.unit_at(j, "N m"));
        Some(match self.remains(j)? {
            Remains::Follows(left) => {
                format!("at {name} a torque of {left:.3} {unit} rms is left that follows from its angle and speed and that no cause explains")
            }
            Remains::ComesAgain(left) => {
                format!("at {name} a torque of {left:.3} {unit} rms is left that lasts, or comes again with its angle and speed, and that no cause explains")
            }
            Remains::More(left) => format!(
                "at {name} a torque of {left:.3} {unit} rms more is missed in what was held out than all causes together leave of what was fitted, and no cause explains it: something acts there alone; hold out another stretch with --held-out FROM-TO to see it fitted"
            ),
            Remains::Unfitted(left) => format!(
                "{name} moves in what was held out alone, and a torque of {left:.3} {unit} rms is missed there: nothing of it was fitted; let it move in both parts, or hold out another stretch with --held-out FROM-TO"
            ),
        })
    }
}
