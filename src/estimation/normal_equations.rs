//! Normal equations of a window, and their solution.
//!
//! Unknowns are ordered knots first, in time, then the dense border (biases, gravity, clock). Stored is the lower triangle
//! by rows with each row's envelope: from its first non-zero column to the diagonal. Cholesky fills nothing outside the
//! envelope (George and Liu 1981), so a band costs a band's work, a dense border its own rows, and a window whose matches
//! link all times with all others the full triangle, by the same code.

/// `H x = b`, with `H` symmetric and positive definite.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations {
    size: usize,
    /// First column of each row that is not zero.
    first: Vec<usize>,
    /// Lower triangle, row-major over the full square; the upper part is not used.
    h: Vec<f64>,
    b: Vec<f64>,
}

/// The factor `H = L L^T`.
#[derive(Debug, Clone, Default)]
pub(super) struct Factor {
    size: usize,
    first: Vec<usize>,
    l: Vec<f64>,
}

/// The matrix is not positive definite: the unknown of this index is not determined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NotDetermined(pub(super) usize);

/// Part of a row of the Jacobian: consecutive entries from a column on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment<'a> {
    pub(super) start: usize,
    pub(super) values: &'a [f64],
}

impl NormalEquations {
    /// Empty equations of `size` unknowns.
    pub(super) fn new(size: usize) -> Self {
        Self { size, first: (0..size).collect(), h: vec![0.0; size * size], b: vec![0.0; size] }
    }

    /// Empties them, for `size` unknowns.
    pub(super) fn reset(&mut self, size: usize) {
        self.size = size;
        self.first.clear();
        self.first.extend(0..size);
        self.h.clear();
        self.h.resize(size * size, 0.0);
        self.b.clear();
        self.b.resize(size, 0.0);
    }

    /// Becomes a copy of `other`.
    pub(super) fn copy_from(&mut self, other: &Self) {
        self.size = other.size;
        self.first.clone_from(&other.first);
        self.h.clone_from(&other.h);
        self.b.clone_from(&other.b);
    }

    /// Adds `other`, of the same size.
    pub(super) fn add(&mut self, other: &Self) {
        for (row, (first, others)) in self.first.iter_mut().zip(&other.first).enumerate() {
            *first = (*first).min(*others);
            let span = row * self.size + *others..=row * self.size + row;
            for (sum, term) in self.h[span.clone()].iter_mut().zip(&other.h[span]) {
                *sum += term;
            }
        }
        for (sum, term) in self.b.iter_mut().zip(&other.b) {
            *sum += term;
        }
    }

    /// Adds `value` to `H` at (`row`, `column`) and, by symmetry, (`column`, `row`).
    pub(super) fn add_entry(&mut self, row: usize, column: usize, value: f64) {
        let (row, column) = (row.max(column), row.min(column));
        self.first[row] = self.first[row].min(column);
        self.h[row * self.size + column] += value;
    }

    /// Adds `value` to the right-hand side.
    pub(super) fn add_right(&mut self, row: usize, value: f64) {
        self.b[row] += value;
    }

    /// Adds a scalar residual `r + J x` with `weight`: `weight J^T J` and `-weight r J^T`. Segments in order of columns,
    /// without overlap.
    pub(super) fn add_row(&mut self, segments: &[Segment<'_>], residual: f64, weight: f64) {
        for (k, rows) in segments.iter().enumerate() {
            for (r, value) in rows.values.iter().enumerate() {
                let row = rows.start + r;
                let scaled = weight * value;
                self.b[row] -= scaled * residual;
                if let Some(leading) = segments.first() {
                    self.first[row] = self.first[row].min(leading.start);
                }
                let line = &mut self.h[row * self.size..=row * self.size + row];
                for columns in &segments[..k] {
                    axpy(&mut line[columns.start..columns.start + columns.values.len()], columns.values, scaled);
                }
                axpy(&mut line[rows.start..], &rows.values[..=r], scaled);
            }
        }
    }

    /// Factors `H` into `into`, whose memory is used again.
    ///
    /// # Errors
    /// When an unknown is not determined.
    pub(super) fn factor(&self, into: &mut Factor) -> Result<(), NotDetermined> {
        let n = self.size;
        into.size = n;
        into.first.clone_from(&self.first);
        into.l.clone_from(&self.h);
        for i in 0..n {
            let from = into.first[i];
            let (above, row) = into.l.split_at_mut(i * n);
            for j in from..i {
                let common = from.max(into.first[j]);
                let other = &above[j * n..=j * n + j];
                let sum = row[j] - dot(&row[common..j], &other[common..j]);
                row[j] = sum / other[j];
            }
            let pivot = row[i] - dot(&row[from..i], &row[from..i]);
            if pivot.is_nan() || pivot <= 1e-14 * row[i].max(f64::MIN_POSITIVE) {
                return Err(NotDetermined(i));
            }
            row[i] = pivot.sqrt();
        }
        Ok(())
    }

    /// The solution, by a factor of these equations.
    pub(super) fn solve(&self, factor: &Factor) -> Vec<f64> {
        let n = self.size;
        let mut x = self.b.clone();
        for i in 0..n {
            let row = factor.row(i);
            x[i] = (x[i] - dot(&row[factor.first[i]..i], &x[factor.first[i]..i])) / row[i];
        }
        for i in (0..n).rev() {
            let row = factor.row(i);
            x[i] /= row[i];
            let (scale, from) = (-x[i], factor.first[i]);
            axpy(&mut x[from..i], &row[from..i], scale);
        }
        x
    }
}

impl Factor {
    fn row(&self, i: usize) -> &[f64] {
        &self.l[i * self.size..=i * self.size + i]
    }

    /// The information that is left about the last `N` unknowns when all others are solved for: `L_bb L_bb^T`.
    pub(super) fn information_of_last<const N: usize>(&self) -> nalgebra::SMatrix<f64, N, N> {
        let from = self.size - N;
        let block =
            nalgebra::SMatrix::<f64, N, N>::from_fn(|r, c| if c <= r { self.row(from + r)[from + c] } else { 0.0 });
        block * block.transpose()
    }
}

#[cfg(test)]
impl NormalEquations {
    /// The whole of `H`, for comparison.
    pub(super) fn dense(&self) -> nalgebra::DMatrix<f64> {
        let n = self.size;
        nalgebra::DMatrix::from_fn(n, n, |r, c| self.h[r.max(c) * n + r.min(c)])
    }

    /// The right-hand side, for comparison.
    pub(super) fn right(&self) -> nalgebra::DVector<f64> {
        nalgebra::DVector::from_column_slice(&self.b)
    }
}

fn axpy(into: &mut [f64], from: &[f64], scale: f64) {
    for (sum, term) in into.iter_mut().zip(from) {
        *sum += scale * term;
    }
}

/// A dot product in four lanes: the order of its sums is fixed, and vector units can take it.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for lane in 0..4 {
            lanes[lane] += x[lane] * y[lane];
        }
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::{DMatrix, DVector};

    /// Segments (start, values) of a row of the Jacobian, and its residual.
    type Row = (Vec<(usize, Vec<f64>)>, f64);

    /// A band of residuals over 20 unknowns and a dense border of 3, with a few links between far unknowns.
    fn rows() -> Vec<Row> {
        let mut rows = Vec::new();
        for k in 0..60_usize {
            let start = k % 18;
            let wave = |m: usize| ((k * k * 3 + m * m * 5 + k * m * 11) as f64 * 0.37).sin();
            let near = (start, (0..3).map(wave).collect());
            let border = (20, (3..6).map(wave).collect());
            let far = (k % 10 == 0 && start < 12).then(|| (start + 5, vec![wave(7), wave(8)]));
            rows.push((std::iter::once(near).chain(far).chain([border]).collect(), wave(9)));
        }
        rows
    }

    #[test]
    fn the_solution_is_that_of_dense_cholesky() {
        let mut equations = NormalEquations::new(23);
        let mut dense = DMatrix::<f64>::zeros(23, 23);
        let mut right = DVector::<f64>::zeros(23);
        for (row, residual) in rows() {
            let segments: Vec<Segment<'_>> =
                row.iter().map(|(start, values)| Segment { start: *start, values }).collect();
            equations.add_row(&segments, residual, 0.7);
            let mut j = DVector::<f64>::zeros(23);
            for (start, values) in &row {
                j.rows_mut(*start, values.len()).copy_from_slice(values);
            }
            dense += &j * j.transpose() * 0.7;
            right -= &j * (residual * 0.7);
        }
        let mut factor = Factor::default();
        equations.factor(&mut factor).unwrap();
        let x = DVector::from_vec(equations.solve(&factor));
        assert_relative_eq!(x, dense.clone().cholesky().unwrap().solve(&right), epsilon = 1e-9);
        // The border's information is the inverse of its block of the inverse.
        let covariance = dense.try_inverse().unwrap().view((20, 20), (3, 3)).into_owned();
        let information = factor.information_of_last::<3>();
        let back = information.try_inverse().unwrap();
        for r in 0..3 {
            for c in 0..3 {
                assert_relative_eq!(back[(r, c)], covariance[(r, c)], epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn parts_add_up_to_the_whole() {
        let mut whole = NormalEquations::new(23);
        let mut parts = [NormalEquations::new(23), NormalEquations::new(23)];
        for (k, (row, residual)) in rows().into_iter().enumerate() {
            let segments: Vec<Segment<'_>> =
                row.iter().map(|(start, values)| Segment { start: *start, values }).collect();
            whole.add_row(&segments, residual, 1.0);
            parts[k % 2].add_row(&segments, residual, 1.0);
        }
        let [mut sum, second] = parts;
        sum.add(&second);
        let (mut a, mut b) = (Factor::default(), Factor::default());
        whole.factor(&mut a).unwrap();
        sum.factor(&mut b).unwrap();
        for (x, y) in whole.solve(&a).iter().zip(sum.solve(&b)) {
            assert_relative_eq!(*x, y, epsilon = 1e-9);
        }
    }

    #[test]
    fn an_unknown_that_nothing_measures_is_named() {
        let mut equations = NormalEquations::new(3);
        equations.add_row(&[Segment { start: 0, values: &[1.0, 0.5] }], 0.1, 1.0);
        equations.add_entry(1, 1, 1.0);
        assert_eq!(equations.factor(&mut Factor::default()), Err(NotDetermined(2)));
    }
}
