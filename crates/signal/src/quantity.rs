//! What a channel measures, and in which unit.

use serde::{Deserialize, Serialize};
use std::fmt;

/// The kind of quantity that a unit measures, translation and rotation alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// Position or angle: m, rad.
    Displacement,
    /// m/s, rad/s.
    Velocity,
    /// m/s², rad/s².
    Acceleration,
    /// Force or torque: N, N m.
    Effort,
    /// s.
    Time,
    /// Anything else, a number without a unit included.
    Other,
}

/// A unit of the International System, with the quantity that it measures.
///
/// Samples are always kept in SI; [`Unit::parse`] gives the factor that takes a file's unit there.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Unit {
    symbol: String,
    quantity: Quantity,
    rotational: bool,
}

/// A unit text that stands for none of the quantities of mechanics.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown unit \"{0}\"; known are for example m, mm, rad, deg, m/s, rad/s, m/s^2, N, kN, N m, mN m, s, ms")]
pub struct UnknownUnit(pub String);

impl Unit {
    /// The unit of `quantity`: metres and newtons, or radians and newton metres where `rotational`.
    pub fn si(quantity: Quantity, rotational: bool) -> Self {
        let symbol = match (quantity, rotational) {
            (Quantity::Displacement, false) => "m",
            (Quantity::Displacement, true) => "rad",
            (Quantity::Velocity, false) => "m/s",
            (Quantity::Velocity, true) => "rad/s",
            (Quantity::Acceleration, false) => "m/s^2",
            (Quantity::Acceleration, true) => "rad/s^2",
            (Quantity::Effort, false) => "N",
            (Quantity::Effort, true) => "N m",
            (Quantity::Time, _) => "s",
            (Quantity::Other, _) => "",
        };
        Unit { symbol: symbol.to_owned(), quantity, rotational }
    }

    /// A unit that mechanics does not know (a voltage, an EMG), kept as it is written.
    pub fn other(symbol: &str) -> Self {
        Unit { symbol: symbol.to_owned(), quantity: Quantity::Other, rotational: false }
    }

    /// Reads a unit as people write it and returns it with the factor to SI: `mm` gives `(m, 1e-3)`.
    ///
    /// Multiplication may be written as a space, `*`, `.`, `·`, `-` or not at all (`N m`, `N*m`, `Nm`); powers as `^2`,
    /// `**2` or `²`; division with `/` or `^-1`.
    ///
    /// # Errors
    /// [`UnknownUnit`] if the text is none of those.
    ///
    /// ```
    /// use ndof_signal::{Quantity, Unit};
    /// let (unit, factor) = Unit::parse("mm")?;
    /// assert_eq!((unit.symbol(), factor), ("m", 1e-3));
    /// assert_eq!(Unit::parse("N m")?.0.quantity(), Quantity::Effort);
    /// # Ok::<(), ndof_signal::UnknownUnit>(())
    /// ```
    pub fn parse(text: &str) -> Result<(Self, f64), UnknownUnit> {
        let plain: String = text
            .trim()
            .replace('²', "^2")
            .replace("**", "^")
            .replace(['·', '⋅', '*'], " ")
            .replace("s^-1", "/s")
            .replace("s^-2", "/s^2")
            .replace("s-1", "/s")
            .replace("s-2", "/s^2")
            .chars()
            .filter(|c| !c.is_whitespace() && *c != '.' && *c != '(' && *c != ')')
            .collect();
        let (quantity, rotational, factor) = match plain.as_str() {
            "s" | "sec" | "second" | "seconds" => (Quantity::Time, false, 1.0),
            "ms" => (Quantity::Time, false, 1e-3),
            "us" | "µs" | "μs" => (Quantity::Time, false, 1e-6),
            "ns" => (Quantity::Time, false, 1e-9),
            "min" => (Quantity::Time, false, 60.0),
            "g" | "gn" => (Quantity::Acceleration, false, 9.806_65),
            "rpm" => (Quantity::Velocity, true, std::f64::consts::TAU / 60.0),
            "" | "1" | "-" => return Ok((Unit::other(""), 1.0)),
            plain => {
                let per = |ends: &[&str], quantity: Quantity| {
                    let (rotational, factor) = ends.iter().find_map(|end| displacement(plain.strip_suffix(*end)?))?;
                    Some((quantity, rotational, factor))
                };
                per(&["/s^2", "/s2", "/s/s"], Quantity::Acceleration)
                    .or_else(|| per(&["/s"], Quantity::Velocity))
                    .or_else(|| per(&[""], Quantity::Displacement))
                    .or_else(|| effort(plain).map(|(rotational, factor)| (Quantity::Effort, rotational, factor)))
                    .ok_or_else(|| UnknownUnit(text.trim().to_owned()))?
            }
        };
        Ok((Unit::si(quantity, rotational), factor))
    }

    /// The SI symbol (`m`, `N m`, …); for [`Quantity::Other`] the text as given.
    pub fn symbol(&self) -> &str {
        &self.symbol
    }

    /// What the unit measures.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Whether it belongs to a rotation (rad, N m) and not to a translation (m, N).
    pub fn is_rotational(&self) -> bool {
        self.rotational
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.symbol)
    }
}

fn displacement(text: &str) -> Option<(bool, f64)> {
    Some(match text {
        "m" => (false, 1.0),
        "dm" => (false, 1e-1),
        "cm" => (false, 1e-2),
        "mm" => (false, 1e-3),
        "um" | "µm" | "μm" => (false, 1e-6),
        "nm" => (false, 1e-9),
        "km" => (false, 1e3),
        "in" | "inch" => (false, 0.0254),
        "rad" => (true, 1.0),
        "mrad" => (true, 1e-3),
        "urad" | "µrad" | "μrad" => (true, 1e-6),
        "deg" | "°" | "degree" | "degrees" => (true, std::f64::consts::PI / 180.0),
        "rev" | "turn" => (true, std::f64::consts::TAU),
        _ => return None,
    })
}

fn effort(text: &str) -> Option<(bool, f64)> {
    Some(match text {
        "N" => (false, 1.0),
        "mN" => (false, 1e-3),
        "cN" => (false, 1e-2),
        "kN" => (false, 1e3),
        "lbf" => (false, 4.448_221_615_260_5),
        "kgf" => (false, 9.806_65),
        "Nm" | "N-m" => (true, 1.0),
        "mNm" | "mN-m" | "Nmm" | "N-mm" => (true, 1e-3),
        "cNm" | "Ncm" | "N-cm" => (true, 1e-2),
        "kNm" | "kN-m" => (true, 1e3),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_as_people_write_them() {
        use std::f64::consts::TAU;
        let known: [(&str, f64, &[&str]); 37] = [
            ("s", 1.0, &["s", "sec", "second", "seconds"]),
            ("s", 1e-3, &["ms"]),
            ("s", 1e-6, &["us", "µs", "μs"]),
            ("s", 1e-9, &["ns"]),
            ("s", 60.0, &["min"]),
            ("m", 1.0, &["m"]),
            ("m", 1e-1, &["dm"]),
            ("m", 1e-2, &["cm"]),
            ("m", 1e-3, &["mm"]),
            ("m", 1e-6, &["um", "µm", "μm"]),
            ("m", 1e-9, &["nm"]),
            ("m", 1e3, &["km"]),
            ("m", 0.0254, &["in", "inch"]),
            ("rad", 1.0, &["rad"]),
            ("rad", 1e-3, &["mrad"]),
            ("rad", 1e-6, &["urad", "µrad", "μrad"]),
            ("rad", TAU / 360.0, &["deg", "°", "degree", "degrees"]),
            ("rad", TAU, &["rev", "turn"]),
            ("N", 1.0, &["N"]),
            ("N", 1e-3, &["mN"]),
            ("N", 1e-2, &["cN"]),
            ("N", 1e3, &["kN"]),
            ("N", 4.448_221_615_260_5, &["lbf"]),
            ("N", 9.806_65, &["kgf"]),
            ("N m", 1.0, &["Nm", "N m", "N·m", "N*m", "N-m"]),
            ("N m", 1e-3, &["mN m", "mN-m", "N mm", "N-mm"]),
            ("N m", 1e-2, &["cN m", "N cm", "N-cm"]),
            ("N m", 1e3, &["kN m", "kN-m"]),
            ("m/s", 1e-2, &["cm/s"]),
            ("m/s", 1e-3, &["mm s^-1"]),
            ("rad/s", TAU / 360.0, &["deg/s"]),
            ("rad/s", TAU / 60.0, &["rpm"]),
            ("m/s^2", 1.0, &["m/s²", "m/s/s", "m/s2"]),
            ("m/s^2", 1e-3, &["mm s^-2"]),
            ("m/s^2", 9.806_65, &["g", "gn"]),
            ("rad/s^2", 1.0, &["rad s-2"]),
            ("", 1.0, &["", "1", "-"]),
        ];
        for (symbol, factor, text) in known.iter().flat_map(|(symbol, factor, texts)| texts.iter().map(move |text| (*symbol, *factor, *text))) {
            let (unit, f) = Unit::parse(text).expect(text);
            assert_eq!((unit.symbol(), unit.to_string().as_str(), unit.is_rotational()), (symbol, symbol, symbol.contains("rad") || symbol == "N m"), "{text}");
            assert!((f - factor).abs() <= 1e-15 * factor, "{text}: {f}");
        }
    }

    #[test]
    fn nm_is_a_torque_only_with_a_capital() {
        assert_eq!(Unit::parse("nm").expect("nanometre").0.quantity(), Quantity::Displacement);
        assert_eq!(Unit::parse("Nm").expect("newton metre").0.quantity(), Quantity::Effort);
    }

    #[test]
    fn volts_are_unknown() {
        assert_eq!(Unit::parse("V"), Err(UnknownUnit("V".to_owned())));
        assert!(Unit::parse("V/s").is_err());
    }
}
