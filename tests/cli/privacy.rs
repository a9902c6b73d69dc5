//! Recordings are patients' data: the program cannot open a network connection, and results name nothing but what the user gave.

use crate::support::{json, ndof, succeed, trial};
use std::path::Path;

/// Whether the program's table of imported functions has this name.
#[cfg(target_os = "linux")]
fn imports(program: &[u8], name: &str) -> bool {
    let entry: Vec<u8> = [b"\0", name.as_bytes(), b"\0"].concat();
    program.windows(entry.len()).any(|window| window == entry)
}

#[test]
#[cfg(target_os = "linux")]
fn the_program_imports_no_function_that_opens_a_connection() {
    let program = std::fs::read(env!("CARGO_BIN_EXE_ndof")).expect("the program");
    // That the names are looked for in the right way: it does write files.
    assert!(imports(&program, "write"));
    for name in ["socket", "connect", "bind", "listen", "accept", "accept4", "getaddrinfo", "gethostbyname", "sendto"] {
        assert!(!imports(&program, name), "the program imports {name}");
    }
}

/// Every text in a JSON value.
fn texts(value: &serde_json::Value, found: &mut Vec<String>) {
    match value {
        serde_json::Value::String(text) => found.push(text.clone()),
        serde_json::Value::Array(items) => items.iter().for_each(|item| texts(item, found)),
        serde_json::Value::Object(fields) => fields.values().for_each(|field| texts(field, found)),
        _ => {}
    }
}

#[test]
fn a_result_names_neither_folder_nor_user_nor_time() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let result = json(folder.path(), &["estimate", "trial.csv", "--nperseg", "1024"]);
    let mut found = Vec::new();
    texts(&result, &mut found);
    let forbidden = [folder.path().to_string_lossy().into_owned(), std::env::var("HOSTNAME").unwrap_or_default(), std::env::var("USER").unwrap_or_default()];
    for text in found {
        assert!(!forbidden.iter().any(|word| word.len() > 2 && text.contains(word.as_str())), "{text}");
    }
    assert_eq!(result, json(folder.path(), &["estimate", "trial.csv", "--nperseg", "1024"]), "no time of day, nothing drawn at random");
}

#[test]
fn only_what_was_asked_for_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    trial(folder.path());
    let files = |folder: &Path| {
        let mut names: Vec<String> =
            std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    };
    let before = files(folder.path());
    succeed(folder.path(), &["estimate", "trial.csv", "--nperseg", "1024", "--json", "out.json"]);
    let mut expected = before;
    expected.push("out.json".to_owned());
    expected.sort();
    assert_eq!(files(folder.path()), expected);
    assert!(!ndof(folder.path(), &["estimate", "nothing.csv", "--json", "other.json"]).status.success());
    assert_eq!(files(folder.path()), expected, "a command that fails leaves nothing behind");
}
