//! Names that MATLAB takes for variables and fields: letters, digits and `_`, from a letter on, 63 at most.
//!
//! Any other character `c` is written `X_HEX_` with its code point, and so is the `X` of a literal `X_`.

/// Characters of a name; MATLAB takes no more.
const MAX: usize = 63;

/// The name as an identifier; [`None`] if that is too long.
pub(super) fn escape(name: &str) -> Option<String> {
    let mut out = String::new();
    let mut chars = name.chars().peekable();
    while let Some(c) = chars.next() {
        let plain = if out.is_empty() { c.is_ascii_alphabetic() } else { c.is_ascii_alphanumeric() || c == '_' };
        if plain && !(c == 'X' && chars.peek() == Some(&'_')) {
            out.push(c);
        } else {
            out.push_str(&format!("X_{:x}_", u32::from(c)));
        }
    }
    (!out.is_empty() && out.len() <= MAX).then_some(out)
}

/// The name that was escaped.
pub(super) fn unescape(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, behind)) = rest.split_once("X_") {
        out.push_str(before);
        let coded = behind.split_once('_').and_then(|(hex, behind)| Some((char::from_u32(u32::from_str_radix(hex, 16).ok()?)?, behind)));
        match coded {
            Some((c, behind)) => {
                out.push(c);
                rest = behind;
            }
            None => {
                out.push_str("X_");
                rest = behind;
            }
        }
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_comes_back() {
        for name in ["force_x", "event/HOLD", "1st", "_a", "X_", "X_41_", "ä b", "left.force_x", "aX"] {
            let escaped = escape(name).unwrap();
            assert!(escaped.starts_with(|c: char| c.is_ascii_alphabetic()) && escaped.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'), "{escaped}");
            assert_eq!(unescape(&escaped), name);
        }
        assert_eq!(escape("force_x").as_deref(), Some("force_x"));
        assert_eq!(escape(&"a".repeat(64)), None);
        assert_eq!(escape(""), None);
    }
}
