//! Sequences that grow during a run, of which a page requests the items that it lacks.

use zsim_report::page::Increment;

/// How much of a sequence a page has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Cursor {
    /// Number of the sequence.
    pub restart: u64,
    /// Number of its first items that the page has.
    pub count: usize,
}

/// A sequence that grows, and sometimes starts again with other items.
#[derive(Debug)]
pub(super) struct Growing<T> {
    restart: u64,
    items: Vec<T>,
}

impl<T> Default for Growing<T> {
    fn default() -> Self {
        Self { restart: 1, items: Vec::new() }
    }
}

impl<T> Growing<T> {
    pub(super) fn items(&self) -> &[T] {
        &self.items
    }

    pub(super) fn push(&mut self, item: T) {
        self.items.push(item);
    }

    /// Starts again with those of the items that `keep` selects.
    pub(super) fn restart_with(&mut self, keep: impl FnMut(&T) -> bool) {
        self.restart += 1;
        self.items.retain(keep);
    }

    /// At most `limit` of the items that a page with `cursor` lacks.
    pub(super) fn since(&self, cursor: Cursor, limit: usize) -> Increment<'_, T> {
        let first = if cursor.restart == self.restart { cursor.count.min(self.items.len()) } else { 0 };
        let end = first.saturating_add(limit).min(self.items.len());
        Increment { restart: self.restart, first, items: &self.items[first..end] }
    }

    /// Whether a page with `cursor` has everything.
    pub(super) fn is_complete_at(&self, cursor: Cursor) -> bool {
        cursor.restart == self.restart && cursor.count >= self.items.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_gets_each_item_once_and_all_again_after_a_restart() {
        let mut growing = Growing::default();
        (0..5).for_each(|k| growing.push(k));
        let first = growing.since(Cursor::default(), 3);
        assert_eq!((first.first, first.items), (0, &[0, 1, 2][..]));
        let cursor = Cursor { restart: first.restart, count: 3 };
        assert_eq!(growing.since(cursor, 10).items, [3, 4]);
        assert!(!growing.is_complete_at(cursor) && growing.is_complete_at(Cursor { count: 5, ..cursor }));
        growing.restart_with(|k| k % 2 == 0);
        let again = growing.since(Cursor { count: 5, ..cursor }, 10);
        assert_eq!((again.first, again.items), (0, &[0, 2, 4][..]));
    }

    #[test]
    fn a_cursor_beyond_the_end_is_harmless() {
        let mut growing = Growing::default();
        growing.push(1);
        assert!(growing.since(Cursor { restart: 1, count: usize::MAX }, usize::MAX).items.is_empty());
    }
}
