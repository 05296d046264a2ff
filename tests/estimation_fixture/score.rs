use super::Run;
use zsim::estimation::OpenLoop;
use zsim::geometry::{Matrix, Pose, Rotation, Vector};
use zsim::time::Stamp;

/// Errors of an estimate.
#[derive(Debug, Clone, Copy)]
pub struct Score {
    /// Position RMSE after rigid alignment, m.
    pub rmse_m: f64,
    /// Largest position error after alignment, m.
    pub worst_m: f64,
    /// Rotation RMSE after alignment, degrees.
    pub rotation_deg: f64,
    /// Position drift after alignment over the first 20 s: mean error of the last 5 s per minute, m/min.
    pub drift_m_per_min: f64,
    /// Clock error at the end, s.
    pub clock_end_s: f64,
    /// Largest clock error after 30 s, s.
    pub clock_worst_s: f64,
    /// Run time of all windows, s.
    pub elapsed_s: f64,
}

fn seconds(stamp: Stamp) -> f64 {
    stamp.nanos() as f64 * 1e-9
}

/// The least-squares rigid transform from `from` to `to` (Umeyama 1991, without scale).
fn align(from: &[Vector], to: &[Vector]) -> Pose {
    let n = from.len() as f64;
    let (a, b) = (from.iter().sum::<Vector>() / n, to.iter().sum::<Vector>() / n);
    let cross: Matrix = from.iter().zip(to).map(|(x, y)| (y - b) * (x - a).transpose()).sum();
    let svd = cross.svd(true, true);
    let (u, vt) = (svd.u.unwrap(), svd.v_t.unwrap());
    let sign = Matrix::from_diagonal(&Vector::new(1.0, 1.0, (u * vt).determinant()));
    let rotation = Rotation::from_matrix(&(u * sign * vt));
    Pose::from_parts((b - rotation * a).into(), rotation)
}

/// Growth of the position error between two times, m.
///
/// The largest error in the interval after alignment of the poses at its start.
pub fn growth_m(result: &OpenLoop, run: &Run, (from_s, to_s): (f64, f64)) -> f64 {
    let mut within = result
        .trajectory
        .iter()
        .map(|(stamp, pose)| (seconds(stamp), pose))
        .skip_while(|(t, _)| *t < from_s)
        .take_while(|(t, _)| *t <= to_s)
        .peekable();
    let Some((start_s, start)) = within.peek().copied() else { return f64::INFINITY };
    let world_from_map = run.walk.pose(start_s) * start.inverse();
    let error_m = |(t, pose): (f64, &Pose)| {
        ((world_from_map * pose).translation.vector - run.walk.pose(t).translation.vector).norm()
    };
    within.map(error_m).fold(0.0, f64::max)
}

impl Score {
    pub fn of(result: &OpenLoop, run: &Run) -> Self {
        let poses: Vec<(f64, Pose)> = result.trajectory.iter().map(|(stamp, pose)| (seconds(stamp), *pose)).collect();
        let truth: Vec<Pose> = poses.iter().map(|(t, _)| run.walk.pose(*t)).collect();
        let position = |pose: &Pose| pose.translation.vector;
        let from: Vec<Vector> = poses.iter().map(|(_, pose)| position(pose)).collect();
        let to: Vec<Vector> = truth.iter().map(position).collect();
        let all = align(&from, &to);
        let errors: Vec<f64> = from
            .iter()
            .zip(&to)
            .map(|(a, b)| (all * nalgebra::Point3::from(*a) - nalgebra::Point3::from(*b)).norm())
            .collect();
        let n = errors.len() as f64;
        let turns = poses.iter().zip(&truth).map(|((_, a), b)| (all.rotation * a.rotation).angle_to(&b.rotation));
        let first = poses.iter().take_while(|(t, _)| *t < poses[0].0 + 20.0).count();
        let early = align(&from[..first], &to[..first]);
        let end_s = poses.last().unwrap().0;
        let late: Vec<f64> = (0..poses.len())
            .filter(|k| poses[*k].0 > end_s - 5.0)
            .map(|k| (early * nalgebra::Point3::from(from[k]) - nalgebra::Point3::from(to[k])).norm())
            .collect();
        let clock = |(stamp, offset): &(Stamp, f64)| offset - run.offset_s(seconds(*stamp));
        let settled = result.clock_offsets.iter().filter(|(stamp, _)| seconds(*stamp) > 30.0);
        Self {
            rmse_m: (errors.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            worst_m: errors.iter().copied().fold(0.0, f64::max),
            rotation_deg: (turns.map(|a| a * a).sum::<f64>() / n).sqrt().to_degrees(),
            drift_m_per_min: late.iter().sum::<f64>() / late.len() as f64 / (end_s / 60.0),
            clock_end_s: result.clock_offsets.last().map_or(f64::NAN, clock),
            clock_worst_s: settled.map(|c| clock(c).abs()).fold(0.0, f64::max),
            elapsed_s: result.windows.iter().map(|window| window.elapsed_s).sum(),
        }
    }
}
