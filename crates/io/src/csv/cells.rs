//! A line into its cells.

use super::rows::is_missing;
use std::borrow::Cow;

/// What stands between two cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Separator {
    /// `,`, `;` or a tab.
    Sign(char),
    /// Any run of spaces.
    Spaces,
    /// There is one column only.
    #[default]
    None,
}

/// One cell; `quoted` tells a name that looks like a number from a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Cell<'a> {
    pub text: Cow<'a, str>,
    pub quoted: bool,
}

impl Cell<'_> {
    /// Whether it is a number, with a decimal point or comma; in quotes it may be a name.
    pub fn is_number(&self) -> bool {
        self.text.parse::<f64>().is_ok() || self.text.replacen(',', ".", 1).parse::<f64>().is_ok()
    }

    /// Whether it is a word or a date, and neither a missing number nor one that is written in a way that is not read.
    pub fn is_words(&self) -> bool {
        let number = self.text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | ','));
        !self.is_number() && !is_missing(&self.text) && (!number || self.text.contains(':'))
    }
}

/// A quotation mark that is never closed.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct OpenQuote;

/// Splits a line. Cells may be quoted, `""` is a quotation mark within quotes; blanks around cells are taken off.
pub(crate) fn split<'a>(line: &'a str, separator: Separator, cells: &mut Vec<Cell<'a>>) -> Result<(), OpenQuote> {
    cells.clear();
    let plain = |text: &'a str| Cell { text: Cow::Borrowed(text.trim()), quoted: false };
    if !line.contains('"') {
        match separator {
            Separator::Sign(sign) => cells.extend(line.split(sign).map(plain)),
            Separator::Spaces => cells.extend(line.split_whitespace().map(plain)),
            Separator::None => cells.push(plain(line)),
        }
        return Ok(());
    }
    let separates = |c: char| match separator {
        Separator::Sign(sign) => c == sign,
        Separator::Spaces => c.is_whitespace(),
        Separator::None => false,
    };
    let mut rest = line.trim();
    loop {
        if let Some(quoted) = rest.strip_prefix('"') {
            let (text, behind) = unquote(quoted)?;
            cells.push(Cell { text: Cow::Owned(text), quoted: true });
            rest = behind.trim_start_matches(|c: char| c.is_whitespace() && !separates(c));
            if let Some(extra) = rest.find(separates).map(|end| &rest[..end]).or((!rest.is_empty()).then_some(rest)).filter(|e| !e.is_empty())
                && let Some(last) = cells.last_mut()
            {
                // `"force, x" [N]`: what follows the quotes belongs to the cell.
                last.text = Cow::Owned(format!("{} {}", last.text, extra.trim()));
                rest = &rest[extra.len()..];
            }
        } else {
            let end = rest.find(separates).unwrap_or(rest.len());
            cells.push(plain(&rest[..end]));
            rest = &rest[end..];
        }
        match rest.chars().next() {
            None => return Ok(()),
            Some(sign) => {
                rest = &rest[sign.len_utf8()..];
                if separator == Separator::Spaces {
                    rest = rest.trim_start();
                } else {
                    rest = rest.trim_start_matches(|c: char| c.is_whitespace() && !separates(c));
                }
            }
        }
    }
}

/// The text up to the closing quotation mark, and what is behind it.
fn unquote(text: &str) -> Result<(String, &str), OpenQuote> {
    let mut out = String::new();
    let mut rest = text;
    loop {
        let end = rest.find('"').ok_or(OpenQuote)?;
        out.push_str(&rest[..end]);
        rest = &rest[end + 1..];
        match rest.strip_prefix('"') {
            Some(behind) => {
                out.push('"');
                rest = behind;
            }
            None => return Ok((out, rest)),
        }
    }
}

/// Decimal places and significant digits of a number as it is written.
pub(super) fn digits(text: &str) -> (u32, u32) {
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let exponent: i64 = exponent.parse().unwrap_or(0);
    let fraction = mantissa.split_once('.').map_or(0, |(_, f)| f.len()) as i64;
    let figures = mantissa.bytes().filter(u8::is_ascii_digit).skip_while(|&c| c == b'0').count();
    ((fraction - exponent).clamp(0, 300) as u32, figures.min(20) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(line: &str, separator: Separator) -> Vec<String> {
        let mut cells = Vec::new();
        split(line, separator, &mut cells).unwrap();
        cells.into_iter().map(|c| c.text.into_owned()).collect()
    }

    #[test]
    fn quotes_hide_separators_and_doubled_quotes_are_one() {
        assert_eq!(texts(r#""a, b [N]", c,"d""e","#, Separator::Sign(',')), ["a, b [N]", "c", "d\"e", ""]);
        assert_eq!(texts(r#""a, b" [N],c"#, Separator::Sign(',')), ["a, b [N]", "c"]);
        assert_eq!(texts("  a   b\tc ", Separator::Spaces), ["a", "b", "c"]);
        assert_eq!(texts(r#""a b"  "c" d"#, Separator::Spaces), ["a b", "c", "d"]);
        assert_eq!(texts("a\t\tb\t", Separator::Sign('\t')), ["a", "", "b", ""]);
        assert_eq!(texts("\"a\"\t\t\"b\"", Separator::Sign('\t')), ["a", "", "b"]);
    }

    #[test]
    fn an_open_quote_is_an_error() {
        assert_eq!(split("\"a,b", Separator::Sign(','), &mut Vec::new()), Err(OpenQuote));
    }

    #[test]
    fn digits_are_counted_as_written() {
        assert_eq!(digits("0.00100002406"), (11, 9));
        assert_eq!(digits("24.840"), (3, 5));
        assert_eq!(digits("-1.5e-3"), (4, 2));
        assert_eq!(digits("120"), (0, 3));
    }
}
