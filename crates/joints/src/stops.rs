//! A file's stops beside what the motion shows.

use crate::answer::Answer;
use crate::causes::Form;
use crate::column::Column;
use ndof_models::robot::Robot;

/// Joint, whether it is the stop towards larger angles, and where it is.
fn stop_of(form: &Form) -> Option<(usize, bool, f64)> {
    if let [Column::Stop { joint, from, above, .. }] = form.columns[..] { Some((joint, above, from)) } else { None }
}

impl Answer<'_> {
    /// What the file says of a stop that was found, where it says anything.
    pub fn of_the_file(&self, form: &Form) -> Option<String> {
        let (joint, above, found) = stop_of(form)?;
        let file = self.scene.chain.ranges()[joint][usize::from(above)];
        let unit = self.unit_at(joint, "rad");
        file.is_finite().then(|| format!("the file says that the joint goes to {file:.4} {unit}, the data that it is stopped at {found:.4} {unit}"))
    }

    /// In words, ends of the file's ranges that the motion goes beyond without a stop.
    pub fn passed_stops(&self) -> Vec<String> {
        let mut out = Vec::new();
        for (joint, ends) in self.scene.chain.ranges().iter().enumerate() {
            let (scale, unit) = (&self.scene.joints[joint], self.unit_at(joint, "rad"));
            for (above, end) in [(false, ends[0]), (true, ends[1])] {
                let (reached, sign) = if above { (scale.range[1], 1.0) } else { (scale.range[0], -1.0) };
                let stopped = self.model.forms.iter().filter_map(stop_of).any(|(j, side, _)| (j, side) == (joint, above));
                if sign * (reached - end) > scale.angle_noise && !stopped {
                    out.push(format!(
                        "{} goes to {reached:.4} {unit}, where the file's range ends at {end:.4} {unit}, and no stop is felt: the range in the file is too narrow, or the angle's zero is elsewhere",
                        self.scene.chain.joints().names[joint]
                    ));
                }
            }
        }
        out
    }
}
