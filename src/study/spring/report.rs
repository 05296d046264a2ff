//! All about one spring under one head.

use super::figures::Design;
use super::{DesignFigures, Shake, closed_form, simulated};
use crate::dynamics::{
    ElementLoad, HeadModel, HeadSpec, HeadState, LinkageSpec, Mode, ModeKind, Peak, Quantity, max_head_mass_kg,
};
use crate::elasticity::{Coil, Matrix6, SpringDesign, buckling_load_n, loaded_stiffness};
use crate::geometry::{Kinematics, Pose, STANDARD_GRAVITY_M_PER_S2, roll_pitch_yaw};
use crate::sensors::Lidar;
use crate::spec::Source;
use crate::study::StudyError;
use crate::study::coverage::{Coverage, CoveragePlan};
use crate::study::gains::{AXES, axis_name};
use serde::Serialize;

/// A spring under its head.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpringReport {
    /// Mass of the head, kg.
    pub head_mass_kg: f64,
    /// Whether the head stands (or hangs) at rest.
    pub stands: bool,
    /// Why not, if not.
    pub falls_because: Option<String>,
    /// The heaviest head of this shape that stands, kg; nothing where none falls.
    pub heaviest_head_kg: Option<f64>,
    /// What each element of the linkage bears at rest.
    pub bearings: Vec<ElementLoad>,
    /// The coil of a head on one spring; nothing for a spring known by its stiffness.
    pub coil: Option<CoilReport>,
    /// Where the head rests, if it does.
    pub rest: Option<RestReport>,
    /// Stiffness about the head's centre of mass at rest, gravity in it: x, y, z, about x, y, z; N, m, rad.
    pub stiffness: Option<[[f64; 6]; 6]>,
    /// The modes about rest, slowest first.
    pub modes: Vec<ModeReport>,
    /// The highest peak of each gain curve up to 20 Hz.
    pub gain_peaks: Vec<(&'static str, Option<Peak>)>,
    /// Under a hand's shake.
    pub shaken: Option<ShakeResponse>,
}

/// A coil spring, and how far it is from its limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoilReport {
    /// Mean diameter of coil over diameter of wire.
    pub index: f64,
    /// Mass of the active wire, g; nothing for a material known by its moduli alone.
    pub mass_g: Option<f64>,
    /// Stiffness along the axis, N/m.
    pub axial_n_per_m: f64,
    /// Stiffness about the axis, N m/rad.
    pub torsion_nm_per_rad: f64,
    /// Stiffness of the top, its base clamped, under the head's weight: x, y, z, about x, y, z; nothing beyond its
    /// limits.
    pub stiffness_at_top: Option<[[f64; 6]; 6]>,
    /// Load that buckles it with its top guided, N; nothing for one that never buckles.
    pub buckling_load_n: Option<f64>,
    /// That load over the head's weight.
    pub buckling_margin: Option<f64>,
    /// What is left between coils under the head's weight, mm a coil; negative where they clash.
    pub gap_mm: f64,
    /// The bend at which the coils touch on the inner side, degrees.
    pub clash_bend_deg: f64,
    /// Greatest stress in the wire at rest, MPa.
    pub stress_at_rest_mpa: Option<f64>,
    /// Stress at which the wire stays bent, MPa; nothing for a material known by its moduli alone.
    pub yield_mpa: Option<f64>,
}

/// Where the head rests.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestReport {
    /// The head's origin in the base, m.
    pub position_m: [f64; 3],
    /// Its roll, pitch and yaw, degrees.
    pub roll_pitch_yaw_deg: [f64; 3],
    /// How much nearer foot and top of the one spring are than without load, mm.
    pub sag_mm: Option<f64>,
}

/// A mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeReport {
    /// What it mostly is.
    pub kind: ModeKind,
    /// Frequency without damping, Hz.
    pub frequency_hz: f64,
    /// Frequency of the free, damped oscillation, Hz.
    pub damped_frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Displacement of the centre of mass (m) and turn (rad), scaled so that the largest of them is 1.
    pub shape: [f64; 6],
}

/// What a hand's shake does to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShakeResponse {
    /// The shake.
    pub shake: Shake,
    /// DesignFigures of the linearised head.
    pub closed_form: DesignFigures,
    /// DesignFigures of the simulated head.
    pub simulated: Option<DesignFigures>,
    /// What the lidar saw in that simulation.
    pub coverage: Option<Coverage>,
    /// Why there is no simulation, if there is none.
    pub failed: Option<String>,
}

/// Everything about the spring of a head, shaken by a hand.
///
/// That the head falls is an answer, not an error.
///
/// # Errors
/// When the spec is wrong, or its head is on no spring.
pub fn spring_report(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    lidar: &Lidar,
    plan: &CoveragePlan,
) -> Result<SpringReport, StudyError> {
    let heaviest_head_kg = max_head_mass_kg(spec, source)?;
    let head = match HeadModel::new(spec, source) {
        Ok(head) => head,
        // A head that no mass brings down does not fall: it is wrong.
        Err(error) if heaviest_head_kg.is_none() => return Err(error.into()),
        // Numbers of a spring that are wrong have been refused above: what is left is a head that falls.
        Err(error) => return fallen(spec, heaviest_head_kg, error.to_string()),
    };
    if let Some(why) = head.rigid_mount_reason() {
        return Err(StudyError::Plan { what: "head", message: why.to_owned() });
    }
    let mass_kg = head.body().mass_kg;
    let design = Design::of(spec, &head)?;
    let at_rest = HeadState {
        t_s: 0.0,
        head: Kinematics::at_rest(*head.rest_pose_base_from_head()),
        base: Kinematics::at_rest(Pose::identity()),
    };
    let stress_pa = design.stress_pa(&at_rest);
    let coil = coil_of(spec)?.map(|coil| coil_report(&coil, &design, mass_kg, stress_pa));
    let response = head.frequency_response(&head.default_points());
    let peak = |axis| (axis_name(axis), response.peak(axis, 20.0, Quantity::Kinematic));
    Ok(SpringReport {
        head_mass_kg: mass_kg,
        stands: true,
        falls_because: None,
        heaviest_head_kg,
        bearings: head.element_loads(),
        coil,
        rest: Some(rest_report(&head, design.free_length_m.map(|_| design.sag_m(&head)))),
        stiffness: head.linear().map(|linear| rows(&linear.stiffness)),
        modes: head.linear_modes().iter().map(mode_report).collect(),
        gain_peaks: AXES.map(peak).to_vec(),
        shaken: head.linear().map(|_| shake_response(spec, source, shake, lidar, plan)).transpose()?,
    })
}

fn fallen(spec: &HeadSpec, heaviest_head_kg: Option<f64>, because: String) -> Result<SpringReport, StudyError> {
    use crate::dynamics::PartSpec::{Block, Body};
    let mass = spec.parts.iter().map(|part| match part {
        Block { mass_kg, .. } | Body { mass_kg, .. } => mass_kg,
    });
    let head_mass_kg = mass.sum();
    let design = match &spec.linkage {
        LinkageSpec::Spring { spring, .. } => Design {
            wire: super::Wire::of(spring)?,
            mass_kg: spring.wire_mass_kg().map_err(crate::dynamics::DynamicsError::from)?,
            ..Design::unmounted()
        },
        LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } | LinkageSpec::Suspension { .. } => {
            Design::unmounted()
        }
    };
    Ok(SpringReport {
        head_mass_kg,
        stands: false,
        falls_because: Some(because),
        heaviest_head_kg,
        bearings: Vec::new(),
        coil: coil_of(spec)?.map(|coil| coil_report(&coil, &design, head_mass_kg, None)),
        rest: None,
        stiffness: None,
        modes: Vec::new(),
        gain_peaks: Vec::new(),
        shaken: None,
    })
}

fn shake_response(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    lidar: &Lidar,
    plan: &CoveragePlan,
) -> Result<ShakeResponse, StudyError> {
    let closed_form = closed_form(spec, source, shake)?;
    let (simulated, coverage, failed) = match simulated(spec, source, shake, lidar, plan) {
        Ok((figures, coverage)) => (Some(figures), Some(coverage), None),
        Err(error @ StudyError::Dynamics(_)) => (None, None, Some(error.to_string())),
        Err(error) => return Err(error),
    };
    Ok(ShakeResponse { shake: *shake, closed_form, simulated, coverage, failed })
}

fn coil_of(spec: &HeadSpec) -> Result<Option<Coil>, StudyError> {
    let LinkageSpec::Spring { spring, .. } = &spec.linkage else { return Ok(None) };
    Ok(match spring.design().map_err(crate::dynamics::DynamicsError::from)? {
        SpringDesign::Coil(coil) => Some(coil),
        SpringDesign::Stiffness { .. } => None,
    })
}

fn coil_report(coil: &Coil, design: &Design, head_mass_kg: f64, stress_pa: Option<f64>) -> CoilReport {
    let weight_n = head_mass_kg * STANDARD_GRAVITY_M_PER_S2;
    let length_m = coil.free_length_m() - weight_n / coil.axial_n_per_m();
    let open_m = length_m - coil.solid_length_m();
    let (radius_m, wire_m) = design.wire.map_or((f64::NAN, f64::NAN), |w| (w.coil_radius_m, w.diameter_m));
    let coils = coil.solid_length_m() / wire_m;
    let buckling = buckling_load_n(coil);
    let at_top = coil.under_load(weight_n).and_then(|column| loaded_stiffness(&column)).ok();
    CoilReport {
        index: 2.0 * radius_m / wire_m,
        mass_g: design.mass_kg.map(|mass_kg| mass_kg * 1e3),
        axial_n_per_m: coil.axial_n_per_m(),
        torsion_nm_per_rad: coil.torsion_nm_per_rad(),
        stiffness_at_top: at_top.as_ref().map(rows),
        buckling_load_n: buckling,
        buckling_margin: buckling.map(|load_n| load_n / weight_n),
        gap_mm: open_m / coils * 1e3,
        // A bend by phi brings each of n neighbours phi R / n nearer on the inner side.
        clash_bend_deg: (open_m / radius_m).to_degrees(),
        stress_at_rest_mpa: stress_pa.map(|pa| pa * 1e-6),
        yield_mpa: design.wire.and_then(|wire| wire.yield_pa()).map(|pa| pa * 1e-6),
    }
}

fn rest_report(head: &HeadModel, sag_m: Option<f64>) -> RestReport {
    let rest = head.rest_pose_base_from_head();
    let (roll, pitch, yaw) = roll_pitch_yaw(&rest.rotation);
    RestReport {
        position_m: rest.translation.vector.into(),
        roll_pitch_yaw_deg: [roll, pitch, yaw].map(f64::to_degrees),
        sag_mm: sag_m.map(|m| m * 1e3),
    }
}

fn mode_report(mode: &Mode) -> ModeReport {
    // The largest entry becomes 1, its sign included.
    let shape = mode.shape / mode.shape[mode.shape.iamax()];
    ModeReport {
        kind: mode.kind,
        frequency_hz: mode.frequency_hz,
        damped_frequency_hz: mode.damped_frequency_hz(),
        damping_ratio: mode.damping_ratio,
        shape: shape.into(),
    }
}

fn rows(matrix: &Matrix6) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{PartSpec, load};
    use crate::spec::{Kind, find, parse};

    fn utm30lx() -> Lidar {
        let source = find(Kind::Lidar, "utm30lx").unwrap();
        Lidar::new(&parse(&source).unwrap(), &source).unwrap()
    }

    #[test]
    fn the_handheld_spring_stands_within_its_limits() {
        let (spec, source) = load("handheld").unwrap();
        let plan = CoveragePlan { duration_s: 4.0, ..CoveragePlan::default() };
        let report = spring_report(&spec, &source, &Shake::default(), &utm30lx(), &plan).unwrap();
        assert!(report.stands && report.heaviest_head_kg.unwrap() > report.head_mass_kg);
        let coil = report.coil.unwrap();
        // Under 0.35 kg at 4282 N/m the spring shortens by 0.80 mm, and 12 gaps share 120 - 36 - 0.8 mm.
        assert!((report.rest.unwrap().sag_mm.unwrap() - 0.80).abs() < 0.02);
        assert!((coil.gap_mm - 83.2 / 12.0).abs() < 0.01, "{}", coil.gap_mm);
        assert!(coil.stress_at_rest_mpa.unwrap() < 0.3 * coil.yield_mpa.unwrap());
        let shaken = report.shaken.unwrap();
        let (linear, full) = (shaken.closed_form, shaken.simulated.unwrap());
        assert_eq!(linear.rocking_hz, full.rocking_hz);
        // 95 % of a sine's time are within 0.997 of its amplitude; the rest of the difference is the large swing.
        assert!((full.field_of_view_deg / linear.field_of_view_deg - 1.0).abs() < 0.25, "{linear:?} {full:?}");
        assert!((full.stress_share.unwrap() / linear.stress_share.unwrap() - 1.0).abs() < 0.3, "{linear:?} {full:?}");
        assert_eq!(report.modes.len(), 6);
    }

    #[test]
    fn a_small_swing_is_the_same_by_closed_form_and_simulation() {
        let (spec, source) = load("handheld").unwrap();
        let shake = Shake { pitch_deg: 0.1, frequency_hz: None };
        let plan = CoveragePlan { from_s: 15.0, duration_s: 3.0, ..CoveragePlan::default() };
        let linear = closed_form(&spec, &source, &shake).unwrap();
        let (full, _) = simulated(&spec, &source, &shake, &utm30lx(), &plan).unwrap();
        assert!((full.field_of_view_deg / linear.field_of_view_deg - 0.997).abs() < 0.01, "{linear:?} {full:?}");
        assert!((full.rate_deg_per_s / linear.rate_deg_per_s - 1.0).abs() < 0.02, "{linear:?} {full:?}");
        assert!((full.stress_share.unwrap() / linear.stress_share.unwrap() - 1.0).abs() < 0.03, "{linear:?} {full:?}");
    }

    #[test]
    fn a_head_that_falls_is_an_answer() {
        let (mut spec, source) = load("handheld").unwrap();
        if let Some(PartSpec::Block { mass_kg, .. }) = spec.parts.first_mut() {
            *mass_kg = 2.0;
        }
        let plan = CoveragePlan::default();
        let report = spring_report(&spec, &source, &Shake::default(), &utm30lx(), &plan).unwrap();
        assert!(!report.stands && report.modes.is_empty());
        assert!(report.heaviest_head_kg.unwrap() < 2.14, "{report:?}");
        assert!(report.falls_because.unwrap().contains("supports at most"));
    }
}
