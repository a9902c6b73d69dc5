//! Inertia, damping and stiffness over a schedule: curves with bands, the mean movement, whether they vary.

use super::path::path_figure;
use crate::figures::{self, FigureError, ScheduleCurve, ScheduleCurves};
use crate::number::{nan, significant};
use crate::{Section, Table};
use ndof_analysis::Trials;
use ndof_analysis::fit::result::Parameter;
use ndof_analysis::fit::schedule::result::{ScheduleEntry, ScheduleResult};
use ndof_analysis::result::word;
use ndof_models::schedule::Term;

/// A probability below this is called evidence in words.
const EVIDENT: f64 = 0.05;

/// The curves that vary with their bands beside the `constant` fit, the mean movement of `trials` with the stiffness along its path, and what
/// varying matrices explain.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn schedule_section(found: &ScheduleResult, constant: &[Parameter], trials: &Trials) -> Result<Section, FigureError> {
    let axis = (found.label(), found.unit.clone());
    let grid = |curves: Vec<ScheduleCurve>, columns: usize| ScheduleCurves { axis: axis.clone(), at: found.at.clone(), curves, columns };
    let mut section = Section::new(format!("Over the schedule: {}", found.label().to_lowercase()), lead(found));
    for (term, name, title) in [
        (Term::Stiffness, "stiffness-over-schedule", "Stiffness"),
        (Term::Damping, "damping-over-schedule", "Damping"),
        (Term::Inertia, "inertia-over-schedule", "Inertia"),
    ] {
        let own: Vec<ScheduleCurve> = found.entries.iter().filter(|e| e.varies && e.name.starts_with(term.symbol())).map(|e| curve(e, constant)).collect();
        if !own.is_empty() {
            let columns = (own.len() as f64).sqrt().round() as usize;
            let caption = "Dark: 95 % interval at each place by itself; light: 95 % band that holds the whole curve.";
            section = section.figure(figures::schedule(name, &format!("{title} over {}", found.label().to_lowercase()), &grid(own, columns))?.caption(caption));
        }
        let own: Vec<ScheduleCurve> = found.joint.iter().filter(|e| e.varies && e.name.starts_with(term.symbol())).map(|e| curve(e, &[])).collect();
        if !own.is_empty() {
            let columns = (own.len() as f64).sqrt().round() as usize;
            let caption = "At the joints, in the posture of the mean movement.";
            let (name, title) = (format!("joint-{name}"), format!("Joint {} over {}", word(&term), found.label().to_lowercase()));
            section = section.figure(figures::schedule(&name, &title, &grid(own, columns))?.caption(caption));
        }
    }
    let mean = found.mean_movement.iter().map(|m| ScheduleCurve {
        label: m.channel.clone(),
        unit: m.unit.clone(),
        value: m.value.clone(),
        ..ScheduleCurve::default()
    });
    section = section.figure(figures::schedule("mean-movement", "Mean movement", &grid(mean.collect(), 1))?);
    if let Some(figure) = path_figure(found, trials)? {
        section = section.figure(figure);
    }
    Ok(section.table(constants(found)).table(held_out(found)))
}

fn curve(entry: &ScheduleEntry, constant: &[Parameter]) -> ScheduleCurve {
    let constant = constant.iter().find(|p| p.name == entry.name).and_then(|p| p.value);
    let beside = constant.map(|value| ("constant, fitted to the response".to_owned(), vec![value; entry.value.len()])).into_iter();
    ScheduleCurve {
        label: entry.name.clone(),
        unit: entry.unit.clone(),
        value: entry.value.clone(),
        ci95: Some(entry.ci95.clone()),
        band95: Some(entry.band95.clone()),
        references: beside.chain(entry.truth.clone().map(|truth| ("simulated".to_owned(), truth))).collect(),
    }
}

fn lead(found: &ScheduleResult) -> String {
    let verdict = |term: Term| {
        let p = found.tests.iter().find(|test| test.matrix == term).and_then(|test| test.p_value);
        let name = word(&term);
        match p {
            Some(p) if p < EVIDENT => format!("{name} varies (p {})", significant(p, 2)),
            Some(p) => format!("nothing says that {name} varies (p {})", significant(p, 2)),
            None => format!("whether {name} varies is not known"),
        }
    };
    let how = match &found.command_share {
        Some(_) => "The commanded force is the instrument, so that the limb's own force does not bias the curves.",
        None => "The motion counts as imposed.",
    };
    let verdicts: Vec<String> = Term::ALL.into_iter().map(verdict).collect();
    format!("From 0 to {} Hz, about the mean movement: {}. {how}", significant(found.high_hz, 3), verdicts.join(", "))
}

/// What was held constant.
fn constants(found: &ScheduleResult) -> Table {
    let mut table = Table::new("Constant over the schedule", ["", "Unit"], ["Estimate", "95 % interval"]);
    for entry in found.entries.iter().filter(|entry| !entry.varies) {
        let at = |values: &[f64]| significant(values.first().copied().unwrap_or(f64::NAN), 4);
        table = table.row([entry.name.clone(), entry.unit.clone(), at(&entry.value), format!("{} … {}", at(&entry.ci95[0]), at(&entry.ci95[1]))]);
    }
    table
}

fn held_out(found: &ScheduleResult) -> Table {
    let caption = "Variance accounted for of the deviation from the mean movement, held out [%]";
    let mut table = Table::new(caption, ["Channel"], ["Constant matrices", "Varying ones"]);
    for held in &found.held_out {
        table = table.row([held.channel.clone(), significant(nan(held.constant_vaf), 4), significant(nan(held.varying_vaf), 4)]);
    }
    table
}
