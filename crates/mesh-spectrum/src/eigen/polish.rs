//! Takes rounding noise out of eigenvectors: a polynomial in A that is small at the upper end of the spectrum.
//!
//! A polynomial of degree d is d products with A, each of which would read the vectors and the matrix from memory. So
//! the rows are put in the levels of a breadth-first search, where a row's neighbours are in its own level or next to it,
//! and all products go through the levels together, each a level behind the one before: what they read is still in the
//! cache (wavefront blocking; Demmel, Hoemmen, Mohiyuddin and Yelick 2008 call it the matrix powers kernel).

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, WIDTH, ZERO};
use crate::eigen::kernel::{self, Kind, add_residual, prefetch, sparse_row};
use crate::eigen::order::permuted;
use crate::operator::Csr;

/// Where the part of the spectrum begins that polishing damps, as a share of ‖A‖; the least and the largest degree of
/// its polynomial.
const FROM: f64 = 0.125;
const DEGREE: [usize; 2] = [4, 12];

/// How far ahead of its use a row of the vectors is asked for, in row numbers.
const AHEAD: usize = 16;

/// A with its rows in the levels of a breadth-first search.
#[derive(Debug)]
pub(crate) struct Levels {
    matrix: Csr,
    /// Position → row of A.
    rows: Vec<u32>,
    /// The first position of each level, and the end.
    starts: Vec<usize>,
}

impl Levels {
    pub(crate) fn new(matrix: &Csr) -> Levels {
        // The row that a search from any row comes to last is far out; from there the levels are many and small.
        let far = search(matrix, 0).0.last().copied().unwrap_or(0);
        let (rows, starts) = search(matrix, far);
        Levels { matrix: permuted(matrix, &rows), rows, starts }
    }

    /// Bytes for a matrix.
    pub(crate) fn bytes(matrix: &Csr) -> usize {
        12 * matrix.columns.len() + 12 * matrix.rows()
    }
}

/// Rows in the order of a breadth-first search, and the starts of its levels.
fn search(matrix: &Csr, first: u32) -> (Vec<u32>, Vec<usize>) {
    let n = matrix.rows();
    let mut seen = vec![false; n];
    let (mut rows, mut starts) = (Vec::with_capacity(n), Vec::new());
    // A matrix that is not connected has several searches, one after another.
    for root in std::iter::once(first).chain(0..n as u32) {
        if rows.len() == n || seen[root as usize] {
            continue;
        }
        seen[root as usize] = true;
        let mut level = rows.len();
        rows.push(root);
        while level < rows.len() {
            starts.push(level);
            let end = rows.len();
            for at in level..end {
                for (column, _) in matrix.row(rows[at] as usize) {
                    if !std::mem::replace(&mut seen[column], true) {
                        rows.push(column as u32);
                    }
                }
            }
            level = end;
        }
    }
    starts.push(n);
    (rows, starts)
}

/// x ← T_d(t(A)) x / T_d(t(λ)) for the eight columns of a block, with the Chebyshev polynomial T_d, t mapping
/// [‖A‖/8, ‖A‖] to [−1, 1]: damps the rounding noise at the upper end of the spectrum, which the residual multiplies by
/// ‖A‖/λ_K, and leaves the pair alone. The degree is what divides the noise by `excess`. Result: ‖A x − λ x‖ of each.
pub(crate) fn polish(
    kind: Kind,
    levels: &Levels,
    norm: f64,
    eigenvalues: &Row,
    excess: f64,
    block: &mut [Row],
    [x, y]: [&mut [Row]; 2],
) -> Row {
    let n = levels.rows.len();
    let (centre, half) = (norm * (1.0 + FROM) / 2.0, norm * (1.0 - FROM) / 2.0);
    // |T_d| outside [−1, 1] is the hyperbolic cosine of d times that of T_1's inverse.
    let outside = ((1.0 + FROM) / (1.0 - FROM)).acosh();
    let degree = ((excess.acosh() / outside).ceil() as usize).clamp(DEGREE[0], DEGREE[1]);
    for (at, to) in x[..n].iter_mut().enumerate() {
        if let Some(&later) = levels.rows.get(at + AHEAD) {
            prefetch(block, later as usize);
        }
        *to = block[levels.rows[at] as usize];
    }
    let mut squares = ZERO;
    let buffers = [&mut x[..n], &mut y[..n]];
    kernel::chebyshev(kind, levels, degree, [1.0 / half, centre / half], buffers, eigenvalues, &mut squares);
    let result = if degree.is_multiple_of(2) { x } else { y };
    let scale = eigenvalues.map(|eigenvalue| {
        let t = (eigenvalue - centre) / half;
        let (mut before, mut value) = (1.0, t);
        for _ in 1..degree {
            (before, value) = (value, 2.0 * t * value - before);
        }
        1.0 / value
    });
    for (from, &row) in result.iter().zip(&levels.rows) {
        let row = &mut block[row as usize];
        for k in 0..WIDTH {
            row[k] = from[k] * scale[k];
        }
    }
    std::array::from_fn(|k| squares[k].sqrt() * scale[k].abs())
}

/// The buffers, of which the first holds x, become T_d(s A − c) x and T_{d−1}(s A − c) x for [s, c], the even degree in the
/// first; `squares[k]` becomes ‖A z_k − λ_k z_k‖² of the higher degree, z.
#[inline(always)]
pub(crate) fn chebyshev_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    levels: &Levels,
    degree: usize,
    [scale, centre]: [f64; 2],
    mut buffers: [&mut [Row]; 2],
    eigenvalues: &Row,
    squares: &mut Row,
) {
    let count = levels.starts.len() - 1;
    *squares = ZERO;
    for time in 0..count + degree {
        for power in 1..=degree {
            let Some(level) = (time + 1).checked_sub(power).filter(|&level| level < count) else { continue };
            let [even, odd] = &mut buffers;
            let (from, to) = if power % 2 == 1 { (&**even, &mut **odd) } else { (&**odd, &mut **even) };
            for i in levels.starts[level]..levels.starts[level + 1] {
                let product = sparse_row::<A>(&levels.matrix, i, from);
                for k in 0..WIDTH {
                    // T_1 = t; T_{d+1} = 2 t T_d − T_{d−1}, in place of T_{d−1}.
                    let t = A::fma(scale, product[k], -centre * from[i][k]);
                    to[i][k] = if power == 1 { t } else { A::fma(2.0, t, -to[i][k]) };
                }
            }
        }
        let Some(level) = time.checked_sub(degree) else { continue };
        let z = &buffers[degree % 2];
        for i in levels.starts[level]..levels.starts[level + 1] {
            add_residual::<A>(&levels.matrix, i, z, eigenvalues, squares);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::kernel::tests::block;

    /// Neighbours i and j of a ring of `n` rows and a shorter one, with chords: two components, levels of several rows.
    fn rings(n: usize) -> Csr {
        let mut rows = vec![Vec::new(); n];
        for (first, size) in [(0, n - 7), (n - 7, 7)] {
            for i in 0..size {
                for step in [1, 3] {
                    let j = (i + step) % size;
                    rows[first + i].push((first + j, -1.0 / step as f64));
                    rows[first + j].push((first + i, -1.0 / step as f64));
                }
                rows[first + i].push((first + i, 2.7));
            }
        }
        let mut matrix = Csr { start: vec![0], columns: Vec::new(), values: Vec::new() };
        for row in &mut rows {
            row.sort_by_key(|entry| entry.0);
            matrix.columns.extend(row.iter().map(|entry| entry.0 as u32));
            matrix.values.extend(row.iter().map(|entry| entry.1));
            matrix.start.push(matrix.columns.len());
        }
        matrix
    }

    #[test]
    fn levels_hold_every_row_once_and_neighbours_are_next_to_each_other() {
        let matrix = rings(60);
        let levels = Levels::new(&matrix);
        let mut rows = levels.rows.clone();
        rows.sort_unstable();
        assert_eq!(rows, (0..60).collect::<Vec<u32>>());
        let level = |at: usize| levels.starts.partition_point(|&start| start <= at);
        for i in 0..60 {
            assert!(levels.matrix.row(i).all(|(j, _)| level(i).abs_diff(level(j)) <= 1));
        }
    }

    #[test]
    fn the_polynomial_is_that_of_its_recurrence() {
        let (n, matrix) = (60, rings(60));
        let levels = Levels::new(&matrix);
        let start = block(n, 1);
        let eigenvalues: Row = std::array::from_fn(|k| 0.1 * k as f64);
        let (norm, excess) = (6.0, 200.0);
        let (centre, half) = (norm * (1.0 + FROM) / 2.0, norm * (1.0 - FROM) / 2.0);
        for kind in [Kind::Portable, Kind::best()] {
            let (mut z, mut x, mut y) = (start.clone(), vec![ZERO; n], vec![ZERO; n]);
            let residuals = polish(kind, &levels, norm, &eigenvalues, excess, &mut z, [&mut x, &mut y]);
            let degree = (excess.acosh() / ((1.0 + FROM) / (1.0 - FROM)).acosh()).ceil() as usize;
            assert!((DEGREE[0]..DEGREE[1]).contains(&degree));
            for k in 0..WIDTH {
                let (mut before, mut now): (Vec<f64>, Vec<f64>) =
                    (vec![0.0; n], start.iter().map(|row| row[k]).collect());
                let (mut t_before, mut t_now) = (0.0, 1.0);
                for power in 1..=degree {
                    let factor = if power == 1 { 1.0 } else { 2.0 };
                    let product = matrix.times(&now);
                    let next = (0..n).map(|i| factor * (product[i] - centre * now[i]) / half - before[i]).collect();
                    before = std::mem::replace(&mut now, next);
                    (t_before, t_now) = (t_now, factor * (eigenvalues[k] - centre) / half * t_now - t_before);
                    if power == 1 {
                        before = start.iter().map(|row| row[k]).collect();
                    }
                }
                let size = now.iter().fold(0.0f64, |most, x| most.max((x / t_now).abs()));
                for i in 0..n {
                    assert!((z[i][k] - now[i] / t_now).abs() <= 1e-13 * size, "rounding of {degree} steps");
                }
                let column: Vec<f64> = z.iter().map(|row| row[k]).collect();
                let product = matrix.times(&column);
                let residual = (0..n).map(|i| (product[i] - eigenvalues[k] * column[i]).powi(2)).sum::<f64>().sqrt();
                assert!((residual / residuals[k] - 1.0).abs() < 1e-12, "two orders of summation");
            }
        }
    }
}
