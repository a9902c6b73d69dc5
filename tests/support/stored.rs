//! Results that are held word by word and number by number against those of a file.

use serde_json::{Value, json};

/// Below this a number is zero; probabilities of chance are, mostly.
const ZERO: f64 = 1e-9;

/// Holds `found` against what `path` has, numbers to `relative` and those in sentences, which are rounded, to a tenth. Writes the file anew
/// where the environment has `write`.
pub fn held(found: &Value, path: &str, relative: f64, write: &str) {
    let found = rounded(found);
    if std::env::var_os(write).is_some() {
        std::fs::write(path, serde_json::to_string_pretty(&found).expect("text") + "\n").expect("written");
    }
    let stored: Value = serde_json::from_str(&std::fs::read_to_string(path).expect("the table")).expect("a table");
    compare(&found, &stored, relative, "");
}

/// What recordings are multiplied by: 1, or as many parts in 10¹¹ beside it as `NDOF_NUDGE` says, another way each time. Round-off on another
/// machine does no more; a table that holds with it asks for nothing that is chance.
#[allow(dead_code)]
pub fn nudge(number: usize) -> f64 {
    let parts: f64 = std::env::var("NDOF_NUDGE").ok().and_then(|parts| parts.parse().ok()).unwrap_or(0.0);
    1.0 + parts * 1e-11 * (2.0 * (0.618_033_988_75 * number as f64).fract() - 1.0)
}

/// With six digits of each number.
fn rounded(value: &Value) -> Value {
    match value {
        Value::Number(number) => number.as_f64().map_or(Value::Null, |x| json!(format!("{x:.5e}").parse::<f64>().expect("a number"))),
        Value::Array(values) => values.iter().map(rounded).collect(),
        Value::Object(entries) => Value::Object(entries.iter().map(|(key, value)| (key.clone(), rounded(value))).collect()),
        other => other.clone(),
    }
}

/// A text without its numbers, and these.
fn apart(text: &str) -> (String, Vec<f64>) {
    let (mut words, mut numbers) = (String::new(), Vec::new());
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        words += &rest[..start];
        words.push('#');
        let digits = |from: usize| rest[from..].find(|c: char| !c.is_ascii_digit()).map_or(rest.len(), |end| from + end);
        let whole = digits(start);
        // A full stop behind a number ends the sentence, two are a range.
        let fraction = rest[whole..].strip_prefix('.').is_some_and(|after| after.starts_with(|c: char| c.is_ascii_digit()));
        let end = if fraction { digits(whole + 1) } else { whole };
        numbers.push(rest[start..end].parse().expect("digits"));
        rest = &rest[end..];
    }
    (words + rest, numbers)
}

fn close(found: f64, stored: f64, relative: f64) -> bool {
    (found - stored).abs() <= relative * found.abs().max(stored.abs()) + ZERO
}

fn compare(found: &Value, stored: &Value, relative: f64, place: &str) {
    match (found, stored) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
            assert!(close(a, b, relative), "{place}: {a}, was {b}");
        }
        (Value::String(a), Value::String(b)) => {
            let ((a_words, a_numbers), (b_words, b_numbers)) = (apart(a), apart(b));
            let alike = a_numbers.iter().zip(&b_numbers).all(|(a, b)| close(*a, *b, 0.1));
            assert!(a_words == b_words && alike, "{place}: \"{a}\", was \"{b}\"");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert!(a.len() == b.len(), "{place}: {} entries, were {}", a.len(), b.len());
            a.iter().zip(b).enumerate().for_each(|(k, (a, b))| compare(a, b, relative, &format!("{place}[{k}]")));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{place}: {:?}, were {:?}", a.keys(), b.keys());
            a.iter().zip(b.values()).for_each(|((key, a), b)| compare(a, b, relative, &format!("{place}.{key}")));
        }
        (a, b) => assert_eq!(a, b, "{place}"),
    }
}
