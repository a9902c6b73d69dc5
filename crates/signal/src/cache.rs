//! Windows, tapers and transform plans of the last settings used: making them costs more than a short analysis.

use std::sync::{Arc, Mutex, PoisonError};

/// The last few values made, by their key.
pub(crate) struct Cache<K, V> {
    entries: Mutex<Vec<(K, Arc<V>)>>,
}

/// Entries kept: more settings than one analysis uses at a time, few enough to search in line.
const KEPT: usize = 8;

impl<K: PartialEq, V> Cache<K, V> {
    pub(crate) const fn new() -> Self {
        Cache { entries: Mutex::new(Vec::new()) }
    }

    /// The value for `key`, made if it is not at hand. The lock is not held meanwhile, so that other threads go on.
    pub(crate) fn get_or_try_make<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        let lock = || self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, value)) = lock().iter().find(|(k, _)| *k == key) {
            return Ok(value.clone());
        }
        let value = Arc::new(make()?);
        let mut entries = lock();
        if entries.len() >= KEPT {
            entries.remove(0);
        }
        entries.push((key, value.clone()));
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_made_once_and_the_oldest_goes_first() {
        let cache = Cache::new();
        let make = |key: usize| cache.get_or_try_make(key, || Ok::<_, ()>(key * 10)).expect("made");
        let first = make(0);
        assert!(Arc::ptr_eq(&first, &make(0)));
        (1..=KEPT).for_each(|key| assert_eq!(*make(key), key * 10));
        assert!(!Arc::ptr_eq(&first, &make(0)));
        assert_eq!(cache.get_or_try_make(100, || Err("no")), Err("no"));
    }
}
