//! Base motions: properties of all, each kind, and the swing of the head that they cause.

mod hand;
mod kinds;
mod properties;
mod recorded;
mod swing;
