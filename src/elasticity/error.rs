/// Errors of spring specs and force laws.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ElasticityError {
    /// The named spring does not exist, or the file is invalid.
    #[error(transparent)]
    Spec(#[from] zsim_base::spec::SpecError),
    /// The spring index is too small for the formulas.
    #[error(
        "the wire of {wire_mm} mm is too thick for a coil of {coil_mm} mm: their ratio, the spring index, is {index:.2}; \
         the minimum is 2"
    )]
    IndexTooSmall {
        /// Wire diameter, mm.
        wire_mm: f64,
        /// Mean coil diameter, mm.
        coil_mm: f64,
        /// Spring index: coil diameter over wire diameter.
        index: f64,
    },
    /// The spring is outside of the range in which the force law was compared with an exact rod.
    #[error(
        "the {quantity} of the spring is {value:.1}; the force law is valid from {} to {}: choose another coil or wire, or \
         give the spring by `stiffness(...)`",
        range[0],
        range[1]
    )]
    OutsideRange {
        /// What is outside, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Lowest and highest valid value.
        range: [f64; 2],
    },
    /// The coils touch without load.
    #[error(
        "the solid length of {coils} coils of {wire_mm} mm wire is {solid_mm:.2} mm; it must be less than the free length of {free_mm} mm"
    )]
    CoilsTouch {
        /// Active coils.
        coils: f64,
        /// Wire diameter, mm.
        wire_mm: f64,
        /// Solid length, at which the coils touch, mm.
        solid_mm: f64,
        /// Free length, mm.
        free_mm: f64,
    },
    /// More coils than a model or a drawing of the spring can have.
    #[error("{coils:e} active coils; expected at most {most}")]
    TooManyCoils {
        /// Active coils.
        coils: f64,
        /// Maximum number.
        most: f64,
    },
    /// The load compresses the spring to the solid length.
    #[error(
        "a load of {load_n:.2} N shortens the spring by {by_mm:.1} mm, but its coils touch after {travel_mm:.1} mm: use a stiffer \
         or longer spring"
    )]
    Clash {
        /// Axial load, N.
        load_n: f64,
        /// By how much the load would shorten the spring without contact of the coils, mm.
        by_mm: f64,
        /// By how much it can be shortened until the coils touch, mm.
        travel_mm: f64,
    },
    /// The moduli are impossible for an isotropic solid.
    #[error(
        "moduli E = {youngs_gpa} GPa and G = {shear_gpa} GPa give a Poisson's ratio of {poisson:.3}; it must be -1 to 0.5"
    )]
    Moduli {
        /// Young's modulus, GPa.
        youngs_gpa: f64,
        /// Shear modulus, GPa.
        shear_gpa: f64,
        /// Poisson's ratio of these moduli.
        poisson: f64,
    },
    /// The stiffness matrix is not symmetric.
    #[error("the stiffness is not symmetric: row {row}, column {column} is {upper}, the transposed entry {lower}")]
    NotSymmetric {
        /// Row, from 1.
        row: usize,
        /// Column, from 1.
        column: usize,
        /// The entry at that row and column.
        upper: f64,
        /// The transposed entry.
        lower: f64,
    },
    /// The stiffness matrix is not positive definite.
    #[error(
        "the stiffness is not positive definite: scaled to a unit diagonal, the smallest eigenvalue is {smallest:.2e}, so some \
         displacement meets no resistance"
    )]
    NotPositiveDefinite {
        /// Smallest eigenvalue of the scaled matrix; -1 if a diagonal entry is not positive.
        smallest: f64,
    },
    /// The axial load buckles the column.
    #[error(
        "an axial load of {load_n:.2} N buckles the spring: at the loaded length of {length_mm:.1} mm the lateral stiffness is zero or negative"
    )]
    Buckles {
        /// Axial load, N.
        load_n: f64,
        /// Length under the load, mm.
        length_mm: f64,
    },
    /// The axial load is above the range of the force law.
    #[error(
        "an axial load of {load_n:.2} N on the spring is above 80 % of its buckling load (top guided), where the force law ends"
    )]
    NearBuckling {
        /// Axial load, N.
        load_n: f64,
    },
    /// The tension is beyond the range of the force law.
    #[error(
        "a pull of {pull_n:.1} N stretches the spring to {length_mm:.0} mm, which is beyond the range of the force law"
    )]
    PullTooStrong {
        /// Tension, N.
        pull_n: f64,
        /// Length under the load, mm.
        length_mm: f64,
    },
    /// The load is beyond the range of the model of the wire.
    #[error("a load of {load_n:.2} N deforms the coils more than the model of the wire allows")]
    NotAHelix {
        /// Axial load, N.
        load_n: f64,
    },
    /// Several segments for a spring that is given by a stiffness matrix.
    #[error("a spring given by a stiffness matrix has one segment, not {segments}: only a coil can be divided")]
    CannotBeDivided {
        /// Requested number of segments.
        segments: usize,
    },
    /// The number of segments is out of range.
    #[error("a spring has 1 to {max} segments, not {segments}")]
    Segments {
        /// Requested number of segments.
        segments: usize,
        /// Maximum number of segments.
        max: usize,
    },
    /// The tension is too high for the number of segments.
    #[error(
        "a pull of {pull_n:.1} N is too strong for a spring of {segments} segment(s): its segments are then too long for the \
         force law; use {needed} segments or more"
    )]
    TooFewSegments {
        /// Tension, N.
        pull_n: f64,
        /// Number of segments.
        segments: usize,
        /// Smallest sufficient number of segments.
        needed: usize,
    },
    /// The equilibrium of the inner nodes did not converge.
    #[error("the equilibrium of the spring's {segments} segments did not converge: residual {residual_n:.1e} N")]
    InnerNodes {
        /// Number of segments of the spring.
        segments: usize,
        /// Largest residual force, or torque over length, N.
        residual_n: f64,
    },
}
