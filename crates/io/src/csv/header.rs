//! The line of names, the separator that it shows, and the metadata in comments.

use super::cells::{Cell, Separator, split};
use crate::error::IoError;
use crate::limits::MAX_CHANNELS;
use crate::names::{MAX_NAME, indexed, is_index, split_name};

/// A name with its unit, as the header gives them.
pub(crate) struct Named {
    pub name: String,
    pub unit: Option<String>,
}

/// The separator that the header uses outside of quotes and brackets; spaces count only if the first row of numbers
/// has as many cells, since a single name may hold them.
pub(crate) fn separator(header: &str, first_row: Option<&str>) -> Separator {
    let mut depth = 0usize;
    let mut quoted = false;
    let outside: String = header
        .chars()
        .filter(|&c| {
            match c {
                '"' => quoted = !quoted,
                '[' | '(' if !quoted => depth += 1,
                ']' | ')' if !quoted => depth = depth.saturating_sub(1),
                _ => {}
            }
            depth == 0 && !quoted
        })
        .collect();
    if let Some(sign) = ['\t', ';', ','].into_iter().find(|&sign| outside.trim_end().contains(sign)) {
        return Separator::Sign(sign);
    }
    let cells = |line: &str| line.split_whitespace().count();
    match first_row {
        Some(row) if cells(row) > 1 && cells(&outside.replace(']', " ")) >= cells(row) => Separator::Spaces,
        _ => Separator::None,
    }
}

/// Reads the line of names.
pub(crate) fn names(file: &str, line: usize, text: &str, separator: Separator) -> Result<Vec<Named>, IoError> {
    let mut cells = Vec::new();
    split(text, separator, &mut cells).map_err(|_| IoError::OpenQuote { file: file.to_owned(), line })?;
    if separator == Separator::Spaces {
        join_units(&mut cells);
    }
    while cells.len() > 1 && cells.last().is_some_and(|c| c.text.is_empty()) {
        cells.pop();
    }
    if cells.len() > MAX_CHANNELS + 1 {
        return Err(IoError::too_large(file, "columns", cells.len(), MAX_CHANNELS, "split the file; if it has a row for each channel, transpose it"));
    }
    // A log that begins in the middle of a line shows no separator.
    let numbers_only = separator == Separator::None && text.split_whitespace().all(|word| word.parse::<f64>().is_ok());
    if numbers_only || cells.iter().all(|c| !c.quoted && (c.is_number() || c.text.is_empty())) {
        return Err(IoError::NoHeader { file: file.to_owned(), line });
    }
    // Among other indices, `q [1]` is one as well.
    let list = |cell: &Cell<'_>| {
        cell.text.trim_end().strip_suffix(']').and_then(|t| t.rsplit_once(" [")).filter(|(_, i)| is_index(i)).map(|(n, i)| (n.to_owned(), i != "1"))
    };
    let lists: Vec<String> = cells.iter().filter_map(list).filter(|(_, other)| *other).map(|(name, _)| name).collect();
    cells
        .iter()
        .enumerate()
        .map(|(column, cell)| {
            let of_list = list(cell).filter(|(name, _)| lists.contains(name)).map(|_| indexed(&cell.text));
            let (name, unit) = of_list.map_or_else(|| split_name(&cell.text), |name| (name, None));
            // Tables are often saved with the numbers of their rows, which have no name.
            let name = if name.is_empty() { format!("column_{}", column + 1).into() } else { name };
            if cell.text.len() > MAX_NAME {
                return Err(IoError::too_large(file, "bytes in a column's name", cell.text.len(), MAX_NAME, "check that the first line holds the names"));
            }
            Ok(Named { name: name.into_owned(), unit: unit.map(str::to_owned) })
        })
        .collect()
}

/// `torque_x [N m] pos_x [m]`, split at spaces: what is in brackets belongs to the name before it.
fn join_units(cells: &mut Vec<Cell<'_>>) {
    let mut joined: Vec<Cell<'_>> = Vec::with_capacity(cells.len());
    let mut open = false;
    for cell in cells.drain(..) {
        let opens = cell.text.starts_with('[');
        let closes = cell.text.ends_with(']');
        match joined.last_mut() {
            Some(last) if open || opens => last.text = format!("{} {}", last.text, cell.text).into(),
            _ => {
                open = cell.text.contains('[');
                joined.push(cell);
                open &= !closes;
                continue;
            }
        }
        open = !closes;
    }
    *cells = joined;
}

/// Whether `key` can stand before the colon of a metadata line.
pub(crate) fn is_key(key: &str) -> bool {
    key.len() <= MAX_NAME
        && key.trim() == key
        && key.starts_with(|c: char| c.is_alphabetic() || c == '_')
        && key.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ' ' | '/'))
}

/// The key and the value of a comment line `# key: value`; a value in quotation marks has escapes.
pub(crate) fn metadata(comment: &str) -> Option<(String, String)> {
    let (key, value) = comment.trim_start_matches('#').split_once(':')?;
    let key = key.trim();
    // An address, `http://…`, is no fact called http.
    if !is_key(key) || value.starts_with("//") {
        return None;
    }
    let value = value.trim();
    let plain = value.strip_prefix('"').and_then(|v| v.strip_suffix('"')).and_then(unescape);
    Some((key.to_owned(), plain.unwrap_or_else(|| value.to_owned())))
}

/// A value as [`metadata`] reads it.
pub(crate) fn escape(value: &str) -> String {
    if value.trim() == value && !value.starts_with('"') && !value.contains(char::is_control) {
        return value.to_owned();
    }
    let mut out = String::from("\"");
    for c in value.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\0' => out.push_str("\\0"), // A zero byte would make the file binary.
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

fn unescape(text: &str) -> Option<String> {
    let mut out = String::new();
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        out.push(match c {
            '"' => return None,
            '\\' => match chars.next()? {
                'n' => '\n',
                'r' => '\r',
                '0' => '\0',
                c @ ('"' | '\\') => c,
                _ => return None,
            },
            c => c,
        });
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_separator_is_seen_outside_of_brackets_and_quotes() {
        assert_eq!(separator("a [x,y];b", None), Separator::Sign(';'));
        assert_eq!(separator("\"a;b\",c", None), Separator::Sign(','));
        assert_eq!(separator("torque_x [N m]", Some("1.5")), Separator::None);
        assert_eq!(separator("a [N m]  b", Some("1 2")), Separator::Spaces);
        assert_eq!(separator("Force X", Some("1")), Separator::None);
    }

    #[test]
    fn units_stay_with_their_names_between_spaces() {
        let named = names("f", 1, "t torque_x [N m] pos_x[mm] b", Separator::Spaces).unwrap();
        let shown: Vec<_> = named.iter().map(|n| (n.name.as_str(), n.unit.as_deref())).collect();
        assert_eq!(shown, [("t", None), ("torque_x", Some("N m")), ("pos_x", Some("mm")), ("b", None)]);
    }

    #[test]
    fn an_integer_in_brackets_is_an_index() {
        let shown = |text| names("f", 1, text, Separator::Sign(',')).unwrap().into_iter().map(|n| (n.name, n.unit)).collect::<Vec<_>>();
        let plain = |name: &str| (name.to_owned(), None);
        assert_eq!(shown("tau_J[0],tau_J[1],tau_J[2]"), [plain("tau_J_0"), plain("tau_J_1"), plain("tau_J_2")]);
        assert_eq!(shown("q [0],q [1],q [2]"), [plain("q_0"), plain("q_1"), plain("q_2")]);
        assert_eq!(shown("q[0] [rad],ratio [1]"), [("q_0".to_owned(), Some("rad".to_owned())), ("ratio".to_owned(), Some("1".to_owned()))]);
    }

    #[test]
    fn metadata_values_survive_line_ends_and_quotes() {
        for value in ["plain", "", " blanks ", "two\nlines", "\"quoted\"", "back\\slash", "a: b", "\\n", "tab\tin", "\"\\\r"] {
            assert_eq!(metadata(&format!("# key: {}", escape(value))), Some(("key".to_owned(), value.to_owned())), "{value:?}");
        }
        assert_eq!(metadata("# see http://example.org"), None);
        assert_eq!(metadata("# no key here"), None);
    }
}
