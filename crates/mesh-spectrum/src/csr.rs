//! A square sparse matrix, compressed by rows.

/// A square sparse matrix, compressed by rows: the columns of row i are `columns[start[i]..start[i + 1]]`, ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct Csr {
    /// One more than rows.
    pub start: Vec<usize>,
    /// Column of each entry.
    pub columns: Vec<u32>,
    /// Value of each entry.
    pub values: Vec<f64>,
}

impl Csr {
    /// A symmetric matrix from entries (i, j, value), i ≠ j, that stand for both places and are summed, and a diagonal.
    /// The sum's order is that of the entries, so the result is exactly symmetric.
    pub(crate) fn symmetric(pairs: &[(u32, u32, f64)], diagonal: Vec<f64>) -> Csr {
        let rows = diagonal.len();
        let mut start = vec![1usize; rows + 1]; // one for the diagonal
        start[0] = 0;
        pairs.iter().for_each(|&(i, j, _)| {
            start[i as usize + 1] += 1;
            start[j as usize + 1] += 1;
        });
        (0..rows).for_each(|row| start[row + 1] += start[row]);
        let mut end = start.clone();
        let mut all = vec![(0u32, 0.0); start[rows]];
        let mut put = |row: u32, column: u32, value: f64| {
            all[end[row as usize]] = (column, value);
            end[row as usize] += 1;
        };
        diagonal.iter().zip(0..).for_each(|(&value, row)| put(row, row, value));
        pairs.iter().for_each(|&(i, j, value)| {
            put(i, j, value);
            put(j, i, value);
        });
        let mut matrix = Csr { start: vec![0], columns: Vec::new(), values: Vec::new() };
        for row in 0..rows {
            let entries = &mut all[start[row]..start[row + 1]];
            entries.sort_by_key(|&(column, _)| column); // stable
            for same in entries.chunk_by(|a, b| a.0 == b.0) {
                matrix.columns.push(same[0].0);
                matrix.values.push(same.iter().map(|entry| entry.1).sum());
            }
            matrix.start.push(matrix.columns.len());
        }
        matrix
    }

    /// The Laplacian of weighted edges (i, j, w), i ≠ j: Lᵢⱼ = −Σ w, Lᵢᵢ = −Σⱼ Lᵢⱼ.
    pub(crate) fn laplacian(rows: usize, edges: &mut [(u32, u32, f64)]) -> Csr {
        edges.iter_mut().for_each(|edge| edge.2 = 0.0 - edge.2);
        let mut matrix = Csr::symmetric(edges, vec![0.0; rows]);
        for row in 0..rows {
            let (mut sum, mut place) = (0.0, None);
            for k in matrix.start[row]..matrix.start[row + 1] {
                if matrix.columns[k] as usize == row {
                    place = Some(k);
                } else {
                    sum += matrix.values[k];
                }
            }
            if let Some(place) = place {
                matrix.values[place] = 0.0 - sum;
            }
        }
        matrix
    }

    /// Sums entries (row, column, value) that share a place, in the order of the entries.
    #[cfg(test)]
    pub(crate) fn from_entries(rows: usize, mut entries: Vec<(u32, u32, f64)>) -> Csr {
        entries.sort_by_key(|&(row, column, _)| (row, column)); // stable
        let mut matrix = Csr { start: vec![0; rows + 1], columns: Vec::new(), values: Vec::new() };
        for same in entries.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            matrix.start[same[0].0 as usize + 1] += 1;
            matrix.columns.push(same[0].1);
            matrix.values.push(same.iter().map(|entry| entry.2).sum());
        }
        for row in 0..rows {
            matrix.start[row + 1] += matrix.start[row];
        }
        matrix
    }

    /// How many rows (and columns) there are.
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// (column, value) of each entry of a row.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.start[row]..self.start[row + 1];
        self.columns[range.clone()].iter().zip(&self.values[range]).map(|(&column, &value)| (column as usize, value))
    }

    /// The product with a vector of as many entries as there are rows.
    ///
    /// # Panics
    /// If `x` is shorter.
    pub fn times(&self, x: &[f64]) -> Vec<f64> {
        (0..self.rows()).map(|row| self.row(row).map(|(column, value)| value * x[column]).sum()).collect()
    }
}
