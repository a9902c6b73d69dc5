//! What is left beside a model, and what that makes of it.

use crate::answer::Answer;
use crate::causes::Form;
use crate::judged::share;
use crate::model::residual;
use crate::refined::refined;
use ndof_diagnose::{NoiseFloor, Score, Verdict};
use ndof_signal::{deviation, rms};

impl Answer<'_> {
    /// What no column of any cause removes, and the noise above the band.
    pub fn floor(&self, reached: &Score) -> NoiseFloor {
        let band = residual(self.held, self.model);
        let nrmse = (0..self.joints())
            .map(|j| {
                let within = band.of_joint(j);
                let logged: Vec<f64> = self.held.pieces.iter().flat_map(|p| p.places.iter().map(|k| self.held.motions[p.trial].torque[j][*k])).collect();
                let spread = deviation(&logged);
                let above = (reached.nrmse[j]?.powi(2) - (rms(&within) / spread).powi(2) / self.held.moving(j)).max(0.0);
                let floor = Some((above + (self.searched.floor[j].deviation / spread).powi(2)).sqrt()).filter(|x| x.is_finite())?;
                // What comes again is no noise; what no past foretells is.
                let [known, new] = [self.comes_again(j), self.held.noise[j].deviation].map(|x| x / self.scene.joints[j].torque);
                let r = reached.nrmse[j]?;
                Some(floor.min(r).min((r * r - known * known).max(new * new).sqrt()))
            })
            .collect();
        let how = format!("what all causes together leave of what was fitted, and the torque above {:.2} Hz", self.fitted.band.pass_hz);
        NoiseFloor { nrmse, how }
    }

    /// Whether a form that was set aside is beyond chance and matters in what was fitted, and does not act in what was held out.
    pub fn is_unseen(&self, form: &Form) -> bool {
        let forms: Vec<Form> = self.model.forms.iter().chain([form]).cloned().collect();
        let with = refined(self.fitted, &forms, &self.model.logged);
        let last = self.model.forms.len();
        let p_value = self.searched.rule(self.forms, self.options).p_value(form, self.fitted_gain(self.model, &with), form.columns.len());
        let [here, there] = [self.fitted, self.held].map(|view| share(view, &with, last));
        p_value <= self.options.false_alarms && form.allows(&with.factors[last]) && here >= self.options.tolerance && there < self.options.tolerance
    }

    /// Whether torque is left that follows from the motion, and matters: what polynomials of angle and speed predict, what comes again with them whatever its form, what
    /// columns of causes that were set aside remove, what acts for a while, or what could not be asked of the held-out part; or whether the log is not of the file's torques.
    pub fn verdict(&self, unseen: bool) -> Verdict {
        let structured = unseen
            || !self.taken.is_as_it_is()
            || self.lost.is_some()
            || self.passing.iter().any(Option::is_some)
            || (0..self.joints()).any(|j| self.remains(j).is_some());
        match (self.model.forms.is_empty(), structured) {
            (true, false) => Verdict::Adequate,
            (true, true) => Verdict::Unexplained,
            (false, false) => Verdict::Explained,
            (false, true) => Verdict::PartlyExplained,
        }
    }

    /// Torque of a joint that is left and comes again with its motion, where it is beyond chance, of all joints, that it matters (N m).
    ///
    /// An encoder's steps come again on the same path, too: what they make of the motion is in the band no more than the noise of the torque.
    pub fn comes_again(&self, j: usize) -> f64 {
        let joint = &self.scene.joints[j];
        let size = (self.options.tolerance * joint.torque).max((joint.hiss * self.fitted.band.pass_hz).sqrt());
        if self.again[j].is_beyond(size, self.options.false_alarms / self.joints() as f64) { self.again[j].rms } else { 0.0 }
    }
}

/// Share of the error above its floor, squared and of all joints, that is gone.
pub(crate) fn removed(before: &Score, after: &Score, floor: &NoiseFloor) -> f64 {
    let sum = |nrmse: &[Option<f64>]| nrmse.iter().flatten().map(|x| x * x).sum::<f64>();
    let [before, after, floor] = [&before.nrmse, &after.nrmse, &floor.nrmse].map(|nrmse| sum(nrmse));
    if before > floor { ((before - after) / (before - floor)).clamp(0.0, 1.0) } else { 0.0 }
}
