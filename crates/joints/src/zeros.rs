//! Zeros of angles: how far each is off by itself.

use crate::causes::Form;
use crate::column::Column;
use crate::logged::Logged;
use crate::model::Model;
use crate::table::View;

/// Steps of Gauss and Newton: each squares what is left of an angle.
const STEPS: usize = 4;

/// What any joint may have: an offset, viscous and dry friction.
pub(crate) fn usual(joints: usize) -> Vec<Column> {
    (0..joints).flat_map(|j| [Column::Constant(j), Column::Velocity(j), Column::Sign(j)]).collect()
}

/// The forms of a zero that is off, at where each settles beside what any joint may have: an offset, dry and viscous friction. Weight is no line of an angle, and a
/// link that is corrected bends as well as it does.
pub(crate) fn by_themselves(view: &View<'_>, forms: &[Form]) -> Vec<Form> {
    let joints = view.scene.joints.len();
    let settled = |form: &Form| {
        let [Column::Zero { joint, .. }] = form.columns[..] else { return None };
        let both = [form.clone(), Form::new(form.cause, None, usual(joints), vec![])];
        let mut logged = Logged::as_it_is(joints);
        for _ in 0..STEPS {
            logged.zero[joint] += Model::fit(view, &both, &logged).factors[0][0];
        }
        let at = logged.zero[joint];
        (at.is_finite() && at != 0.0).then(|| Form { columns: vec![Column::Zero { joint, at }], ..form.clone() })
    };
    forms.iter().filter_map(settled).collect()
}
