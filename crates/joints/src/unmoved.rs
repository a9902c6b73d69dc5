//! Joints that hardly move: whose encoder does not show how.

use crate::causes::Form;
use crate::column::Column;
use crate::table::View;
use ndof_signal::{Recording, rms};
use ndof_sysid::Ports;

/// For each joint whether it goes no further than a step of its encoder in the time that the band resolves: its rate is then that of single steps, which follow from nothing.
pub(crate) fn unmoved(view: &View<'_>, trials: &[Recording], ports: &Ports) -> Vec<bool> {
    let of = |(j, angle): (usize, &usize)| {
        let step = trials.iter().map(|trial| step(&trial.channels()[*angle].samples)).fold(f64::INFINITY, f64::min);
        let rate = view.series(&[Column::Velocity(j)])[0].of_joint(j);
        rms(&rate) / view.moving(j).sqrt() < step * 2.0 * view.band.pass_hz
    };
    ports.outputs.iter().enumerate().map(of).collect()
}

/// The smallest step from one sample to the next: that of the encoder, where one is seen.
fn step(angle: &[f64]) -> f64 {
    angle.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min)
}

/// Whether a form is of what the motion of such a joint alone would tell.
pub(crate) fn needs_motion(form: &Form, unmoved: &[bool]) -> bool {
    form.cause.card.side == "joint" && form.joint.is_some_and(|j| unmoved[j])
}

/// In words.
pub(crate) fn words(joint: &str) -> String {
    format!(
        "{joint} hardly moves: in the time that the band resolves it goes no further than a step of its encoder. Friction, rotor, springs, stops and gear of it cannot be told, and are not asked; let it move over a good part of its range"
    )
}
