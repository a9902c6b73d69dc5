//! Repeated measurements: how well they agree, and whether a subject has changed.

use std::sync::Arc;

use super::error::{FigureError, expect_shape};
use super::forest::Estimate;
use crate::number::significant;
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};

/// Difference over mean of two measurements of the same subjects (Bland and Altman 1986), with the mean difference
/// and the limits of agreement, mean ± 1.96 standard deviations.
///
/// # Errors
/// [`FigureError`] where the two differ in number or hold fewer than two pairs.
pub fn agreement(name: &str, title: &str, quantity: &str, unit: &str, first: &[f64], second: &[f64]) -> Result<Figure, FigureError> {
    expect_shape("the second measurement", "subjects", &[first.len()], &[second.len()])?;
    let pairs: Vec<(f64, f64)> = first.iter().copied().zip(second.iter().copied()).filter(|(a, b)| a.is_finite() && b.is_finite()).collect();
    if pairs.len() < 2 {
        return Err(FigureError::Empty { what: "the list of complete pairs (two are needed)" });
    }
    let count = pairs.len() as f64;
    let differences = || pairs.iter().map(|(a, b)| b - a);
    let bias = differences().sum::<f64>() / count;
    let deviation = (differences().map(|difference| (difference - bias).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    let limit = 1.96 * deviation;
    let means: Vec<f64> = pairs.iter().map(|(a, b)| 0.5 * (a + b)).collect();
    let panel = Panel::new(Axis::linear(format!("Mean {quantity}"), unit), Axis::linear("Second less first", unit))
        .with(Series::points("subjects", means, differences().collect(), Color::Blue))
        .rule(bias, format!("mean {}", significant(bias, 3)))
        .rule(bias + limit, format!("+1.96 SD {}", significant(bias + limit, 3)))
        .rule(bias - limit, format!("−1.96 SD {}", significant(bias - limit, 3)));
    let caption = "Difference of two measurements over their mean; 95 % of the differences are expected between the outer lines.";
    Ok(Figure::new(name, title).caption(caption).columns(2).panel("", panel))
}

/// One parameter over the sessions of a subject.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// What it is.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// Time of each session, in days.
    pub day: Vec<f64>,
    /// One a session.
    pub estimates: Vec<Estimate>,
    /// Smallest change that is not chance (minimal detectable change), drawn around the first session.
    pub detectable_change: Option<f64>,
}

/// A parameter over sessions with its intervals; outside the grey band the change since the first session is more
/// than repetition explains.
///
/// # Errors
/// [`FigureError::Shape`] where there is not one estimate a session.
pub fn course(name: &str, title: &str, data: &Course) -> Result<Figure, FigureError> {
    expect_shape("the course", "sessions", &[data.day.len()], &[data.estimates.len()])?;
    let day: Arc<[f64]> = data.day.clone().into();
    let each = |of: fn(&Estimate) -> f64| data.estimates.iter().map(of).collect::<Vec<f64>>();
    let values = each(|estimate| estimate.value);
    let mut panel = Panel::new(Axis::linear("Time", "d"), Axis::linear(data.quantity.as_str(), data.unit.as_str())).height(160.0);
    if let (Some(change), Some(first)) = (data.detectable_change, values.first()) {
        let flat = |level: f64| vec![level; day.len()];
        panel.series.push(Series::band("no detectable change", day.clone(), flat(first - change), flat(first + change), Color::Grey));
        panel.series.push(Series::line("no detectable change", day.clone(), flat(*first), Color::Grey).dash(Dash::Dashed));
    }
    panel.series.push(Series::band("measured", day.clone(), each(|estimate| estimate.ci95.0), each(|estimate| estimate.ci95.1), Color::Blue));
    panel.series.push(Series::line("measured", day.clone(), values.clone(), Color::Blue));
    panel.series.push(Series::points("measured", day, values, Color::Blue));
    Ok(Figure::new(name, title).panel("", panel))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_of_agreement_are_bias_and_two_standard_deviations() {
        // Differences 1, 2, 3: mean 2, standard deviation 1.
        let figure = agreement("a", "Agreement", "stiffness", "N/m", &[10.0, 20.0, 30.0, f64::NAN], &[11.0, 22.0, 33.0, 1.0]).unwrap();
        let rules: Vec<f64> = figure.cells[0].panels[0].rules.iter().map(|rule| rule.y).collect();
        let expected = [2.0, 3.96, 0.04];
        assert!(rules.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-12), "{rules:?}");
        assert!(agreement("a", "", "", "", &[1.0], &[1.0]).is_err());
    }

    #[test]
    fn the_detectable_change_lies_around_the_first_session() {
        let estimate = |value: f64| Estimate { value, ci95: (value - 1.0, value + 1.0) };
        let data = Course {
            quantity: "K".into(),
            unit: "N/m".into(),
            day: vec![0.0, 7.0],
            estimates: vec![estimate(300.0), estimate(260.0)],
            detectable_change: Some(25.0),
        };
        let figure = course("c", "Course", &data).unwrap();
        let columns = figure.cells[0].panels[0].series[0].mark.columns();
        assert_eq!((columns[0].1, columns[1].1), (&[275.0, 275.0][..], &[325.0, 325.0][..]));
    }
}
