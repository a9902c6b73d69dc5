//! Which output and which input `OUT_IN` stands for, where both may have underscores.

use crate::units::infer_unit;
use std::collections::BTreeSet;

/// The outputs and inputs of `pairs`, of which every output goes with every input; [`None`] where that can be read in no way, or in
/// several.
pub(super) fn axes(pairs: &[String]) -> Option<(Vec<String>, Vec<String>)> {
    let first = pairs.first()?;
    let known: BTreeSet<&str> = pairs.iter().map(String::as_str).collect();
    let mut found: Vec<(bool, Vec<String>, Vec<String>)> = Vec::new();
    for (at, _) in first.match_indices('_') {
        let (output, input) = (&first[..at], &first[at + 1..]);
        if output.is_empty() || input.is_empty() {
            continue;
        }
        let outputs: Vec<String> = pairs.iter().filter_map(|p| p.strip_suffix(input)?.strip_suffix('_')).map(str::to_owned).collect();
        let inputs: Vec<String> = pairs.iter().filter_map(|p| p.strip_prefix(output)?.strip_prefix('_')).map(str::to_owned).collect();
        let all = outputs.iter().all(|o| inputs.iter().all(|i| known.contains(format!("{o}_{i}").as_str())));
        if all && outputs.len() * inputs.len() == pairs.len() {
            let channels = outputs.iter().chain(&inputs).all(|name| infer_unit(name).is_some() || name.starts_with("cmd_"));
            found.push((channels, outputs, inputs));
        }
    }
    // `pos_x_force_x`: names of channels decide among several ways.
    if found.len() > 1 {
        found.retain(|(channels, ..)| *channels);
    }
    match &mut found[..] {
        [(_, outputs, inputs)] => Some((std::mem::take(outputs), std::mem::take(inputs))),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pairs: &[&str]) -> Option<(Vec<String>, Vec<String>)> {
        axes(&pairs.iter().map(|&p| p.to_owned()).collect::<Vec<_>>())
    }

    fn names(outputs: &[&str], inputs: &[&str]) -> Option<(Vec<String>, Vec<String>)> {
        Some((outputs.iter().map(|&o| o.to_owned()).collect(), inputs.iter().map(|&i| i.to_owned()).collect()))
    }

    #[test]
    fn every_output_goes_with_every_input() {
        assert_eq!(of(&["x_f"]), names(&["x"], &["f"]));
        assert_eq!(of(&["pos_x_force_x"]), names(&["pos_x"], &["force_x"]));
        assert_eq!(of(&["pos_x_force_x", "pos_x_force_y", "pos_y_force_x", "pos_y_force_y"]), names(&["pos_x", "pos_y"], &["force_x", "force_y"]));
        assert_eq!(of(&["x_f", "x_g", "y_f", "y_g"]), names(&["x", "y"], &["f", "g"]));
        assert_eq!(of(&["hand_x_f", "elbow_x_f"]), None, "of f, or of x_f");
        assert_eq!(of(&["a_b_c"]), None, "a and b_c, or a_b and c");
        assert_eq!(of(&["x_f", "y_g"]), None, "y_f and x_g are missing");
        assert_eq!(of(&["xf"]), None);
    }
}
