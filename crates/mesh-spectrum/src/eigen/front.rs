//! The numbers of L D Lᵀ: the multifrontal method (Duff and Reid 1983; Liu 1992), without pivoting.
//!
//! Each supernode has a front, a dense symmetric matrix over its columns and the rows below them. It starts with the
//! entries of A − σI in the columns and with what the supernode's children left (their *updates*, added where their
//! rows are in this front); then its columns are eliminated, and what that leaves of the rest is its own update. As
//! children come before parents, updates live on a stack.
//!
//! A front is column-major, only its lower triangle is used. Its columns take the first places, filled up to a multiple
//! of eight, so that the rows below start at a cache line and products run over whole tiles of 8 × 8.

use crate::eigen::arithmetic::Arithmetic;
use crate::eigen::block::{Row, SMALL_ZERO, WIDTH, ZERO};
use crate::eigen::factor::Pivots;
use crate::eigen::products::{in_groups, outer};
use crate::eigen::solve::{Layout, Packed, Supernode};
use crate::operator::Csr;

/// Columns that are eliminated before the rest of the front is updated: as much of them as stays in a core's cache.
const TOGETHER: usize = 32;

/// Fronts of more rows than this are refused: places in them are 32-bit numbers, and they take 30 GB.
const ROWS_MAX: usize = 65_000;

/// Which supernode leaves its update to which, and where everything goes.
pub(crate) struct Tree {
    /// The front's place of every stored entry of A in the lower triangle, as the entries come; and its diagonal
    /// entries among all.
    places: Vec<u32>,
    diagonal: Vec<usize>,
    /// Where each row below a supernode is in the front of its parent; numbered as `Layout::rows`.
    in_parent: Vec<u32>,
    /// Children of each supernode, which are the latest on the stack when its turn comes.
    children: Vec<u32>,
    front_max: usize,
    stack_max: usize,
}

/// What a factorisation needs beside its result.
#[derive(Default)]
pub(crate) struct Workspace {
    front: Vec<f64>,
    stack: Vec<f64>,
    /// Supernodes whose updates are on the stack.
    waiting: Vec<u32>,
    /// Columns in groups of eight rows, as they are and times D.
    panel: Vec<Row>,
    scaled: Vec<Row>,
    pivots: Vec<f64>,
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
        let first_below = |s: &Supernode| layout.rows[s.rows..].first().copied().filter(|_| s.groups > 0);
        let mut of_parent: Vec<Vec<u32>> = vec![Vec::new(); supernodes.len()];
        for (number, s) in supernodes.iter().enumerate() {
            if let Some(row) = first_below(s) {
                of_parent[supernode_of[row as usize] as usize].push(number as u32);
            }
        }
        let mut tree = Tree {
            places: vec![0; matrix.columns.len()],
            diagonal: Vec::with_capacity(n),
            in_parent: vec![0; layout.rows.len()],
            children: of_parent.iter().map(|children| children.len() as u32).collect(),
            front_max: 0,
            stack_max: 0,
        };
        let mut place = vec![0u32; n + 1];
        let (mut stack, mut waiting) = (0, Vec::new());
        for (s, children) in supernodes.iter().zip(&of_parent) {
            let side = s.side();
            if side > ROWS_MAX {
                return None;
            }
            for j in 0..s.width {
                place[s.begin + j] = j as u32;
            }
            for (i, &row) in layout.rows[s.rows..][..s.update_side()].iter().enumerate() {
                place[row as usize] = (s.head() + i) as u32;
            }
            place[n] = 0; // what fills up groups: zeros, to be added anywhere
            for row in s.begin..s.begin + s.width {
                let entries = matrix.start[row]..matrix.start[row + 1];
                let diagonal = entries.start + matrix.columns[entries.clone()].partition_point(|&c| (c as usize) < row);
                tree.diagonal.push(diagonal);
                for entry in diagonal..entries.end {
                    tree.places[entry] = (row - s.begin) as u32 * side as u32 + place[matrix.columns[entry] as usize];
                }
            }
            for &child in children {
                let child = &supernodes[child as usize];
                for i in child.rows..child.rows + child.update_side() {
                    tree.in_parent[i] = place[layout.rows[i] as usize];
                }
            }
            let taken = waiting.split_off(waiting.len().checked_sub(children.len())?);
            stack -= taken.iter().sum::<usize>();
            waiting.push(s.update_side() * s.update_side());
            stack += s.update_side() * s.update_side();
            tree.front_max = tree.front_max.max(side * side);
            tree.stack_max = tree.stack_max.max(stack);
        }
        Some(tree)
    }

    /// Columns of L.
    pub(crate) fn columns(&self) -> usize {
        self.diagonal.len()
    }

    /// Bytes of the tree.
    pub(crate) fn bytes(&self) -> usize {
        4 * self.places.len() + 8 * self.diagonal.len() + 4 * self.in_parent.len() + 4 * self.children.len()
    }

    /// Bytes of a workspace.
    pub(crate) fn workspace_bytes(&self) -> usize {
        8 * (self.front_max + self.stack_max)
    }

    pub(crate) fn workspace(&self) -> Workspace {
        Workspace { front: vec![0.0; self.front_max], stack: vec![0.0; self.stack_max], ..Workspace::default() }
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
    workspace.waiting.clear();
    let mut stack = 0;
    for (number, s) in layout.supernodes.iter().enumerate() {
        let side = s.side();
        let front = &mut workspace.front[..side * side];
        for (j, column) in front.chunks_exact_mut(side).enumerate() {
            column[j..].fill(0.0);
        }
        for row in s.begin..s.begin + s.width {
            let entries = tree.diagonal[row]..matrix.start[row + 1];
            for (&place, value) in tree.places[entries.clone()].iter().zip(&matrix.values[entries]) {
                front[place as usize] = *value;
            }
            front[(row - s.begin) * (side + 1)] -= shift;
        }
        for _ in 0..tree.children[number] {
            let Some(child) = workspace.waiting.pop() else { continue };
            let child = &layout.supernodes[child as usize];
            let below = child.update_side();
            stack -= below * below;
            add_update(&workspace.stack[stack..][..below * below], &tree.in_parent[child.rows..][..below], front, side);
        }
        workspace.pivots.clear();
        for first in (0..s.width).step_by(TOGETHER) {
            let end = (first + TOGETHER).min(s.width);
            for column in first..end {
                eliminate::<A>(front, side, (first, column), &mut workspace.pivots);
            }
            let rest = end.next_multiple_of(WIDTH);
            let (panel, scaled) = (&mut workspace.panel, &mut workspace.scaled);
            copy(front, side, (first, end), rest, &workspace.pivots, panel, scaled);
            update::<A, HIGH, P>(front, side, rest, end - first, panel, scaled);
        }
        pack(front, s, &workspace.pivots, packed, pivots);
        let (head, below) = (s.head(), s.update_side());
        for (j, to) in workspace.stack[stack..][..below * below].chunks_exact_mut(below.max(1)).enumerate() {
            to[j..].copy_from_slice(&front[(head + j) * side + head + j..][..below - j]);
        }
        stack += below * below;
        workspace.waiting.push(number as u32);
    }
}

/// Adds a child's update, a column-major lower triangle, to the front of its parent.
#[inline(always)]
fn add_update(update: &[f64], places: &[u32], front: &mut [f64], side: usize) {
    let below = places.len();
    for (j, column) in update.chunks_exact(below.max(1)).enumerate() {
        let to = &mut front[places[j] as usize * side..][..side];
        let first = j.next_multiple_of(WIDTH).min(below);
        add_at(to, &column[j..first], &places[j..first]);
        for (values, places) in
            column[first..].as_chunks::<WIDTH>().0.iter().zip(places[first..].as_chunks::<WIDTH>().0)
        {
            let start = places[0] as usize;
            match to.get_mut(start..start + WIDTH) {
                // Rows of a child are mostly neighbours in its parent, too.
                Some(to) if places[WIDTH - 1] as usize == start + WIDTH - 1 => {
                    to.iter_mut().zip(values).for_each(|(to, value)| *to += value);
                }
                _ => add_at(to, values, places),
            }
        }
    }
}

/// Adds values to entries at such places.
#[inline(always)]
fn add_at(to: &mut [f64], values: &[f64], places: &[u32]) {
    for (value, &place) in values.iter().zip(places) {
        to[place as usize] += value;
    }
}

/// Eliminates a column: takes off it what those from `first` on owe it, and divides by its pivot.
#[inline(always)]
fn eliminate<A: Arithmetic>(front: &mut [f64], side: usize, (first, column): (usize, usize), pivots: &mut Vec<f64>) {
    let (before, rest) = front.split_at_mut(column * side);
    let own = &mut rest[column..side];
    let source = |j: usize| &before[j * side + column..(j + 1) * side];
    let mut j = first;
    while j + WIDTH <= column {
        let from: [&[f64]; WIDTH] = std::array::from_fn(|k| &source(j + k)[..own.len()]);
        let minus: Row = std::array::from_fn(|k| -from[k][0] * pivots[j + k]);
        for (i, own) in own.iter_mut().enumerate() {
            for k in 0..WIDTH {
                *own = A::fma(minus[k], from[k][i], *own);
            }
        }
        j += WIDTH;
    }
    for (j, pivot) in pivots.iter().enumerate().skip(j) {
        let from = source(j);
        let minus = -from[0] * pivot;
        own.iter_mut().zip(from).for_each(|(own, from)| *own = A::fma(minus, *from, *own));
    }
    let pivot = own[0];
    pivots.push(pivot);
    let inverse = 1.0 / pivot;
    own[1..].iter_mut().for_each(|entry| *entry *= inverse);
}

/// Copies the eliminated columns into groups of eight rows, from row `rest` on: as they are, and times D.
#[inline(always)]
fn copy(
    front: &[f64],
    side: usize,
    (first, end): (usize, usize),
    rest: usize,
    pivots: &[f64],
    panel: &mut Vec<Row>,
    scaled: &mut Vec<Row>,
) {
    let (columns, groups) = (end - first, (side - rest) / WIDTH);
    panel.resize(columns * groups, ZERO);
    scaled.resize(columns * groups, ZERO);
    for (j, pivot) in (first..end).zip(&pivots[first..]) {
        for (g, rows) in front[j * side + rest..(j + 1) * side].as_chunks().0.iter().enumerate() {
            panel[g * columns + j - first] = *rows;
            scaled[g * columns + j - first] = rows.map(|x| x * pivot);
        }
    }
}

/// Takes L D Lᵀ of the eliminated columns off the rest of the front.
#[inline(always)]
fn update<A: Arithmetic, const HIGH: usize, const P: usize>(
    front: &mut [f64],
    side: usize,
    rest: usize,
    columns: usize,
    panel: &[Row],
    scaled: &[Row],
) {
    let groups = (side - rest) / WIDTH;
    let of_panel = |g: usize| &panel[g * columns..][..columns];
    for h in 0..groups {
        let right = &scaled[h * columns..][..columns];
        in_groups!(P, groups - h, g, N => {
            let mut tiles = [SMALL_ZERO; N];
            outer::<A, HIGH, N>(right, std::array::from_fn(|p| of_panel(h + g + p)), 0, &mut tiles);
            for (p, tile) in tiles.iter().enumerate() {
                subtract(front, side, rest + WIDTH * (h + g + p), rest + WIDTH * h, tile);
            }
        });
    }
}

#[inline(always)]
fn subtract(front: &mut [f64], side: usize, row: usize, column: usize, tile: &[Row; WIDTH]) {
    for (a, from) in tile.iter().enumerate() {
        let to = &mut front[(column + a) * side + row..][..WIDTH];
        for k in 0..WIDTH {
            to[k] -= from[k];
        }
    }
}

/// Writes a supernode's columns to where the solve wants them, and notes its pivots. What fills up groups there is zero
/// from the start and never written to.
#[inline(always)]
fn pack(front: &[f64], s: &Supernode, own: &[f64], packed: &mut Packed, pivots: &mut Pivots) {
    let (side, head) = (s.side(), s.head());
    let (values, inverse) = (&mut packed.values[..], &mut packed.inverse);
    let mut most = ZERO;
    for (j, &pivot) in own.iter().enumerate() {
        pivots.negative += usize::from(pivot < 0.0);
        pivots.least = if pivot.is_nan() { f64::NAN } else { pivots.least.min(pivot.abs()) };
        inverse[s.begin + j] = 1.0 / pivot;
        let column = &front[j * side..][..side];
        for (i, &entry) in column[..s.width].iter().enumerate().skip(j + 1) {
            most[0] = if entry.abs() > most[0] { entry.abs() } else { most[0] };
            let group = i / WIDTH;
            values[s.diagonal + WIDTH * (group * (group + 1) / 2) + j][i % WIDTH] = entry;
        }
        for (g, rows) in column[head..].as_chunks().0.iter().enumerate() {
            values[s.below + g * s.stride + j] = *rows;
            for k in 0..WIDTH {
                most[k] = if rows[k].abs() > most[k] { rows[k].abs() } else { most[k] };
            }
        }
    }
    pivots.growth = most.iter().fold(pivots.growth, |most, x| x.max(most));
}
