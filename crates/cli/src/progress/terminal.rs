//! Progress bars, on standard error and only where somebody looks.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// One bar or line that shows what is under way; silent where nobody looks, gone when dropped.
pub struct Progress(ProgressBar);

impl Progress {
    /// A bar, hidden if `quiet` or standard error is no terminal.
    pub fn steps(quiet: bool) -> Self {
        Self::new(quiet, "{msg:<12} {bar:30} {pos}/{len} {elapsed}")
    }

    /// A line, for work whose length is not known; hidden like the bar.
    pub fn spinner(quiet: bool) -> Self {
        Self::new(quiet, "{spinner} {msg}")
    }

    fn new(quiet: bool, template: &str) -> Self {
        let shown = !quiet && std::io::stderr().is_terminal();
        let bar = ProgressBar::with_draw_target(Some(1), if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() });
        Progress(match ProgressStyle::with_template(template) {
            Ok(style) => bar.with_style(style),
            Err(_) => bar,
        })
    }

    /// Says that `done` of `total` of the step `what` are done.
    pub fn show(&self, what: &str, done: usize, total: usize) {
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
        self.say(what);
    }

    /// Says what is being done.
    pub fn say(&self, what: &str) {
        self.0.set_message(what.to_owned());
        self.0.tick();
    }
}
