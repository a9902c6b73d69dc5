//! Intervals that are wanted of a design.

use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// An interval that is wanted: `K=0.1` for ± 10 % of every entry on the diagonal of K, likewise `M`, `B`; one entry such as
/// `K_x_y=0.2`; `gain@2=5%` for the gain at 2 Hz of every entry on the diagonal of the compliance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "String", into = "String")]
pub struct Target {
    /// Of what.
    pub(super) what: What,
    /// Half of its width as a share of the value.
    pub(super) half_width: f64,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum What {
    /// The diagonal of M, B or K.
    Diagonal(String),
    /// One entry.
    Entry(String),
    /// The compliance at a frequency.
    Gain(f64),
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("\"{text}\": write M, B, K, an entry such as K_x_y, or gain@HZ, then = and a share, such as K=0.1 or gain@2=5%");
        let (what, share) = text.split_once('=').ok_or_else(wrong)?;
        let share = match share.trim().strip_suffix('%') {
            Some(percent) => percent.trim().parse::<f64>().map(|p| p / 100.0),
            None => share.trim().parse(),
        };
        let half_width =
            share.ok().filter(|share| *share > 0.0 && *share < 1.0).ok_or_else(|| format!("\"{text}\": the share must lie between 0 and 1 (0 and 100 %)"))?;
        let what = what.trim();
        let what = match what.strip_prefix("gain@") {
            Some(hz) => What::Gain(hz.trim_end_matches("Hz").trim().parse().ok().filter(|hz: &f64| *hz > 0.0 && hz.is_finite()).ok_or_else(wrong)?),
            None if ["M", "B", "K"].contains(&what) => What::Diagonal(what.to_owned()),
            None if ["M_", "B_", "K_"].iter().any(|matrix| what.starts_with(matrix)) => What::Entry(what.to_owned()),
            None => return Err(wrong()),
        };
        Ok(Target { what, half_width })
    }
}

impl TryFrom<String> for Target {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Target> for String {
    fn from(target: Target) -> Self {
        format!("{}={}", target.name(), target.half_width)
    }
}

impl Target {
    /// What the interval is of.
    pub(super) fn name(&self) -> String {
        match &self.what {
            What::Diagonal(name) | What::Entry(name) => name.clone(),
            What::Gain(hz) => format!("gain@{hz}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_read_as_they_are_written() {
        let of = |text: &str| text.parse::<Target>();
        assert_eq!(of("K=0.1"), Ok(Target { what: What::Diagonal("K".to_owned()), half_width: 0.1 }));
        assert_eq!(of("B_x_y = 20 %"), Ok(Target { what: What::Entry("B_x_y".to_owned()), half_width: 0.2 }));
        assert_eq!(of("gain@2Hz=5%"), Ok(Target { what: What::Gain(2.0), half_width: 0.05 }));
        for wrong in ["K", "Q=0.1", "K=0", "K=120%", "gain@=0.1", "gain@-1=0.1", "K=x"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
