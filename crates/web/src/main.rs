//! A study as a program that needs nothing but standard input and output.
//!
//! ```text
//! ndof-web < study.toml > answer.json
//! ```
//!
//! Compiled to WebAssembly (`crates/web/build`) it is what the book's page *In the browser* runs: the page writes the file of a study from
//! its sliders, this program simulates, estimates, fits and, where the file has a table `[diagnose]`, diagnoses. An error is an answer too,
//! `{"error": …}`, so that the page can show it.

mod answer;

use std::error::Error;
use std::io::{Read, Write};

fn main() -> Result<(), Box<dyn Error>> {
    let mut study = String::new();
    std::io::stdin().read_to_string(&mut study)?;
    let answer = match answer::answer(&study) {
        Ok(answer) => serde_json::to_vec(&answer)?,
        Err(error) => serde_json::to_vec(&serde_json::json!({ "error": error.to_string() }))?,
    };
    std::io::stdout().write_all(&answer)?;
    Ok(())
}
