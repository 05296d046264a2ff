//! A spring of one or several elements.

use super::chain::Chain;
use super::deformation::Deformation;
use super::{Column, ElasticityError, Element, Matrix6, Vector6};
use crate::geometry::Pose;

/// The most segments a spring may be cut into.
pub const MOST_SEGMENTS: usize = 64;

/// The force law of a spring between its clamped base and its top, for turns of the top below pi.
///
/// The spring has no mass. Cut into segments, its inner nodes are wherever they are in equilibrium; that place is found
/// by Newton's method from where they last were, which is what a [`SpringState`] remembers.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    element: Element,
    segments: usize,
    length_m: f64,
}

/// Where a spring's inner nodes last were.
#[derive(Debug, Clone)]
pub struct SpringState {
    chain: Option<Chain>,
}

impl Spring {
    /// A loaded column, cut into `segments` equal elements. Straight, it has the column's stiffness for any number of
    /// them.
    ///
    /// # Errors
    /// When the load buckles the column, or `segments` is not 1 to [`MOST_SEGMENTS`].
    pub fn of_column(column: &Column, segments: usize) -> Result<Self, ElasticityError> {
        if !(1..=MOST_SEGMENTS).contains(&segments) {
            return Err(ElasticityError::Segments { segments, most: MOST_SEGMENTS });
        }
        // The whole column must not buckle either, though each piece of it be short enough not to.
        super::loaded_stiffness(column)?;
        let element = Element::of_column(&column.piece(segments))?;
        Ok(Self { element, segments, length_m: column.length_m })
    }

    /// A single element that has the stiffness `at_top` when straight, `length_m` long, under `load_n`.
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

    /// Segments.
    pub fn segments(&self) -> usize {
        self.segments
    }

    /// Inner nodes that nobody has looked at yet.
    pub fn state(&self) -> SpringState {
        SpringState { chain: (self.segments > 1).then(|| Chain::new(self.segments)) }
    }

    /// The wrench of the spring on whatever holds its top at `base_from_top`, whose deformation is given too.
    ///
    /// # Errors
    /// When the inner nodes find no equilibrium.
    pub fn wrench(
        &self,
        state: &mut SpringState,
        base_from_top: &Pose,
        deformation: &Deformation,
    ) -> Result<Vector6, ElasticityError> {
        match &mut state.chain {
            None => Ok(-deformation.wrench(&self.element.gradient(&deformation.coordinates))),
            Some(chain) => {
                chain.settle(&self.element, self.length_m, base_from_top, deformation)?;
                Ok(chain.wrench_on_top())
            }
        }
    }

    /// The energy in the spring with its top at `base_from_top`, zero when straight under its load, J.
    ///
    /// # Errors
    /// When the inner nodes find no equilibrium.
    pub fn potential_j(&self, state: &mut SpringState, base_from_top: &Pose) -> Result<f64, ElasticityError> {
        let deformation = Deformation::of(base_from_top);
        match &mut state.chain {
            None => Ok(self.element.potential_j(&deformation.coordinates)),
            Some(chain) => {
                chain.settle(&self.element, self.length_m, base_from_top, &deformation)?;
                Ok(chain.potential_j(&self.element))
            }
        }
    }
}
