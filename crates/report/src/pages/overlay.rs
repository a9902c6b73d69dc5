//! Models beside measurements in time, and what they leave.

use crate::figures::{self, FigureError, Residual, Trace, Traces};
use crate::number::significant;
use crate::{Figure, Section, Table};
use ndof_analysis::{Fitted, Leftover, Trials, leftover, overlay};
use std::path::Path;

/// The fitted model over the first trial, its residual, and how well it runs on every trial; nothing where the band is too narrow.
///
/// # Errors
/// [`FigureError`] if a picture cannot be drawn.
pub fn overlay_section(trials: &Trials, fitted: &Fitted) -> Result<Option<Section>, FigureError> {
    let mut all = trials.trials.iter().filter_map(|trial| overlay(trials, trial, fitted)).peekable();
    let Some(first) = all.peek().cloned() else { return Ok(None) };
    let mut table = Table::new("Variance accounted for in time [%]", ["Trial"], first.outputs.iter().map(|run| run.name.as_str()));
    for one in all {
        let share = |measured: &[f64], simulated: &[f64]| leftover(measured, simulated, one.sample_rate_hz, one.band_hz).map_or(f64::NAN, |l| l.vaf_percent);
        let cells = one.outputs.iter().map(|run| significant(share(&run.measured, &run.simulated), 4));
        table = table.row(std::iter::once(one.file.clone()).chain(cells).collect::<Vec<_>>());
    }
    let runs: Vec<Compared> = first
        .outputs
        .iter()
        .map(|run| Compared {
            output: run.name.clone(),
            unit: run.unit.clone(),
            measured: &run.measured,
            models: vec![("simulated", run.simulated.as_slice())],
        })
        .collect();
    let inputs = trials.names(&trials.roles.ports.inputs).join(", ");
    let lead = format!(
        "The fitted model runs from {inputs} alone; both are shown within the fitted band, {} to {} Hz. The fit has seen these data.",
        significant(first.band_hz[0], 2),
        significant(first.band_hz[1], 3)
    );
    let clock = (first.sample_rate_hz, first.start_s);
    let title = format!("Measured and simulated, {}", Path::new(&first.file).file_name().unwrap_or_default().to_string_lossy());
    let mut section = Section::new("Simulated beside measured", lead).figure(run_figure("simulated", &title, clock, &runs)?);
    if let Some(figure) = residual_figure("residual", "What the model leaves", clock, first.band_hz, &runs)? {
        section = section.figure(figure);
    }
    Ok(Some(section.table(table)))
}

/// One output beside what models make of it, the best one last.
pub(super) struct Compared<'a> {
    pub output: String,
    pub unit: String,
    pub measured: &'a [f64],
    pub models: Vec<(&'static str, &'a [f64])>,
}

/// Every output with its models over the whole time and enlarged.
pub(super) fn run_figure(name: &str, title: &str, (sample_rate_hz, start_s): (f64, f64), runs: &[Compared<'_>]) -> Result<Figure, FigureError> {
    const DETAIL_S: f64 = 4.0;
    let duration = runs.first().map_or(0, |run| run.measured.len()) as f64 / sample_rate_hz;
    let (middle, half) = (start_s + duration / 2.0, 0.5 * DETAIL_S.min(duration / 4.0));
    let traces = runs
        .iter()
        .map(|run| Trace {
            label: run.output.clone(),
            unit: run.unit.clone(),
            measured: run.measured.to_vec(),
            simulated: run.models.iter().map(|(model, samples)| ((*model).to_owned(), samples.to_vec())).collect(),
        })
        .collect();
    figures::traces(name, title, &Traces { sample_rate_hz, start_s, traces, detail_s: Some((middle - half, middle + half)) })
}

/// What the last model of each output leaves; nothing where one of them has no finite run or the band is too narrow.
pub(super) fn residual_figure(name: &str, title: &str, clock: (f64, f64), band_hz: [f64; 2], runs: &[Compared<'_>]) -> Result<Option<Figure>, FigureError> {
    let left: Option<Vec<Leftover>> =
        runs.iter().map(|run| run.models.last().and_then(|(_, simulated)| leftover(run.measured, simulated, clock.0, band_hz))).collect();
    let Some(left) = left else { return Ok(None) };
    if left.is_empty() {
        return Ok(None);
    }
    let residuals: Vec<Residual> = runs.iter().zip(left).map(|(run, left)| Residual { output: run.output.clone(), unit: run.unit.clone(), left }).collect();
    Ok(Some(figures::residual(name, title, clock, &residuals)?))
}
