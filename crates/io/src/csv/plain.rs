//! Lines that hold nothing but numbers, and all of them: most of every file. They are read on all cores, and what is not so plain is left to the
//! reader that knows everything.

use super::cells::{Separator, digits};
use rayon::prelude::*;

/// Bytes that a thread takes at a time: some thousand lines.
const TOGETHER: usize = 1 << 17;

/// What plain lines hold.
pub(super) struct Plain {
    /// Samples, column after column.
    pub columns: Vec<Vec<f64>>,
    /// Lines.
    pub count: usize,
    /// Most decimal places and most significant digits of the column of times.
    pub digits: (u32, u32),
}

impl Plain {
    fn new(width: usize) -> Self {
        Plain { columns: vec![Vec::new(); width], count: 0, digits: (0, 0) }
    }

    fn append(&mut self, other: Plain) {
        self.columns.iter_mut().zip(other.columns).for_each(|(all, new)| all.extend(new));
        self.count += other.count;
        self.digits = (self.digits.0.max(other.digits.0), self.digits.1.max(other.digits.1));
    }
}

/// The numbers of `text`, lines of `width` cells of which `time` is the column of times; `None` if a line is not plain, is blank or has no end.
pub(super) fn read(text: &str, separator: Separator, width: usize, time: Option<usize>) -> Option<Plain> {
    let Separator::Sign(sign @ (',' | ';' | '\t')) = separator else { return None };
    if !text.ends_with('\n') {
        return None;
    }
    let parts: Vec<Plain> = pieces(text).par_iter().map(|piece| lines(piece, sign as u8, width, time)).collect::<Option<_>>()?;
    let mut all = Plain::new(width);
    let count = parts.iter().map(|part| part.count).sum();
    all.columns.iter_mut().for_each(|column| column.reserve_exact(count));
    parts.into_iter().for_each(|part| all.append(part));
    Some(all)
}

/// The text in pieces that end with a line.
fn pieces(mut text: &str) -> Vec<&str> {
    let mut out = Vec::with_capacity(text.len() / TOGETHER + 1);
    while text.len() > TOGETHER {
        let Some(end) = text.as_bytes()[TOGETHER..].iter().position(|byte| *byte == b'\n') else { break };
        let (piece, rest) = text.split_at(TOGETHER + end + 1);
        out.push(piece);
        text = rest;
    }
    out.push(text);
    out
}

fn lines(text: &str, sign: u8, width: usize, time: Option<usize>) -> Option<Plain> {
    let mut out = Plain::new(width);
    // A number and its separator seldom have fewer bytes.
    out.columns.iter_mut().for_each(|column| column.reserve(text.len() / (8 * width) + 1));
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        for (column, samples) in out.columns.iter_mut().enumerate() {
            let from = at;
            while matches!(bytes.get(at)?, b'0'..=b'9' | b'.' | b'-' | b'+' | b'e' | b'E') {
                at += 1;
            }
            let cell = &text[from..at];
            if column + 1 < width {
                if bytes[at] != sign {
                    return None;
                }
                at += 1;
            } else {
                at += usize::from(bytes[at] == b'\r');
                if *bytes.get(at)? != b'\n' {
                    return None;
                }
                at += 1;
            }
            samples.push(cell.parse().ok()?);
            if time == Some(column) {
                let (decimals, significant) = digits(cell);
                out.digits = (out.digits.0.max(decimals), out.digits.1.max(significant));
            }
        }
        out.count += 1;
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMMA: Separator = Separator::Sign(',');

    #[test]
    fn plain_lines_are_read_in_order_over_all_pieces() {
        let text: String = (0..40_000).map(|k| format!("{},{:e},-{}.5\n", f64::from(k) / 8.0, f64::from(k), k)).collect();
        assert!(pieces(&text).len() > 3);
        let plain = read(&text, COMMA, 3, Some(0)).expect("plain lines");
        assert_eq!((plain.count, plain.digits), (40_000, (3, 7)));
        for k in 0..40_000 {
            assert_eq!([0, 1, 2].map(|c| plain.columns[c][k as usize]), [f64::from(k) / 8.0, f64::from(k), -f64::from(k) - 0.5]);
        }
        let ended = read("1\t2\r\n3\t4\r\n", Separator::Sign('\t'), 2, None).expect("plain lines");
        assert_eq!(ended.columns, [[1.0, 3.0], [2.0, 4.0]]);
    }

    #[test]
    fn what_is_not_plain_is_left_to_the_other_reader() {
        for text in [
            "1,2",
            "1,2\n\n3,4\n",
            "1\n",
            "1,2,3\n",
            "1,\n",
            "1,nan\n",
            "1, 2\n",
            "1,\"2\"\n",
            "# note\n1,2\n",
            "1,-\n",
            "1,2\r\r\n",
            "1,2\rx\n",
            "1,é\n",
            "1,2\n3",
        ] {
            assert!(read(text, COMMA, 2, None).is_none(), "{text:?}");
        }
        assert!(read("1 2\n", Separator::Spaces, 2, None).is_none());
        assert_eq!(read("1,2\n3,4\n", COMMA, 2, None).expect("plain lines").count, 2);
    }
}
