//! The library names arguments, `` `nperseg` ``; here they are flags, `--nperseg`.

use std::collections::BTreeSet;
use std::sync::OnceLock;

/// The long options of all commands.
static OPTIONS: OnceLock<BTreeSet<String>> = OnceLock::new();

/// Takes note of what is an option, once and before anything is said.
pub fn know(definition: &clap::Command) {
    OPTIONS.get_or_init(|| definition.get_subcommands().flat_map(clap::Command::get_arguments).filter_map(|a| a.get_long().map(str::to_owned)).collect());
}

/// The text with every argument in backticks that is an option of some command written as its flag: `` `method=welch` `` is
/// `--method welch`.
pub fn as_flags(text: &str) -> String {
    let is_option = |flag: &str| OPTIONS.get().is_some_and(|options| options.contains(flag));
    let mut out = String::with_capacity(text.len());
    for (k, part) in text.split('`').enumerate() {
        if k % 2 == 0 {
            out += part;
            continue;
        }
        let (name, value) = part.split_once('=').map_or((part, None), |(name, value)| (name, Some(value)));
        let flag = name.replace('_', "-");
        out += &match (is_option(&flag), value) {
            (true, Some(value)) => format!("--{flag} {value}"),
            (true, None) => format!("--{flag}"),
            (false, _) => format!("`{part}`"),
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_become_flags_and_other_words_stay() {
        know(&crate::definition());
        let text = "take `method=welch` with a smaller `time_bandwidth`, or ask `ndof diagnose`; lower `duration_s`";
        assert_eq!(as_flags(text), "take --method welch with a smaller --time-bandwidth, or ask `ndof diagnose`; lower `duration_s`");
    }
}
