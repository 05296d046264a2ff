//! The pages that show a run.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// A page that has not asked for this time is closed. Pages ask at least once a second.
const CLOSED_AFTER: Duration = Duration::from_secs(5);
/// Maximum number of pages that are known.
const MAX_VIEWERS: usize = 64;

/// Pages by the number that each has chosen, with the time of the last request.
#[derive(Debug, Default)]
pub(super) struct Viewers(BTreeMap<u64, Instant>);

impl Viewers {
    /// A page has asked for an update, or received one.
    pub(super) fn see(&mut self, viewer: u64) {
        if self.0.len() < MAX_VIEWERS || self.0.contains_key(&viewer) {
            self.0.insert(viewer, Instant::now());
        }
    }

    /// A page has everything that it needs.
    pub(super) fn leave(&mut self, viewer: u64) {
        self.0.remove(&viewer);
    }

    /// Whether a page is open that still needs something.
    pub(super) fn are_present(&mut self) -> bool {
        self.0.retain(|_, seen| seen.elapsed() < CLOSED_AFTER);
        !self.0.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_present_until_it_leaves() {
        let mut viewers = Viewers::default();
        assert!(!viewers.are_present());
        viewers.see(1);
        viewers.see(2);
        viewers.leave(1);
        assert!(viewers.are_present());
        viewers.leave(2);
        assert!(!viewers.are_present());
    }
}
