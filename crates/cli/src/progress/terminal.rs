//! Progress bars, on standard error and only where somebody looks.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// One bar that shows the step that is under way; silent where nobody looks, gone when dropped.
pub struct Steps {
    bar: ProgressBar,
}

impl Steps {
    /// A bar, hidden if `quiet` or standard error is no terminal.
    pub fn new(quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        let bar = ProgressBar::with_draw_target(Some(1), if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() });
        if let Ok(style) = ProgressStyle::with_template("{msg:<12} {bar:30} {pos}/{len} {elapsed}") {
            bar.set_style(style);
        }
        Steps { bar }
    }

    /// Says that `done` of `total` of the step `what` are done.
    pub fn show(&self, what: &'static str, done: usize, total: usize) {
        self.bar.set_message(what);
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }
}

impl Drop for Steps {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A line that says what is under way, for work whose length is not known.
pub struct Spinner {
    bar: ProgressBar,
}

impl Spinner {
    /// A line, hidden if `quiet` or standard error is no terminal.
    pub fn new(quiet: bool) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        let bar = ProgressBar::with_draw_target(None, if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() });
        Spinner { bar }
    }

    /// Says what is being done.
    pub fn show(&self, what: &str) {
        self.bar.set_message(what.to_owned());
        self.bar.tick();
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
