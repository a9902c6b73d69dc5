//! What a simulation gets wrong, and what a named cause changes.

use std::sync::Arc;

use super::error::{FigureError, expect_shape};
use super::forest::{Estimate, Forest, ForestGroup, forest};
use crate::number::significant;
use crate::plot::{Axis, Color, Figure, Panel, Pin, Scale, Series};
use crate::table::Table;

/// Shares that sum to one, as one bar: linear, nonlinear, time-varying, noise.
///
/// # Errors
/// [`FigureError::Empty`] without a share.
pub fn shares(name: &str, title: &str, parts: &[(String, f64)]) -> Result<Figure, FigureError> {
    if parts.is_empty() {
        return Err(FigureError::Empty { what: "the list of shares" });
    }
    let mut panel = Panel::new(Axis::linear("Share of the error's power", "%").range(0.0, 100.0), Axis::names(vec![String::new()])).height(34.0);
    let mut table = Table::new(title, ["Part"], ["Share [%]"]);
    let mut from = 0.0;
    for (k, (label, share)) in parts.iter().enumerate() {
        let width = if share.is_finite() { 100.0 * share.max(0.0) } else { 0.0 };
        let to = from + width;
        panel.series.push(Series::area(label.as_str(), vec![from, to, to, from], vec![0.12, 0.12, 0.88, 0.88], Color::nth(k)));
        if width >= 6.0 {
            panel.pins.push(Pin { x: 0.5 * (from + to), y: 0.5, label: format!("{} %", significant(width.round(), 2)), centred: true });
        }
        table = table.row([label.clone(), significant(100.0 * share, 2)]);
        from = to;
    }
    let mut figure = Figure::new(name, title).panel("", panel);
    figure.table = Some(table);
    Ok(figure)
}

/// A quantity in stretches of frequency or time: one line an output.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretches {
    /// Name and unit of what is cut into stretches, e.g. ("Frequency", "Hz").
    pub over: (String, String),
    /// Even or logarithmic.
    pub scale: Scale,
    /// Borders; one more than there are stretches.
    pub edges: Vec<f64>,
    /// Name and unit of what is shown, e.g. ("Error", "% of the output").
    pub quantity: (String, String),
    /// Label and one value a stretch.
    pub lines: Vec<(String, Vec<f64>)>,
}

/// The discrepancy by frequency band or by time.
///
/// # Errors
/// [`FigureError::Shape`] where a line does not have one value a stretch.
pub fn discrepancy(name: &str, title: &str, data: &Stretches) -> Result<Figure, FigureError> {
    let count = data.edges.len().saturating_sub(1);
    let edges: Arc<[f64]> = data.edges.clone().into();
    let x = Axis { scale: data.scale, ..Axis::linear(data.over.0.as_str(), data.over.1.as_str()) };
    let mut panel = Panel::new(x, Axis::linear(data.quantity.0.as_str(), data.quantity.1.as_str())).height(150.0);
    let highest = data.lines.iter().flat_map(|(_, values)| values).copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
    if highest > 0.0 {
        panel.y = panel.y.range(0.0, 1.06 * highest);
    }
    for (k, (label, values)) in data.lines.iter().enumerate() {
        expect_shape(format!("the line \"{label}\""), "stretches", &[count], &[values.len()])?;
        panel.series.push(Series::steps(label.as_str(), edges.clone(), values.clone(), Color::nth(k)));
    }
    Ok(Figure::new(name, title).panel("", panel))
}

/// The held-out error of one output.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOut {
    /// Its name.
    pub output: String,
    /// Of the baseline.
    pub before: f64,
    /// Of the extended model.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
}

/// Held-out error of each output before and after the extension, with the noise floor.
///
/// # Errors
/// [`FigureError::Empty`] without an output.
pub fn before_after(name: &str, title: &str, outputs: &[HeldOut]) -> Result<Figure, FigureError> {
    let bare = |value: fn(&HeldOut) -> f64| outputs.iter().map(|output| Estimate { value: 100.0 * value(output), ci95: (f64::NAN, f64::NAN) }).collect();
    let data = Forest {
        quantity: "Error on held-out data (NRMSE)".into(),
        unit: "%".into(),
        scale: Scale::Linear,
        rows: outputs.iter().map(|output| output.output.clone()).collect(),
        groups: vec![
            ForestGroup { label: "before".into(), color: Color::Vermillion, estimates: bare(|output| output.before) },
            ForestGroup { label: "after".into(), color: Color::Blue, estimates: bare(|output| output.after) },
            ForestGroup { label: "noise floor".into(), color: Color::Grey, estimates: bare(|output| output.floor) },
        ],
        reference: None,
    };
    let mut figure = forest(name, title, &data)?;
    let highest = outputs.iter().flat_map(|output| [output.before, output.after]).filter(|value| value.is_finite()).fold(0.0, f64::max);
    for panel in figure.cells.iter_mut().flat_map(|cell| &mut cell.panels).filter(|_| highest > 0.0) {
        panel.x = panel.x.clone().range(0.0, 106.0 * highest);
        let (mut across, mut along) = (Vec::new(), Vec::new());
        for (row, output) in outputs.iter().enumerate() {
            across.extend([100.0 * output.before, 100.0 * output.after, f64::NAN]);
            along.extend([panel.y.row(row), panel.y.row(row), f64::NAN]);
        }
        panel.series.insert(0, Series::line("", across, along, Color::Grey));
    }
    Ok(figure)
}

/// A cause that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Considered {
    /// Effect and site, e.g. "hysteresis, limb, x".
    pub cause: String,
    /// Share of what there is to gain on held-out data, with its interval.
    pub explained: Estimate,
    /// Adjusted p-value.
    pub p_value: f64,
    /// Whether it was named.
    pub named: bool,
    /// Why it was not.
    pub why_not: String,
}

/// The named causes beside their look-alikes: how much each explains.
///
/// # Errors
/// [`FigureError::Empty`] without a cause.
pub fn considered(name: &str, title: &str, causes: &[Considered]) -> Result<Figure, FigureError> {
    const NONE: Estimate = Estimate { value: f64::NAN, ci95: (f64::NAN, f64::NAN) };
    let percent = |estimate: Estimate| Estimate { value: 100.0 * estimate.value, ci95: (100.0 * estimate.ci95.0, 100.0 * estimate.ci95.1) };
    let pick = |named: bool| causes.iter().map(|cause| if cause.named == named { percent(cause.explained) } else { NONE }).collect();
    let data = Forest {
        quantity: "Share of what there is to gain".into(),
        unit: "%".into(),
        scale: Scale::Linear,
        rows: causes.iter().map(|cause| cause.cause.clone()).collect(),
        groups: vec![
            ForestGroup { label: "named".into(), color: Color::Blue, estimates: pick(true) },
            ForestGroup { label: "considered".into(), color: Color::Grey, estimates: pick(false) },
        ],
        reference: Some((0.0, "nothing explained".into())),
    };
    let mut figure = forest(name, title, &data)?;
    let mut table = Table::new(title, ["Cause"], ["Explained [%]", "p"]).remarks("");
    for cause in causes {
        let judgement = if cause.named { "named" } else { cause.why_not.as_str() };
        table = table.row([cause.cause.as_str(), &significant(100.0 * cause.explained.value, 3), &significant(cause.p_value, 2), judgement]);
    }
    figure.table = Some(table);
    Ok(figure)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_fill_the_bar() {
        let figure = shares("s", "Where the error lives", &[("linear".into(), 0.62), ("noise".into(), 0.38)]).unwrap();
        let ends: Vec<f64> = figure.cells[0].panels[0].series.iter().map(|series| series.mark.x()[1]).collect();
        assert_eq!(ends, [62.0, 100.0]);
        assert_eq!(figure.table.unwrap().rows[0], ["linear", "62"]);
    }

    #[test]
    fn a_stretch_more_than_there_are_is_refused() {
        let mut data = Stretches {
            over: ("Frequency".into(), "Hz".into()),
            scale: Scale::Log,
            edges: vec![0.5, 1.0, 2.0],
            quantity: ("Error".into(), "%".into()),
            lines: vec![("x".into(), vec![10.0, 5.0])],
        };
        assert_eq!(discrepancy("d", "", &data).unwrap().cells[0].panels[0].series.len(), 1);
        data.lines[0].1.push(1.0);
        assert!(discrepancy("d", "", &data).is_err());
    }

    #[test]
    fn named_and_considered_causes_are_told_apart() {
        let cause = |name: &str, share: f64, named: bool| Considered {
            cause: name.into(),
            explained: Estimate { value: share, ci95: (share - 0.05, share + 0.05) },
            p_value: 1e-6,
            named,
            why_not: "explains less than hysteresis".into(),
        };
        let figure = considered("c", "Causes", &[cause("hysteresis", 0.83, true), cause("friction", 0.61, false)]).unwrap();
        assert_eq!(figure.table.as_ref().unwrap().rows[1][3], "explains less than hysteresis");
        assert_eq!(figure.table.as_ref().unwrap().rows[0][1], "83.0");
    }

    #[test]
    fn before_and_after_start_at_zero() {
        let output = HeldOut { output: "pos_x".into(), before: 0.31, after: 0.12, floor: 0.1 };
        let figure = before_after("b", "Gain", &[output]).unwrap();
        assert_eq!(figure.cells[0].panels[0].x.range, Some((0.0, 106.0 * 0.31)));
    }
}
