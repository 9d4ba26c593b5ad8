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
//! Panels and updates are column-major, of updates only the lower triangle is used. The columns take the first places of
//! a panel, filled up to a multiple of eight, so that the rows below start at a cache line and products run over whole
//! tiles of 8 × 8. Eliminated columns go straight to where the solve wants them, eight rows of a column together, which
//! is also what products want.

mod eliminate;

use std::ops::Range;

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, WIDTH, ZERO};
use crate::eigen::factor::Pivots;
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
    panel_max: usize,
    columns_max: usize,
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
#[derive(Default)]
pub(crate) struct Workspace {
    panel: Vec<f64>,
    stacks: [Vec<f64>; 2],
    /// −D times the columns of a supernode, as they are stored there.
    minus: Vec<Row>,
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
            panel_max: 0,
            columns_max: 0,
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
            // The children's updates are the last ones on the other stack.
            let Front { stack, .. } = tree.fronts[number];
            if let Some(&first) = children.first() {
                taken[1 - stack] = tree.fronts[first as usize].at;
            }
            tree.fronts[number] = Front { children: children_before, at: taken[stack], ..tree.fronts[number] };
            children_before += children.len();
            taken[stack] += below * below;
            tree.stack_max[stack] = tree.stack_max[stack].max(taken[stack]);
            tree.panel_max = tree.panel_max.max(side * s.width);
            tree.columns_max = tree.columns_max.max(s.len());
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
        8 * (self.panel_max + WIDTH * self.columns_max + self.stack_max.iter().sum::<usize>())
    }

    pub(crate) fn workspace(&self) -> Workspace {
        let stacks = self.stack_max.map(|most| vec![0.0; most]);
        Workspace { panel: vec![0.0; self.panel_max], stacks, minus: vec![ZERO; self.columns_max] }
    }

    fn children(&self, number: usize) -> &[u32] {
        let end = self.fronts.get(number + 1).map_or(self.children.len(), |next| next.children);
        &self.children[self.fronts[number].children..end]
    }
}

/// L D Lᵀ = A − σI into `packed`.
#[inline(always)]
pub(crate) fn factor_with<A: Arithmetic, const R: usize, const HIGH: usize, const P: usize>(
    tree: &Tree,
    matrix: &Csr,
    shift: f64,
    workspace: &mut Workspace,
    packed: &mut Packed,
    pivots: &mut Pivots,
) {
    let layout = packed.layout.clone();
    let Workspace { panel, stacks: [even, odd], minus } = workspace;
    for (number, s) in layout.supernodes.iter().enumerate() {
        let (side, below) = (s.side(), s.update_side());
        let Front { stack, at, .. } = tree.fronts[number];
        let (own, others) = if stack == 0 { (&mut *even, &*odd) } else { (&mut *odd, &*even) };
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
            let child = Update::new(tree, &layout, child as usize, others);
            child.add(0..child.shared, panel, side, 0);
        }
        let columns = &mut packed.values[s.diagonal..s.diagonal + s.len()];
        eliminate::<A, HIGH, P>(s, panel, columns, minus, &mut packed.inverse[s.begin..], pivots);
        if below > 0 {
            let update = &mut own[at..at + below * below];
            make_update::<A, HIGH, P>(s, columns, minus, update);
            for &child in tree.children(number) {
                let child = Update::new(tree, &layout, child as usize, others);
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
    fn new(tree: &'a Tree, layout: &Layout, number: usize, stack: &'a [f64]) -> Update<'a> {
        let (s, Front { at, shared, rows, .. }) = (&layout.supernodes[number], tree.fronts[number]);
        let places = &tree.in_parent[s.rows..][..s.update_side()];
        let groups = &tree.groups_in_parent[s.rows / WIDTH..][..s.groups];
        Update { values: &stack[at..], places, groups, shared, rows }
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
