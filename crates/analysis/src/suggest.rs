//! "Did you mean …?"

use ndof_signal::Window;

/// The name among `known` that is nearest to `name`, if it is near enough to be a slip of the hand.
///
/// ```
/// assert_eq!(ndof_analysis::nearest("force_X", ["force_x", "pos_x"]), Some("force_x".to_owned()));
/// assert_eq!(ndof_analysis::nearest("temperature", ["force_x", "pos_x"]), None);
/// ```
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    const NEAR: f64 = 0.8;
    let lower = name.to_lowercase();
    known
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(similarity, _)| *similarity >= NEAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}

/// The data window of a name; the error knows the nearest one that there is.
///
/// # Errors
/// What is wrong, in words.
///
/// ```
/// assert!(ndof_analysis::window_named("haming").unwrap_err().starts_with("unknown window \"haming\" (did you mean \"hamming\"?)"));
/// ```
pub fn window_named(name: &str) -> Result<Window, String> {
    const NAMES: [&str; 8] = ["hann", "hamming", "blackman", "blackmanharris", "flattop", "bartlett", "boxcar", "tukey"];
    let unknown = format!("unknown window \"{name}\"");
    name.parse::<Window>().map_err(|error| {
        let suggestion = did_you_mean(nearest(name.split(':').next().unwrap_or(name), NAMES).filter(|known| known.as_str() != name).as_deref());
        error.to_string().replacen(&unknown, &format!("{unknown}{suggestion}"), 1)
    })
}

/// What an error adds where it knows a name that is near: ` (did you mean "…"?)`.
pub fn did_you_mean(suggestion: Option<&str>) -> String {
    suggestion.map(|s| format!(" (did you mean \"{s}\"?)")).unwrap_or_default()
}
