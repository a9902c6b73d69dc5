//! Two measurements side by side: what has changed, and whether that is more than chance.

use crate::figures::Estimate;
use crate::number::{printed_unit, significant, with_half_width};
use crate::table::{Align, Table};

/// A parameter in two measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// E.g. "K_x_x".
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// In the first.
    pub first: Estimate,
    /// In the second.
    pub second: Estimate,
    /// Second less first.
    pub difference: Estimate,
    /// Probability of a difference this large by chance, adjusted for the number of parameters.
    pub p_value: f64,
}

/// One row a parameter: both estimates, their difference with its 95 % interval, and a judgement at `level` (e.g. 0.05).
pub fn comparison_table(caption: impl Into<String>, labels: [&str; 2], comparisons: &[Comparison], level: f64) -> Table {
    let columns = [
        ("Parameter", Align::Left),
        ("Unit", Align::Left),
        (labels[0], Align::Right),
        (labels[1], Align::Right),
        ("Difference", Align::Right),
        ("p", Align::Right),
        ("", Align::Left),
    ];
    let half = |estimate: Estimate| 0.5 * (estimate.ci95.1 - estimate.ci95.0);
    let shown = |estimate: Estimate| with_half_width(estimate.value, half(estimate));
    let mut table = Table::new(caption, &columns);
    for one in comparisons {
        table = table.row([
            one.name.clone(),
            printed_unit(&one.unit),
            shown(one.first),
            shown(one.second),
            shown(one.difference),
            significant(one.p_value, 2),
            judgement(one, level).to_string(),
        ]);
    }
    table
}

fn judgement(comparison: &Comparison, level: f64) -> &'static str {
    match (comparison.p_value <= level, comparison.difference.value > 0.0) {
        _ if comparison.p_value.is_nan() => "not comparable",
        (false, _) => "no more than chance",
        (true, true) => "higher",
        (true, false) => "lower",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_named_only_where_it_is_more_than_chance() {
        let estimate = |value: f64, half: f64| Estimate { value, ci95: (value - half, value + half) };
        let one = |name: &str, second: f64, p_value: f64| Comparison {
            name: name.into(),
            unit: "N s^2/m".into(),
            first: estimate(300.0, 5.0),
            second: estimate(second, 6.0),
            difference: estimate(second - 300.0, 7.8),
            p_value,
        };
        let all = [one("K_x_x", 280.0, 1e-4), one("K_y_y", 303.0, 0.6), one("K_x_y", 340.0, 0.05), one("K_z_z", 300.0, f64::NAN)];
        let table = comparison_table("Before and after", ["before", "after"], &all, 0.05);
        assert_eq!(table.rows[0], ["K_x_x", "N s²/m", "300.0 ± 5.0", "280.0 ± 6.0", "−20.0 ± 7.8", "1.0 × 10⁻⁴", "lower"]);
        let judged: Vec<_> = table.rows.iter().map(|row| row[6].as_str()).collect();
        assert_eq!(judged, ["lower", "no more than chance", "higher", "not comparable"]);
    }
}
