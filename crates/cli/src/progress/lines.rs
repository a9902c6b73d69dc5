//! Progress as lines on standard error, `progress: WHAT DONE/TOTAL`: a page that runs the program has no terminal, and shows them as it likes.

/// One line a step that is done or under way.
pub struct Progress {
    quiet: bool,
}

impl Progress {
    /// Lines, or none if `quiet`.
    pub fn steps(quiet: bool) -> Self {
        Progress { quiet }
    }

    /// The same for work whose length is not known.
    pub fn spinner(quiet: bool) -> Self {
        Progress { quiet }
    }

    /// Says that `done` of `total` of the step `what` are done.
    pub fn show(&self, what: &str, done: usize, total: usize) {
        self.say(&format!("{what} {done}/{total}"));
    }

    /// Says what is being done.
    pub fn say(&self, what: &str) {
        if !self.quiet {
            eprintln!("progress: {what}");
        }
    }
}
