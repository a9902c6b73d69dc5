//! Measured records of others; each test says so and passes where its record is not at hand.

use crate::records::{self, Row};

fn at_hand<T, E: std::fmt::Debug>(found: Option<Result<T, E>>) -> Option<T> {
    if found.is_none() {
        println!("skipped: the record is not at hand");
    }
    found.map(|f| f.expect("a fit"))
}

fn held_out(rows: &[Row], name: &str) -> f64 {
    rows.iter().find(|r| r.name == name).map(|r| r.held_out.vaf_percent[0]).expect("a row")
}

#[test]
fn the_carriage_has_its_published_mass_and_friction() {
    let Some((published, rows)) = at_hand(records::emps()) else { return };
    // Janot, Gautier & Brunot (2019): 95.11 kg, 203.5 N s/m, 20.39 N, −3.16 N.
    for (found, value) in published.parameters.iter().zip([95.11, 203.5, -3.16, 20.39]) {
        assert!((found.value / value - 1.0).abs() < 0.02, "{found:?} against {value}");
        assert!((found.ci95[0]..=found.ci95[1]).contains(&value), "{found:?} against {value}");
    }
    // Free-running on held-out data, dry friction halves what is left.
    assert!(2.0 * rows[1].held_out.nrmse[0] < rows[0].held_out.nrmse[0] && rows[1].held_out.vaf_percent[0] > 99.9);
}

#[test]
fn the_ankle_has_a_delayed_reflex_in_one_direction() {
    let Some(rows) = at_hand(records::ankle()) else { return };
    let intrinsic = held_out(&rows, "inertia, damping, stiffness");
    let best = held_out(&rows, "and a reflex to positive velocity");
    assert!((57.0..65.0).contains(&intrinsic) && best >= 90.0, "{intrinsic} {best}");
    assert!(best > held_out(&rows, "and a linear reflex") + 5.0 && best > held_out(&rows, "and a reflex to negative velocity") + 15.0);
    let delay = rows[2].fit.parameters.iter().find(|p| p.name == "reflex_delay_s").expect("a delay");
    assert!(delay.ci95[0] > 0.04 && delay.ci95[1] < 0.06, "{delay:?}");
}

#[test]
fn no_static_curve_does_what_hysteresis_does_for_the_damper() {
    let Some((curve, rows)) = at_hand(records::damper()) else { return };
    assert!(held_out(&rows, "and Bouc-Wen") > curve + 10.0, "{curve} {:?}", rows.iter().map(|r| r.held_out.vaf_percent[0]).collect::<Vec<_>>());
}
