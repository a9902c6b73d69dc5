//! Data windows under SciPy's names.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// A data window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Window {
    /// Raised cosine, the default of the method.
    #[default]
    Hann,
    /// Raised cosine on a pedestal.
    Hamming,
    /// Three cosine terms.
    Blackman,
    /// Four cosine terms, side lobes under −92 dB.
    BlackmanHarris,
    /// Five cosine terms, flat top: amplitudes of lines.
    FlatTop,
    /// Triangle that reaches zero.
    Bartlett,
    /// No taper.
    Rectangular,
    /// Flat with cosine flanks; the number is the tapered share of the length.
    Tukey(f64),
}

/// A window name that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown window \"{0}\"; there are hann, hamming, blackman, blackmanharris, flattop, bartlett, boxcar, tukey or tukey:SHARE with a share from 0 to 1")]
pub struct ParseWindowError(pub String);

impl FromStr for Window {
    type Err = ParseWindowError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text.trim().to_ascii_lowercase().as_str() {
            "hann" | "hanning" => Window::Hann,
            "hamming" => Window::Hamming,
            "blackman" => Window::Blackman,
            "blackmanharris" => Window::BlackmanHarris,
            "flattop" => Window::FlatTop,
            "bartlett" => Window::Bartlett,
            "boxcar" | "rectangular" | "rect" => Window::Rectangular,
            "tukey" => Window::Tukey(0.5),
            other => match other.strip_prefix("tukey:").map(str::parse) {
                Some(Ok(share)) if (0.0..=1.0).contains(&share) => Window::Tukey(share),
                _ => return Err(ParseWindowError(text.to_owned())),
            },
        })
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Window::Hann => "hann",
            Window::Hamming => "hamming",
            Window::Blackman => "blackman",
            Window::BlackmanHarris => "blackmanharris",
            Window::FlatTop => "flattop",
            Window::Bartlett => "bartlett",
            Window::Rectangular => "boxcar",
            Window::Tukey(share) => return write!(f, "tukey:{share}"),
        })
    }
}

impl Window {
    /// The window's `n` values; periodic as spectra want it, or symmetric.
    ///
    /// Equal to `scipy.signal.get_window(name, n, fftbins=not symmetric)`.
    ///
    /// ```
    /// use ndof_signal::Window;
    /// let hann = Window::Hann.samples(4, false);
    /// assert!((hann[1] - 0.5).abs() < 1e-15 && hann[2] == 1.0);
    /// ```
    pub fn samples(self, n: usize, symmetric: bool) -> Vec<f64> {
        if n <= 1 {
            return vec![1.0; n];
        }
        let intervals = if symmetric { n - 1 } else { n } as f64;
        let cosines = |a: &[f64]| -> Vec<f64> {
            (0..n)
                .map(|k| {
                    let x = 2.0 * PI * k as f64 / intervals;
                    a.iter().enumerate().map(|(i, a)| if i % 2 == 0 { a * (i as f64 * x).cos() } else { -a * (i as f64 * x).cos() }).sum()
                })
                .collect()
        };
        match self {
            Window::Hann => cosines(&[0.5, 0.5]),
            Window::Hamming => cosines(&[0.54, 0.46]),
            Window::Blackman => cosines(&[0.42, 0.50, 0.08]),
            Window::BlackmanHarris => cosines(&[0.35875, 0.48829, 0.14128, 0.01168]),
            Window::FlatTop => cosines(&[0.215_578_95, 0.416_631_58, 0.277_263_158, 0.083_578_947, 0.006_947_368]),
            Window::Bartlett => (0..n).map(|k| 1.0 - (2.0 * k as f64 / intervals - 1.0).abs()).collect(),
            Window::Rectangular => vec![1.0; n],
            Window::Tukey(share) => (0..n).map(|k| tukey(k as f64 / intervals, share)).collect(),
        }
    }
}

fn tukey(x: f64, share: f64) -> f64 {
    let edge = x.min(1.0 - x);
    if share <= 0.0 || edge >= share / 2.0 { 1.0 } else { 0.5 * (1.0 - (2.0 * PI * edge / share).cos()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_round_trip() {
        for name in ["hann", "hamming", "blackman", "blackmanharris", "flattop", "bartlett", "boxcar", "tukey:0.2"] {
            assert_eq!(name.parse::<Window>().expect(name).to_string(), name);
        }
        assert!("hannn".parse::<Window>().is_err());
        assert!("tukey:2".parse::<Window>().is_err());
    }

    #[test]
    fn a_symmetric_window_is_symmetric() {
        for window in [Window::Hann, Window::FlatTop, Window::Bartlett, Window::Tukey(0.3)] {
            let w = window.samples(33, true);
            for k in 0..33 {
                assert!((w[k] - w[32 - k]).abs() < 1e-15, "{window} at {k}");
            }
        }
    }
}
