use super::EvaluationError;
use nalgebra::Rotation3;
use zsim_base::geometry::{Matrix, Pose, Rotation, Vector};

/// Ratio of the second to the first singular value of the scatter below which points are collinear.
const COLLINEAR: f64 = 1e-12;

/// Aligns the points `from` to the points `to` by a rigid transform.
///
/// In least squares, as Umeyama (1991), eq. 40-42, with the scale fixed at 1: the rotation is `U S V^T` of the singular
/// value decomposition of the cross covariance, with the sign in `S` that makes it proper.
///
/// # Errors
/// When there are fewer than three pairs, or all points lie on a line.
pub fn align(to: &[Vector], from: &[Vector]) -> Result<Pose, EvaluationError> {
    least_squares(to, from, &Matrix::zeros())
}

/// Aligns the poses `from` to the poses `to` by a rigid transform.
///
/// In least squares; a rotation by an angle has the weight of a translation by `lever_m` times the angle.
///
/// The squared distance of two rotation matrices is twice the squared angle between them, so attitudes enter the cross
/// covariance as `lever_m^2 / 2 R_to R_from^T`.
///
/// # Errors
/// When there are fewer than three pairs, or no direction is determined.
pub fn align_poses(to: &[Pose], from: &[Pose], lever_m: f64) -> Result<Pose, EvaluationError> {
    let turn = |(a, b): (&Pose, &Pose)| (a.rotation * b.rotation.inverse()).to_rotation_matrix().into_inner();
    let turns: Matrix = to.iter().zip(from).map(turn).sum();
    let positions = |poses: &[Pose]| poses.iter().map(|pose| pose.translation.vector).collect::<Vec<Vector>>();
    let each = 0.5 * lever_m * lever_m / to.len().min(from.len()).max(1) as f64;
    least_squares(&positions(to), &positions(from), &(turns * each))
}

/// As [`align`], with the contribution of the attitudes to the mean cross covariance.
fn least_squares(to: &[Vector], from: &[Vector], turns: &Matrix) -> Result<Pose, EvaluationError> {
    let pairs = to.len().min(from.len());
    if pairs < 3 {
        return Err(EvaluationError::TooFew { pairs });
    }
    let mean = |points: &[Vector]| points[..pairs].iter().sum::<Vector>() / pairs as f64;
    let (to_mean, from_mean) = (mean(to), mean(from));
    let scatter = to
        .iter()
        .zip(from)
        .fold(*turns, |sum, (a, b)| sum + (a - to_mean) * (b - from_mean).transpose() / pairs as f64);

    let svd = scatter.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err(EvaluationError::OnALine) };
    if svd.singular_values[1] <= COLLINEAR * svd.singular_values[0].max(f64::MIN_POSITIVE) {
        return Err(EvaluationError::OnALine);
    }
    let handedness = (u.determinant() * v_t.determinant()).signum();
    let proper = u * Matrix::from_diagonal(&Vector::new(1.0, 1.0, handedness)) * v_t;
    let rotation = Rotation::from_rotation_matrix(&Rotation3::from_matrix_unchecked(proper));
    Ok(Pose::from_parts((to_mean - rotation * from_mean).into(), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use zsim_base::geometry::from_roll_pitch_yaw;

    fn helix(count: usize) -> Vec<Vector> {
        let point = |t: f64| Vector::new(2.0 * t.cos(), 2.0 * t.sin(), 0.1 * t);
        (0..count).map(|k| point(k as f64 * 0.1)).collect()
    }

    #[test]
    fn a_known_transform_is_recovered() {
        let points = helix(80);
        for yaw in [0.3, -2.8] {
            let planted = Pose::from_parts(Vector::new(1.0, -2.0, 0.5).into(), from_roll_pitch_yaw(0.2, -0.4, yaw));
            let moved: Vec<Vector> = points.iter().map(|p| planted.rotation * p + planted.translation.vector).collect();
            let found = align(&moved, &points).unwrap();
            assert_relative_eq!(found.to_homogeneous(), planted.to_homogeneous(), epsilon = 1e-12);
        }
    }

    #[test]
    fn attitudes_determine_the_rotation_about_a_straight_path() {
        let line =
            |k: i32| Pose::from_parts(Vector::x().scale(f64::from(k)).into(), from_roll_pitch_yaw(0.1, 0.2, 0.3));
        let from: Vec<Pose> = (0..10).map(line).collect();
        let planted = Pose::from_parts(Vector::new(1.0, -2.0, 0.5).into(), from_roll_pitch_yaw(0.7, -0.4, 2.0));
        let to: Vec<Pose> = from.iter().map(|pose| planted * pose).collect();
        let found = align_poses(&to, &from, 0.3).unwrap();
        assert_relative_eq!(found.to_homogeneous(), planted.to_homogeneous(), epsilon = 1e-12);
        assert_eq!(align_poses(&to, &from, 0.0), Err(EvaluationError::OnALine));
    }

    #[test]
    fn the_alignment_of_a_mirror_image_is_a_proper_rotation() {
        // Points in a plane fit their mirror image exactly by a half turn; the rotation must be proper.
        let flat: Vec<Vector> = helix(80).iter().map(|p| Vector::new(p.x, p.y, 0.0)).collect();
        let mirrored: Vec<Vector> = flat.iter().map(|p| Vector::new(-p.x, p.y, 0.0)).collect();
        let found = align(&mirrored, &flat).unwrap();
        assert_relative_eq!(found.rotation.to_rotation_matrix().matrix().determinant(), 1.0, epsilon = 1e-12);
        assert_relative_eq!(found * nalgebra::Point3::from(flat[7]), mirrored[7].into(), epsilon = 1e-12);
    }

    #[test]
    fn collinear_points_and_two_points_are_rejected() {
        let line: Vec<Vector> = (0..10).map(|k| Vector::new(k as f64, 2.0 * k as f64, 0.0)).collect();
        assert_eq!(align(&line, &line), Err(EvaluationError::OnALine));
        assert_eq!(align(&[Vector::zeros(); 5], &[Vector::zeros(); 5]), Err(EvaluationError::OnALine));
        assert_eq!(align(&line[..2], &line[..2]), Err(EvaluationError::TooFew { pairs: 2 }));
    }
}
