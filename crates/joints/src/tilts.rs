//! The base: how far it is tilted by itself.

use crate::bodies::{cross, most_across, size, tilt_to, turned, turning, unit};
use crate::causes::{Form, Told};
use crate::column::Column;
use crate::logged::Logged;
use crate::model::Model;
use crate::table::View;
use crate::zeros::usual;

/// Steps of Gauss and Newton: each squares what is left of an angle.
const STEPS: usize = 4;

/// The form of a tilt at where it settles beside what any joint may have. Torques are lines of gravity, whose direction is where it starts from: from no tilt a large one is not
/// found. What differs by less than the tolerance does not matter: a small tilt is the file's line.
pub(crate) fn by_itself(view: &View<'_>, forms: &[Form], tolerance: f64) -> Option<Form> {
    let axis = |column: &Column| if let Column::Tilt { axis, .. } = column { Some(*axis) } else { None };
    let form = forms.iter().find(|form| form.columns.first().and_then(axis).is_some())?;
    let (cause, file, joints) = (form.cause, view.scene.chain.gravity(), view.scene.joints.len());
    let beside = Form::new(cause, None, usual(joints), vec![]);
    // How much more of these gravities there is beside a tilt.
    let more = |gravities: &[[f64; 3]], tilt: [f64; 3]| {
        let columns = gravities.iter().map(|gravity| Column::Weight(*gravity)).collect();
        let logged = Logged { tilt, ..Logged::as_it_is(joints) };
        let factors = Model::fit(view, &[Form::new(cause, None, columns, vec![]), beside.clone()], &logged).factors.swap_remove(0);
        let sum = |k: usize| gravities.iter().zip(&factors).map(|(gravity, factor)| gravity[k] * factor).sum::<f64>();
        [0, 1, 2].map(sum)
    };
    let upright = [0, 1, 2].map(unit);
    let mut gravity = plus(file, more(&upright, [0.0; 3]));
    for _ in 0..STEPS {
        let tilt = tilt_to(file, gravity, 0.0);
        gravity = plus(file, turned(file, &tilt));
        let across = most_across(gravity);
        let other = cross(gravity, across);
        gravity = plus(gravity, more(&[across, other.map(|x| x / size(other))], tilt));
    }
    let at = tilt_to(file, gravity, tolerance);
    // The other way up only a turn about one axis is seen.
    let over = size(turned(file, &at)) >= 2.0 * size(file) * (1.0 - tolerance * tolerance);
    let kept = form.columns.iter().zip(&form.told).filter_map(|(column, told)| Some((axis(column)?, told))).filter(|(axis, _)| !over || at[*axis] != 0.0);
    let (columns, told) = kept.enumerate().map(|(k, (axis, told))| (Column::Tilt { axis, at }, Told { parts: vec![(k, 1.0)], ..told.clone() })).unzip();
    // What a line from no tilt misses of it.
    let (lines, whole) = (turning(file, &[0.0; 3]), turned(file, &at));
    let bent = std::array::from_fn(|k| whole[k] - (0..3).map(|axis| lines[axis][k] * at[axis]).sum::<f64>());
    (at.iter().all(|x| x.is_finite()) && size(bent) > tolerance * size(file)).then(|| Form { columns, told, ..form.clone() })
}

/// How far a form says that the base is tilted.
pub(crate) fn tilt_of(form: &Form) -> [f64; 3] {
    if let Some(Column::Tilt { at, .. }) = form.columns.first() { *at } else { [0.0; 3] }
}

fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + b[k])
}
