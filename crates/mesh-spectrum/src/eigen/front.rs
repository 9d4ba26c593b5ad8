//! The numbers of L D Lᵀ: the multifrontal method (Duff and Reid 1983; Liu 1992), without pivoting.
//!
//! Each supernode has a front, a dense symmetric matrix over its columns and the rows below them. It starts with the
//! entries of A − σI in the columns and with what the supernode's children left (their *updates*, added where their
//! rows are in this front); then its columns are eliminated, and what that leaves of the rest is its own update.
//!
//! Only the columns of a front are put together before they are eliminated, in a *panel*. The rest of it is what the
//! columns take off, which is written where the update belongs, and the children's updates are added to that: so nothing
//! is filled with zeros or copied but the panel. As children come before parents, updates live on a stack, or rather on
//! two, one for every other level of the tree, so that an update can be written while the children's are still there.
//!
//! Two parts of the tree that owe each other nothing are factored at the same time, if there is a thread for it, and then
//! the rest, which is what both leave their updates to.
//!
//! Panels and updates are column-major, of updates only the lower triangle is used. The columns take the first places of
//! a panel, filled up to a multiple of eight, so that the rows below start at a cache line and products run over whole
//! tiles of 8 × 8. Eliminated columns go straight to where the solve wants them, eight rows of a column together, which
//! is also what products want.

mod eliminate;

use std::ops::Range;

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, WIDTH, ZERO};
use crate::eigen::factor::Pivots;
use crate::eigen::kernel::{self, Kind};
use crate::eigen::solve::{Layout, Packed, Supernode};
use crate::operator::Csr;

use self::eliminate::{eliminate, make_update, row, row_mut};

/// Fronts of more rows than this are refused: places in them are 32-bit numbers, and they take 30 GB.
const ROWS_MAX: usize = 65_000;

/// The place in its parent's front of what fills up a group of rows.
const NOWHERE: u32 = u32::MAX;

/// Which supernode leaves its update to which, and where everything goes.
pub(crate) struct Tree {
    /// The place in the panel of every stored entry of A in the lower triangle, as the entries come; and its diagonal
    /// entries among all.
    places: Vec<u32>,
    diagonal: Vec<usize>,
    /// Where each row below a supernode is in the front of its parent; numbered as `Layout::rows`.
    in_parent: Vec<u32>,
    /// Where groups of eight rows whose neighbours are neighbours there, too, start there; or `NOWHERE`.
    groups_in_parent: Vec<u32>,
    fronts: Vec<Front>,
    /// Children of all supernodes, one's after another's.
    children: Vec<u32>,
    /// Supernodes below the first number and from there to the second owe each other nothing.
    ends: [usize; 2],
    /// What the second of these needs, and what all the others.
    bench_max: [BenchSize; 2],
    /// Where the second of these starts on the stacks, and how large they are.
    stack_from: [usize; 2],
    stack_max: [usize; 2],
}

/// What there is to know of a supernode's front beside its size.
#[derive(Debug, Clone, Copy, Default)]
struct Front {
    /// Where its children start in the list of all.
    children: usize,
    /// Which stack its update is on, and where.
    stack: usize,
    at: usize,
    /// How many of its rows below are columns of its parent, and how many there are.
    shared: usize,
    rows: usize,
}

/// What a factorisation needs beside its result.
pub(crate) struct Workspace {
    /// As in [`Tree::bench_max`].
    benches: [Bench; 2],
    stacks: [Vec<f64>; 2],
}

/// Where one thread eliminates.
struct Bench {
    panel: Vec<f64>,
    /// −D times the columns of a supernode, as they are stored there.
    minus: Vec<Row>,
}

#[derive(Debug, Clone, Copy, Default)]
struct BenchSize {
    panel: usize,
    columns: usize,
}

/// Supernodes next to each other, and what factoring them writes to.
pub(crate) struct Share<'a> {
    supernodes: Range<usize>,
    /// Their columns of L, and D⁻¹.
    columns: &'a mut [Row],
    inverse: &'a mut [f64],
    /// The stacks from certain places on.
    stacks: [&'a mut [f64]; 2],
    stack_from: [usize; 2],
    bench: &'a mut Bench,
}

impl Supernode {
    /// Places that the columns take in the front.
    fn head(&self) -> usize {
        self.width.next_multiple_of(WIDTH)
    }

    /// Rows of the front.
    fn side(&self) -> usize {
        self.head() + WIDTH * self.groups
    }

    /// Rows of its update.
    fn update_side(&self) -> usize {
        WIDTH * self.groups
    }

    /// Rows of 64 bytes that its columns are stored in.
    fn len(&self) -> usize {
        self.below - self.diagonal + self.width * self.groups
    }
}

impl Tree {
    /// `None` if a front is too large.
    pub(crate) fn new(matrix: &Csr, layout: &Layout) -> Option<Tree> {
        let n = matrix.rows();
        let supernodes = &layout.supernodes;
        let mut supernode_of = vec![0u32; n];
        for (number, s) in supernodes.iter().enumerate() {
            supernode_of[s.begin..s.begin + s.width].fill(number as u32);
        }
        // Children of each, by the supernode that holds their first row below.
        let parent = |s: &Supernode| (s.groups > 0).then(|| supernode_of[layout.rows[s.rows] as usize] as usize);
        let mut of_parent: Vec<Vec<u32>> = vec![Vec::new(); supernodes.len()];
        for (number, s) in supernodes.iter().enumerate() {
            parent(s).into_iter().for_each(|parent| of_parent[parent].push(number as u32));
        }
        let mut fronts = vec![Front::default(); supernodes.len()];
        for (number, s) in supernodes.iter().enumerate().rev() {
            fronts[number].stack = parent(s).map_or(0, |parent| 1 - fronts[parent].stack);
        }
        let mut tree = Tree {
            places: vec![0; matrix.columns.len()],
            diagonal: Vec::with_capacity(n),
            in_parent: vec![NOWHERE; layout.rows.len()],
            groups_in_parent: vec![NOWHERE; layout.rows.len() / WIDTH],
            fronts,
            children: of_parent.concat(),
            ends: ends(supernodes, &of_parent),
            bench_max: [BenchSize::default(); 2],
            stack_from: [0; 2],
            stack_max: [0; 2],
        };
        let mut place = vec![0u32; n];
        let (mut taken, mut children_before) = ([0; 2], 0);
        for (number, (s, children)) in supernodes.iter().zip(&of_parent).enumerate() {
            let (side, below) = (s.side(), s.update_side());
            if side > ROWS_MAX {
                return None;
            }
            for j in 0..s.width {
                place[s.begin + j] = j as u32;
            }
            for (i, &row) in layout.rows[s.rows..][..below].iter().enumerate().filter(|(_, row)| (**row as usize) < n) {
                place[row as usize] = (s.head() + i) as u32;
            }
            for row in s.begin..s.begin + s.width {
                let entries = matrix.start[row]..matrix.start[row + 1];
                let diagonal = entries.start + matrix.columns[entries.clone()].partition_point(|&c| (c as usize) < row);
                tree.diagonal.push(diagonal);
                for entry in diagonal..entries.end {
                    tree.places[entry] = (row - s.begin) as u32 * side as u32 + place[matrix.columns[entry] as usize];
                }
            }
            for &child in children {
                let front = &mut tree.fronts[child as usize];
                let child = &supernodes[child as usize];
                let rows = &layout.rows[child.rows..][..child.update_side()];
                front.shared = rows.partition_point(|&row| (row as usize) < s.begin + s.width);
                front.rows = rows.partition_point(|&row| (row as usize) < n);
                for group in (child.rows..child.rows + child.update_side()).step_by(WIDTH) {
                    let places = &mut tree.in_parent[group..group + WIDTH];
                    for (to, &row) in places.iter_mut().zip(&layout.rows[group..]) {
                        *to = place.get(row as usize).copied().unwrap_or(NOWHERE);
                    }
                    // What fills up a group is zero, and may be added to whatever comes next in a column.
                    let start = places[0];
                    let neighbours = places.iter().zip(start..).all(|(&at, next)| at == next || at == NOWHERE);
                    if neighbours && start as usize + WIDTH <= side {
                        tree.groups_in_parent[group / WIDTH] = start;
                    }
                }
            }
            if number == tree.ends[0] {
                taken = tree.stack_max;
                tree.stack_from = taken;
            }
            // The children's updates are the last ones on the other stack.
            let Front { stack, .. } = tree.fronts[number];
            if let Some(&first) = children.first() {
                taken[1 - stack] = tree.fronts[first as usize].at;
            }
            tree.fronts[number] = Front { children: children_before, at: taken[stack], ..tree.fronts[number] };
            children_before += children.len();
            taken[stack] += below * below;
            tree.stack_max[stack] = tree.stack_max[stack].max(taken[stack]);
            let bench = &mut tree.bench_max[usize::from((tree.ends[0]..tree.ends[1]).contains(&number))];
            bench.panel = bench.panel.max(side * s.width);
            bench.columns = bench.columns.max(s.len());
        }
        Some(tree)
    }

    /// Columns of L.
    pub(crate) fn columns(&self) -> usize {
        self.diagonal.len()
    }

    /// Bytes of the tree.
    pub(crate) fn bytes(&self) -> usize {
        let lists = self.places.len() + self.in_parent.len() + self.groups_in_parent.len() + self.children.len();
        4 * lists + 8 * self.diagonal.len() + size_of::<Front>() * self.fronts.len()
    }

    /// Bytes of a workspace.
    pub(crate) fn workspace_bytes(&self) -> usize {
        let benches = self.bench_max.iter().map(|most| most.panel + WIDTH * most.columns).sum::<usize>();
        8 * (benches + self.stack_max.iter().sum::<usize>())
    }

    pub(crate) fn workspace(&self) -> Workspace {
        let bench = |most: BenchSize| Bench { panel: vec![0.0; most.panel], minus: vec![ZERO; most.columns] };
        Workspace { benches: self.bench_max.map(bench), stacks: self.stack_max.map(|most| vec![0.0; most]) }
    }

    /// L D Lᵀ = A − σI into `packed`.
    pub(crate) fn factor(
        &self,
        kind: Kind,
        matrix: &Csr,
        shift: f64,
        workspace: &mut Workspace,
        packed: &mut Packed,
    ) -> Pivots {
        let layout = &*packed.layout;
        let Workspace { benches: [bench, other], stacks: [even, odd] } = workspace;
        let [middle, end] = self.ends;
        let line = |number: usize| layout.supernodes.get(number).map_or(packed.values.len(), |s| s.diagonal);
        let row = |number: usize| layout.supernodes.get(number).map_or(self.columns(), |s| s.begin);
        let (lines, rows) = ([line(middle), line(end)], [row(middle), row(end)]);
        let (both, columns) = packed.values.split_at_mut(lines[1]);
        let (first_columns, second_columns) = both.split_at_mut(lines[0]);
        let (both, inverse) = packed.inverse.split_at_mut(rows[1]);
        let (first_inverse, second_inverse) = both.split_at_mut(rows[0]);
        let mut pivots = [Pivots::default(); 3];
        let [first, second, rest] = &mut pivots;
        if end > 0 {
            let (even, even_after) = even.split_at_mut(self.stack_from[0]);
            let (odd, odd_after) = odd.split_at_mut(self.stack_from[1]);
            let before = Share {
                supernodes: 0..middle,
                columns: first_columns,
                inverse: first_inverse,
                stacks: [even, odd],
                stack_from: [0; 2],
                bench: &mut *bench,
            };
            let after = Share {
                supernodes: middle..end,
                columns: second_columns,
                inverse: second_inverse,
                stacks: [even_after, odd_after],
                stack_from: self.stack_from,
                bench: other,
            };
            rayon::join(
                || kernel::factor(kind, self, layout, matrix, shift, before, first),
                || kernel::factor(kind, self, layout, matrix, shift, after, second),
            );
        }
        let supernodes = end..layout.supernodes.len();
        let share = Share { supernodes, columns, inverse, stacks: [even, odd], stack_from: [0; 2], bench };
        kernel::factor(kind, self, layout, matrix, shift, share, rest);
        pivots.into_iter().fold(Pivots::default(), Pivots::and)
    }

    fn children(&self, number: usize) -> &[u32] {
        let end = self.fronts.get(number + 1).map_or(self.children.len(), |next| next.children);
        &self.children[self.fronts[number].children..end]
    }
}

/// Multiplications that must be saved for two threads to factor two parts of a tree: what waking a thread takes.
const WORTH: f64 = 2e6;

/// Where two parts end that owe each other nothing, one from the first supernode on and one from there: a subtree, such
/// that the smaller of both is as much work as can be. Nowhere, if that is not worth it.
fn ends(supernodes: &[Supernode], children: &[Vec<u32>]) -> [usize; 2] {
    let (mut work, mut first) = (vec![0.0f64], Vec::new()); // before each supernode; the first one of each subtree
    let (mut most, mut ends) = (WORTH, [0; 2]);
    for (number, (s, children)) in supernodes.iter().zip(children).enumerate() {
        work.push(work[number] + s.width as f64 * (s.side() as f64).powi(2));
        first.push(children.first().map_or(number, |&child| first[child as usize]));
        let saved = work[first[number]].min(work[number + 1] - work[first[number]]);
        if saved > most {
            (most, ends) = (saved, [first[number], number + 1]);
        }
    }
    ends
}

/// L D Lᵀ = A − σI for some supernodes, once what they depend on is there.
#[inline(always)]
pub(crate) fn factor_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    tree: &Tree,
    layout: &Layout,
    matrix: &Csr,
    shift: f64,
    share: Share,
    pivots: &mut Pivots,
) {
    let Share { supernodes, columns, inverse, stacks: [even, odd], stack_from, bench: Bench { panel, minus } } = share;
    let Some(&Supernode { begin: first_row, diagonal: first_line, .. }) = layout.supernodes.get(supernodes.start)
    else {
        return;
    };
    for number in supernodes {
        let s = &layout.supernodes[number];
        let (side, below) = (s.side(), s.update_side());
        let Front { stack, at, .. } = tree.fronts[number];
        let (own, others) = if stack == 0 { (&mut *even, &*odd) } else { (&mut *odd, &*even) };
        let (at, others_from) = (at - stack_from[stack], stack_from[1 - stack]);
        let panel = &mut panel[..side * s.width];
        panel.fill(0.0);
        for row in s.begin..s.begin + s.width {
            let entries = tree.diagonal[row]..matrix.start[row + 1];
            for (&place, value) in tree.places[entries.clone()].iter().zip(&matrix.values[entries]) {
                panel[place as usize] = *value;
            }
            panel[(row - s.begin) * (side + 1)] -= shift;
        }
        for &child in tree.children(number) {
            let child = Update::new(tree, layout, child as usize, others, others_from);
            child.add(0..child.shared, panel, side, 0);
        }
        let columns = &mut columns[s.diagonal - first_line..][..s.len()];
        eliminate::<A, HIGH, P>(s, panel, columns, minus, &mut inverse[s.begin - first_row..], pivots);
        if below > 0 {
            let update = &mut own[at..at + below * below];
            make_update::<A, HIGH, P>(s, columns, minus, update);
            for &child in tree.children(number) {
                let child = Update::new(tree, layout, child as usize, others, others_from);
                child.add(child.shared..child.rows, update, below, s.head());
            }
        }
    }
}

/// What a supernode leaves to its parent.
struct Update<'a> {
    /// Column-major, the lower triangle and whole tiles of 8 × 8 on the diagonal.
    values: &'a [f64],
    /// Where its rows are in the front of the parent, and its groups of rows, as in [`Tree`].
    places: &'a [u32],
    groups: &'a [u32],
    /// How many of its columns are columns of the parent, and how many there are but for what fills up a group.
    shared: usize,
    rows: usize,
}

impl<'a> Update<'a> {
    #[inline(always)]
    fn new(tree: &'a Tree, layout: &Layout, number: usize, stack: &'a [f64], from: usize) -> Update<'a> {
        let (s, Front { at, shared, rows, .. }) = (&layout.supernodes[number], tree.fronts[number]);
        let places = &tree.in_parent[s.rows..][..s.update_side()];
        let groups = &tree.groups_in_parent[s.rows / WIDTH..][..s.groups];
        Update { values: &stack[at - from..], places, groups, shared, rows }
    }

    /// Adds some of its columns to those of its parent, which have `side` rows from place `first` on.
    #[inline(always)]
    fn add(&self, columns: Range<usize>, to: &mut [f64], side: usize, first: usize) {
        let below = self.places.len();
        for h in columns.start / WIDTH..columns.end.div_ceil(WIDTH) {
            let of_tile = columns.start.max(WIDTH * h)..columns.end.min(WIDTH * (h + 1));
            for g in h..self.groups.len() {
                let places = &self.places[WIDTH * g..WIDTH * (g + 1)];
                let neighbours = self.groups[g] != NOWHERE && self.groups[g] as usize >= first;
                for j in of_tile.clone() {
                    let to = &mut to[(self.places[j] as usize - first) * side..][..side];
                    let values = row(self.values, j * below + WIDTH * g);
                    // Above the diagonal there may be anything on both sides.
                    if neighbours {
                        let to = row_mut(to, self.groups[g] as usize - first);
                        for k in 0..WIDTH {
                            to[k] += values[k];
                        }
                        continue;
                    }
                    for k in j.saturating_sub(WIDTH * g)..WIDTH {
                        if places[k] != NOWHERE {
                            to[places[k] as usize - first] += values[k];
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::Progress;
    use crate::eigen::factor::Symbolic;
    use crate::eigen::factor::tests::grid;
    use crate::eigen::order::{elimination_order, permuted};

    #[test]
    fn parts_of_a_tree_that_are_factored_at_the_same_time_give_the_same_bytes() {
        let matrix = grid(150);
        let matrix = permuted(&matrix, &elimination_order(&matrix).unwrap());
        let n = matrix.rows();
        let symbolic = Symbolic::new(&matrix, Kind::best()).unwrap();
        let [middle, end] = symbolic.tree().ends;
        assert!(0 < middle && middle < end, "a grid falls into two");
        let factor = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| symbolic.factor(&matrix, 0.01, &Progress::new(&(), 0)).unwrap())
        };
        let (one, two) = (factor(1), factor(2));
        assert_eq!(one.packed.inverse, two.packed.inverse);
        assert_eq!(one.packed.values[..], two.packed.values[..]);
        assert_eq!((one.below, one.growth, one.pivot_min), (two.below, two.growth, two.pivot_min));
        let mut x = vec![[1.0; WIDTH]; n + 1];
        kernel::solve(Kind::best(), &two.packed, &mut x);
        for i in 0..n {
            let product: f64 = matrix.row(i).map(|(j, a)| a * x[j][3]).sum();
            assert!((product - 0.01 * x[i][3] - 1.0).abs() < 1e-12 * two.growth.max(1.0) * 1e3, "row {i}");
        }
    }
}
