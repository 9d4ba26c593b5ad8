//! Blocks of eight vectors, where they are kept, and the small matrices that couple them.
//!
//! A block is n × 8, row-major: the eight vectors' values at one degree of freedom are one row of 64 bytes, a cache
//! line. So a sparse solve loads its indices and its matrix once for eight right-hand sides.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

use crate::eigen::pages;

/// Vectors in a block. A wider block solves faster per vector and converges slower; 8 and 4 tie, 16 loses.
pub(crate) const WIDTH: usize = 8;

/// The values of a block's vectors at one degree of freedom.
pub(crate) type Row = [f64; WIDTH];

/// An 8 × 8 matrix, row-major.
pub(crate) type Small = [[f64; WIDTH]; WIDTH];

pub(crate) const ZERO: Row = [0.0; WIDTH];
pub(crate) const SMALL_ZERO: Small = [[0.0; WIDTH]; WIDTH];

/// Rows that start at a cache line. Dereferences to `[Row]`.
#[derive(Debug)]
pub(crate) struct Block {
    memory: Vec<f64>,
    /// Entries before the first row, which starts a cache line.
    offset: usize,
    rows: usize,
}

impl Block {
    /// So many rows of zeros.
    pub(crate) fn zeros(rows: usize) -> Block {
        Block::aligned(0, rows, 64)
    }

    /// The same, behind so many other rows that are not its own.
    pub(crate) fn behind(others: usize, rows: usize) -> Block {
        Block::aligned(others, rows, 64)
    }

    /// The same, for memory that is gone through again and again: in large pages, if it is large.
    pub(crate) fn lasting(rows: usize) -> Block {
        let page = pages::large(size_of::<Row>() * rows);
        if page == 0 {
            return Block::zeros(rows);
        }
        let block = Block::aligned(0, rows, page);
        pages::advise(&block.memory[..block.offset + WIDTH * rows], block.offset);
        block
    }

    fn aligned(others: usize, rows: usize, bytes: usize) -> Block {
        let most = bytes / size_of::<f64>() - 1;
        let memory = vec![0.0; (others + rows) * WIDTH + most];
        // Where the allocator gives no way to align, the block works all the same, a little slower.
        let offset = memory.as_ptr().align_offset(bytes).min(most) + others * WIDTH;
        Block { memory, offset, rows }
    }

    /// All entries, and how many of them come before the first row.
    pub(crate) fn into_memory(self) -> (Vec<f64>, usize) {
        (self.memory, self.offset)
    }
}

impl Deref for Block {
    type Target = [Row];
    fn deref(&self) -> &[Row] {
        self.memory[self.offset..][..self.rows * WIDTH].as_chunks().0
    }
}

impl DerefMut for Block {
    fn deref_mut(&mut self) -> &mut [Row] {
        self.memory[self.offset..][..self.rows * WIDTH].as_chunks_mut().0
    }
}

/// Blocks that are not in use, all of one length. Memory touched for the first time costs more than what it is then
/// used for, so blocks go from slice to slice. Their contents are whatever was left there.
#[derive(Debug, Default)]
pub(crate) struct Pool {
    free: Mutex<Vec<Block>>,
}

impl Pool {
    pub(crate) fn take(&self, rows: usize) -> Block {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| {
            let mut fresh = Block::zeros(rows);
            pages::touch(&mut fresh);
            fresh
        })
    }

    pub(crate) fn give(&self, blocks: impl IntoIterator<Item = Block>) {
        self.free.lock().unwrap_or_else(PoisonError::into_inner).extend(blocks);
    }
}

pub(crate) fn transpose(a: &Small) -> Small {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

pub(crate) fn negative(a: &Small) -> Small {
    a.map(|row| row.map(|x| -x))
}

/// The largest magnitude.
pub(crate) fn largest(all: &[Small]) -> f64 {
    all.as_flattened().as_flattened().iter().fold(0.0, |most, x| x.abs().max(most))
}

/// A += B.
#[inline(always)]
pub(crate) fn add(a: &mut Small, b: &Small) {
    for i in 0..WIDTH {
        for j in 0..WIDTH {
            a[i][j] += b[i][j];
        }
    }
}

/// A B.
pub(crate) fn product(a: &Small, b: &Small) -> Small {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..WIDTH).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Upper triangular R with Rᵀ R = G, and R⁻¹; `None` if a column is dependent on those before it to 13 digits.
pub(crate) fn cholesky(g: &Small) -> Option<(Small, Small)> {
    let mut r = SMALL_ZERO;
    for i in 0..WIDTH {
        for j in i..WIDTH {
            let rest = g[i][j] - (0..i).map(|k| r[k][i] * r[k][j]).sum::<f64>();
            if i < j {
                r[i][j] = rest / r[i][i];
            } else if rest > 1e-13 * g[i][i] && rest.is_normal() {
                r[i][i] = rest.sqrt();
            } else {
                return None;
            }
        }
    }
    Some((r, inverse_of_upper(&r)))
}

/// R⁻¹ of an upper triangular R.
pub(crate) fn inverse_of_upper(r: &Small) -> Small {
    let mut inverse = SMALL_ZERO;
    for j in 0..WIDTH {
        inverse[j][j] = 1.0 / r[j][j];
        for i in (0..j).rev() {
            inverse[i][j] = -(i + 1..=j).map(|k| r[i][k] * inverse[k][j]).sum::<f64>() / r[i][i];
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::kernel::Kind;
    use crate::eigen::kernel::tests::block;
    use crate::eigen::parts::gram_of;

    #[test]
    fn cholesky_gives_a_factor_and_its_inverse() {
        let w = block(100, 4);
        let g = gram_of(Kind::best(), &w, &w);
        let (r, inverse) = cholesky(&g).unwrap();
        for (i, row) in product(&transpose(&r), &r).iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                assert!((entry - g[i][j]).abs() < 1e-14, "rounding of entries below 10");
                assert!((product(&r, &inverse)[i][j] - f64::from(i == j)).abs() < 1e-13);
            }
        }
        let mut twice = w;
        twice.iter_mut().for_each(|row| row[6] = 2.0 * row[1]);
        assert!(cholesky(&gram_of(Kind::best(), &twice, &twice)).is_none(), "a dependent column");
    }

    #[test]
    fn blocks_start_at_a_cache_line() {
        for rows in [1, 5, 100, 10_000, 100_000] {
            for block in [Block::zeros(rows), Block::lasting(rows)] {
                assert_eq!((block.len(), block.as_ptr().addr() % 64), (rows, 0));
                assert!(block.iter().all(|row| *row == ZERO));
            }
        }
    }
}
