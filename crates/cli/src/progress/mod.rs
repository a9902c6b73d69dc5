//! How far the work is: bars on a terminal, lines for whoever runs the program as WebAssembly.

#[cfg(target_family = "wasm")]
mod lines;
#[cfg(not(target_family = "wasm"))]
mod terminal;

#[cfg(target_family = "wasm")]
pub use lines::Progress;
#[cfg(not(target_family = "wasm"))]
pub use terminal::Progress;
