//! Ctrl-C: no half file, exit code 130.

use crate::error::CliError;
use std::sync::atomic::{AtomicBool, Ordering};

/// The exit code of a program that was interrupted.
pub const EXIT_CODE: u8 = 130;

/// A command that ends by itself when it sees [`requested`].
static HANDLED: AtomicBool = AtomicBool::new(false);
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// WebAssembly knows no signals: whoever runs the program ends it as a whole.
#[cfg(target_family = "wasm")]
pub fn listen() -> Result<(), CliError> {
    Ok(())
}

/// Ends the program on Ctrl-C or a signal to terminate, with the files that are being written taken back.
#[cfg(not(target_family = "wasm"))]
pub fn listen() -> Result<(), CliError> {
    let handler = || {
        // The second time even a command that wants to end by itself is ended.
        if HANDLED.load(Ordering::SeqCst) && !REQUESTED.swap(true, Ordering::SeqCst) {
            return;
        }
        ndof_io::abandon_writes(|| {
            eprintln!("\ninterrupted; every file is as it was before or complete");
            std::process::exit(i32::from(EXIT_CODE))
        });
    };
    ctrlc::set_handler(handler).map_err(|error| CliError::Machine { what: "listening for Ctrl-C".to_owned(), source: std::io::Error::other(error) })
}

/// From now on the command looks at [`requested`] and ends by itself.
pub fn handle() {
    HANDLED.store(true, Ordering::SeqCst);
}

/// Whether Ctrl-C was pressed.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}
