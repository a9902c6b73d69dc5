//! Text to values, for settings that a command line reads: errors say what would be right.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::DeserializeOwned;
use std::str::FromStr;

/// `LO-HI` as two increasing numbers; either may be negative.
///
/// # Errors
/// What to write, in words; so do all of these.
pub fn pair(text: &str) -> Result<[f64; 2], String> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    let ends = text.match_indices('-').skip_while(|(at, _)| *at == 0).find_map(|(at, _)| Some((number(&text[..at])?, number(&text[at + 1..])?)));
    match ends {
        Some((low, high)) if low < high => Ok([low, high]),
        Some((low, high)) => Err(format!("{low} is not below {high}; write the smaller number first")),
        None => Err("write two numbers with a minus between them, such as 0.25-10".to_owned()),
    }
}

/// A number above zero.
///
/// # Errors
/// What to write.
pub fn positive(text: &str) -> Result<f64, String> {
    not_negative(text).ok().filter(|value| *value > 0.0).ok_or_else(|| "write a number above zero".to_owned())
}

/// A number of seconds or the like, of either sign.
///
/// # Errors
/// What to write.
pub fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| "write a number".to_owned())
}

/// A whole number of 1 or more.
///
/// # Errors
/// What to write.
pub fn count(text: &str) -> Result<usize, String> {
    text.trim().parse().ok().filter(|value| *value > 0).ok_or_else(|| "write a whole number of 1 or more".to_owned())
}

/// A whole number of 0 or more.
///
/// # Errors
/// What to write.
pub fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.trim().parse().map_err(|_| "write a whole number of 0 or more".to_owned())
}

/// A number that is zero or more.
///
/// # Errors
/// What to write.
pub fn not_negative(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|value: &f64| value.is_finite() && *value >= 0.0).ok_or_else(|| "write a number that is not negative".to_owned())
}

/// What forces may do between samples, as `hold` says it.
pub const HOLDS: [&str; 5] = ["zero", "linear", "band-limited", "read-after", "read-before"];

/// A parser for the words of an enum, as serde writes them.
pub fn words<T: DeserializeOwned + Clone + Send + Sync + 'static>(known: &'static [&'static str]) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(known).try_map(|word| serde_json::from_value::<T>(serde_json::Value::String(word)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_and_stretches() {
        assert_eq!(pair("0.25-10"), Ok([0.25, 10.0]));
        assert_eq!(pair("-1--0.5"), Ok([-1.0, -0.5]));
        assert_eq!(pair("1e-3-2"), Ok([1e-3, 2.0]));
        assert_eq!((count("3"), whole::<u64>("0"), number("-2.5")), (Ok(3), Ok(0), Ok(-2.5)));
        assert!(count("0").is_err() && whole::<usize>("-1").is_err() && number("inf").is_err());
        assert!(pair("10-1").is_err() && pair("10").is_err() && pair("a-b").is_err());
    }
}
