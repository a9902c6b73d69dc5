//! Whether a stated probability is kept: the reliability diagram.

use super::error::FigureError;
use crate::plot::{Axis, Color, Dash, Figure, Panel, Series};

/// Answers of similar confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConfidenceBin {
    /// Mean of the stated probabilities.
    pub stated: f64,
    /// Number of answers.
    pub count: usize,
    /// How many were right.
    pub right: usize,
}

impl ConfidenceBin {
    /// Share that was right, and its 95 % interval (Wilson 1927): (p + z²/2n ± z √(p(1−p)/n + z²/4n²)) / (1 + z²/n).
    fn observed(self) -> (f64, f64, f64) {
        const Z: f64 = 1.959_963_984_540_054;
        let n = self.count as f64;
        let share = self.right as f64 / n;
        let (middle, scale) = (share + Z * Z / (2.0 * n), 1.0 + Z * Z / n);
        let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
        (share, (middle - half) / scale, (middle + half) / scale)
    }
}

/// Share of right answers over stated probability, with 95 % intervals; on the diagonal a probability is what it says.
///
/// # Errors
/// [`FigureError::Empty`] without an answer.
pub fn reliability(name: &str, title: &str, bins: &[ConfidenceBin]) -> Result<Figure, FigureError> {
    let bins: Vec<ConfidenceBin> = bins.iter().copied().filter(|bin| bin.count > 0).collect();
    if bins.is_empty() {
        return Err(FigureError::Empty { what: "the list of bins with answers" });
    }
    let stated: Vec<f64> = bins.iter().map(|bin| bin.stated).collect();
    let (mut across, mut along) = (Vec::new(), Vec::new());
    for bin in &bins {
        let (_, low, high) = bin.observed();
        across.extend([bin.stated, bin.stated, f64::NAN]);
        along.extend([low, high, f64::NAN]);
    }
    let mut panel = Panel::new(Axis::linear("Stated probability", "").range(-0.02, 1.02), Axis::linear("Share that was right", "").range(-0.02, 1.02))
        .with(Series::line("as stated", vec![0.0, 1.0], vec![0.0, 1.0], Color::Grey).dash(Dash::Dashed))
        .with(Series::line("observed, 95 % interval", across, along, Color::Blue))
        .with(Series::points("observed, 95 % interval", stated, bins.iter().map(|bin| bin.observed().0).collect(), Color::Blue));
    panel.equal_aspect = true;
    let caption = "Below the diagonal the answers are too sure of themselves.";
    Ok(Figure::new(name, title).caption(caption).panel("", panel))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_wilsons() {
        // scipy.stats.binomtest(8, 10).proportion_ci(method="wilson") of SciPy 1.17.1.
        let (share, low, high) = ConfidenceBin { stated: 0.8, count: 10, right: 8 }.observed();
        assert!(share == 0.8 && (low - 0.4902).abs() < 5e-5 && (high - 0.9433).abs() < 5e-5, "{low} {high}");
    }

    #[test]
    fn empty_bins_are_left_out() {
        let empty = ConfidenceBin { stated: 0.1, count: 0, right: 0 };
        assert!(reliability("r", "", &[empty]).is_err());
        let figure = reliability("r", "", &[empty, ConfidenceBin { stated: 0.9, count: 50, right: 46 }]).unwrap();
        assert_eq!(figure.cells[0].panels[0].series[2].mark.x().len(), 1);
    }
}
