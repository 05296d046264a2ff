//! The evaluation compared with evo and with closed forms.

mod bound;
mod evo;
mod shaft_bound;
mod slam_bound;
