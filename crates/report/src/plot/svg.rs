//! The little of SVG and XML that is needed: escaping and coordinates.

/// Text that is safe between tags and in double-quoted attributes; control characters, which XML forbids, become "�".
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\t' | '\n' | '\r' => safe.push(' '),
            control if control.is_control() || matches!(control, '\u{fffe}' | '\u{ffff}') => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

/// A coordinate in pixels: at most two decimals, no trailing zeros, no "-0".
pub(crate) fn px(value: f64) -> String {
    let mut text = format!("{value:.2}");
    if text.contains('.') {
        let kept = text.trim_end_matches('0').trim_end_matches('.').len();
        text.truncate(kept);
    }
    if text == "-0" { "0".to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hostile_name_cannot_leave_its_attribute_or_element() {
        assert_eq!(escape("<script>\"&'</script>\u{0}\n"), "&lt;script&gt;&quot;&amp;&#39;&lt;/script&gt;\u{fffd} ");
    }

    #[test]
    fn coordinates_are_short() {
        assert_eq!([px(12.0), px(12.5), px(12.346), px(-0.001), px(100.0)], ["12", "12.5", "12.35", "0", "100"]);
    }
}
