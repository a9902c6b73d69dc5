//! How a name, its index and its unit are written together.

use ndof_signal::Unit;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Bytes of a channel's name with its unit.
pub(crate) const MAX_NAME: usize = 1000;

/// Splits `name [unit]`, or `name (unit)` where the text in brackets is a unit, into its parts. A bracket that holds an integer
/// is an index and belongs to the name: `tau_J[0]` is `tau_J_0`. Behind a blank, ` [1]` is the unit of a plain number.
pub(crate) fn split_name(text: &str) -> (Cow<'_, str>, Option<&str>) {
    let text = text.trim();
    if let Some((name, inside)) = text.strip_suffix(']').and_then(|t| t.rsplit_once('[')) {
        let plain_number = inside.trim() == "1" && name.ends_with(char::is_whitespace);
        if plain_number || !is_index(inside.trim()) {
            return (indexed(name.trim()), Some(inside.trim()));
        }
    }
    if let Some((name, unit)) = text.strip_suffix(')').and_then(|t| t.split_once('('))
        && !unit.trim().is_empty()
        && Unit::parse(unit).is_ok()
    {
        return (indexed(name.trim()), Some(unit.trim()));
    }
    (indexed(text), None)
}

/// Whether a bracket with this inside is an index.
pub(crate) fn is_index(inside: &str) -> bool {
    !inside.is_empty() && inside.len() <= 9 && inside.bytes().all(|b| b.is_ascii_digit())
}

/// The name with each index in brackets as a suffix: `a[0].b[1]` is `a_0.b_1`.
pub(crate) fn indexed(name: &str) -> Cow<'_, str> {
    if !name.contains('[') {
        return name.into();
    }
    let mut out = String::with_capacity(name.len());
    let mut rest = name;
    while let Some((before, behind)) = rest.split_once('[') {
        out.push_str(before);
        rest = behind;
        match behind.split_once(']').filter(|(inside, _)| is_index(inside.trim())) {
            Some((inside, behind)) => {
                out.truncate(out.trim_end().len());
                out.push('_');
                out.push_str(inside.trim());
                rest = behind;
            }
            None => out.push('['),
        }
    }
    out.push_str(rest);
    out.into()
}

/// Each path's last name where that is unique among them, else its names joined by dots.
pub(crate) fn uniquely<P: AsRef<[String]>>(paths: &[P]) -> Vec<String> {
    let mut count: BTreeMap<&String, usize> = BTreeMap::new();
    paths.iter().filter_map(|path| path.as_ref().last()).for_each(|name| *count.entry(name).or_default() += 1);
    let name = |path: &P| match path.as_ref().last() {
        Some(last) if count.get(last) == Some(&1) => last.clone(),
        _ => path.as_ref().join("."),
    };
    paths.iter().map(name).collect()
}

/// The unit that a written symbol is read as.
pub(crate) fn read_back(symbol: &str) -> Unit {
    Unit::parse(symbol).map_or_else(|_| Unit::other(symbol), |(unit, _)| unit)
}

/// A key of metadata that every format can write: letters, digits, blanks and `_ - . /`, from a letter on.
pub(crate) fn key(text: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ' ' | '/') { c } else { '_' };
    let mut key: String = text.trim().chars().take(MAX_NAME / 4).map(plain).collect();
    if !key.starts_with(|c: char| c.is_alphabetic() || c == '_') {
        key.insert(0, '_');
    }
    key.truncate(key.trim_end().len());
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_units_are_told_apart() {
        let split = |text| {
            let (name, unit) = split_name(text);
            (name.into_owned(), unit.map(str::to_owned))
        };
        for (text, name, unit) in [
            (" pos_x [mm] ", "pos_x", Some("mm")),
            ("pos_x(mm)", "pos_x", Some("mm")),
            ("acc_x (m/(s^2))", "acc_x", Some("m/(s^2)")),
            ("emg (left)", "emg (left)", None),
            ("pos_x []", "pos_x", Some("")),
            ("pos_x", "pos_x", None),
            ("tau_J[0]", "tau_J_0", None),
            ("tau_J[12] [N m]", "tau_J_12", Some("N m")),
            ("q [3]", "q_3", None),
            ("ratio [1]", "ratio", Some("1")),
            ("a[0].b[1] (rad)", "a_0.b_1", Some("rad")),
            ("a[b][1]", "a[b]_1", None),
        ] {
            assert_eq!(split(text), (name.to_owned(), unit.map(str::to_owned)), "{text}");
        }
    }

    #[test]
    fn keys_can_be_written_everywhere() {
        assert_eq!(key("1st (try)"), "_1st _try_");
        assert_eq!(key(""), "_");
    }
}
