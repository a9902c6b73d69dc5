use std::sync::{Condvar, Mutex, PoisonError};

/// A total to which threads add in a fixed order, each as soon as the one before has.
pub(super) struct InTurn<T> {
    total: Mutex<(usize, T)>,
    added: Condvar,
}

impl<T> InTurn<T> {
    pub(super) fn new(total: T) -> InTurn<T> {
        InTurn { total: Mutex::new((0, total)), added: Condvar::new() }
    }

    /// Waits until the parts before `part` are in. Each of them must be in the hands of a thread that runs and holds a `guard`.
    pub(super) fn add(&self, part: usize, add: impl FnOnce(&mut T)) {
        let total = self.total.lock().unwrap_or_else(PoisonError::into_inner);
        let mut total = self.added.wait_while(total, |(parts, _)| *parts < part).unwrap_or_else(PoisonError::into_inner);
        add(&mut total.1);
        total.0 = total.0.max(part + 1);
        self.added.notify_all();
    }

    /// Whoever drops it by a panic lets all others go on: nobody waits for a part that never comes.
    pub(super) fn guard(&self) -> Guard<'_, T> {
        Guard(self)
    }

    pub(super) fn into_inner(self) -> T {
        self.total.into_inner().unwrap_or_else(PoisonError::into_inner).1
    }
}

pub(super) struct Guard<'a, T>(&'a InTurn<T>);

impl<T> Drop for Guard<'_, T> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.total.lock().unwrap_or_else(PoisonError::into_inner).0 = usize::MAX;
            self.0.added.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, mpsc};
    use std::thread;
    use std::time::Duration;

    #[test]
    fn parts_are_added_in_order_whoever_is_first() {
        let text = InTurn::new(String::new());
        thread::scope(|scope| {
            for part in (0..20).rev() {
                let text = &text;
                scope.spawn(move || text.add(part, |t| *t += &format!("{part} ")));
            }
        });
        assert_eq!(text.into_inner(), (0..20).map(|part| format!("{part} ")).collect::<String>());
    }

    #[test]
    fn nobody_waits_for_a_thread_that_panicked() {
        let count = Arc::new(InTurn::new(0));
        let (first, second) = (count.clone(), count.clone());
        let (done, heard) = mpsc::channel();
        thread::spawn(move || {
            second.add(1, |n| *n += 1);
            done.send(()).expect("a listener");
        });
        let first = thread::spawn(move || {
            let _guard = first.guard();
            panic!("on purpose");
        });
        assert!(first.join().is_err());
        heard.recv_timeout(Duration::from_secs(60)).expect("the second part is added without the first");
        assert_eq!(count.total.lock().expect("no thread holds it").1, 1);
    }
}
