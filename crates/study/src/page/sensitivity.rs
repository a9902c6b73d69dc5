//! What pre-compensation by a wrong model does, as a section.

use crate::sensitivity::result::SensitivityResult;
use ndof_report::number::{nan, significant};
use ndof_report::plot::{Axis, Color, Dash, Figure, Panel, Series};
use ndof_report::{Section, Table};
use std::sync::Arc;

/// Table and picture.
pub(super) fn section(result: &SensitivityResult) -> Section {
    let [low, high] = result.band_hz;
    let low_band = result.low_band_hz[1];
    let below = format!("max below {low_band} Hz");
    let simulated = ["Simulated, max", "Force rms", "K direct, %", "K derived, %", "B direct, %", "B derived, %"];
    let numbers = ["Coherence, max", "mean", &below].into_iter().chain(simulated);
    let mut table = Table::new("Pre-compensation by a model that is not the arm", ["Model"], numbers);
    for row in &result.rows {
        let own = [row.coherence.max, row.coherence.mean, row.coherence_low_max].map(|v| format!("{v:.4}"));
        let simulated = row.simulated.as_ref().map(|s| {
            let share = |v: Option<f64>| significant(100.0 * nan(v), 3);
            vec![format!("{:.4}", s.coherence.max), significant(s.force_rms, 3), share(s.direct.K), share(s.derived.K), share(s.direct.B), share(s.derived.B)]
        });
        table = table.row(std::iter::once(row.model.clone()).chain(own).chain(simulated.unwrap_or_else(|| vec![String::new(); 6])));
    }
    let lead = format!(
        "Coherence between the delivered forces from {low} to {high} Hz: by the linear models without scatter, and of all trials on the simulated device; errors of the fits to the direct and the derived estimate."
    );
    Section::new("Pre-compensation: sensitivity to the model", lead).figure(figure(result)).table(table)
}

fn figure(result: &SensitivityResult) -> Figure {
    let hz: Arc<[f64]> = result.frequency_hz.clone().into();
    let mut panel = Panel::new(Axis::log("Frequency", "Hz"), Axis::linear("Coherence", "").range(0.0, 1.0)).height(180.0);
    let name = format!("every entry off by up to {} %", 100.0 * result.spread);
    panel.series.push(Series::band(name, hz.clone(), vec![0.0; hz.len()], result.envelope.clone(), Color::Grey));
    for (k, (name, values)) in result.curves.iter().enumerate() {
        let label = if name == "none" { "no compensation".to_owned() } else { format!("compensation by the {name}") };
        panel.series.push(Series::line(label, hz.clone(), values.clone(), Color::nth(k)).dash(if k == 0 { Dash::Solid } else { Dash::Dashed }));
    }
    Figure::new("sensitivity", "Coherence between the delivered forces")
        .caption("By the linear models, for independent designed forces. 0: the forces are independent; 1: one follows from the other.")
        .panel("", panel)
}
