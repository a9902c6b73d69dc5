//! Work without the interpreter's lock: interruptible, with progress, and safe after a fork.

use crate::error::raise;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;

/// How often a waiting interpreter looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(20);

/// Samples up to which a call is done on the calling thread: a few milliseconds, which nobody interrupts.
pub const SMALL: usize = 50_000;

/// What is being done, how much of it is done, and of how much.
type Step = (String, usize, usize);

/// Tells how far the work is, and ends it where it was interrupted.
pub struct Reporter {
    steps: Option<Sender<Step>>,
    interrupted: Arc<AtomicBool>,
}

/// What unwinds work that nobody waits for any more.
struct Interrupted;

impl Reporter {
    /// Says that `done` of `total` of the step `what` are done; does not return if the work was interrupted.
    pub fn report(&self, what: &str, done: usize, total: usize) {
        if self.interrupted.load(Ordering::Relaxed) {
            // Not a panic: nothing is printed, and nobody sees it but the thread that ends.
            resume_unwind(Box::new(Interrupted));
        }
        if let Some(steps) = &self.steps {
            // Whoever listened may be gone, after an interrupt.
            steps.send((what.to_owned(), done, total)).ok();
        }
    }
}

/// Does `work` on `samples` samples without the interpreter's lock.
///
/// Small work is done at once. Larger work, and work with a `progress` callback, runs on a thread of its own, while this
/// one looks for Ctrl-C and calls back. After an interrupt the work ends at its next report.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    samples: usize,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Reporter) -> T + Send + 'static,
) -> PyResult<T> {
    let interrupted = Arc::new(AtomicBool::new(false));
    if samples <= SMALL && progress.is_none() {
        let reporter = Reporter { steps: None, interrupted };
        return py.detach(|| in_pool(|| work(&reporter)));
    }
    let (steps, mut heard) = channel();
    let reporter = Reporter { steps: Some(steps), interrupted: interrupted.clone() };
    let worker = std::thread::spawn(move || in_pool(|| work(&reporter)));
    let waited = wait(py, &mut heard, progress);
    if let Err(error) = waited {
        interrupted.store(true, Ordering::Relaxed);
        return Err(error);
    }
    match py.detach(|| worker.join()) {
        Ok(done) => done,
        Err(panic) => resume_unwind(panic),
    }
}

/// Until the work is done: progress to Python, and a look for signals.
fn wait(py: Python<'_>, heard: &mut Receiver<Step>, progress: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
    loop {
        let heard = &mut *heard;
        match py.detach(move || heard.recv_timeout(LOOK)) {
            Ok((what, done, total)) => {
                if let Some(progress) = progress {
                    progress.call1((what, done, total))?;
                }
                py.check_signals()?;
            }
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}

/// Threads of our own, with the process that they belong to.
struct Own {
    process: u32,
    pool: Option<Arc<ThreadPool>>,
    count: usize,
}

static OWN: Mutex<Option<Own>> = Mutex::new(None);

/// The process that used threads first: rayon's own pool does not live in its forked children.
static FIRST: OnceLock<u32> = OnceLock::new();

fn build(count: usize) -> PyResult<Arc<ThreadPool>> {
    ThreadPoolBuilder::new().num_threads(count).build().map(Arc::new).map_err(raise)
}

/// The pool of this process; none where rayon's own will do.
fn own_pool() -> PyResult<Option<Arc<ThreadPool>>> {
    let process = std::process::id();
    let first = *FIRST.get_or_init(|| process);
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    match own.as_mut() {
        Some(own) if own.process == process => Ok(own.pool.clone()),
        None if process == first => Ok(None),
        before => {
            // Forked: the threads of the parent's pool are not here, and it must not be dropped, which would wait for them.
            let count = before.as_ref().map_or(0, |own| own.count);
            if let Some(pool) = before.and_then(|own| own.pool.take()) {
                std::mem::forget(pool);
            }
            let pool = build(count)?;
            *own = Some(Own { process, pool: Some(pool.clone()), count });
            Ok(Some(pool))
        }
    }
}

/// Does `work` on the threads of this process.
pub fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(match own_pool()? {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

/// Sets how many threads this process computes with; 0 stands for one a processor. Results do not depend on it.
#[pyfunction]
pub fn set_threads(count: usize) -> PyResult<()> {
    let process = std::process::id();
    FIRST.get_or_init(|| process);
    let pool = build(count)?;
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(before) = own.take().filter(|own| own.process != process) {
        std::mem::forget(before.pool);
    }
    *own = Some(Own { process, pool: Some(pool), count });
    Ok(())
}

/// How many threads this process computes with.
#[pyfunction]
pub fn threads() -> PyResult<usize> {
    Ok(own_pool()?.map_or_else(rayon::current_num_threads, |pool| pool.current_num_threads()))
}
