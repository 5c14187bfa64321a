//! The latest results in memory, for experiments that do the same work many times.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use trueup_core::Result;
use trueup_core::diagnostics::Reported;

use super::key::Key;

/// Results kept, the latest first: enough for trials that take turns with a few forms of the mesh.
const KEPT: usize = 3;

/// A few results by what they were made from.
#[derive(Default)]
pub(crate) struct MemoryStore(Mutex<Vec<(Key, Arc<dyn Any + Send + Sync>)>>);

impl fmt::Debug for MemoryStore {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("MemoryStore").finish_non_exhaustive()
    }
}

impl MemoryStore {
    /// The result of this key; made if it is not there.
    pub(super) fn recall<T: Send + Sync + 'static>(
        &self,
        key: Key,
        make: impl FnOnce() -> Result<Arc<Reported<T>>>,
    ) -> Result<Arc<Reported<T>>> {
        let known = || {
            let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let (_, found) = kept.iter().find(|(made_from, _)| *made_from == key)?;
            found.clone().downcast().ok()
        };
        if let Some(found) = known() {
            return Ok(found);
        }
        let made = make()?;
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.insert(0, (key, made.clone()));
        kept.truncate(KEPT);
        Ok(made)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::key::KeyMaker;
    use super::*;

    #[test]
    fn the_latest_results_are_kept() {
        let store = MemoryStore::default();
        let made = |number: usize| {
            let mut calls = 0;
            let reported = Reported { value: number, findings: Vec::new(), seconds: BTreeMap::new() };
            let found = store.recall(KeyMaker::new().part(&number).finish(), || {
                calls += 1;
                Ok(Arc::new(reported))
            });
            assert_eq!(found.expect("made").value, number);
            calls
        };
        let calls: Vec<usize> = [1, 2, 1, 3, 4, 2, 1, 4].map(made).to_vec();
        // The oldest of four goes when the fifth different one comes; a hit does not make a result younger.
        assert_eq!(calls, [1, 1, 0, 1, 1, 0, 1, 0]);
    }
}
