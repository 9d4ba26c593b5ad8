//! In which order to eliminate: little fill, and columns of one supernode next to each other.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::eigen::EigenError;
use crate::operator::Csr;

/// An elimination order with little fill: approximate minimum degree, then a postorder of the elimination tree, so that
/// columns of one supernode are neighbours. Result: position → row.
pub(crate) fn elimination_order(matrix: &Csr) -> Result<Vec<u32>, EigenError> {
    let n = matrix.rows();
    let out_of_memory = || EigenError::OutOfMemory { dofs: n };
    let start = starts(matrix).ok_or_else(out_of_memory)?;
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &matrix.columns);
    let (mut order, mut position) = (vec![0; n], vec![0; n]);
    let needed = amd::order_scratch::<u32>(n, matrix.columns.len());
    let mut scratch = MemBuffer::try_new(needed).map_err(|_| out_of_memory())?;
    amd::order(&mut order, &mut position, pattern, amd::Control::default(), MemStack::new(&mut scratch))
        .map_err(|_| out_of_memory())?;
    let parents = elimination_tree(matrix, &order, &position);
    Ok(postorder(&parents).iter().map(|&position| order[position as usize]).collect())
}

/// Where rows start, in the numbers that columns have; `None` if there are too many entries.
fn starts(matrix: &Csr) -> Option<Vec<u32>> {
    matrix.start.iter().map(|&start| start.try_into().ok()).collect()
}

/// B[i, j] = A[order[i], order[j]] of a symmetric A.
pub(crate) fn permuted(matrix: &Csr, order: &[u32]) -> Csr {
    let (mut position, mut start) = (vec![0; order.len()], vec![0]);
    for (new, &old) in order.iter().enumerate() {
        position[old as usize] = new;
        start.push(start[new] + matrix.start[old as usize + 1] - matrix.start[old as usize]);
    }
    let (mut columns, mut values) = (vec![0; matrix.columns.len()], vec![0.0; matrix.columns.len()]);
    let mut next = start.clone();
    // A's rows are its columns. Taken in order, they leave the rows of the result sorted.
    for (new, &old) in order.iter().enumerate() {
        for (row, value) in matrix.row(old as usize) {
            let at = &mut next[position[row]];
            (columns[*at], values[*at]) = (new as u32, value);
            *at += 1;
        }
    }
    Csr { start, columns, values }
}

const NONE: u32 = u32::MAX;

/// Parent of every column in the elimination tree, columns numbered by position (Liu 1986, with path compression).
fn elimination_tree(matrix: &Csr, order: &[u32], position: &[u32]) -> Vec<u32> {
    let (mut parent, mut ancestor) = (vec![NONE; order.len()], vec![NONE; order.len()]);
    for (k, &row) in order.iter().enumerate() {
        for (column, _) in matrix.row(row as usize) {
            let mut i = position[column] as usize;
            while i < k {
                let next = std::mem::replace(&mut ancestor[i], k as u32);
                if next == NONE {
                    parent[i] = k as u32;
                    break;
                }
                i = next as usize;
            }
        }
    }
    parent
}

/// Children before parents, the largest subtree last, next to its parent.
fn postorder(parent: &[u32]) -> Vec<u32> {
    let n = parent.len();
    // All trees hang from one more vertex, number n.
    let above = |i: usize| if parent[i] == NONE { n } else { parent[i] as usize };
    let (mut size, mut start) = (vec![1u32; n + 1], vec![0; n + 2]);
    for i in 0..n {
        start[above(i) + 1] += 1;
        size[above(i)] += size[i]; // parents come after their children
    }
    (0..=n).for_each(|i| start[i + 1] += start[i]);
    let (mut children, mut next) = (vec![0u32; n], start.clone());
    for i in 0..n {
        children[next[above(i)]] = i as u32;
        next[above(i)] += 1;
    }
    // A subtree ends at its root, and its children's end before that, one before the other.
    let (mut order, mut end) = (vec![0; n + 1], vec![n + 1; n + 1]);
    for i in (0..=n).rev() {
        let mut at = end[i] - 1;
        order[at] = i as u32;
        let below = &mut children[start[i]..start[i + 1]];
        below.sort_by_key(|&child| std::cmp::Reverse(size[child as usize]));
        for &child in &*below {
            end[child as usize] = at;
            at -= size[child as usize] as usize;
        }
    }
    order.pop();
    order
}
