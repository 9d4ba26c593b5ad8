//! Eigenvectors on vertices, one after another, from blocks in elimination order.
//!
//! They are as large as everything else together, so where there is one component the blocks are turned into rows in
//! the memory they are in. It has room for some blocks in front of the first one, so that the rows of as many blocks end
//! before the first of these starts.

use rayon::prelude::*;

use crate::eigen::block::{Block, Row, WIDTH, ZERO};
use crate::eigen::component::{Component, Pairs};
use crate::eigen::finish::Evidence;
use crate::eigen::kernel::prefetch;
use crate::operator::Operator;

/// Blocks that are turned into rows together.
const TOGETHER: usize = 4;

/// How many vertices ahead of its use a row is asked for.
const AHEAD: usize = 16;

/// A vertex, its row in the component, and 1 / √mass.
type Place = (u32, u32, f64);

/// Blocks of `n` rows that [`eigenvectors`] can turn into its result where they are.
pub(crate) fn blocks(n: usize, count: usize) -> Block {
    Block::behind(n * TOGETHER, n * count)
}

/// K × N, row-major, φ = M^-½ v with its sign fixed, in the given order of (component, number of the pair).
pub(crate) fn eigenvectors(
    operator: &Operator,
    components: &[Component],
    mut solved: Vec<Pairs>,
    evidence: &[Evidence],
    order: &[(usize, usize)],
) -> Vec<f64> {
    let vertices = operator.vertex_mass.len();
    let mut row_of_dof = vec![0u32; operator.mass.len()];
    for component in components {
        component.dofs.iter().enumerate().for_each(|(row, &dof)| row_of_dof[dof as usize] = row as u32);
    }
    let mut vertices_of: Vec<Vec<Place>> = vec![Vec::new(); components.len()];
    for (vertex, &dof) in operator.dof_of_vertex.iter().enumerate() {
        let (number, row) = (operator.component_of_dof[dof as usize] as usize, row_of_dof[dof as usize]);
        vertices_of[number].push((vertex as u32, row, 1.0 / components[number].root_mass[row as usize]));
    }
    if let ([pairs], [evidence]) = (&mut solved[..], evidence)
        && operator.mass.len() == vertices
    {
        let vectors = std::mem::replace(&mut pairs.vectors, Block::zeros(0));
        return in_place(vectors, &pairs.places, &evidence.scales, &vertices_of[0]);
    }
    let mut result = vec![0.0; order.len() * vertices];
    let mut rows_of: Vec<Vec<&mut [f64]>> = components.iter().map(|_| Vec::new()).collect();
    for (row, &(number, _)) in result.chunks_exact_mut(vertices).zip(order) {
        rows_of[number].push(row); // the pairs of a component are in ascending order there too
    }
    for (number, rows) in rows_of.into_iter().enumerate() {
        let n = components[number].rows();
        let Pairs { vectors, places, .. } = &solved[number];
        let blocks: Vec<&[Row]> = vectors.chunks_exact(n).collect();
        write(&blocks, 0, places, &evidence[number].scales, &vertices_of[number], rows);
        solved[number].vectors = Block::zeros(0);
    }
    result
}

/// Turns the blocks of one component, made by [`blocks`], into rows, in the same memory.
fn in_place(vectors: Block, places: &[usize], scales: &[f64], vertices: &[Place]) -> Vec<f64> {
    let n = vertices.len();
    let (mut memory, offset) = vectors.into_memory();
    let mut done = 0;
    while let Some(&place) = places.get(done) {
        let first = place / WIDTH;
        let end = done + places[done..].iter().take_while(|&&place| place / WIDTH < first + TOGETHER).count();
        // Pairs come no later than their places, so that rows end at 8 (first + TOGETHER) n at most: where block `first` is.
        let (rows, blocks) = memory.split_at_mut(offset + WIDTH * first * n);
        let blocks: Vec<&[Row]> = blocks.as_chunks().0.chunks(n).take(TOGETHER).collect();
        let rows = rows[done * n..end * n].chunks_exact_mut(n).collect();
        write(&blocks, first, &places[done..end], &scales[done..end], vertices, rows);
        done = end;
    }
    memory.truncate(places.len() * n);
    memory.shrink_to_fit();
    memory
}

/// Writes one row for every place in the blocks, of which the first one given has the number `first`.
fn write(
    blocks: &[&[Row]],
    first: usize,
    places: &[usize],
    scales: &[f64],
    vertices: &[Place],
    mut rows: Vec<&mut [f64]>,
) {
    let mut jobs = Vec::new();
    let mut rest = &mut rows[..];
    let mut done = 0;
    for same in places.chunk_by(|a, b| a / WIDTH == b / WIDTH) {
        let (own, after) = rest.split_at_mut(same.len());
        jobs.push((blocks[same[0] / WIDTH - first], same, &scales[done..done + same.len()], own));
        rest = after;
        done += same.len();
    }
    jobs.into_par_iter().for_each(|(block, places, scales, rows)| {
        for (i, &(vertex, row, inverse)) in vertices.iter().enumerate() {
            if let Some(later) = vertices.get(i + AHEAD) {
                prefetch(block, later.1 as usize);
            }
            let values = &block[row as usize];
            for ((phi, place), scale) in rows.iter_mut().zip(places).zip(scales) {
                phi[vertex as usize] = values[place % WIDTH] * (scale * inverse);
            }
        }
        rows.iter_mut().for_each(|phi| fix_sign(phi));
    });
}

/// Makes the entry of largest magnitude positive; among those within 1e-3 of it, the first.
pub(crate) fn fix_sign(phi: &mut [f64]) {
    let (eights, rest) = phi.as_chunks::<WIDTH>();
    let mut most = ZERO; // of eight columns at once: one comparison would wait for the one before
    for eight in eights {
        (0..WIDTH).for_each(|k| most[k] = if eight[k].abs() > most[k] { eight[k].abs() } else { most[k] });
    }
    let most = most.iter().chain(rest).fold(0.0f64, |most, x| most.max(x.abs()));
    let decides = phi.iter().find(|x| x.abs() >= (1.0 - 1e-3) * most);
    if decides.is_some_and(|x| *x < 0.0) {
        phi.iter_mut().for_each(|x| *x = 0.0 - *x); // 0 stays 0, not −0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sign_is_decided_by_the_lowest_of_nearly_equal_entries() {
        let mut phi = [0.0, -1.0, 1.0 + 1e-12];
        fix_sign(&mut phi);
        assert_eq!(phi[1], 1.0);
        assert_eq!(phi[0].to_bits(), 0, "zero keeps its sign");
    }
}
