//! The simulated head and its spring compared with linear models, closed forms and conservation laws.

mod actuated;
mod base;
mod contact;
mod decay;
mod elasticity;
mod elements;
mod energy;
mod heads;
mod imu;
mod invalid;
mod invariance;
mod linkage;
mod rest;
mod rod;
mod shipped;
mod wire;
