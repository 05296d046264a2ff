use super::TimedReturn;
use zsim_base::geometry::{Matrix, Vector};

/// Additive sums over points: their number, mean time, mean and second central moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in super::super) struct Moments {
    count: f64,
    time_s: f64,
    noise2: f64,
    weakness: f64,
    sum: [f64; 3],
    /// Sums of xx, xy, xz, yy, yz, zz.
    outer: [f64; 6],
}

impl Moments {
    /// Adds the point of `beam`, measured with variance `noise2` (m^2) along the beam.
    pub(in super::super) fn add(&mut self, point: &Vector, beam: &TimedReturn, noise2: f64) {
        let [x, y, z] = [point.x, point.y, point.z];
        self.count += 1.0;
        self.time_s += beam.tau_s;
        self.noise2 += noise2;
        self.weakness += f64::from(beam.weakness);
        for (sum, term) in self.sum.iter_mut().zip([x, y, z]) {
            *sum += term;
        }
        for (sum, term) in self.outer.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
            *sum += term;
        }
    }

    /// Adds the points of `other`.
    pub(in super::super) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.time_s += other.time_s;
        self.noise2 += other.noise2;
        self.weakness += other.weakness;
        for (sum, term) in self.sum.iter_mut().zip(other.sum) {
            *sum += term;
        }
        for (sum, term) in self.outer.iter_mut().zip(other.outer) {
            *sum += term;
        }
    }

    /// Number of points.
    pub(in super::super) fn count(&self) -> f64 {
        self.count
    }

    /// Mean time of the points, s.
    pub(in super::super) fn mean_time_s(&self) -> f64 {
        self.time_s / self.count
    }

    /// Mean range variance of the points along their beams, m^2.
    pub(in super::super) fn mean_noise2(&self) -> f64 {
        self.noise2 / self.count
    }

    /// Mean weakness of the returns.
    pub(in super::super) fn mean_weakness(&self) -> f64 {
        self.weakness / self.count
    }

    /// Mean of the points, m.
    pub(in super::super) fn mean(&self) -> Vector {
        Vector::from(self.sum) / self.count
    }

    /// Second central moment of the points, m^2.
    pub(in super::super) fn covariance(&self) -> Matrix {
        let mean = self.mean();
        let [xx, xy, xz, yy, yz, zz] = self.outer.map(|sum| sum / self.count);
        Matrix::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) - mean * mean.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn merged_moments_equal_the_moments_of_all_points() {
        // The definition: the mean, and the mean of (p - mean)(p - mean)^T over all points.
        let points: Vec<Vector> =
            (0..40).map(f64::from).map(|k| Vector::new((k * 0.7).sin(), (k * 1.3).cos(), 0.1 * k)).collect();
        let (mut first, mut second) = (Moments::default(), Moments::default());
        for (k, point) in points.iter().enumerate() {
            let beam =
                TimedReturn { tau_s: k as f64, point_in_imu: point.cast(), range_m: 1.0, weakness: (k * k) as f32 };
            if k % 3 == 0 { &mut first } else { &mut second }.add(point, &beam, 1e-4);
        }
        first.merge(&second);
        let mean = points.iter().sum::<Vector>() / 40.0;
        let expected = points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix>() / 40.0;
        assert_eq!(first.count(), 40.0);
        assert_relative_eq!(first.mean(), mean, epsilon = 1e-13);
        assert_relative_eq!(first.mean_time_s(), 19.5, epsilon = 1e-13);
        // The sum of the squares below 40 is 39 * 40 * 79 / 6.
        assert_relative_eq!(first.mean_weakness(), 39.0 * 79.0 / 6.0, epsilon = 1e-9);
        assert_relative_eq!(first.covariance(), expected, epsilon = 1e-12);
    }
}
