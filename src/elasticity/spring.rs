//! The force law of a spring of one or several elements.

use super::chain::Chain;
use super::coil_stop::CoilStop;
use super::deformation::Deformation;
use super::{Coil, Column, ElasticityError, Element, Matrix6, SectionLoad, Vector6};
use crate::geometry::Pose;

/// Maximum number of segments of a spring.
pub const MAX_SEGMENTS: usize = 64;

/// The force law of a spring between the clamped base and the top, for rotations of the top below pi.
///
/// The spring is massless. The inner nodes of a segmented spring are in equilibrium; Newton's method finds them,
/// starting from the last solution in [`SpringState`].
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    element: Element,
    segments: usize,
    length_m: f64,
}

/// The last solution for the inner nodes of a spring.
#[derive(Debug, Clone)]
pub struct SpringState {
    chain: Option<Chain>,
}

impl Spring {
    /// Creates the spring of a loaded column, divided into `segments` equal elements.
    ///
    /// The straight spring has the stiffness of the column for any number of segments.
    ///
    /// # Errors
    /// When the load buckles the column, `segments` is not 1 to [`MAX_SEGMENTS`], or a tension needs more of them.
    pub fn of_column(column: &Column, segments: usize) -> Result<Self, ElasticityError> {
        if !(1..=MAX_SEGMENTS).contains(&segments) {
            return Err(ElasticityError::Segments { segments, max: MAX_SEGMENTS });
        }
        // The full column must not buckle either, even if each segment is short enough.
        super::loaded_stiffness(column)?;
        let element = Element::of_column(&column.segment(segments))
            .map_err(|error| too_few_segments(column, segments).unwrap_or(error))?;
        Ok(Self { element, segments, length_m: column.length_m })
    }

    /// The same spring, whose coils stop each other where they touch; it was created from `coil` under `load_n`.
    pub fn with_contact(self, coil: &Coil, load_n: f64) -> Self {
        let stop = CoilStop::new(coil, load_n, self.segments, self.element.stiffness().m33);
        Self { element: self.element.with_stop(stop), ..self }
    }

    /// Creates a single element of length `length_m` under `load_n` with the stiffness `at_top` when straight.
    ///
    /// # Errors
    /// When `at_top` is not symmetric or not positive definite.
    pub fn from_stiffness(length_m: f64, load_n: f64, at_top: &Matrix6) -> Result<Self, ElasticityError> {
        let element = Element::new(length_m, load_n, at_top)?;
        super::element::check_positive_definite(at_top)?;
        Ok(Self { element, segments: 1, length_m })
    }

    /// Length of the straight, loaded spring, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// A state without a solution for the inner nodes.
    pub fn state(&self) -> SpringState {
        SpringState { chain: (self.segments > 1).then(|| Chain::new(self.segments)) }
    }

    /// The wrench of the spring on the body at the top.
    ///
    /// `deformation` must be that of `base_from_top`.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn wrench(
        &self,
        state: &mut SpringState,
        base_from_top: &Pose,
        deformation: &Deformation,
    ) -> Result<Vector6, ElasticityError> {
        match &mut state.chain {
            None => Ok(-deformation.wrench(&self.element.gradient(&deformation.coordinates))),
            Some(chain) => {
                chain.find_equilibrium(&self.element, self.length_m, base_from_top, deformation)?;
                Ok(chain.wrench_on_top())
            }
        }
    }

    /// The loads on the sections at the two ends of each segment, from the foot to the top.
    ///
    /// `deformation` must be that of `base_from_top`.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn section_loads(
        &self,
        state: &mut SpringState,
        base_from_top: &Pose,
        deformation: &Deformation,
    ) -> Result<Vec<SectionLoad>, ElasticityError> {
        match &mut state.chain {
            None => Ok(self.element.section_loads(base_from_top).to_vec()),
            Some(chain) => {
                chain.find_equilibrium(&self.element, self.length_m, base_from_top, deformation)?;
                Ok(chain.section_loads(&self.element))
            }
        }
    }

    /// The elastic energy with the top at `base_from_top`, J; zero when straight under the reference load.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn potential_j(&self, state: &mut SpringState, base_from_top: &Pose) -> Result<f64, ElasticityError> {
        let deformation = Deformation::of(base_from_top);
        match &mut state.chain {
            None => Ok(self.element.potential_j(&deformation.coordinates)),
            Some(chain) => {
                chain.find_equilibrium(&self.element, self.length_m, base_from_top, &deformation)?;
                Ok(chain.potential_j(&self.element))
            }
        }
    }
}

/// The error of a pulled column that more segments can represent.
///
/// A column under strong tension bends near its ends only, over the length `sqrt(B / P)`. A segment assumes constant
/// curvature, so its stiffness in the deformation coordinates becomes indefinite if it is much longer than that.
fn too_few_segments(column: &Column, segments: usize) -> Option<ElasticityError> {
    let is_sufficient = |count: &usize| Element::of_column(&column.segment(*count)).is_ok();
    let needed = (segments + 1..=MAX_SEGMENTS).find(is_sufficient).filter(|_| column.load_n < 0.0)?;
    Some(ElasticityError::TooFewSegments { pull_n: -column.load_n, segments, needed })
}
