//! Rotations of rigid bodies: vectors and matrices of three.

pub(crate) type Vector = [f64; 3];
/// Rows.
pub(crate) type Matrix = [Vector; 3];

/// Entries of Rᵀ R − 1 up to which R is a rotation: rounding of single precision, and of solvers that add up small turns.
const ROUNDING: f64 = 1e-3;

/// Whether three rows of three are a rotation, but for rounding.
pub(crate) fn is_rotation(matrix: &Matrix) -> bool {
    let identity = product(&transposed(matrix), matrix);
    let [a, b, c] = matrix;
    is_identity(&identity, ROUNDING) && square(&minus(&cross(a, b), c)) < 1.0
}

/// NaN is not near anything.
pub(crate) fn is_identity(matrix: &Matrix, rounding: f64) -> bool {
    let near = |row: usize, column: usize| (matrix[row][column] - f64::from(u8::from(row == column))).abs() <= rounding;
    (0..3).all(|row| (0..3).all(|column| near(row, column)))
}

/// The rotation between two matrices of nine words each.
pub(crate) fn turn(after: &Matrix, before: &Matrix, by_columns: bool) -> Matrix {
    if by_columns { product(&transposed(after), before) } else { product(after, &transposed(before)) }
}

/// Axis of a rotation, as long as its angle in radians.
pub(crate) fn rotation_vector(m: &Matrix) -> Vector {
    let axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]].map(|value| value / 2.0);
    let sine = square(&axis).sqrt();
    let angle = sine.atan2((m[0][0] + m[1][1] + m[2][2] - 1.0) / 2.0);
    axis.map(|value| if sine > f64::EPSILON { value * angle / sine } else { value })
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = transposed(b);
    a.map(|row| columns.map(|column| dot(&row, &column)))
}

fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|column| [m[0][column], m[1][column], m[2][column]])
}

pub(crate) fn times(m: &Matrix, v: &Vector) -> Vector {
    m.map(|row| dot(&row, v))
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn square(v: &Vector) -> f64 {
    dot(v, v)
}

pub(crate) fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn plus(a: &Vector, b: &Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn minus(a: &Vector, b: &Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn mean(a: &Vector, b: &Vector) -> Vector {
    plus(a, b).map(|value| value / 2.0)
}
