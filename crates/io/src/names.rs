//! How a name and its unit are written together.

use ndof_signal::Unit;

/// Bytes of a channel's name with its unit.
#[cfg(any(feature = "csv", feature = "npz", feature = "mat"))]
pub(crate) const MAX_NAME: usize = 1000;

/// Splits `name [unit]`, or `name (unit)` where the text in brackets is a unit, into its parts.
pub(crate) fn split_name(text: &str) -> (&str, Option<&str>) {
    let text = text.trim();
    if let Some((name, unit)) = text.strip_suffix(']').and_then(|t| t.rsplit_once('[')) {
        return (name.trim(), Some(unit.trim()));
    }
    if let Some((name, unit)) = text.strip_suffix(')').and_then(|t| t.split_once('('))
        && !unit.trim().is_empty()
        && Unit::parse(unit).is_ok()
    {
        return (name.trim(), Some(unit.trim()));
    }
    (text, None)
}

/// The unit that a written symbol is read as.
#[cfg(any(feature = "csv", feature = "npz", feature = "parquet"))]
pub(crate) fn read_back(symbol: &str) -> Unit {
    Unit::parse(symbol).map_or_else(|_| Unit::other(symbol), |(unit, _)| unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_units_are_told_apart() {
        assert_eq!(split_name(" pos_x [mm] "), ("pos_x", Some("mm")));
        assert_eq!(split_name("pos_x(mm)"), ("pos_x", Some("mm")));
        assert_eq!(split_name("acc_x (m/(s^2))"), ("acc_x", Some("m/(s^2)")));
        assert_eq!(split_name("emg (left)"), ("emg (left)", None));
        assert_eq!(split_name("pos_x []"), ("pos_x", Some("")));
        assert_eq!(split_name("pos_x"), ("pos_x", None));
    }
}
