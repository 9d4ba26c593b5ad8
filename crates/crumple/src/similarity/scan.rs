//! One pass over stored coefficients: how alike every row and a target are.
//!
//! What is compared of a row is v_i = a_i x_i + b_i for its stored x_i: offset, scale, centre and weight are all in a and b.
//! A cosine needs Σ t v and Σ v², a distance Σ (t − v)². Every x is read once, in single precision as it is stored, and
//! everything else stays in the first-level cache, so that a search takes about as long as its numbers take to come from
//! memory (docs/performance.md). Sums are in double precision: cosines of coordinates differ in the sixth digit and beyond.
//!
//! The loop is there twice: for AVX2, two rows at a time, and for any processor. A row's sums are always added in the
//! same order, alone or among others, so that every command gives one run the same number.

/// Numbers that are worked on at a time: one register of AVX2 in double precision.
const LANES: usize = 4;

type Lanes = [f64; LANES];

/// Sums of one row: Σ t v and Σ v² for a cosine, Σ (t − v)² and nothing for a distance.
pub(super) type Sums = [f64; 2];

/// Bytes from a row to what is asked for ahead of it: about the time that memory takes to answer.
#[cfg(target_arch = "x86_64")]
const AHEAD: usize = 4096;
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

/// What is compared of one slice of stored coefficients, by whole lanes. The last lanes are those of the row's end, with
/// zeros for what the lanes before have, or for what a row of fewer numbers lacks.
#[derive(Debug, Clone)]
pub(super) struct Slice {
    /// Numbers that a row has.
    pub(super) width: usize,
    numbers: Vec<Numbers>,
}

/// a, b and t of some numbers.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers {
    factor: Lanes,
    offset: Lanes,
    target: Lanes,
}

impl Slice {
    /// `factors`, `offsets` and `target`, all of one length: a, b and t of every number.
    pub(super) fn new(factors: &[f64], offsets: &[f64], target: &[f64]) -> Self {
        let width = target.len();
        let mut numbers = vec![Numbers::default(); width.div_ceil(LANES)];
        let last = numbers.len().saturating_sub(1);
        for at in 0..width {
            let (of, lane) = match at / LANES {
                of if of == last && width >= LANES => (of, at + LANES - width),
                of => (of, at % LANES),
            };
            numbers[of].factor[lane] = factors[at];
            numbers[of].offset[lane] = offsets[at];
            numbers[of].target[lane] = target[at];
        }
        Self { width, numbers }
    }

    /// Σ t², added in the order of a row's sums, so that a row that is the target has a cosine of exactly 1.
    pub(super) fn target_square(&self) -> f64 {
        let mut sums = [0.0; LANES];
        for numbers in &self.numbers {
            for (sum, t) in sums.iter_mut().zip(numbers.target) {
                *sum = if fused() { t.mul_add(t, *sum) } else { t * t + *sum };
            }
        }
        total(sums)
    }

    /// Adds the sums of rows to `sums`. `values`: rows × width.
    pub(super) fn add<const COSINE: bool>(&self, values: &[f32], sums: &mut [Sums]) {
        if self.width == 0 {
            return;
        }
        #[cfg(target_arch = "x86_64")]
        if fused() && self.width >= LANES {
            // SAFETY: ordinary safe code; calling it is unsafe only because it uses instructions that the line before has
            // found on this processor.
            return unsafe { self.add_avx2::<COSINE>(values, sums) };
        }
        if fused() {
            self.add_with::<COSINE, true>(values, sums);
        } else {
            self.add_with::<COSINE, false>(values, sums);
        }
    }

    fn add_with<const COSINE: bool, const FUSED: bool>(&self, values: &[f32], sums: &mut [Sums]) {
        let Some((last, whole)) = self.numbers.split_last() else { return };
        for (row, sums) in values.chunks_exact(self.width).zip(sums) {
            let (mut first, mut second) = ([0.0; LANES], [0.0; LANES]);
            for (x, numbers) in row.as_chunks::<LANES>().0.iter().zip(whole) {
                numbers.add::<COSINE, FUSED>(x, &mut first, &mut second);
            }
            match row.last_chunk::<LANES>() {
                Some(end) => last.add::<COSINE, FUSED>(end, &mut first, &mut second),
                None => last.add::<COSINE, FUSED>(&filled_up(row), &mut first, &mut second),
            }
            sums[0] += total(first);
            sums[1] += total(second);
        }
    }

    /// The same, number by number, two rows at a time: what is compared with is loaded once for both.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn add_avx2<const COSINE: bool>(&self, values: &[f32], sums: &mut [Sums]) {
        let mut pairs = sums.chunks_exact_mut(2);
        for (rows, sums) in values.chunks_exact(2 * self.width).zip(&mut pairs) {
            ask_ahead(rows);
            let (one, other) = rows.split_at(self.width);
            let [of_one, of_other] = self.pair::<COSINE>(one, other);
            sums[0] = [sums[0][0] + of_one[0], sums[0][1] + of_one[1]];
            sums[1] = [sums[1][0] + of_other[0], sums[1][1] + of_other[1]];
        }
        if let [odd] = pairs.into_remainder() {
            let row = &values[values.len() - self.width..];
            let [of, _] = self.pair::<COSINE>(row, row);
            *odd = [odd[0] + of[0], odd[1] + of[1]];
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn pair<const COSINE: bool>(&self, one: &[f32], other: &[f32]) -> [Sums; 2] {
        use std::arch::x86_64::{
            __m128d, __m256d, _mm_add_pd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm256_castpd256_pd128,
            _mm256_extractf128_pd, _mm256_hadd_pd,
        };
        let ends = [one.last_chunk(), other.last_chunk()];
        let (Some((last, whole)), [Some(end), Some(other_end)]) = (self.numbers.split_last(), ends) else {
            return Default::default();
        };
        let mut pair = Pair::zero();
        for ((x, y), numbers) in one.as_chunks().0.iter().zip(other.as_chunks().0).zip(whole) {
            pair.add::<COSINE>(numbers, x, y);
        }
        pair.add::<COSINE>(last, end, other_end);
        let Pair { firsts, seconds } = pair;
        // (a₀ + a₁) + (a₂ + a₃) of both sums at once, as `total` adds them.
        let totals = |first: __m256d, second: __m256d| -> Sums {
            let pairs = _mm256_hadd_pd(first, second);
            let sums: __m128d = _mm_add_pd(_mm256_castpd256_pd128(pairs), _mm256_extractf128_pd::<1>(pairs));
            [_mm_cvtsd_f64(sums), _mm_cvtsd_f64(_mm_unpackhi_pd(sums, sums))]
        };
        [totals(firsts[0], seconds[0]), totals(firsts[1], seconds[1])]
    }
}

/// Lanes of the sums of two rows.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
struct Pair {
    firsts: [std::arch::x86_64::__m256d; 2],
    seconds: [std::arch::x86_64::__m256d; 2],
}

#[cfg(target_arch = "x86_64")]
impl Pair {
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn zero() -> Self {
        let zero = std::arch::x86_64::_mm256_setzero_pd();
        Self { firsts: [zero; 2], seconds: [zero; 2] }
    }

    /// [`Numbers::add`] for a number of either row.
    #[target_feature(enable = "avx2,fma")]
    #[inline]
    fn add<const COSINE: bool>(&mut self, numbers: &Numbers, one: &[f32; LANES], other: &[f32; LANES]) {
        use std::arch::x86_64::{_mm_setr_ps, _mm256_cvtps_pd, _mm256_fmadd_pd, _mm256_setr_pd, _mm256_sub_pd};
        let double = |[a, b, c, d]: Lanes| _mm256_setr_pd(a, b, c, d);
        let (factor, offset, target) = (double(numbers.factor), double(numbers.offset), double(numbers.target));
        for (row, &[a, b, c, d]) in [one, other].into_iter().enumerate() {
            let v = _mm256_fmadd_pd(factor, _mm256_cvtps_pd(_mm_setr_ps(a, b, c, d)), offset);
            if COSINE {
                self.firsts[row] = _mm256_fmadd_pd(target, v, self.firsts[row]);
                self.seconds[row] = _mm256_fmadd_pd(v, v, self.seconds[row]);
            } else {
                let off = _mm256_sub_pd(target, v);
                self.firsts[row] = _mm256_fmadd_pd(off, off, self.firsts[row]);
            }
        }
    }
}

/// A row of fewer numbers than lanes.
fn filled_up(row: &[f32]) -> [f32; LANES] {
    std::array::from_fn(|lane| row.get(lane).copied().unwrap_or(0.0))
}

/// Asks for the numbers that come [`AHEAD`] of these, so that they are there when their row comes.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn ask_ahead(rows: &[f32]) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
    for line in 0..(4 * rows.len()).div_ceil(LINE) {
        let ahead = rows.as_ptr().cast::<i8>().wrapping_add(AHEAD + line * LINE);
        // SAFETY: a prefetch of any address reads nothing and cannot fault.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(ahead) };
    }
}

impl Numbers {
    fn add<const COSINE: bool, const FUSED: bool>(&self, x: &[f32; LANES], first: &mut Lanes, second: &mut Lanes) {
        for lane in 0..LANES {
            let v = fma::<FUSED>(self.factor[lane], f64::from(x[lane]), self.offset[lane]);
            if COSINE {
                first[lane] = fma::<FUSED>(self.target[lane], v, first[lane]);
                second[lane] = fma::<FUSED>(v, v, second[lane]);
            } else {
                let off = self.target[lane] - v;
                first[lane] = fma::<FUSED>(off, off, first[lane]);
            }
        }
    }
}

/// a·b + c, rounded once where it is fused.
fn fma<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Sum of the lanes, always in the same order.
fn total([a, b, c, d]: Lanes) -> f64 {
    (a + b) + (c + d)
}

/// Whether a product and a sum are rounded once.
fn fused() -> bool {
    #[cfg(target_arch = "x86_64")]
    return is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

/// The rows with the smallest keys, of those offered in rising order.
#[derive(Debug, Clone)]
pub(super) struct Smallest {
    count: usize,
    kept: Vec<(f64, usize)>,
    /// What a key must be below to be among them, once there are enough.
    bound: f64,
}

impl Smallest {
    pub(super) fn new(count: usize) -> Self {
        let bound = if count == 0 { f64::NEG_INFINITY } else { f64::INFINITY };
        Self { count, kept: Vec::new(), bound }
    }

    pub(super) fn bound(&self) -> f64 {
        self.bound
    }

    /// Among equal keys the row that came first stays.
    #[inline(always)]
    pub(super) fn offer(&mut self, key: f64, row: usize) {
        if key < self.bound {
            self.kept.push((key, row));
            if self.kept.len() >= self.count.saturating_mul(2) {
                self.cut();
            }
        }
    }

    /// Those of both.
    pub(super) fn with(mut self, other: Self) -> Self {
        self.kept.extend(other.kept);
        self.cut();
        self
    }

    fn cut(&mut self) {
        if self.kept.len() > self.count {
            let last = self.kept.select_nth_unstable_by(self.count - 1, order).1.0;
            self.kept.truncate(self.count);
            self.bound = last;
        }
    }

    /// Rows, smallest key first, ties by row.
    pub(super) fn rows(mut self) -> Vec<usize> {
        self.cut();
        self.kept.sort_unstable_by(order);
        self.kept.into_iter().map(|(_, row)| row).collect()
    }
}

fn order(a: &(f64, usize), b: &(f64, usize)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_any_width_are_those_of_the_formula_by_both_compilations() {
        for width in [1, 2, 7, 8, 9, 16, 51, 60] {
            let number = |seed: usize, at: usize| ((at * 37 + seed * 11 + 5) % 83) as f64 / 20.0 - 2.0;
            let list = |seed: usize| (0..width).map(|at| number(seed, at)).collect::<Vec<f64>>();
            let (factors, offsets, target) = (list(1), list(2), list(3));
            let slice = Slice::new(&factors, &offsets, &target);
            let values: Vec<f32> = (0..5 * width).map(|at| number(4, at) as f32).collect();
            let (mut cosine, mut plain, mut distance) = ([[0.0; 2]; 5], [[0.0; 2]; 5], [[0.0; 2]; 5]);
            slice.add::<true>(&values, &mut cosine);
            slice.add_with::<true, false>(&values, &mut plain);
            slice.add::<false>(&values, &mut distance);
            for row in 0..5 {
                let v: Vec<f64> =
                    (0..width).map(|at| factors[at] * f64::from(values[row * width + at]) + offsets[at]).collect();
                let sum = |of: &dyn Fn(usize) -> f64| (0..width).map(of).sum::<f64>();
                let expected = [sum(&|at| target[at] * v[at]), sum(&|at| v[at] * v[at])];
                let off = sum(&|at| (target[at] - v[at]).powi(2));
                // Rounding of 60 sums of numbers below 100.
                let close = |a: f64, b: f64| (a - b).abs() < 1e-10;
                assert!((0..2).all(|at| close(cosine[row][at], expected[at]) && close(plain[row][at], expected[at])));
                assert!(close(distance[row][0], off), "{width}");
                // One row alone has the same bits, and the other loop gives them too where it rounds as often.
                let (mut alone, mut other) = ([[0.0; 2]], [[0.0; 2]]);
                let row_values = &values[row * width..(row + 1) * width];
                slice.add::<true>(row_values, &mut alone);
                slice.add_with::<true, true>(row_values, &mut other);
                assert_eq!(alone[0], cosine[row]);
                assert!(other[0] == cosine[row] || !fused(), "{width}");
            }
        }
    }

    #[test]
    fn the_target_itself_has_a_cosine_of_exactly_one() {
        let target: Vec<f32> = (0..51).map(|at| 1.0 / (at as f32 + 3.0)).collect();
        let wide: Vec<f64> = target.iter().map(|&t| f64::from(t)).collect();
        let slice = Slice::new(&[1.0; 51], &[0.0; 51], &wide);
        let mut sums = [[0.0; 2]];
        slice.add::<true>(&target, &mut sums);
        assert_eq!(sums[0], [slice.target_square(); 2]);
    }

    #[test]
    fn the_smallest_are_those_of_a_full_sort() {
        let keys: Vec<f64> = (0..1000_u32).map(|i| f64::from((i * i * 31) % 97)).collect();
        let mut sorted: Vec<usize> = (0..1000).collect();
        sorted.sort_by(|&a, &b| keys[a].total_cmp(&keys[b]).then(a.cmp(&b)));
        for count in [0, 1, 7, 500, 1000, 5000] {
            let some = |rows: std::ops::Range<usize>| {
                let mut smallest = Smallest::new(count);
                rows.for_each(|row| smallest.offer(keys[row], row));
                smallest
            };
            let expected = &sorted[..count.min(1000)];
            assert_eq!(some(0..1000).rows(), expected);
            assert_eq!(some(0..300).with(some(300..1000)).rows(), expected);
        }
    }
}
