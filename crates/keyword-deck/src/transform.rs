//! *DEFINE_TRANSFORMATION: where the nodes of an include go.

use std::collections::HashMap;

type Point = [f64; 3];

/// x ↦ A x + b.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Affine {
    pub(crate) matrix: [[f64; 3]; 3],
    pub(crate) shift: Point,
}

impl Affine {
    pub(crate) const IDENTITY: Affine =
        Affine { matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], shift: [0.0; 3] };

    pub(crate) fn scale(factors: Point) -> Affine {
        let mut scaled = Affine::IDENTITY;
        (0..3).for_each(|i| scaled.matrix[i][i] = factors[i]);
        scaled
    }

    pub(crate) fn apply(&self, x: Point) -> Point {
        std::array::from_fn(|i| (0..3).map(|j| self.matrix[i][j] * x[j]).sum::<f64>() + self.shift[i])
    }

    /// This one first, `next` after it.
    pub(crate) fn then(&self, next: &Affine) -> Affine {
        let matrix = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| next.matrix[i][k] * self.matrix[k][j]).sum())
        });
        Affine { matrix, shift: next.apply(self.shift) }
    }

    /// A linear map about a point that stays.
    fn about(matrix: [[f64; 3]; 3], point: Point) -> Affine {
        let moved = Affine { matrix, shift: [0.0; 3] }.apply(point);
        Affine { matrix, shift: std::array::from_fn(|i| point[i] - moved[i]) }
    }
}

/// One card of a transformation: its option and seven numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Step {
    pub(crate) option: String,
    pub(crate) a: [f64; 7],
}

/// The map of a transformation's cards, in their order; `nodes` finds nodes by id for the options that name some.
///
/// # Errors
/// The option that is not understood, in words.
pub(crate) fn affine(steps: &[Step], nodes: &dyn Fn(u64) -> Option<Point>) -> Result<Affine, String> {
    let mut whole = Affine::IDENTITY;
    let mut points: HashMap<i64, Point> = HashMap::new();
    for step in steps {
        let a = &step.a;
        let point = |value: f64| {
            points
                .get(&(value as i64))
                .copied()
                .ok_or_else(|| format!("{} names POINT {value}, which is not defined before", step.option))
        };
        let node = |value: f64| {
            nodes(value as u64).ok_or_else(|| format!("{} names node {value}, which is not there", step.option))
        };
        let next = match step.option.as_str() {
            "POINT" => {
                points.insert(a[0] as i64, [a[1], a[2], a[3]]);
                continue;
            }
            "TRANSL" => Affine { shift: [a[0], a[1], a[2]], ..Affine::IDENTITY },
            "SCALE" => Affine::scale([a[0], a[1], a[2]].map(|factor| if factor == 0.0 { 1.0 } else { factor })),
            // By two points: their ids and the angle; else direction, point and angle.
            "ROTATE" if a[3..].iter().all(|x| *x == 0.0) && points.contains_key(&(a[0] as i64)) => {
                let (from, to) = (point(a[0])?, point(a[1])?);
                rotation(sub(to, from), from, a[2])?
            }
            "ROTATE" => rotation([a[0], a[1], a[2]], [a[3], a[4], a[5]], a[6])?,
            "ROTATE3NA" => {
                let (from, to) = (node(a[0])?, node(a[1])?);
                rotation(sub(to, from), from, a[3])?
            }
            "MIRROR" => {
                let from = [a[0], a[1], a[2]];
                let normal = unit(sub([a[3], a[4], a[5]], from)).ok_or("MIRROR with a plane without a normal")?;
                let reflect =
                    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j) - 2.0 * normal[i] * normal[j]));
                Affine::about(reflect, from)
            }
            "POS6P" => {
                position([point(a[0])?, point(a[1])?, point(a[2])?], [point(a[3])?, point(a[4])?, point(a[5])?])?
            }
            "POS6N" => position([node(a[0])?, node(a[1])?, node(a[2])?], [node(a[3])?, node(a[4])?, node(a[5])?])?,
            "TRANSL2ND" => {
                let direction = unit(sub(node(a[1])?, node(a[0])?)).ok_or("TRANSL2ND of two nodes at one place")?;
                Affine { shift: direction.map(|x| x * a[2]), ..Affine::IDENTITY }
            }
            other => return Err(format!("the transformation's option {other} is not known")),
        };
        whole = whole.then(&next);
    }
    Ok(whole)
}

/// About an axis by an angle in degrees (Rodrigues).
fn rotation(axis: Point, point: Point, degrees: f64) -> Result<Affine, String> {
    let axis = unit(axis).ok_or("a rotation about an axis without length")?;
    let (sin, cos) = degrees.to_radians().sin_cos();
    let skew = [[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]];
    let matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| cos * f64::from(i == j) + sin * skew[i][j] + (1.0 - cos) * axis[i] * axis[j])
    });
    Ok(Affine::about(matrix, point))
}

/// Takes the first three points to the last three: first onto first, and the frames that they span onto each other.
fn position(from: [Point; 3], to: [Point; 3]) -> Result<Affine, String> {
    let frame = |[p, q, r]: [Point; 3]| -> Option<[Point; 3]> {
        let x = unit(sub(q, p))?;
        let z = unit(cross(x, sub(r, p)))?;
        Some([x, cross(z, x), z])
    };
    let (f, t) = frame(from).zip(frame(to)).ok_or("three points of a position lie on a line")?;
    let matrix = std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| t[k][i] * f[k][j]).sum()));
    let turned = Affine { matrix, shift: [0.0; 3] };
    Ok(Affine { shift: sub(to[0], turned.apply(from[0])), ..turned })
}

fn sub(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Point) -> Option<Point> {
    let length = a.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length > 0.0).then(|| a.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(cards: &[(&str, [f64; 7])]) -> Affine {
        let steps: Vec<Step> = cards.iter().map(|(option, a)| Step { option: (*option).to_owned(), a: *a }).collect();
        affine(&steps, &|_| None).unwrap()
    }

    fn close(a: Point, b: Point) -> bool {
        (0..3).all(|i| (a[i] - b[i]).abs() < 1e-12)
    }

    #[test]
    fn steps_are_taken_in_order() {
        let turn = ("ROTATE", [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 90.0]);
        let shift = ("TRANSL", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(close(map(&[turn, shift]).apply([1.0, 0.0, 0.0]), [1.0, 1.0, 0.0]));
        assert!(close(map(&[shift, turn]).apply([1.0, 0.0, 0.0]), [0.0, 2.0, 0.0]));
        let scale = ("SCALE", [2.0, 3.0, 4.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(close(map(&[scale, shift]).apply([1.0, 1.0, 1.0]), [3.0, 3.0, 4.0]));
    }

    #[test]
    fn mirrors_and_positions() {
        let mirror = map(&[("MIRROR", [1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0])]);
        assert!(close(mirror.apply([3.0, 5.0, 7.0]), [-1.0, 5.0, 7.0]));
        let point = |id: f64, p: Point| ("POINT", [id, p[0], p[1], p[2], 0.0, 0.0, 0.0]);
        let cards = [
            point(1.0, [0.0; 3]),
            point(2.0, [1.0, 0.0, 0.0]),
            point(3.0, [0.0, 1.0, 0.0]),
            point(4.0, [5.0, 5.0, 5.0]),
            point(5.0, [5.0, 9.0, 5.0]),
            point(6.0, [5.0, 5.0, 6.0]),
            ("POS6P", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0]),
        ];
        let placed = map(&cards);
        assert!(close(placed.apply([1.0, 0.0, 0.0]), [5.0, 6.0, 5.0]));
        assert!(close(placed.apply([0.0, 0.0, 1.0]), [6.0, 5.0, 5.0]));
        let turn = map(&[
            point(1.0, [1.0, 0.0, 0.0]),
            point(2.0, [1.0, 0.0, 9.0]),
            ("ROTATE", [1.0, 2.0, 180.0, 0.0, 0.0, 0.0, 0.0]),
        ]);
        assert!(close(turn.apply([3.0, 0.0, 0.0]), [-1.0, 0.0, 0.0]));
    }

    #[test]
    fn what_is_not_known_is_said() {
        let step = |option: &str| Step { option: option.to_owned(), a: [0.0; 7] };
        assert!(affine(&[step("TWIST")], &|_| None).unwrap_err().contains("TWIST"));
        assert!(affine(&[step("ROTATE")], &|_| None).unwrap_err().contains("axis"));
        assert!(affine(&[step("POS6N")], &|_| None).unwrap_err().contains("node 0"));
    }
}
