//! "Did you mean …?"

/// The name among `known` that is nearest to `name`, if it is near enough to be a slip of the hand.
///
/// ```
/// assert_eq!(ndof_study::nearest("force_X", ["force_x", "pos_x"]), Some("force_x".to_owned()));
/// assert_eq!(ndof_study::nearest("temperature", ["force_x", "pos_x"]), None);
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
