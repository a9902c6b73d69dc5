//! Numbers as people read them: the interval decides the digits.

/// Decimals that show `spread` to two significant digits, e.g. 0.013 → 3, 5.2 → 1, 240 → 0.
fn decimals_for(spread: f64) -> i32 {
    if !spread.is_finite() || spread <= 0.0 {
        return 0;
    }
    let exponent = spread.log10().floor() as i32;
    // Rounding to two digits may carry (0.0996 → 0.10): one decimal less is then enough.
    let carried = (spread / 10f64.powi(exponent - 1)).round() >= 100.0;
    1 - exponent - i32::from(carried)
}

const SUPERSCRIPTS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];

/// An integer in superscript characters, e.g. -3 → "⁻³".
pub(crate) fn superscript(exponent: i32) -> String {
    let sign = if exponent < 0 { "⁻" } else { "" };
    let digits = exponent.unsigned_abs().to_string();
    sign.chars().chain(digits.bytes().map(|digit| SUPERSCRIPTS[usize::from(digit - b'0')])).collect()
}

/// A unit as it is printed: "N s^2/m" → "N s²/m".
pub(crate) fn printed_unit(unit: &str) -> String {
    let mut printed = String::with_capacity(unit.len());
    let mut parts = unit.split('^');
    printed.push_str(parts.next().unwrap_or_default());
    for part in parts {
        let digits = part.char_indices().take_while(|&(k, c)| c.is_ascii_digit() || (k == 0 && c == '-')).count();
        match part[..digits].parse::<i32>() {
            Ok(exponent) => printed.push_str(&superscript(exponent)),
            Err(_) => printed.extend(["^", &part[..digits]]),
        }
        printed.push_str(&part[digits..]);
    }
    printed
}

/// The unit of a power density: `N²/Hz`, `(N m)²/Hz`.
pub(crate) fn density_unit(symbol: &str) -> String {
    match symbol {
        "" => "1/Hz".to_owned(),
        plain if plain.chars().all(char::is_alphanumeric) => format!("{plain}²/Hz"),
        product => format!("({product})²/Hz"),
    }
}

/// A number with `decimals` places and a typographic minus; never "−0".
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|byte| byte == b'0' || byte == b'.') => rest.to_string(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => text,
    }
}

/// The number, or the one that is shown as a dash.
pub fn nan(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

/// A number with `digits` significant digits, in powers of ten outside 10⁻³ … 10⁵; "–" where it does not exist.
///
/// ```
/// # use ndof_report::number::significant;
/// assert_eq!(significant(0.012345, 3), "0.0123");
/// assert_eq!(significant(-1.5e-7, 2), "−1.5 × 10⁻⁷");
/// assert_eq!(significant(f64::NAN, 3), "–");
/// ```
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "–".to_string();
    }
    if value == 0.0 {
        return "0".to_string();
    }
    let digits = digits.max(1);
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-3..5).contains(&exponent) {
        return fixed(value, (digits as i32 - 1 - exponent).max(0) as usize);
    }
    format!("{} × 10{}", mantissa.replace('-', "\u{2212}"), superscript(exponent))
}

/// A value with the half-width of its interval, to two digits of the latter.
///
/// The value is rounded where its interval is, so that no digit is shown which the data do not carry.
/// ```
/// # use ndof_report::number::with_half_width;
/// assert_eq!(with_half_width(302.4417, 5.13), "302.4 ± 5.1");
/// assert_eq!(with_half_width(-0.55019, 0.0129), "−0.550 ± 0.013");
/// assert_eq!(with_half_width(123456.0, 2345.0), "(1.235 ± 0.023) × 10⁵");
/// assert_eq!(with_half_width(2.5, f64::NAN), "2.5 ± –");
/// ```
pub fn with_half_width(value: f64, half_width: f64) -> String {
    let spread = half_width.abs();
    if !value.is_finite() || !spread.is_finite() || spread == 0.0 {
        let value = significant(value, 4);
        let value = if value.contains('.') && !value.contains('×') { value.trim_end_matches('0').trim_end_matches('.').to_string() } else { value };
        return format!("{value} ± {}", if spread == 0.0 { "0".to_string() } else { significant(spread, 2) });
    }
    let exponent = value.abs().max(spread).log10().floor() as i32;
    if (-3..5).contains(&exponent) && decimals_for(spread) >= 0 {
        let decimals = decimals_for(spread) as usize;
        return format!("{} ± {}", fixed(value, decimals), fixed(spread, decimals));
    }
    let scale = 10f64.powi(exponent);
    let decimals = decimals_for(spread / scale).max(0) as usize;
    format!("({} ± {}) × 10{}", fixed(value / scale, decimals), fixed(spread / scale, decimals), superscript(exponent))
}

/// A value to the digits of an interval's half-width, for tables that show value and interval in columns of their own.
pub fn to_interval(value: f64, half_width: f64) -> String {
    let decimals = decimals_for(half_width.abs());
    let exponent = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    if !value.is_finite() || !half_width.is_finite() || half_width == 0.0 || !(0..=9).contains(&decimals) || exponent >= 5 {
        return significant(value, 4);
    }
    fixed(value, decimals as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_decides_the_digits() {
        assert_eq!(with_half_width(302.4417, 24.0), "302 ± 24");
        assert_eq!(with_half_width(302.4417, 0.51), "302.44 ± 0.51");
        assert_eq!(with_half_width(1.0, 0.0996), "1.00 ± 0.10");
        assert_eq!(to_interval(302.4417, 0.51), "302.44");
    }

    #[test]
    fn a_small_value_with_a_large_interval_keeps_the_scale_of_the_interval() {
        assert_eq!(with_half_width(0.0001, 3.2), "0.0 ± 3.2");
        assert_eq!(with_half_width(-0.0001, 3.2), "0.0 ± 3.2");
    }

    #[test]
    fn wide_intervals_and_tiny_values_use_powers_of_ten() {
        assert_eq!(with_half_width(4.0e-6, 1.2e-7), "(4.00 ± 0.12) × 10⁻⁶");
        assert_eq!(with_half_width(12_345.0, 678.0), "(1.234 ± 0.068) × 10⁴");
        assert_eq!(significant(123_456.0, 3), "1.23 × 10⁵");
    }

    #[test]
    fn units_are_printed_with_their_exponents_raised() {
        let printed = ["N s^2/m", "N m", "m s^-12", "a^b", "", "^", "x^-"].map(printed_unit);
        assert_eq!(printed, ["N s²/m", "N m", "m s⁻¹²", "a^b", "", "^", "x^-"]);
    }

    #[test]
    fn numbers_that_do_not_exist_are_a_dash() {
        assert_eq!(with_half_width(f64::NAN, 1.0), "– ± 1.0");
        assert_eq!(to_interval(f64::NAN, 1.0), "–");
        assert_eq!(significant(0.0, 3), "0");
    }
}
