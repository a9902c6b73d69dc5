//! The report of a design: how coherent the axes are, what will move.

use crate::design::Designed;
use ndof_report::figures::{self, FigureError, Traces};
use ndof_report::number::{nan, significant};
use ndof_report::pages::channel_traces;
use ndof_report::plot::{Axis, Color, Figure, Panel, Series};
use ndof_report::{Report, Section, Table};

/// The page of `ndof design`.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn design_report(designed: &Designed, command: &str) -> Result<Report, FigureError> {
    let result = &designed.result;
    let lead = match result.pooled.as_ref().map(|p| p.delivered.unwrap_or(p.commanded)) {
        Some(size) => format!("All trials pooled, the axes reach a coherence of {:.3} with each other.", size.max),
        None => "One perturbation an axis.".to_owned(),
    };
    let mut report = Report {
        lead,
        facts: vec![
            ("Kind".to_owned(), result.kind.clone()),
            ("Axes".to_owned(), result.axes.join(", ")),
            ("Trials".to_owned(), format!("{} of {} s at {} Hz", result.trials.len(), result.duration_s, result.sample_rate_hz)),
            ("Pre-compensated".to_owned(), if result.precompensated { "yes" } else { "no" }.to_owned()),
        ],
        ..Report::of(&result.head, "Perturbation", command)
    };
    if !designed.curves.is_empty() {
        report
            .sections
            .push(Section::new("Coherence between the axes", "Of each axis with all others, the largest, all trials pooled.").figure(curves(&designed.curves)));
    }
    let mut table = Table::new("Predicted motion", ["Limb", "Axis"], ["Displacement, rms", "peak", "Velocity, peak"]);
    for m in &result.motion {
        let numbers = [m.displacement_rms, m.displacement_peak, m.velocity_peak].map(|v| significant(v, 3));
        table = table.row([m.limb.clone(), m.axis.clone()].into_iter().chain(numbers));
    }
    report.sections.push(Section::new("Motion", "What the perturbation does to a soft and a stiff limb, in m and m/s or rad and rad/s.").table(table));
    if let Some(plan) = &result.length {
        let mut table = Table::new("Length", ["Parameter"], ["Value", "Half width, %"]);
        for p in &plan.predicted {
            table = table.row([p.name.clone(), significant(nan(p.value), 4), significant(100.0 * nan(p.half_width), 3)]);
        }
        let lead = match plan.duration_s {
            Some(s) => format!("{} trial(s) of {s:.0} s give the wanted intervals; this design itself those of the table.", plan.trials),
            None => "No length gives all of the wanted intervals; this design itself those of the table.".to_owned(),
        };
        report.sections.push(Section::new("Length", lead).table(table));
    }
    if let Some(first) = designed.recordings.first() {
        let traces = Traces {
            sample_rate_hz: first.sample_rate_hz(),
            start_s: -result.lead_in_s,
            traces: channel_traces(first),
            detail_s: Some((0.0, 5.0_f64.min(result.duration_s))),
        };
        report.sections.push(Section::new("Commands", "The first trial.").figure(figures::traces("commands", "Commands", &traces)?));
    }
    Ok(report)
}

/// Coherence over frequency, one line a stage.
pub(super) fn curves(curves: &[(String, Vec<f64>, Vec<f64>)]) -> Figure {
    let mut panel = Panel::new(Axis::log("Frequency", "Hz"), Axis::linear("Coherence", "").range(0.0, 1.0)).height(180.0);
    for (k, (name, hz, values)) in curves.iter().enumerate() {
        panel.series.push(Series::line(name.as_str(), hz.clone(), values.clone(), Color::nth(k)));
    }
    Figure::new("input-coherence", "Coherence between the axes").caption("0: the axes are independent; 1: one follows from the others.").panel("", panel)
}
