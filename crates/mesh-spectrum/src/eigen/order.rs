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
    let columns: Vec<usize> = matrix.columns.iter().map(|&column| column as usize).collect();
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &matrix.start, None, &columns);
    let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
    let out_of_memory = || EigenError::OutOfMemory { dofs: n };
    let mut scratch = MemBuffer::try_new(amd::order_scratch::<usize>(n, columns.len())).map_err(|_| out_of_memory())?;
    amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut scratch))
        .map_err(|_| out_of_memory())?;
    let order: Vec<u32> = order.iter().map(|&row| row as u32).collect();
    let parents = elimination_tree(&permuted(matrix, &order));
    Ok(postorder(&parents).iter().map(|&position| order[position as usize]).collect())
}

/// B[i, j] = A[order[i], order[j]].
pub(crate) fn permuted(matrix: &Csr, order: &[u32]) -> Csr {
    let mut position = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        position[old as usize] = new as u32;
    }
    let mut result = Csr {
        start: vec![0],
        columns: Vec::with_capacity(matrix.columns.len()),
        values: Vec::with_capacity(matrix.values.len()),
    };
    for &old in order {
        let mut row: Vec<(u32, f64)> =
            matrix.row(old as usize).map(|(column, value)| (position[column], value)).collect();
        row.sort_unstable_by_key(|entry| entry.0);
        result.columns.extend(row.iter().map(|entry| entry.0));
        result.values.extend(row.iter().map(|entry| entry.1));
        result.start.push(result.columns.len());
    }
    result
}

const NONE: u32 = u32::MAX;

/// Parent of every column in the elimination tree (Liu 1986, with path compression).
fn elimination_tree(matrix: &Csr) -> Vec<u32> {
    let n = matrix.rows();
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for k in 0..n {
        for (mut i, _) in matrix.row(k).take_while(|&(column, _)| column < k) {
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
    let mut size = vec![1u32; n];
    let mut children = vec![Vec::new(); n];
    let mut stack = Vec::new();
    for i in 0..n {
        match parent[i] {
            NONE => stack.push((i as u32, false)),
            p => {
                size[p as usize] += size[i]; // parents come after their children
                children[p as usize].push(i as u32);
            }
        }
    }
    let mut order = Vec::with_capacity(n);
    while let Some((node, visited)) = stack.pop() {
        if visited {
            order.push(node);
            continue;
        }
        stack.push((node, true));
        let mut below = std::mem::take(&mut children[node as usize]);
        below.sort_by_key(|&child| std::cmp::Reverse(size[child as usize]));
        stack.extend(below.into_iter().map(|child| (child, false)));
    }
    order
}
