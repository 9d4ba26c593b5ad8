//! Pictures of shapes: a small z-buffer rasteriser. The report page draws its shapes itself where the browser has WebGL;
//! elsewhere, in mails and in the README, a picture stands for them. Both are meant to look the same: the view, the
//! crease angle, the light and the colours here are those of `page/js/shapes.js` and `page/js/data.js`.
//!
//! The projection is orthographic. Each sample keeps the nearest triangle; colour comes from one value a vertex by a
//! diverging map, light from a lamp beside the viewer that falls on both sides of a sheet. The same input gives the same
//! bytes on every machine that computes in IEEE double precision.

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

type Point = [f64; 3];

/// The diverging map of Moreland 2009 ("Diverging color maps for scientific visualization"), made for shaded surfaces:
/// seventeen sRGB steps with straight lines between. `page/js/data.js` holds the same table; a test compares.
const DIVERGING: [u32; 17] = [
    0x3b4cc0, 0x4e68d7, 0x6282ea, 0x779af7, 0x8db0fe, 0xa3c2ff, 0xb8d0f9, 0xccd9ee, 0xdddddd, 0xecd3c6, 0xf5c4ad,
    0xf7b194, 0xf49a7b, 0xec7f63, 0xde614c, 0xcb3e38, 0xb40426,
];

/// Cosine of the crease angle, 40°: triangles tilted by more keep a sharp edge between them.
const CREASE: f64 = 0.766_044_443_118_978;

/// Samples a pixel has along each side.
const SAMPLES: usize = 3;

/// Longest side of a picture in pixels; a larger one is cut down to it.
const SIDE_MAX: u32 = 4096;

/// How a shape is looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Width of the picture in pixels, 1 to 4096.
    pub width: u32,
    /// Height of the picture in pixels, 1 to 4096.
    pub height: u32,
    /// From the shape towards the viewer, of any length; z is up in the picture. The default is for a shape whose
    /// longest axis is x; [`View::of`] chooses.
    pub direction: [f64; 3],
    /// What the picture covers. `None`: the shape itself. Pictures with the same frame can be compared by eye.
    pub frame: Option<Frame>,
}

impl Default for View {
    fn default() -> Self {
        Self { width: 720, height: 360, direction: [0.4, -1.0, 0.5], frame: None }
    }
}

impl View {
    /// The page's view of a shape: the longer of x and y runs to the right, z is up, slightly from above.
    ///
    /// `vertices`: N × 3, usually the undeformed shape, so that all runs are seen alike.
    pub fn of(vertices: &[[f64; 3]]) -> Self {
        let side = |axis: usize| {
            let (low, high) = extent(vertices.iter().map(|vertex| vertex[axis]));
            high - low
        };
        let along_y = side(1) > side(0);
        Self { direction: if along_y { [1.0, 0.4, 0.5] } else { [0.4, -1.0, 0.5] }, ..Self::default() }
    }
}

/// A rectangle in the plane of the picture, in the model's length unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The middle: how far to the right and how far up it lies from the origin.
    pub middle: [f64; 2],
    /// Half of the width and half of the height.
    pub half: [f64; 2],
}

impl Frame {
    /// The smallest frame that holds all the given shapes, each N × 3, seen from `direction` (see [`View::direction`]).
    /// Vertices that are not finite do not count; `None` when no other is there.
    pub fn of(shapes: &[&[[f64; 3]]], direction: [f64; 3]) -> Option<Self> {
        let axes = axes(direction);
        let across = |axis: usize| {
            let vertices = shapes.iter().flat_map(|shape| shape.iter());
            extent(vertices.filter(|vertex| is_finite(vertex)).map(|vertex| dot(axes[axis], *vertex)))
        };
        let ([left, right], [bottom, top]) = (<[f64; 2]>::from(across(0)), <[f64; 2]>::from(across(1)));
        (left <= right && bottom <= top).then_some(Self {
            middle: [(left + right) / 2.0, (bottom + top) / 2.0],
            half: [(right - left) / 2.0, (top - bottom) / 2.0],
        })
    }
}

/// A PNG picture of a shape on a transparent ground.
///
/// `vertices`: N × 3 in the model's length unit. `triangles`: T × 3 indices of vertices. `values`: N, for example the
/// displacement along z in mm; a value that is missing or not finite counts as 0. `range`: the colours span
/// −`range` … `range`, values beyond it have the colour of the end.
///
/// Triangles that name a vertex that does not exist or is not finite are left out, as are those without area. With
/// nothing to draw the picture is blank.
pub fn picture(vertices: &[[f64; 3]], triangles: &[[u32; 3]], values: &[f64], range: f64, view: &View) -> Vec<u8> {
    let (width, height) = (view.width.clamp(1, SIDE_MAX), view.height.clamp(1, SIDE_MAX));
    encode(&pixels(vertices, triangles, values, range, view), width, height)
}

/// The pixels of [`picture`], row by row from the top: height × width × 4, RGBA with straight alpha.
pub fn pixels(vertices: &[[f64; 3]], triangles: &[[u32; 3]], values: &[f64], range: f64, view: &View) -> Vec<u8> {
    let (width, height) = (view.width.clamp(1, SIDE_MAX), view.height.clamp(1, SIDE_MAX));
    let triangles: Vec<[usize; 3]> = triangles
        .iter()
        .map(|corners| corners.map(|corner| corner as usize))
        .filter(|corners| corners.iter().all(|&corner| vertices.get(corner).is_some_and(is_finite)))
        .collect();
    let mut canvas = Canvas::new(width as usize * SAMPLES, height as usize * SAMPLES);
    if let Some(frame) = view.frame.or_else(|| Frame::of(&[vertices], view.direction)) {
        let place = placement(&frame, view.direction, &canvas);
        let normals = corner_normals(vertices, &triangles, axes(view.direction));
        for (corners, normals) in triangles.iter().zip(&normals) {
            let share = |corner: usize| share(values.get(corner).copied().unwrap_or(0.0), range);
            canvas.triangle(corners.map(|corner| place(vertices[corner])), corners.map(share), *normals);
        }
    }
    canvas.pixels()
}

// ---- where things are ---------------------------------------------------------------------------------------------

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The vector of length 1, or `otherwise` where there is no direction.
fn unit(a: Point, otherwise: Point) -> Point {
    let length = dot(a, a).sqrt();
    if length.is_finite() && length > 0.0 { a.map(|part| part / length) } else { otherwise }
}

fn is_finite(vertex: &Point) -> bool {
    vertex.iter().all(|part| part.is_finite())
}

/// Smallest and largest; (∞, −∞) of nothing. Numbers that are not finite do not count.
fn extent(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    let finite = numbers.filter(|number| number.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), number| (low.min(number), high.max(number)))
}

/// To the right, upward and towards the viewer, in the picture, as vectors of length 1.
fn axes(direction: Point) -> [Point; 3] {
    let towards = unit(direction, [0.0, -1.0, 0.0]);
    let right = unit(cross([0.0, 0.0, 1.0], towards), [1.0, 0.0, 0.0]); // from straight above, x is to the right
    [right, cross(towards, right), towards]
}

/// Model to samples: x to the right, y down, z towards the viewer. The frame fits with a margin of 4 %.
fn placement(frame: &Frame, direction: Point, canvas: &Canvas) -> impl Fn(Point) -> Point + use<> {
    let [right, up, towards] = axes(direction);
    let (width, height) = (canvas.width as f64, canvas.height as f64);
    let half = 1.04 * frame.half[1].max(frame.half[0] * height / width);
    let scale = if half.is_finite() && half > 0.0 { height / (2.0 * half) } else { 1.0 };
    let [x, y] = frame.middle;
    move |point| {
        [
            width / 2.0 + scale * (dot(right, point) - x),
            height / 2.0 - scale * (dot(up, point) - y),
            scale * dot(towards, point),
        ]
    }
}

/// Normals at the three corners of each triangle, in the axes of the picture: the mean, weighted by area, over the
/// triangles around the vertex that are tilted by less than the crease. T × 3.
fn corner_normals(vertices: &[Point], triangles: &[[usize; 3]], axes: [Point; 3]) -> Vec<[Point; 3]> {
    let faces: Vec<Point> = triangles
        .iter()
        .map(|&[a, b, c]| cross(minus(vertices[b], vertices[a]), minus(vertices[c], vertices[a])))
        .collect();
    let mut around = vec![Vec::new(); vertices.len()];
    for (triangle, corners) in triangles.iter().enumerate() {
        corners.iter().for_each(|&corner| around[corner].push(triangle));
    }
    let length = |a: Point| dot(a, a).sqrt();
    let normal = |corner: usize, own: Point| {
        let smooth = around[corner]
            .iter()
            .map(|&face| faces[face])
            .filter(|&face| dot(own, face) >= CREASE * length(own) * length(face));
        let sum = smooth.fold([0.0; 3], |sum, face| [sum[0] + face[0], sum[1] + face[1], sum[2] + face[2]]);
        unit(axes.map(|axis| dot(axis, sum)), [0.0, 0.0, 1.0])
    };
    triangles.iter().zip(&faces).map(|(corners, &own)| corners.map(|corner| normal(corner, own))).collect()
}

// ---- colour and light ---------------------------------------------------------------------------------------------

/// Where a value stands between −range and range, 0 to 1.
fn share(value: f64, range: f64) -> f64 {
    let share = 0.5 + 0.5 * value / range;
    if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 }
}

/// The colour at a share, sRGB, each part 0 to 255.
fn colour(share: f64) -> [f64; 3] {
    let at = share.clamp(0.0, 1.0) * (DIVERGING.len() - 1) as f64;
    let step = (at as usize).min(DIVERGING.len() - 2);
    let part = |step: usize, shift: u32| f64::from((DIVERGING[step] >> shift) & 255);
    [16, 8, 0].map(|shift| part(step, shift) + (at - step as f64) * (part(step + 1, shift) - part(step, shift)))
}

/// How bright a surface with this normal (in the axes of the picture, any length) is. The page's shader has the same formula.
fn light(normal: Point) -> f64 {
    let facing = if normal[2] < 0.0 { normal.map(|part| -part) } else { normal }; // both sides of a sheet are lit
    let lamp = unit([-0.35, 0.55, 0.76], [0.0, 0.0, 1.0]);
    0.5 + 0.54 * dot(unit(facing, [0.0, 0.0, 1.0]), lamp).max(0.0)
}

// ---- samples and pixels -------------------------------------------------------------------------------------------

/// Samples of a picture, [`SAMPLES`] × [`SAMPLES`] to the pixel, row by row from the top.
struct Canvas {
    width: usize,
    height: usize,
    /// How near the nearest triangle is; −∞ where there is none.
    depth: Vec<f64>,
    /// Its colour, sRGB.
    colour: Vec<[u8; 3]>,
}

impl Canvas {
    fn new(width: usize, height: usize) -> Self {
        Self { width, height, depth: vec![f64::NEG_INFINITY; width * height], colour: vec![[0; 3]; width * height] }
    }

    /// Draws a triangle: corners in samples, shares of the colour map and normals at them.
    fn triangle(&mut self, corners: [Point; 3], shares: [f64; 3], normals: [Point; 3]) {
        let [a, b, c] = corners;
        let double_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if !double_area.is_finite() || double_area == 0.0 {
            return;
        }
        let span = |axis: usize, most: usize| {
            let (low, high) = extent(corners.iter().map(|corner| corner[axis]));
            // casts saturate: what lies outside of the picture becomes its edge or an empty span
            ((low - 0.5).ceil().max(0.0) as usize, ((high + 0.5).floor().max(0.0) as usize).min(most))
        };
        let ((left, right), (top, bottom)) = (span(0, self.width), span(1, self.height));
        for row in top..bottom {
            for column in left..right {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                // the share of a corner is the area of the triangle opposite to it
                let of_b = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / double_area;
                let of_c = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / double_area;
                let parts = [1.0 - of_b - of_c, of_b, of_c];
                // a sample on the edge of two triangles belongs to both, so that rounding leaves no crack
                if parts.iter().all(|&part| part >= -1e-9) {
                    self.sample(row * self.width + column, parts, corners, shares, normals);
                }
            }
        }
    }

    fn sample(&mut self, at: usize, parts: [f64; 3], corners: [Point; 3], shares: [f64; 3], normals: [Point; 3]) {
        let mean = |numbers: [f64; 3]| dot(parts, numbers);
        let depth = mean(corners.map(|corner| corner[2]));
        if depth > self.depth[at] {
            // normals of a sheet seen from behind turn together, so that their mean does not vanish
            let bright = light([0, 1, 2].map(|axis| mean(normals.map(|normal| normal[axis]))));
            self.depth[at] = depth;
            self.colour[at] = colour(mean(shares)).map(|part| (part * bright).round().clamp(0.0, 255.0) as u8);
        }
    }

    /// Means over the samples of each pixel, RGBA with straight alpha.
    fn pixels(&self) -> Vec<u8> {
        let (width, height) = (self.width / SAMPLES, self.height / SAMPLES);
        let mut pixels = Vec::with_capacity(4 * width * height);
        for row in 0..height {
            for column in 0..width {
                pixels.extend(self.pixel(row, column));
            }
        }
        pixels
    }

    fn pixel(&self, row: usize, column: usize) -> [u8; 4] {
        let (mut sum, mut covered) = ([0u32; 3], 0u32);
        for y in 0..SAMPLES {
            for x in 0..SAMPLES {
                let at = (row * SAMPLES + y) * self.width + column * SAMPLES + x;
                if self.depth[at] > f64::NEG_INFINITY {
                    covered += 1;
                    sum.iter_mut().zip(self.colour[at]).for_each(|(sum, part)| *sum += u32::from(part));
                }
            }
        }
        if covered == 0 {
            return [0; 4];
        }
        let all = (SAMPLES * SAMPLES) as u32;
        let [red, green, blue] = sum.map(|part| ((part + covered / 2) / covered) as u8);
        [red, green, blue, ((255 * covered + all / 2) / all) as u8]
    }
}

/// RGBA pixels as the bytes of a PNG file.
fn encode(pixels: &[u8], width: u32, height: u32) -> Vec<u8> {
    let mut file = Vec::new();
    PngEncoder::new(&mut file)
        .write_image(pixels, width, height, ExtendedColorType::Rgba8)
        .expect("memory takes every byte, and there are four for each pixel");
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(file: &[u8]) -> image::RgbaImage {
        image::load_from_memory(file).expect("a PNG").to_rgba8()
    }

    /// A sphere of radius 1 in rings of latitude, with a displacement that grows with z.
    fn sphere(rings: u32, columns: u32) -> (Vec<Point>, Vec<[u32; 3]>, Vec<f64>) {
        let mut vertices = Vec::new();
        for ring in 0..=rings {
            for column in 0..columns {
                let (down, around) = (f64::from(ring) / f64::from(rings), f64::from(column) / f64::from(columns));
                let (down, around) = (std::f64::consts::PI * down, 2.0 * std::f64::consts::PI * around);
                vertices.push([down.sin() * around.cos(), down.sin() * around.sin(), down.cos()]);
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..rings {
            for column in 0..columns {
                let (a, b) = (ring * columns + column, ring * columns + (column + 1) % columns);
                triangles.extend([[a, a + columns, b], [b, a + columns, b + columns]]);
            }
        }
        let values = vertices.iter().map(|vertex| vertex[2]).collect();
        (vertices, triangles, values)
    }

    fn square(y: f64) -> [Point; 4] {
        [[0.0, y, 0.0], [1.0, y, 0.0], [1.0, y, 1.0], [0.0, y, 1.0]]
    }

    const FRONT: Point = [0.0, -1.0, 0.0];

    fn front(width: u32, height: u32) -> View {
        View { width, height, direction: FRONT, frame: None }
    }

    #[test]
    fn the_outline_of_a_sphere_is_a_disc() {
        let (vertices, triangles, values) = sphere(48, 96);
        let image = decode(&picture(&vertices, &triangles, &values, 1.0, &front(120, 120)));
        let covered: f64 = image.pixels().map(|pixel| f64::from(pixel[3]) / 255.0).sum();
        let radius = 120.0 / 2.0 / 1.04;
        // the outline is a polygon of 96 sides, 0.07 % smaller than the disc; alpha is rounded to a ninth of a pixel
        assert!((covered / (std::f64::consts::PI * radius * radius) - 1.0).abs() < 0.005);
        for (x, y, pixel) in image.enumerate_pixels() {
            assert!(pixel[3].abs_diff(image.get_pixel(119 - x, y)[3]) <= 86, "left and right differ at {x}, {y}");
            assert!(pixel[3].abs_diff(image.get_pixel(x, 119 - y)[3]) <= 86, "top and bottom differ at {x}, {y}");
        }
    }

    #[test]
    fn up_is_red_down_is_blue_and_rest_is_grey() {
        let (vertices, triangles, values) = sphere(24, 48);
        let image = decode(&picture(&vertices, &triangles, &values, 1.0, &front(90, 90)));
        let at = |y: u32| image.get_pixel(45, y).0;
        assert!(at(6)[0] > at(6)[2] + 60 && at(83)[2] > at(83)[0] + 40);
        assert!(at(45)[0].abs_diff(at(45)[2]) < 12);
    }

    #[test]
    fn the_side_of_a_sheet_does_not_matter() {
        let (vertices, triangles, values) = sphere(12, 24);
        let turned: Vec<_> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let view = View { width: 80, height: 60, ..View::default() };
        let [one, other] =
            [&triangles, &turned].map(|triangles| decode(&picture(&vertices, triangles, &values, 1.0, &view)));
        // corners come in another order, so that sums may round to the next step
        assert!(one.iter().zip(other.iter()).all(|(a, b)| a.abs_diff(*b) <= 1));
        assert_eq!(light([0.3, 0.2, 0.8]), light([-0.3, -0.2, -0.8]));
    }

    #[test]
    fn the_nearer_of_two_sheets_is_seen() {
        for near_first in [true, false] {
            let (near, far) = (square(0.0), square(1.0));
            let vertices = if near_first { [near, far] } else { [far, near] }.concat();
            let values: Vec<f64> = vertices.iter().map(|vertex| if vertex[1] == 0.0 { 1.0 } else { -1.0 }).collect();
            let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
            let pixel = decode(&picture(&vertices, &triangles, &values, 1.0, &front(30, 30))).get_pixel(15, 15).0;
            assert!(pixel[0] > pixel[2], "the near sheet is red, the pixel is {pixel:?}");
        }
    }

    #[test]
    fn pictures_in_one_frame_have_one_scale() {
        let small = square(0.0);
        let large = small.map(|vertex| vertex.map(|part| 2.0 * part));
        let frame = Frame::of(&[&small, &large], FRONT);
        assert_eq!(frame, Some(Frame { middle: [1.0, 1.0], half: [1.0, 1.0] }));
        let covered = |vertices: &[Point]| {
            let file = picture(vertices, &[[0, 1, 2], [0, 2, 3]], &[], 1.0, &View { frame, ..front(104, 104) });
            decode(&file).pixels().map(|pixel| f64::from(pixel[3]) / 255.0).sum::<f64>()
        };
        assert!((covered(&large) - 10_000.0).abs() < 1e-6, "half of 104 / 1.04 is 50 pixels");
        assert!((covered(&small) - 2_500.0).abs() < 1e-6);
    }

    #[test]
    fn the_longest_axis_runs_to_the_right() {
        for (shape, axis) in [([[0.0; 3], [9.0, 1.0, 2.0]], 0), ([[0.0; 3], [1.0, 9.0, 2.0]], 1)] {
            let [right, up, _] = axes(View::of(&shape).direction);
            assert!(right[axis] > 0.85 && up[2] > 0.85, "right is {right:?}, up is {up:?}");
        }
    }

    #[test]
    fn nothing_gives_a_blank_picture() {
        let image = decode(&picture(&[], &[], &[], 1.0, &View { width: 7, height: 5, ..View::default() }));
        assert_eq!(image.dimensions(), (7, 5));
        assert!(image.pixels().all(|pixel| pixel.0 == [0; 4]));
    }

    #[test]
    fn bad_input_is_left_out() {
        let mut vertices = square(0.0).to_vec();
        vertices.extend([[f64::NAN; 3], [f64::INFINITY, 0.0, 0.0], [0.5, 0.0, 0.5]]);
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 1, 4], [0, 1, 5], [0, 1, 900], [6, 6, 6]];
        let good = decode(&picture(&square(0.0), &triangles[..2], &[0.0; 4], 1.0, &front(40, 40)));
        let bad = decode(&picture(&vertices, &triangles, &[f64::NAN, 0.0], f64::NAN, &front(40, 40)));
        assert_eq!(good, bad);
        for (direction, frame) in [
            ([f64::NAN; 3], None),
            ([0.0; 3], None),
            ([0.0, 0.0, 1.0], Some(Frame { middle: [f64::NAN; 2], half: [0.0; 2] })),
        ] {
            picture(&vertices, &triangles, &[], 0.0, &View { width: 0, height: 3, direction, frame });
        }
    }

    #[test]
    fn the_page_has_the_same_colours_and_light() {
        let (data, shapes) = (include_str!("page/js/data.js"), include_str!("page/js/shapes.js"));
        let table =
            data.split("const DIVERGING = [").nth(1).and_then(|rest| rest.split(']').next()).unwrap_or_default();
        let steps: Vec<u32> =
            table.split('"').skip(1).step_by(2).filter_map(|step| u32::from_str_radix(step, 16).ok()).collect();
        assert_eq!(steps, DIVERGING);
        assert!(shapes.contains("0.5 + 0.54 * max(dot(m, normalize(vec3(-0.35, 0.55, 0.76))), 0.0)"));
        assert!(shapes.contains("alongY ? [1, 0.4, 0.5] : [0.4, -1, 0.5]"));
    }
}
