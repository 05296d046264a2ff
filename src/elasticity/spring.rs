//! The force law of a spring of one or several elements.

use super::chain::Chain;
use super::coil_stop::CoilStop;
use super::deformation::{Deformation, split, stack};
use super::helix::{Helix, about_axis};
use super::{Coil, Column, ElasticityError, Element, Matrix6, SectionLoad, Vector6};
use zsim_base::geometry::Pose;

/// Maximum number of segments of a spring.
pub const MAX_SEGMENTS: usize = 64;

/// The force law of a spring between the clamped base and the top, for rotations of the top below pi.
///
/// The spring is massless. The inner nodes of a segmented spring are in equilibrium; Newton's method finds them,
/// starting from the last solution in [`SpringState`].
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// The elements without contact of their coils.
    open: Vec<Element>,
    /// The elements with contact of their coils; equal to `open` for a spring given by a stiffness.
    elements: Vec<Element>,
    length_m: f64,
    /// The ends of the elements are on the axis of the loaded helix, which leans against the clamped ends of the wire.
    base_from_axis: Pose,
    axis_from_top: Pose,
}

/// The wrench of a spring on the body at its top, in the axes of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringWrench {
    /// The wrench of the spring if its coils could pass through each other.
    pub open: Vector6,
    /// What the contact of the coils adds to it; zero if none touch.
    pub contact: Vector6,
    /// The largest overlap of the coils of a segment, m; negative without contact.
    pub overlap_m: f64,
}

/// The last solution for the inner nodes of a spring.
#[derive(Debug, Clone)]
pub struct SpringState {
    chains: Option<Chains>,
}

/// The inner nodes of a segmented spring.
#[derive(Debug, Clone)]
struct Chains {
    /// Those of a spring whose coils could pass through each other.
    open: Chain,
    /// Those with contact; `None` if no coils touch.
    touching: Option<Chain>,
}

impl Chains {
    /// Moves the inner nodes into equilibrium and returns the largest overlap of the coils of a segment, m.
    fn find_equilibrium(&mut self, spring: &Spring, ends: &Pose) -> Result<f64, ElasticityError> {
        self.open.find_equilibrium(&spring.open, spring.length_m, ends)?;
        let overlap_m = self.open.overlap_m(&spring.elements);
        if overlap_m <= 0.0 {
            self.touching = None;
        } else {
            let touching = self.touching.get_or_insert_with(|| self.open.clone());
            touching.find_equilibrium(&spring.elements, spring.length_m, ends)?;
        }
        Ok(overlap_m)
    }

    /// The nodes, with contact if coils touch.
    fn nodes(&self) -> &Chain {
        self.touching.as_ref().unwrap_or(&self.open)
    }
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
            open: elements.clone(),
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
        let elements = vec![element; segments];
        Ok(Self { open: elements.clone(), elements, length_m: column.length_m, base_from_axis, axis_from_top })
    }

    /// The same spring, whose coils stop each other where they touch; it was created from `coil` under `load_n`.
    pub fn with_contact(self, coil: &Coil, load_n: f64) -> Self {
        let stop = CoilStop::new(coil, load_n, self.segments(), self.open[0].stiffness().m33);
        Self { elements: self.open.iter().map(|element| element.with_stop(stop)).collect(), ..self }
    }

    /// Creates a single element of length `length_m` under `load_n` with the stiffness `at_top` when straight.
    ///
    /// # Errors
    /// When `at_top` is not symmetric or not positive definite.
    pub fn from_stiffness(length_m: f64, load_n: f64, at_top: &Matrix6) -> Result<Self, ElasticityError> {
        let element = Element::new(length_m, load_n, at_top)?;
        super::element::check_positive_definite(at_top)?;
        let (base_from_axis, axis_from_top) = (Pose::identity(), Pose::identity());
        Ok(Self { open: vec![element], elements: vec![element], length_m, base_from_axis, axis_from_top })
    }

    /// The stiffness of the contact when all coils touch, in the coordinates of the spring; `None` without contact.
    pub fn contact_stiffness(&self) -> Option<Matrix6> {
        Some(self.elements[0].closed_stiffness()? / self.segments() as f64)
    }

    /// Axial stiffness of the straight, loaded spring without contact, N/m.
    pub fn axial_n_per_m(&self) -> f64 {
        self.open[0].stiffness().m33 / self.segments() as f64
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
        let chains = || Chains { open: Chain::new(self.segments()), touching: None };
        SpringState { chains: (self.segments() > 1).then(chains) }
    }

    /// The upper end of the elements relative to the lower one.
    fn between_ends(&self, base_from_top: &Pose) -> Pose {
        self.base_from_axis.inv_mul(base_from_top) * self.axis_from_top.inverse()
    }

    /// The wrench of the spring on the body at the top.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn wrench(&self, state: &mut SpringState, base_from_top: &Pose) -> Result<SpringWrench, ElasticityError> {
        let ends = self.between_ends(base_from_top);
        let Some(chains) = &mut state.chains else {
            let deformation = Deformation::of(&ends);
            let on_top = |element: &Element| {
                self.about_top(&ends, &-deformation.wrench(&element.gradient(&deformation.coordinates)))
            };
            let overlap_m = self.elements[0].overlap_m(&deformation.coordinates);
            return Ok(SpringWrench::new(on_top(&self.open[0]), overlap_m, || on_top(&self.elements[0])));
        };
        let overlap_m = chains.find_equilibrium(self, &ends)?;
        let on_top = |chain: &Chain| self.about_top(&ends, &chain.wrench_on_top());
        Ok(SpringWrench::new(on_top(&chains.open), overlap_m, || on_top(chains.nodes())))
    }

    /// A wrench about the upper end of the elements, as one about the top.
    fn about_top(&self, ends: &Pose, wrench: &Vector6) -> Vector6 {
        let (force, torque) = split(wrench);
        let lever = ends.rotation * self.axis_from_top.translation.vector;
        let axes = self.base_from_axis.rotation;
        stack(&(axes * force), &(axes * (torque - lever.cross(&force))))
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
        match &mut state.chains {
            None => Ok(self.elements[0].section_loads(&ends).to_vec()),
            Some(chains) => {
                chains.find_equilibrium(self, &ends)?;
                Ok(chains.nodes().section_loads(&self.elements))
            }
        }
    }

    /// The elastic energy with the top at `base_from_top`, J; zero in the reference state.
    ///
    /// # Errors
    /// When the equilibrium of the inner nodes does not converge.
    pub fn potential_j(&self, state: &mut SpringState, base_from_top: &Pose) -> Result<f64, ElasticityError> {
        let ends = self.between_ends(base_from_top);
        match &mut state.chains {
            None => Ok(self.elements[0].potential_j(&Deformation::of(&ends).coordinates)),
            Some(chains) => {
                chains.find_equilibrium(self, &ends)?;
                Ok(chains.nodes().potential_j(&self.elements))
            }
        }
    }
}

impl SpringWrench {
    /// The wrench without contact, and that with it if coils touch.
    fn new(open: Vector6, overlap_m: f64, touching: impl FnOnce() -> Vector6) -> Self {
        let contact = if overlap_m > 0.0 { touching() - open } else { Vector6::zeros() };
        Self { open, contact, overlap_m }
    }

    /// The sum of both parts.
    pub fn total(&self) -> Vector6 {
        self.open + self.contact
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
