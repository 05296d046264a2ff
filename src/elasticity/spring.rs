//! The force law of a spring of one or several elements.

use super::chain::Chain;
use super::coil_stop::CoilStop;
use super::deformation::{Deformation, split, stack};
use super::helix::{Helix, about_axis};
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
    elements: Vec<Element>,
    length_m: f64,
    /// The ends of the elements are on the axis of the loaded helix, which leans against the clamped ends of the wire.
    base_from_axis: Pose,
    axis_from_top: Pose,
}

/// The last solution for the inner nodes of a spring.
#[derive(Debug, Clone)]
pub struct SpringState {
    chain: Option<Chain>,
}

impl Spring {
    /// Creates the spring of a coil under `load_n` (compression positive), divided into `segments` equal elements.
    ///
    /// Its reference state is the helix under the axial load, with the stiffness of an elastic rod along the wire. The wire
    /// begins and ends rigidly clamped to base and top.
    ///
    /// # Errors
    /// When the load buckles the coil, `segments` is not 1 to [`MAX_SEGMENTS`], or a tension needs more of them.
    pub fn of_coil(coil: &Coil, load_n: f64, segments: usize) -> Result<Self, ElasticityError> {
        check_segments(segments)?;
        super::loaded_stiffness(&coil.under_load(load_n)?)?;
        let helix = Helix::new(coil, load_n)?;
        let elements = elements_of(&helix, load_n, segments).map_err(|error| {
            too_few_segments(load_n, segments, |count| elements_of(&helix, load_n, count).is_ok()).unwrap_or(error)
        })?;
        Ok(Self {
            elements,
            length_m: helix.length_m(),
            base_from_axis: helix.foot_from_axis(),
            axis_from_top: helix.axis_from_top(),
        })
    }

    /// Creates the spring of a loaded column, divided into `segments` equal elements, without couplings.
    ///
    /// The straight spring has the stiffness of the column for any number of segments.
    ///
    /// # Errors
    /// As [`Spring::of_coil`].
    pub fn of_column(column: &Column, segments: usize) -> Result<Self, ElasticityError> {
        check_segments(segments)?;
        // The full column must not buckle either, even if each segment is short enough.
        super::loaded_stiffness(column)?;
        let element_of = |count| Element::of_column(&column.segment(count));
        let element = element_of(segments).map_err(|error| {
            too_few_segments(column.load_n, segments, |count| element_of(count).is_ok()).unwrap_or(error)
        })?;
        let (base_from_axis, axis_from_top) = (Pose::identity(), Pose::identity());
        Ok(Self { elements: vec![element; segments], length_m: column.length_m, base_from_axis, axis_from_top })
    }

    /// The same spring, whose coils stop each other where they touch; it was created from `coil` under `load_n`.
    pub fn with_contact(self, coil: &Coil, load_n: f64) -> Self {
        let stop = CoilStop::new(coil, load_n, self.segments(), self.elements[0].stiffness().m33);
        Self { elements: self.elements.into_iter().map(|element| element.with_stop(stop)).collect(), ..self }
    }

    /// Creates a single element of length `length_m` under `load_n` with the stiffness `at_top` when straight.
    ///
    /// # Errors
    /// When `at_top` is not symmetric or not positive definite.
    pub fn from_stiffness(length_m: f64, load_n: f64, at_top: &Matrix6) -> Result<Self, ElasticityError> {
        let element = Element::new(length_m, load_n, at_top)?;
        super::element::check_positive_definite(at_top)?;
        let (base_from_axis, axis_from_top) = (Pose::identity(), Pose::identity());
        Ok(Self { elements: vec![element], length_m, base_from_axis, axis_from_top })
    }

    /// Length of the loaded spring along its axis, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.elements.len()
    }

    /// The top relative to the base in the reference state: the load is along the axis of the helix.
    pub fn base_from_top_at_rest(&self) -> Pose {
        self.base_from_axis * Pose::translation(0.0, 0.0, self.length_m) * self.axis_from_top
    }

    /// A state without a solution for the inner nodes.
    pub fn state(&self) -> SpringState {
        SpringState { chain: (self.segments() > 1).then(|| Chain::new(self.segments())) }
    }

    /// The upper end of the elements relative to the lower one.
    fn between_ends(&self, base_from_top: &Pose) -> Pose {
        self.base_from_axis.inv_mul(base_from_top) * self.axis_from_top.inverse()
    }

    /// The wrench of the spring on the body at the top.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn wrench(&self, state: &mut SpringState, base_from_top: &Pose) -> Result<Vector6, ElasticityError> {
        let ends = self.between_ends(base_from_top);
        let on_axis = match &mut state.chain {
            None => self.elements[0].wrench(&ends),
            Some(chain) => {
                chain.find_equilibrium(&self.elements, self.length_m, &ends)?;
                chain.wrench_on_top()
            }
        };
        let (force, torque) = split(&on_axis);
        let lever = ends.rotation * self.axis_from_top.translation.vector;
        let torque = torque - lever.cross(&force);
        let axes = self.base_from_axis.rotation;
        Ok(stack(&(axes * force), &(axes * torque)))
    }

    /// The loads on the sections at the two ends of each segment, from the foot to the top.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn section_loads(
        &self,
        state: &mut SpringState,
        base_from_top: &Pose,
    ) -> Result<Vec<SectionLoad>, ElasticityError> {
        let ends = self.between_ends(base_from_top);
        match &mut state.chain {
            None => Ok(self.elements[0].section_loads(&ends).to_vec()),
            Some(chain) => {
                chain.find_equilibrium(&self.elements, self.length_m, &ends)?;
                Ok(chain.section_loads(&self.elements))
            }
        }
    }

    /// The elastic energy with the top at `base_from_top`, J; zero in the reference state.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn potential_j(&self, state: &mut SpringState, base_from_top: &Pose) -> Result<f64, ElasticityError> {
        let ends = self.between_ends(base_from_top);
        match &mut state.chain {
            None => Ok(self.elements[0].potential_j(&Deformation::of(&ends).coordinates)),
            Some(chain) => {
                chain.find_equilibrium(&self.elements, self.length_m, &ends)?;
                Ok(chain.potential_j(&self.elements))
            }
        }
    }
}

/// The elements of a helix, each with the stiffness of its portion of the wire.
fn elements_of(helix: &Helix, load_n: f64, segments: usize) -> Result<Vec<Element>, ElasticityError> {
    let singular = ElasticityError::NotAHelix { load_n };
    let portion = helix.portion(segments).ok_or(singular)?;
    let element = |k: usize| {
        let start_rad = helix.start_rad() + portion.turn_rad * k as f64;
        let at_top = about_axis(&portion.at_top, start_rad);
        Element::new(portion.length_m, load_n, &((at_top + at_top.transpose()) * 0.5))
    };
    (0..segments).map(element).collect()
}

fn check_segments(segments: usize) -> Result<(), ElasticityError> {
    if (1..=MAX_SEGMENTS).contains(&segments) {
        Ok(())
    } else {
        Err(ElasticityError::Segments { segments, max: MAX_SEGMENTS })
    }
}

/// The error of a pulled spring that more segments can represent.
///
/// A spring under strong tension bends near its ends only, over the length `sqrt(B / P)`. A segment assumes constant
/// curvature, so its stiffness in the deformation coordinates becomes indefinite if it is much longer than that.
fn too_few_segments(load_n: f64, segments: usize, is_sufficient: impl Fn(usize) -> bool) -> Option<ElasticityError> {
    let needed = (segments + 1..=MAX_SEGMENTS).find(|count| is_sufficient(*count)).filter(|_| load_n < 0.0)?;
    Some(ElasticityError::TooFewSegments { pull_n: -load_n, segments, needed })
}
