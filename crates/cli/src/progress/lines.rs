//! Progress as lines on standard error, `progress: WHAT DONE/TOTAL`: a page that runs the program has no terminal, and shows them as it likes.

/// One line a step that is done.
pub struct Steps {
    quiet: bool,
}

impl Steps {
    /// Lines, or none if `quiet`.
    pub fn new(quiet: bool) -> Self {
        Steps { quiet }
    }

    /// Says that `done` of `total` of the step `what` are done.
    pub fn show(&self, what: &'static str, done: usize, total: usize) {
        if !self.quiet {
            eprintln!("progress: {what} {done}/{total}");
        }
    }
}

/// Lines that say what is under way, for work whose length is not known.
pub struct Spinner {
    quiet: bool,
}

impl Spinner {
    /// Lines, or none if `quiet`.
    pub fn new(quiet: bool) -> Self {
        Spinner { quiet }
    }

    /// Says what is being done.
    pub fn show(&self, what: &str) {
        if !self.quiet {
            eprintln!("progress: {what}");
        }
    }
}
