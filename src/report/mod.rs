//! Results for people: tables, plots, a page.

pub mod plot;
