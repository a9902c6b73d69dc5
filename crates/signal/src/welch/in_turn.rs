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
    use std::thread;

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
        let count = InTurn::new(0);
        let first = thread::scope(|scope| {
            scope.spawn(|| count.add(1, |n| *n += 1));
            let first = scope.spawn(|| {
                let _guard = count.guard();
                panic!("on purpose");
            });
            first.join()
        });
        assert!(first.is_err());
        assert_eq!(count.into_inner(), 1);
    }
}
