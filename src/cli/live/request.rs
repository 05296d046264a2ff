//! What a page asks for.

use super::growing::Cursor;
use super::run::PageState;

/// A request for an update: who asks, what the page has, and whether it leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct UpdateRequest {
    /// Number that the page has chosen for itself.
    pub viewer: u64,
    /// What the page has.
    pub page: PageState,
    /// Whether the page has everything that it needs.
    pub leaves: bool,
}

impl UpdateRequest {
    /// Reads the query of an address, `viewer=7&version=3&points=1.200`; `None` if a value is not a number.
    pub(super) fn of_query(query: &str) -> Option<Self> {
        let mut request = Self::default();
        for pair in query.split('&').filter(|pair| !pair.is_empty()) {
            let (name, value) = pair.split_once('=')?;
            match name {
                "viewer" => request.viewer = value.parse().ok()?,
                "version" => request.page.version = value.parse().ok()?,
                "points" => request.page.points = cursor(value)?,
                "estimate" => request.page.estimate = cursor(value)?,
                "truth" => request.page.truth = cursor(value)?,
                "scan" => request.page.next_scan = value.parse().ok()?,
                "leaves" => request.leaves = value == "1",
                _ => return None,
            }
        }
        Some(request)
    }
}

/// Number of a sequence and number of its items, `2.150`.
fn cursor(value: &str) -> Option<Cursor> {
    let (restart, count) = value.split_once('.')?;
    Some(Cursor { restart: restart.parse().ok()?, count: count.parse().ok()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_is_read_and_a_wrong_one_refused() {
        let request = UpdateRequest::of_query("viewer=7&version=3&points=2.150&scan=9&leaves=1").unwrap();
        assert_eq!((request.viewer, request.page.version, request.page.next_scan, request.leaves), (7, 3, 9, true));
        assert_eq!(request.page.points, Cursor { restart: 2, count: 150 });
        assert_eq!(UpdateRequest::of_query(""), Some(UpdateRequest::default()));
        for wrong in ["points=1", "points=1.-2", "version=x", "other=1", "viewer", "scan=99999999999999999999999"] {
            assert_eq!(UpdateRequest::of_query(wrong), None, "{wrong}");
        }
    }
}
