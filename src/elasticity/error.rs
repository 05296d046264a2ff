/// Why a spring is none, or cannot do what is asked of it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ElasticityError {
    /// A spring of the library that is not there, or whose file is wrong.
    #[error(transparent)]
    Spec(#[from] crate::spec::SpecError),
    /// A wire that cannot be wound so tightly.
    #[error(
        "the wire of {wire_mm} mm is too thick for a coil of {coil_mm} mm: their ratio, the spring index, is {index:.2}, \
         and the formulas hold from 2 up"
    )]
    IndexTooSmall {
        /// Wire diameter, mm.
        wire_mm: f64,
        /// Mean coil diameter, mm.
        coil_mm: f64,
        /// Their ratio.
        index: f64,
    },
    /// Coils that touch before any load.
    #[error(
        "{coils} coils of {wire_mm} mm wire are {solid_mm:.2} mm long when they touch, which is not less than the free length of {free_mm} mm"
    )]
    CoilsTouch {
        /// Active coils.
        coils: f64,
        /// Wire diameter, mm.
        wire_mm: f64,
        /// Length at which coils touch, mm.
        solid_mm: f64,
        /// Free length, mm.
        free_mm: f64,
    },
    /// A load that presses the coils together.
    #[error("a load of {load_n:.2} N presses the spring to {loaded_mm:.2} mm, but its coils touch at {solid_mm:.2} mm")]
    Clash {
        /// Axial load, N.
        load_n: f64,
        /// Length it would have under the load, mm.
        loaded_mm: f64,
        /// Length at which coils touch, mm.
        solid_mm: f64,
    },
    /// Moduli of no isotropic solid.
    #[error(
        "moduli E = {youngs_gpa} GPa and G = {shear_gpa} GPa give a Poisson's ratio of {poisson:.3}; a solid has -1 to 0.5"
    )]
    Moduli {
        /// Young's modulus, GPa.
        youngs_gpa: f64,
        /// Shear modulus, GPa.
        shear_gpa: f64,
        /// Their Poisson's ratio.
        poisson: f64,
    },
    /// A stiffness that is no spring's.
    #[error("the stiffness is not symmetric: row {row}, column {column} has {upper}, its mirror image {lower}")]
    NotSymmetric {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The entry there.
        upper: f64,
        /// The entry mirrored at the diagonal.
        lower: f64,
    },
    /// A stiffness that lets go in some direction.
    #[error(
        "the stiffness is not positive definite: scaled to a unit diagonal its least eigenvalue is {least:.2e}, so some \
         displacement meets no resistance"
    )]
    NotPositiveDefinite {
        /// Least eigenvalue, scaled; -1 where the diagonal itself is not positive.
        least: f64,
    },
    /// An axial load that the column does not carry.
    #[error(
        "an axial load of {load_n:.2} N buckles the spring: {length_mm:.1} mm long under it, its lateral stiffness is gone"
    )]
    Buckles {
        /// Axial load, N.
        load_n: f64,
        /// Length under the load, mm.
        length_mm: f64,
    },
    /// More than one segment for a stiffness that comes without a shape.
    #[error("a spring given by its stiffness is one segment, not {segments}: only a coil can be cut")]
    CannotBeCut {
        /// Segments asked for.
        segments: usize,
    },
    /// No segments, or too many.
    #[error("a spring has 1 to {most} segments, not {segments}")]
    Segments {
        /// Segments asked for.
        segments: usize,
        /// The most there may be.
        most: usize,
    },
    /// Inner nodes that found no equilibrium.
    #[error(
        "the spring's {segments} segments found no equilibrium between its ends: a residual of {residual_n:.1e} N is left"
    )]
    InnerNodes {
        /// Segments of the spring.
        segments: usize,
        /// Greatest residual force or torque over length, N.
        residual_n: f64,
    },
}
