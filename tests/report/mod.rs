//! The report in a browser.

mod live;
mod page;
