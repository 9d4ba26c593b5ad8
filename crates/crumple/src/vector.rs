//! Arithmetic of points and vectors in space.

pub(crate) type Vector = [f64; 3];

pub(crate) fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|c| a[c] + b[c])
}

pub(crate) fn subtract(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|c| a[c] - b[c])
}

pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn square(a: Vector) -> f64 {
    dot(a, a)
}

pub(crate) fn distance(a: Vector, b: Vector) -> f64 {
    square(subtract(a, b)).sqrt()
}

/// Twice the area of a triangle, along its normal.
pub(crate) fn double_area([a, b, c]: [Vector; 3]) -> Vector {
    cross(subtract(b, a), subtract(c, a))
}

/// Area of a triangle.
pub(crate) fn area(corners: [Vector; 3]) -> f64 {
    square(double_area(corners)).sqrt() / 2.0
}

/// Inner product in any dimension.
pub(crate) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Of length 1; a zero vector, of any dimension, stays zero.
pub(crate) fn unit(mut numbers: Vec<f64>) -> Vec<f64> {
    let length = product(&numbers, &numbers).sqrt();
    if length > 0.0 {
        numbers.iter_mut().for_each(|x| *x /= length);
    }
    numbers
}
