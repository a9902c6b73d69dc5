//! What a simulator that is judged has beside the file's robot.

use crate::causes::Form;
use crate::column::Column;
use crate::model::solved;
use crate::sizes::Sizes;
use crate::table::View;

/// Adds what a simulator has more of a joint's friction, rotor and springs than the file to what its numbers start from, where that is at least
/// `tolerance` of the joint's torque: what was found beside the simulator's own is then the robot's, whatever the file says.
///
/// All forces that files have words for are fitted together to the simulator's torques less the file's, along its own motion.
pub(crate) fn beside_the_file(view: &View<'_>, forms: &mut [Form], tolerance: f64) {
    let plain = |form: &&Form| form.shape.is_empty() && form.cause.card.side != "sensor" && form.columns.iter().all(is_of_a_file);
    let own: Vec<Form> = forms.iter().filter(plain).cloned().collect();
    let mut columns: Vec<Column> = Vec::new();
    own.iter().flat_map(|form| &form.columns).for_each(|column| {
        if !columns.contains(column) {
            columns.push(column.clone());
        }
    });
    let beyond = view.together(1, |motion| vec![motion.beyond.iter().cloned().enumerate().collect()]).swap_remove(0).whitened(&view.noise);
    let (_, found) = solved(&view.white(&columns), &beyond);
    let sizes = Sizes::new(view, &own);
    for (k, plain) in own.iter().enumerate().filter(|(_, form)| form.cause.card.side == "joint") {
        let places: Vec<usize> = plain.columns.iter().filter_map(|column| columns.iter().position(|own| own == column)).collect();
        let factors = found.of(&places);
        if sizes.share(k, &factors) < tolerance {
            continue;
        }
        let more = |parts: &[(usize, f64)]| parts.iter().map(|(k, w)| w * factors[*k]).sum::<f64>();
        for form in forms.iter_mut().filter(|form| form.joint == plain.joint) {
            let alike = form.same_place(plain);
            for told in &mut form.told {
                // A level at rest is the level in motion and what is beyond it; a gear has the rotor before it.
                let named = |own: &str| own == told.name && (alike || own == "rotor_kg_m2") || alike && own == "level_nm" && told.name == "stribeck_level_nm";
                if let Some(own) = plain.told.iter().find(|own| named(&own.name)) {
                    told.file += more(&own.parts);
                    if let (Some((file, _)), Some((_, parts))) = (&mut told.over, &own.over) {
                        *file += more(parts);
                    }
                }
            }
        }
    }
}

/// Whether a robot's file has a number for it.
fn is_of_a_file(column: &Column) -> bool {
    match column {
        Column::Velocity(_) | Column::Sign(_) | Column::Turn { .. } | Column::Soft { .. } | Column::Acceleration(_) | Column::Body { .. } => true,
        // A spring, by what it pulls at rest and by its stiffness.
        Column::Constant(_) | Column::Power { power: 1, .. } => true,
        _ => false,
    }
}
