//! The documents at the root and the book's table of contents are in step with the code.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const VERSION: &str = env!("CARGO_PKG_VERSION");

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Files below a folder whose name ends so, as paths from the root.
fn files(folder: &str, suffix: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else if path.to_string_lossy().ends_with(suffix) {
                found.push(path.strip_prefix(root()).expect("below").to_owned());
            }
        }
    }
    found.sort();
    found
}

/// What stands between backticks on one line.
fn quoted(text: &str) -> Vec<String> {
    text.lines().flat_map(|line| line.split('`').skip(1).step_by(2).map(str::to_owned)).collect()
}

#[test]
fn every_crate_has_its_row_in_the_architecture_and_the_version_of_the_program() {
    let architecture = read("ARCHITECTURE.md");
    for manifest in files("crates", "Cargo.toml").iter().filter(|path| path.components().count() == 3) {
        let folder = manifest.parent().expect("a folder").display().to_string();
        assert!(architecture.contains(&format!("| `{folder}` |")), "ARCHITECTURE.md has no row for {folder}");
        let manifest: toml::Table = read(&manifest.display().to_string()).parse().expect("TOML");
        let version = &manifest["package"]["version"];
        let own = version.as_str().map(str::to_owned);
        assert!(own.as_deref().is_none_or(|own| own == VERSION), "{folder} has version {own:?}, the program {VERSION}");
    }
}

#[test]
fn what_the_documents_name_exists() {
    for document in ["ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md", "README.md"] {
        for name in quoted(&read(document)) {
            let path = name.split(['#', ':']).next().unwrap_or_default();
            let of_here = ["crates/", "examples/", "tests/", "book/", "benches/", "src/"].iter().any(|start| path.starts_with(start));
            if of_here && !path.contains([' ', '*', '<', '…']) {
                assert!(root().join(path).exists() || Path::new(path).starts_with("book/book"), "{document} names {path}, which there is not");
            }
        }
    }
}

#[test]
fn the_types_that_the_contract_names_are_in_the_code() {
    let code: String = files("crates", ".rs").iter().map(|path| read(&path.display().to_string())).collect();
    let contract = read("CONTRIBUTING.md");
    let from = contract.find("## The contract").expect("a contract");
    let is_type = |name: &&String| name.starts_with(char::is_uppercase) && name.chars().all(char::is_alphanumeric);
    let is_list = |name: &&String| name.len() > 3 && name.chars().all(|c| c.is_uppercase());
    let names: BTreeSet<String> = quoted(&contract[from..]).iter().filter(|name| is_type(name) || is_list(name)).cloned().collect();
    assert!(names.len() >= 8, "{names:?}");
    for name in names {
        assert!(["trait", "enum", "struct", "static"].iter().any(|kind| code.contains(&format!("{kind} {name}"))), "CONTRIBUTING.md names {name}");
    }
}

#[test]
fn version_and_changes_agree() {
    assert!(read("CITATION.cff").lines().any(|line| line == format!("version: {VERSION}")), "CITATION.cff has another version than {VERSION}");
    let changes = read("CHANGELOG.md");
    let newest = changes.lines().find(|line| line.starts_with("## ")).expect("a section");
    assert!(newest == "## [Unreleased]" || newest.starts_with(&format!("## [{VERSION}]")), "the newest section of CHANGELOG.md is {newest}");
    let python: toml::Table = read("crates/python/pyproject.toml").parse().expect("TOML");
    let version = python["project"].get("version").and_then(toml::Value::as_str);
    assert!(version.is_none_or(|version| version == VERSION), "{version:?}");
}

#[test]
fn every_page_of_the_book_is_listed_once_and_is_no_stub() {
    let summary = read("book/src/SUMMARY.md");
    for page in files("book/src", ".md") {
        let page = page.strip_prefix("book/src").expect("below").display().to_string();
        if page == "SUMMARY.md" {
            continue;
        }
        assert_eq!(summary.matches(&format!("]({page})")).count(), 1, "{page} in SUMMARY.md");
        let text = read(&format!("book/src/{page}"));
        let words = text.split_whitespace().count();
        assert!(text.starts_with("# ") && (words > 150 || text.contains("{{#include")), "{page} has {words} words");
        for stub in ["TODO", "FIXME", "TBD", "coming soon", "to be written"] {
            assert!(!text.contains(stub), "{page}: {stub}");
        }
    }
}

#[test]
fn every_picture_of_the_book_is_shown_and_every_example_is_told_of() {
    let book: String = files("book/src", ".md").iter().map(|path| read(&path.display().to_string())).collect();
    for picture in files("book/src/pictures", ".svg") {
        let name = picture.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(book.contains(&name), "{name} is shown on no page");
    }
    let told = book + &read("README.md") + &read("CONTRIBUTING.md");
    let code: String = files("tests", ".rs").iter().chain(&files("src", ".rs")).map(|path| read(&path.display().to_string())).collect();
    let shipped: String = files("examples", ".toml").iter().map(|path| read(&path.display().to_string())).collect();
    for suffix in [".rs", ".toml", ".urdf"] {
        for example in files("examples", suffix) {
            let stem = example.file_stem().expect("a name").to_string_lossy().into_owned();
            let dashed = stem.replace('_', "-");
            let ways = [format!("{stem}{suffix}"), format!("example {stem}"), format!("study {dashed}"), format!("\"{dashed}\"")];
            let named = |text: &str| ways.iter().any(|way| text.contains(way.as_str()));
            assert!(named(&told) || named(&code) || named(&shipped), "{} is named nowhere", example.display());
        }
    }
}
