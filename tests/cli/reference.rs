//! The pages of the book's reference are what the program prints.

use crate::support::succeed;
use std::path::Path;

/// The page of that name, from its first heading of the second level: what stands before is written by hand.
fn generated_part(page: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("book/src/reference").join(page);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let from = text.find("\n## ").map_or(0, |at| at + 1);
    text[from..].to_owned()
}

#[test]
fn the_reference_pages_are_what_the_program_prints() {
    let folder = tempfile::tempdir().expect("a folder");
    let print = |arguments: &[&str]| succeed(folder.path(), arguments);
    for what in ["effects", "joints", "devices", "models", "laws", "methods"] {
        assert_eq!(generated_part(&format!("{what}.md")), print(&["list", what, "--format", "markdown"]), "run book/reference to write {what}.md anew");
    }
    let results: Vec<String> = ["estimate", "fit", "diagnosis", "check", "compare", "live", "design", "excitation", "study-result", "sensitivity", "truth"]
        .iter()
        .map(|name| print(&["schema", name, "--format", "markdown"]))
        .collect();
    assert_eq!(generated_part("results.md"), results.join("\n"), "run book/reference to write results.md anew");
    assert_eq!(generated_part("command_line.md"), print(&["completions", "markdown"]), "run book/reference to write command_line.md anew");
}
