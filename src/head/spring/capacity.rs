//! The heaviest head on a linkage: the mass at which the head falls or the wire of its spring yields.

use super::model::SpringModel;
use crate::HeadError;
use zsim_base::geometry::{Kinematics, Pose};
use zsim_base::spec::Source;
use zsim_dynamics::{Body, HeadSpec, HeadState, MassLimit, max_head_mass};

/// The maximum mass of a head with the shape of `spec` that has a stable rest pose, with a stress at rest below the yield
/// stress of the wire.
///
/// `None` if no mass makes the head fall and the strength of the wire is not known.
///
/// # Errors
/// When the parts of the head or a spring are invalid.
pub(super) fn heaviest_head(spec: &HeadSpec, source: &Source) -> Result<Option<MassLimit>, HeadError> {
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
