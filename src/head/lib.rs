//! Studies of a head without an estimator.
//!
//! The [`gains`] of its modes from base to head, the stress and motion of its [`spring`], and the [`coverage`] of its lidar.

pub mod coverage;
mod error;
pub mod gains;
pub mod spring;

pub use error::HeadError;
