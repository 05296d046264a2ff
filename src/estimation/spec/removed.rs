//! Settings of earlier versions, and what takes their place.

use zsim_base::spec::SpecError;

/// Keys that are no longer settings, and the setting or rule that took their place.
const REMOVED: [(&str, &str); 20] = [
    ("formulation", "the trajectory is always in IMU time"),
    ("offset_grids", "each resolution has an offset grid"),
    ("flat_within_sigmas", "max_thickness_sigmas is the limit of flat surfels, too"),
    ("reciprocal", "matches are always reciprocal"),
    ("match_weight", "match_sigma_m sets the weight of matches"),
    ("covariance_inflation", "the covariance is that of the measurements"),
    ("cauchy_start", "cauchy is the threshold of the last iteration, and twice that in the first one"),
    ("cauchy_end", "cauchy"),
    ("gyro_matrix_sigma", "matrix_sigma, of gyroscope and accelerometer"),
    ("accel_matrix_sigma", "matrix_sigma, of gyroscope and accelerometer"),
    ("finest_voxel_m", "surfels.finest_voxel_m, for the registration, too"),
    ("levels", "surfels.levels; the registration has one more"),
    ("min_planarity", "surfels.min_planarity; the registration uses lines, too"),
    ("partners", "references"),
    ("neighbours", "views.neighbours, for the registration, too"),
    ("max_iterations", "solve.max_iterations, for the registration, too"),
    ("settled_m", "solve.settled_m, for the registration, too"),
    ("length_s", "window_s; a node of the pose graph has the length of a window"),
    ("max_plane_distance_m", "matching.max_plane_distance_m, for places, too"),
    ("again_after_s", "two and a half windows"),
];

/// The same error, with what took the place of the key that it is about, if earlier versions had it.
pub(super) fn explained(error: SpecError) -> SpecError {
    let removed = error.unknown_key().and_then(|key| REMOVED.iter().find(|(removed, _)| *removed == key));
    match removed {
        Some((key, instead)) => error.with_help(format!("earlier versions had {key}; in its place: {instead}")),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use crate::EstimatorSpec;
    use zsim_base::spec::{NamedSpec, Source};

    fn error_of(text: &str) -> String {
        EstimatorSpec::parse(&Source::in_memory("mine.ron", text)).unwrap_err().to_string()
    }

    #[test]
    fn a_removed_key_is_an_error_at_its_place_that_names_what_replaced_it() {
        for (text, instead) in [
            ("(\n formulation: paper)", "IMU time"),
            ("(solve: (\n cauchy_end: 2.0))", "in its place: cauchy"),
            ("(registration: (\n finest_voxel_m: 0.3))", "surfels.finest_voxel_m"),
            ("(registration: (places: (\n length_s: 5.0)))", "window_s"),
        ] {
            let error = error_of(text);
            assert!(error.starts_with("mine.ron:2:2: ") && error.contains(instead), "{error}");
        }
        let error = error_of("(solve: (\n cauchi: 2.0))");
        assert!(!error.contains("earlier versions"), "{error}");
    }
}
