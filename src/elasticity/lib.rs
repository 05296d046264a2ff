//! Stiffness and force law of springs from geometry and load; pure mechanics.
//!
//! A spring connects two frames: the clamped *base* and the *top*. In both, z points along the straight spring from
//! base to top. A *wrench* is a force and a torque about the top; a *twist* is the velocity and angular velocity of the
//! top. Both are columns of six in the axes of the base, translation first.
//!
//! - [`Coil`]: a helical spring as a column with axial, torsional, bending and shear rigidity.
//! - [`loaded_stiffness`]: the effect of an axial load on the stiffness of such a column (Haringx), and its buckling.
//! - [`Spring::of_coil`]: the same coil as an elastic rod along its wire, with couplings: the force law of heads.
//! - [`Deformation`]: the displacement of the top in corotational coordinates.
//! - [`Spring`]: the force law for large rotations: one or several elements, each with a potential in those
//!   coordinates, so that energy is conserved exactly; the nodes between elements are massless and in equilibrium. Coils that
//!   touch stop each other elastically.

mod buckling;
mod chain;
mod coil;
mod coil_stop;
mod deformation;
mod element;
mod error;
mod guided;
mod haringx;
mod helix;
mod material;
mod section;
mod six_vector;
mod solutions;
mod spec;
mod spring;

pub use buckling::{VALID_BUCKLING_MARGIN, buckling_load_n, check_buckling};
pub use coil::{Coil, Moduli, Winding};
pub use deformation::{Deformation, blocks, split, stack};
pub use element::Element;
pub use error::ElasticityError;
pub use guided::GuidedTop;
pub use haringx::{Column, loaded_stiffness};
pub use material::{Density, Material, Stress};
pub use section::SectionLoad;
pub use six_vector::{Matrix6, Vector6, conditioning};
pub use spec::{EndsSpec, HandSpec, SpringDesign, SpringSpec, StiffnessRow};
pub use spring::{MAX_SEGMENTS, Spring, SpringState, SpringWrench};
