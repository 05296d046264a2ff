//! Gain curves of a head with fitted damping.

use super::damping::DampingFit;
use super::spec::DesignedSpec;
use zsim_head::gains::GainCurve;

/// A head with fitted damping and its gain curves.
pub(super) struct HeadResponse<'a> {
    pub design: &'a DesignedSpec,
    pub fit: DampingFit,
    pub curves: Vec<GainCurve>,
}
