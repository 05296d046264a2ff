//! Report on a spring under a head: rest pose, stiffness, modes, limits and response to a shake.

use super::model::{SpringModel, at_rest};
use super::{DesignMetrics, MISSION_HOURS, Shake, closed_form, mode_name, simulated};
use crate::HeadError;
use crate::coverage::{Coverage, CoveragePlan};
use crate::gains::{AXES, axis_name};
use serde::Serialize;
use zsim_base::geometry::{Kinematics, Pose, STANDARD_GRAVITY_M_PER_S2, gravity_in_world, roll_pitch_yaw};
use zsim_base::spec::Source;
use zsim_dynamics::{
    AccelerationKind, Body, ElementLoad, HeadModel, HeadSpec, HeadState, LinkageSpec, MassLimit, Mode, ModeKind, Peak,
    max_head_mass, stands_with_mass,
};
use zsim_elasticity::{Coil, EndsSpec, Material, Matrix6, Spring, SpringDesign, SpringSpec, buckling_load_n};
use zsim_sensors::Lidar;

/// Segments for the stiffness of a guided spring, whose ends bend it: near buckling four err by up to 8 %, eight by 6, these by 3.
const GUIDED_SEGMENTS: usize = 16;

/// Report on a spring under a head.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SpringReport {
    /// Mass of the head, kg.
    pub head_mass_kg: f64,
    /// Whether the head has a stable rest pose.
    pub stands: bool,
    /// The reason why it has none.
    pub falls_because: Option<String>,
    /// Maximum mass of a head of this shape with a stable rest pose and a stress at rest below the yield stress, kg;
    /// `None` if there is no limit, or the strength of the wire is not known.
    pub heaviest_head_kg: Option<f64>,
    /// What happens to a heavier head.
    pub heaviest_head_limit: Option<String>,
    /// Load on each element of the linkage at rest.
    pub bearings: Vec<ElementLoad>,
    /// Coil of a head on a single spring; `None` for a spring specified by stiffness.
    pub coil: Option<CoilReport>,
    /// Rest pose of the head.
    pub rest: Option<RestReport>,
    /// Stiffness matrix about the centre of mass at rest, including gravity; x, y, z, rx, ry, rz; N, m, rad.
    pub stiffness: Option<[[f64; 6]; 6]>,
    /// Modes about the rest pose, slowest first.
    pub modes: Vec<ModeReport>,
    /// Peak of each gain curve up to 20 Hz.
    pub gain_peaks: Vec<(&'static str, Option<Peak>)>,
    /// Response to a shake of the base.
    pub shaken: Option<ShakeResponse>,
}

/// A coil spring and its margins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoilReport {
    /// Free length, mm.
    pub free_length_mm: f64,
    /// Mean diameter of the coil, mm.
    pub coil_diameter_mm: f64,
    /// Diameter of the wire, mm.
    pub wire_diameter_mm: f64,
    /// Number of active coils.
    pub active_coils: f64,
    /// Number of coils, those of the ends included.
    pub total_coils: f64,
    /// Length at which all coils touch, ends included, mm.
    pub solid_length_mm: f64,
    /// Ends.
    pub ends: EndsSpec,
    /// Material of the wire.
    pub material: Material,
    /// Spring index: mean coil diameter divided by wire diameter.
    pub index: f64,
    /// Mass of the active wire, g; `None` for a material specified by its moduli only.
    pub mass_g: Option<f64>,
    /// Axial stiffness, N/m.
    pub axial_n_per_m: f64,
    /// Torsional stiffness, N m/rad.
    pub torsion_nm_per_rad: f64,
    /// Compressive load, N, negative for tension: that at rest, or for a head without a rest pose the component of its
    /// weight along the spring.
    pub load_n: f64,
    /// Stiffness matrix of the top end, guided under that load, with a clamped foot; x, y, z, rx, ry, rz; `None` if the spring is
    /// beyond its limits.
    pub stiffness_at_top: Option<[[f64; 6]; 6]>,
    /// Buckling load with a guided top, N; `None` if the spring does not buckle or the load is a tension.
    pub buckling_load_n: Option<f64>,
    /// Buckling load divided by the load; `None` if the spring does not buckle or the load is a tension.
    pub buckling_margin: Option<f64>,
    /// Gap between adjacent coils under the load, mm; negative if the coils touch.
    pub gap_mm: f64,
    /// Bending angle at which the coils touch on the inner side, degrees.
    pub clash_bend_deg: f64,
    /// Maximum stress in the wire at rest, MPa.
    pub stress_at_rest_mpa: Option<f64>,
    /// Yield stress of the wire, MPa; `None` for a material specified by its moduli only.
    pub yield_mpa: Option<f64>,
}

/// Rest pose of a head.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RestReport {
    /// Origin of the head in the base frame, m.
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw, degrees.
    pub roll_pitch_yaw_deg: [f64; 3],
    /// Static compression of a single spring, mm; negative for an extension.
    pub sag_mm: Option<f64>,
}

/// A mode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModeReport {
    /// Dominant motion.
    pub kind: ModeKind,
    /// Dominant motion with its direction in words.
    pub name: String,
    /// Undamped frequency, Hz.
    pub frequency_hz: f64,
    /// Damped frequency, Hz.
    pub damped_frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Translation of the centre of mass (m) and rotation (rad), scaled so that the largest entry is 1.
    pub shape: [f64; 6],
}

/// Response of the head to a shake of the base.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShakeResponse {
    /// The shake.
    pub shake: Shake,
    /// Metrics of the linearised head.
    pub closed_form: DesignMetrics,
    /// Metrics of the simulated head.
    pub simulated: Option<DesignMetrics>,
    /// Coverage of the lidar in the simulation.
    pub coverage: Option<Coverage>,
    /// The reason why the simulation failed.
    pub failed: Option<String>,
}

/// Computes the report on the spring of a head.
///
/// A head without a stable rest pose is reported, not an error.
///
/// # Errors
/// When the spec is invalid, or the head has no elastic linkage.
pub fn spring_report(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    lidar: &Lidar,
    plan: &CoveragePlan,
) -> Result<SpringReport, HeadError> {
    let heaviest = heaviest_head(spec, source)?;
    let head = match HeadModel::new(spec, source) {
        Ok(head) => head,
        // If a head of this mass has a rest pose, the error has another cause in the spec.
        Err(error) if stands_with_mass(spec, source, 1.0)? => return Err(error.into()),
        Err(error) => return unstable_report(spec, heaviest, error.to_string()),
    };
    if let Some(why) = head.rigid_mount_reason() {
        return Err(HeadError::Plan { what: "head", message: why.to_owned() });
    }
    let mass_kg = head.body().mass_kg;
    let model = SpringModel::of(spec, head.body())?;
    let stress_pa = model.stress_pa(&at_rest(&head));
    let bearings = head.element_loads();
    let load_n = bearings.first().and_then(|spring| spring.load_n).unwrap_or(mass_kg * STANDARD_GRAVITY_M_PER_S2);
    let coil = coil_of(spec)?.map(|coil| coil_report(&coil, &model, load_n, stress_pa));
    let response = head.frequency_response(&head.default_points());
    let peak = |axis| (axis_name(axis), response.peak(axis, 20.0, AccelerationKind::Kinematic));
    Ok(SpringReport {
        head_mass_kg: mass_kg,
        stands: true,
        falls_because: None,
        heaviest_head_kg: heaviest.as_ref().map(|limit| limit.mass_kg),
        heaviest_head_limit: heaviest.map(|limit| limit.reason),
        bearings,
        coil,
        rest: Some(rest_report(&head, model.sag_m(&head))),
        stiffness: head.linear().map(|linear| rows(&linear.stiffness)),
        modes: head.linear_modes().iter().map(mode_report).collect(),
        gain_peaks: AXES.map(peak).to_vec(),
        shaken: head.linear().map(|_| shake_response(spec, source, shake, lidar, plan)).transpose()?,
    })
}

/// The report on a head without a stable rest pose.
fn unstable_report(spec: &HeadSpec, heaviest: Option<MassLimit>, because: String) -> Result<SpringReport, HeadError> {
    use zsim_dynamics::PartSpec::{Block, Body};
    let mass = spec.parts.iter().map(|part| match part {
        Block { mass_kg, .. } | Body { mass_kg, .. } => mass_kg,
    });
    let head_mass_kg: f64 = mass.sum();
    let weight = gravity_in_world() * head_mass_kg;
    let (model, load_n) = match &spec.linkage {
        LinkageSpec::Spring { spring, base_from_spring, .. } => {
            let model = SpringModel {
                wire: super::Wire::of(spring)?,
                end_m: spring.end_length_m()?,
                mass_kg: spring.wire_mass_kg().map_err(zsim_dynamics::DynamicsError::from)?,
                ..SpringModel::default()
            };
            (model, -(base_from_spring.pose().rotation.inverse() * weight).z)
        }
        LinkageSpec::Rigid { .. } | LinkageSpec::Actuated { .. } | LinkageSpec::Suspension { .. } => {
            (SpringModel::default(), weight.norm())
        }
    };
    Ok(SpringReport {
        head_mass_kg,
        falls_because: Some(because),
        heaviest_head_kg: heaviest.as_ref().map(|limit| limit.mass_kg),
        heaviest_head_limit: heaviest.map(|limit| limit.reason),
        coil: coil_of(spec)?.map(|coil| coil_report(&coil, &model, load_n, None)),
        ..SpringReport::default()
    })
}

fn shake_response(
    spec: &HeadSpec,
    source: &Source,
    shake: &Shake,
    lidar: &Lidar,
    plan: &CoveragePlan,
) -> Result<ShakeResponse, HeadError> {
    let closed_form = closed_form(spec, source, shake, MISSION_HOURS)?;
    let (simulated, coverage, failed) = match simulated(spec, source, shake, lidar, plan, MISSION_HOURS) {
        Ok((metrics, coverage)) => (Some(metrics), Some(coverage), None),
        Err(error @ HeadError::Dynamics(_)) => (None, None, Some(error.to_string())),
        Err(error) => return Err(error),
    };
    Ok(ShakeResponse { shake: *shake, closed_form, simulated, coverage, failed })
}

/// The coil of a head on a single spring, with its ends and material.
type OrderedCoil = (Coil, EndsSpec, Material);

fn coil_of(spec: &HeadSpec) -> Result<Option<OrderedCoil>, HeadError> {
    let LinkageSpec::Spring { spring, .. } = &spec.linkage else { return Ok(None) };
    let resolved = spring.resolved()?;
    let design = resolved.design().map_err(zsim_dynamics::DynamicsError::from)?;
    Ok(match (design, resolved) {
        (SpringDesign::Coil(coil), SpringSpec::Coil { ends, material, .. }) => Some((coil, ends, material)),
        _ => None,
    })
}

/// The report on a coil under the compressive load `load_n`.
fn coil_report(
    (coil, ends, material): &OrderedCoil,
    model: &SpringModel,
    load_n: f64,
    stress_pa: Option<f64>,
) -> CoilReport {
    let length_m = coil.free_length_m() - load_n / coil.axial_n_per_m();
    let open_m = length_m - coil.solid_length_m();
    let (radius_m, wire_m) = model.wire.map_or((f64::NAN, f64::NAN), |w| (w.coil_radius_m, w.diameter_m));
    let coils = coil.solid_length_m() / wire_m;
    let buckling = buckling_load_n(coil).filter(|_| load_n > 0.0);
    let at_top = Spring::of_coil(coil, load_n, GUIDED_SEGMENTS).and_then(|spring| spring.guided(load_n)).ok();
    CoilReport {
        free_length_mm: (coil.free_length_m() + 2.0 * model.end_m) * 1e3,
        coil_diameter_mm: coil.coil_diameter_m() * 1e3,
        wire_diameter_mm: coil.wire_diameter_m() * 1e3,
        active_coils: coil.active_coils(),
        total_coils: coil.active_coils() + ends.inactive_coils(),
        solid_length_mm: (coil.solid_length_m() + 2.0 * model.end_m) * 1e3,
        ends: *ends,
        material: *material,
        load_n,
        index: 2.0 * radius_m / wire_m,
        mass_g: model.mass_kg.map(|mass_kg| mass_kg * 1e3),
        axial_n_per_m: coil.axial_n_per_m(),
        torsion_nm_per_rad: coil.torsion_nm_per_rad(),
        stiffness_at_top: at_top.map(|top| rows(&top.stiffness)),
        buckling_load_n: buckling,
        buckling_margin: buckling.map(|buckling_n| buckling_n / load_n),
        gap_mm: open_m / coils * 1e3,
        // Bending by phi reduces each of the n gaps by phi R / n on the inner side.
        clash_bend_deg: (open_m / radius_m).to_degrees(),
        stress_at_rest_mpa: stress_pa.map(|pa| pa * 1e-6),
        yield_mpa: model.wire.and_then(|wire| wire.yield_pa()).map(|pa| pa * 1e-6),
    }
}

fn rest_report(head: &HeadModel, sag_m: Option<f64>) -> RestReport {
    let rest = head.base_from_head_at_rest();
    let (roll, pitch, yaw) = roll_pitch_yaw(&rest.rotation);
    RestReport {
        position_m: rest.translation.vector.into(),
        roll_pitch_yaw_deg: [roll, pitch, yaw].map(f64::to_degrees),
        sag_mm: sag_m.map(|m| m * 1e3),
    }
}

fn mode_report(mode: &Mode) -> ModeReport {
    // Dividing by the signed value makes the largest entry +1.
    let shape = mode.shape / mode.shape[mode.shape.iamax()];
    ModeReport {
        kind: mode.kind,
        name: mode_name(mode),
        frequency_hz: mode.frequency_hz,
        damped_frequency_hz: mode.damped_frequency_hz(),
        damping_ratio: mode.damping_ratio,
        shape: shape.into(),
    }
}

fn rows(matrix: &Matrix6) -> [[f64; 6]; 6] {
    std::array::from_fn(|i| std::array::from_fn(|j| matrix[(i, j)]))
}

/// The maximum mass of a head with the shape of `spec` that has a stable rest pose, with a stress at rest below the yield
/// stress of the wire.
///
/// `None` if no mass makes the head fall and the strength of the wire is not known.
///
/// # Errors
/// When the parts of the head or a spring are invalid.
fn heaviest_head(spec: &HeadSpec, source: &Source) -> Result<Option<MassLimit>, HeadError> {
    let too_much = |body: &Body, rest: &Pose| {
        let model = SpringModel::of(spec, body).ok()?;
        let at_rest =
            HeadState { t_s: 0.0, head: Kinematics::at_rest(*rest), base: Kinematics::at_rest(Pose::identity()) };
        let yield_pa = model.wire?.yield_pa()?;
        let stress_pa = model.stress_pa(&at_rest)?;
        (stress_pa > yield_pa).then(|| "the wire yields".to_owned())
    };
    Ok(max_head_mass(spec, source, &too_much)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use zsim_base::spec::{Kind, find, parse};
    use zsim_dynamics::{PartSpec, load};

    fn utm30lx() -> Lidar {
        let source = find(Kind::Lidar, "utm30lx").unwrap();
        Lidar::new(&parse(&source).unwrap(), &source).unwrap()
    }

    #[test]
    fn the_handheld_spring_is_within_its_limits() {
        let (spec, source) = load("handheld").unwrap();
        let plan = CoveragePlan { duration_s: 4.0, ..CoveragePlan::default() };
        let report = spring_report(&spec, &source, &Shake::default(), &utm30lx(), &plan).unwrap();
        assert!(report.stands && report.heaviest_head_kg.unwrap() > report.head_mass_kg);
        let buckling_at = |margin: f64| {
            let mut report = report.clone();
            report.coil.as_mut().unwrap().buckling_margin = Some(margin);
            let rows = super::super::tables::properties(&report).rows;
            rows.into_iter().find(|row| row[0] == "buckling load").unwrap().remove(1)
        };
        assert!(buckling_at(1.24).contains("valid up to 80 %") && !buckling_at(1.26).contains("valid"));
        let coil = report.coil.unwrap();
        // 0.35 kg and half of the wire's 52 g at 4282 N/m compress the spring by 0.86 mm; 12 equal gaps add up to 120 - 36 - 0.86 mm.
        assert!((report.rest.unwrap().sag_mm.unwrap() - 0.86).abs() < 0.02);
        assert!((coil.gap_mm - 83.14 / 12.0).abs() < 0.01, "{}", coil.gap_mm);
        // 25 mm x 3 mm, 12 coils, 120 mm: 36 mm when all coils touch.
        let lengths = [coil.solid_length_mm, coil.free_length_mm, coil.active_coils, coil.total_coils];
        assert!(
            lengths.iter().zip([36.0, 120.0, 12.0, 12.0]).all(|(x, known)| (x - known).abs() < 1e-9),
            "{lengths:?}"
        );
        assert!(coil.stress_at_rest_mpa.unwrap() < 0.3 * coil.yield_mpa.unwrap());
        let shaken = report.shaken.unwrap();
        let (linear, full) = (shaken.closed_form, shaken.simulated.unwrap());
        assert_eq!(linear.rocking_hz, full.rocking_hz);
        // A sine is within 0.997 of the amplitude for 95 % of the time; the rest of the difference is nonlinear.
        assert!((full.field_of_view_deg / linear.field_of_view_deg - 1.0).abs() < 0.25, "{linear:?} {full:?}");
        assert!((full.stress_share.unwrap() / linear.stress_share.unwrap() - 1.0).abs() < 0.3, "{linear:?} {full:?}");
        assert_eq!(report.modes.len(), 6);
    }

    #[test]
    fn closed_form_and_simulation_agree_for_a_small_shake() {
        let (spec, source) = load("handheld").unwrap();
        let shake = Shake { pitch_deg: 0.1, frequency_hz: None };
        let plan = CoveragePlan { from_s: 15.0, duration_s: 3.0, ..CoveragePlan::default() };
        let linear = closed_form(&spec, &source, &shake, MISSION_HOURS).unwrap();
        let (full, _) = simulated(&spec, &source, &shake, &utm30lx(), &plan, MISSION_HOURS).unwrap();
        assert!((full.field_of_view_deg / linear.field_of_view_deg - 0.997).abs() < 0.01, "{linear:?} {full:?}");
        assert!((full.rate_deg_per_s / linear.rate_deg_per_s - 1.0).abs() < 0.02, "{linear:?} {full:?}");
        assert!((full.stress_share.unwrap() / linear.stress_share.unwrap() - 1.0).abs() < 0.03, "{linear:?} {full:?}");
    }

    #[test]
    fn a_head_without_a_rest_pose_is_reported() {
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
