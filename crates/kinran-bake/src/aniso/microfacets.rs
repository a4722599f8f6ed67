//! Microfacets of a footprint, and the lobe that a filter fits to them.
//!
//! Each texel gives up to 16 microfacets: the four radii of [`UNIT_SLOPES`](kinran_shading::UNIT_SLOPES), each on
//! opposite pairs of directions that are turned from texel to texel ([`turn`]), mapped by the texel's normal and
//! roughness. Seen in the frame of the footprint's linear result n0, microfacet h has slope `s = h.xy/h.z` and weight
//! `W = h.z`: its area as the mesh sees it, times the weight of its texel where texels differ in that. A filter finds the lobe's mean slope and squared roughness among them,
//! starting at the linear result. What it found counts as far as it is smooth ([`towards_linear`]).
//!
//! Every level is fitted to microfacets of level 0. Footprints of more than 25 texels use fewer microfacets a texel, and
//! those of more than 1024 texels a stratified choice of texels: a summary, whose error against all microfacets is stated
//! at [`MAX_TEXELS`] and bounded by a test.

use std::array::from_fn;
use std::f32::consts::PI;
use std::marker::PhantomData;
use std::sync::LazyLock;

use glam::{Vec2, vec2};
use kinran_shading::{Sym2, Sym3, sggx_principal_axis};

use super::footprint::Taps;
use super::lanes::{F8, LANES, V8};
use super::maps::{SurfaceMaps, TexelSpan};
use super::moments::{sggx_normals, sggx_roughness};
use super::weights;
use crate::simd::dispatch;

/// Texels of a footprint looked at: all, or 32 × 32 of a larger one, or as many of a longer and narrower one. Each axis is
/// cut into strata and one texel is drawn from each, at a different place in every row so that no weave lines up with it.
///
/// Error of this summary against the likelihood's optimum over all texels with 16 microfacets each, on random, brushed and
/// woven textures of 64² and 128² texels: levels 1 and 2 within 0.5 % of alpha and 0.1°, levels 3 and 4 within 5 % (median 1 %)
/// and 0.5°, further levels within 8 % (median 1.5 %) and 3°; of weaves and stripes whose period is a power of two, those
/// within 10 %.
pub const MAX_TEXELS: usize = 1024;

/// Texels looked at along each axis of a footprint that is long along both.
const MAX_AXIS_TEXELS: usize = 32;

/// Squared roughness, of an alpha of 0.63, around which [`towards_linear`] leaves the fit; chosen with its power so that on no
/// class of rough footprints in `tests/filter_quality.rs` the fit is worse than the linear filter by more than 2 %.
const ROUGH: f32 = 0.4;

/// Smallest squared roughness in an iteration, against division by a vanishing determinant: 1/8 of the
/// smallest step of an 8-bit aniso channel, squared.
pub(super) const MIN_A: f32 = 2.4e-7;

/// Smallest cosine to n0 at which a microfacet still has a slope; chosen by eye.
const MIN_COSINE: f32 = 1e-3;

/// Smallest eigenvalue of a normal, as a share of the SGGX matrix's trace: ten times the rounding of single
/// precision.
const MIN_AREA: f32 = 1e-6;

/// Mean slopes and squared roughness `[xx, xy, yy]` of the lanes' lobes.
pub(super) type Lobes = ([F8; 2], [F8; 3]);

/// How a filter fits a lobe to microfacets. A trait, since functions that are passed along are called, not inlined, and what
/// is not inlined is not compiled for the processor's vectors.
pub(super) trait Fit {
    /// The lobes of microfacets, starting at the squared roughness of the linear results, whose mean slopes are zero.
    fn fit(microfacets: &[Microfacet], start: [F8; 3]) -> Lobes;
}

/// Fits some rows of a level: `columns` are the footprints of their texels along x, `rows` those along y.
pub(super) fn fit_band<F: Fit>(maps: &SurfaceMaps, columns: &[Taps], rows: &[Taps], out: &mut TexelSpan) {
    out.resize(columns.len() * rows.len());
    dispatch(FitBand::<F> { maps, columns, rows, out, fit: PhantomData });
}

struct FitBand<'a, F> {
    maps: &'a SurfaceMaps,
    columns: &'a [Taps],
    rows: &'a [Taps],
    out: &'a mut TexelSpan,
    fit: PhantomData<F>,
}

/// One texel of each lane's footprint.
#[derive(Clone, Copy, Default)]
struct Sample {
    /// Images of the unit slopes' axes, and the normal: `h = p X + q Y + n`.
    basis: [V8; 3],
    weight: F8,
}

/// One microfacet of each lane's footprint in the frame of the lane's n0.
#[derive(Clone, Copy, Default)]
pub(super) struct Microfacet {
    pub(super) x: F8,
    pub(super) y: F8,
    pub(super) weight: F8,
}

impl<F: Fit> pulp::WithSimd for FitBand<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { maps, columns, rows, out, .. } = self;
        let width = columns.len();
        let weighted = maps.checked_weights().is_some();
        let mut block = Block { most: most_texels(longest(columns), longest(rows)), ..Block::default() };
        let mut microfacets = Vec::new();
        let mut x0 = 0;
        while x0 < width {
            let end = block_end(columns, longest(rows).min(block.most[1]), x0);
            let columns = &columns[x0..end];
            block.begin(columns);
            for (y, rows) in rows.iter().enumerate() {
                block.decode(maps, columns, rows);
                for (group, columns) in columns.chunks(LANES).enumerate() {
                    let at = y * width + x0 + group * LANES;
                    fit_group::<F>(&block, group, columns.len(), weighted, &mut microfacets, at, out);
                }
            }
            x0 = end;
        }
    }
}

/// Texels of level 0 decoded at a time, when one group of lanes does not need more: their samples take 160 KiB.
const BLOCK_TEXELS: u32 = 4096;

/// Texels looked at along each axis of footprints of this size.
fn most_texels(columns: usize, rows: usize) -> [usize; 2] {
    [rows, columns].map(|other| MAX_TEXELS / other.clamp(1, MAX_AXIS_TEXELS))
}

/// End of the texels from `x` on, whole groups of lanes, whose footprints of so many `rows` are decoded together.
fn block_end(columns: &[Taps], rows: usize, x: usize) -> usize {
    let most = BLOCK_TEXELS / rows as u32;
    let mut end = (x + LANES).min(columns.len());
    let first = columns[x][0].0;
    while end < columns.len() {
        let next = (end + LANES).min(columns.len());
        let last = columns[next - 1].last().map_or(0, |tap| tap.0);
        // A footprint that wraps around the border may begin before the block does.
        if last < first || last - first >= most {
            break;
        }
        end = next;
    }
    end
}

/// The samples of the footprints of some neighbouring output texels.
#[derive(Default)]
struct Block {
    /// Texels looked at along each axis.
    most: [usize; 2],
    /// First column of level 0 and the number of columns.
    columns: (u32, usize),
    /// Samples of a footprint along x.
    taps: usize,
    /// Rows drawn, one from each stratum, and their weights.
    rows: Vec<(u32, f32)>,
    /// `[group][row][tap]`.
    samples: Vec<Sample>,
    /// Texels as decoded, from which the samples of a row are gathered.
    span: TexelSpan,
    /// Square roots of the texels' squared roughness, `[xx, xy, yy]`.
    roots: [Vec<f32>; 3],
    /// Column of each lane of each sample of a row, `[group][tap]`, from the first column on.
    picked: Vec<[u32; LANES]>,
    /// Weights of the same.
    weights: Vec<F8>,
    /// `[nx, ny, nz]` and roots `[xx, xy, yy]` of the same.
    gathered: [Vec<F8>; 6],
    /// The first texel of each output texel's footprint.
    first: TexelSpan,
}

impl Block {
    /// Samples of one group of lanes.
    #[inline(always)]
    fn group(&self, group: usize) -> &[Sample] {
        let len = self.rows.len() * self.taps;
        &self.samples[group * len..][..len]
    }

    /// Goes to other columns.
    fn begin(&mut self, columns: &[Taps]) {
        let taps = || columns.iter().flatten().map(|tap| tap.0);
        let (first, last) = (taps().min().unwrap_or(0), taps().max().unwrap_or(0));
        self.columns = (first, (last - first + 1) as usize);
        self.taps = longest(columns).min(self.most[0]);
        self.pick(columns, 0);
    }

    /// Makes the samples of the footprints that have these rows.
    #[inline(always)]
    fn decode(&mut self, maps: &SurfaceMaps, columns: &[Taps], rows: &Taps) {
        let (first, len) = self.columns;
        self.rows.clear();
        let salt = |j| j as u32 * 977 + rows[0].0;
        self.rows
            .extend(strata(rows, self.most[1]).enumerate().map(|(j, stratum)| draw(rows, stratum, salt(j))));

        let row_len = columns.len().div_ceil(LANES) * self.taps;
        self.samples.resize(self.rows.len() * row_len, Sample::default());
        self.gathered.iter_mut().for_each(|plane| plane.resize(row_len, F8::default()));
        for j in 0..self.rows.len() {
            let (row, row_weight) = self.rows[j];
            maps.decode_span(maps.size(), row, first, len, &mut self.span);
            // Taps that are drawn are others in every row.
            if longest(columns) > self.most[0] {
                self.pick(columns, row);
            }
            if j == 0 {
                self.first.resize(columns.len());
                for i in 0..columns.len() {
                    let column = self.picked[i / LANES * self.taps][i % LANES];
                    let (n, a) = self.span.texel(column as usize);
                    self.first.set(i, n, a);
                }
            }
            self.gather(j, row_weight);
            if let Some(weights) = &maps.weights {
                self.weigh(j, weights.row(row, first, len));
            }
        }
    }

    /// Draws the texels of a row.
    fn pick(&mut self, columns: &[Taps], row: u32) {
        self.picked.clear();
        self.weights.clear();
        for group in columns.chunks(LANES) {
            for i in 0..self.taps {
                let mut weights = F8::default();
                self.picked.push(from_fn(|l| {
                    let (column, weight) = pick(&group[l.min(group.len() - 1)], self.most[0], row, i);
                    weights.0[l] = weight;
                    column - self.columns.0
                }));
                self.weights.push(weights);
            }
        }
    }

    /// Weighs the samples of row `j` by the weights of its texels.
    #[inline(always)]
    fn weigh(&mut self, j: usize, of: &[u16]) {
        let (taps, rows) = (self.taps, self.rows.len());
        let groups = self.samples.chunks_exact_mut(rows * taps).zip(self.picked.chunks_exact(taps));
        for (samples, picked) in groups {
            for (sample, picked) in samples[j * taps..(j + 1) * taps].iter_mut().zip(picked) {
                sample.weight = sample.weight * F8(picked.map(|column| weights::share(of[column as usize])));
            }
        }
    }

    /// Makes the samples of row `j` from its decoded texels.
    #[inline(always)]
    fn gather(&mut self, j: usize, row_weight: f32) {
        let len = self.span.len();
        let Self { span, roots: [rxx, rxy, ryy], .. } = self;
        let (axx, axy, ayy) = (&span.axx[..len], &span.axy[..len], &span.ayy[..len]);
        [&mut *rxx, &mut *rxy, &mut *ryy].into_iter().for_each(|root| root.resize(len, 0.0));
        let (rxx, rxy, ryy) = (&mut rxx[..len], &mut rxy[..len], &mut ryy[..len]);
        for i in 0..len {
            let root = Sym2 { xx: axx[i], xy: axy[i], yy: ayy[i] }.sqrt();
            (rxx[i], rxy[i], ryy[i]) = (root.xx, root.xy, root.yy);
        }

        // Plane by plane: gathering texel by texel, the processor waits to read together what it wrote one by one.
        let planes = [&span.nx[..len], &span.ny[..len], &span.nz[..len], rxx, rxy, ryy];
        for (gathered, plane) in self.gathered.iter_mut().zip(planes) {
            for (gathered, picked) in gathered.iter_mut().zip(&self.picked) {
                for (v, column) in gathered.0.iter_mut().zip(picked) {
                    *v = plane[*column as usize];
                }
            }
        }

        let (taps, rows) = (self.taps, self.rows.len());
        let [nx, ny, nz, xx, xy, yy] = &self.gathered;
        for (group, samples) in self.samples.chunks_exact_mut(rows * taps).enumerate() {
            for (i, sample) in (group * taps..).zip(&mut samples[j * taps..(j + 1) * taps]) {
                let n = V8 { x: nx[i], y: ny[i], z: nz[i] };
                *sample = Sample {
                    basis: microfacet_bases(n, [xx[i], xy[i], yy[i]]),
                    weight: self.weights[i] * F8::splat(row_weight),
                };
            }
        }
    }
}

/// Texels of the longest of some footprints.
fn longest(columns: &[Taps]) -> usize {
    columns.iter().map(|taps| taps.len()).max().unwrap_or(0)
}

/// The columns of [`m_n`](kinran_shading::m_n) of normals with z ≥ 0.
#[inline(always)]
fn frames(n: V8) -> [V8; 3] {
    let a = (F8::splat(1.0) + n.z).recip();
    let mixed = -n.x * n.y * a;
    let x = V8 { x: n.z + n.y * n.y * a, y: mixed, z: -n.x };
    let y = V8 { x: mixed, y: n.z + n.x * n.x * a, z: -n.y };
    [x, y, n]
}

/// [`microfacet_basis`](kinran_shading::microfacet_basis) of normals with z ≥ 0 and roots `[xx, xy, yy]`.
#[inline(always)]
fn microfacet_bases(n: V8, [xx, xy, yy]: [F8; 3]) -> [V8; 3] {
    let [x, y, n] = frames(n);
    [x * xx + y * xy, x * xy + y * yy, n]
}

/// Microfacets a texel contributes, by the number of texels looked at: all 16 for the 16 texels of the second level, half as
/// many for the 64 of the third, where all would not stay in the first-level cache and gain one hundredth on metal.
fn microfacets_per_texel(texels: usize) -> usize {
    match texels {
        0..=25 => 16,
        26..=100 => 8,
        101..=300 => 8,
        301..=600 => 4,
        _ => 2,
    }
}

/// Directions in half a turn.
const DIRECTIONS: usize = 128;

/// Slopes of a unit GGX lobe: four radii `sqrt(u / (1 - u))`, `u = (k + 1/2) / 4`, in every direction.
static SLOPES: LazyLock<[[Vec2; DIRECTIONS]; 4]> = LazyLock::new(|| {
    from_fn(|k| {
        let u = (k as f32 + 0.5) / 4.0;
        let radius = (u / (1.0 - u)).sqrt();
        from_fn(|i| {
            let angle = PI * i as f32 / DIRECTIONS as f32;
            vec2(libm::cosf(angle), libm::sinf(angle)) * radius
        })
    })
});

/// By how much the microfacets of the texel in row `j` and column `i` of the samples are turned, and at which radii they
/// lie where a texel gives too few for all four; both in [0, 2^32).
///
/// Rank-1 lattices, whose steps are so irrational (powers of the plastic number, as Roberts 2018 has them; the golden ratio
/// and √2 − 1 for the radii) that the texels of a thread, a stripe or a checker of any period are spread evenly over all
/// turns. Microfacets in the same 16 directions in every texel make crossing threads up to 35 % too narrow, and those at
/// ±25° 7 to 19 % too wide.
#[inline(always)]
fn turn(i: usize, j: usize) -> [u32; 2] {
    let lattice = |x: u32, y: u32| (i as u32).wrapping_mul(x).wrapping_add((j as u32).wrapping_mul(y));
    [lattice(0xC13F_A9A9, 0x91E1_0DA5), lattice(0x9E37_79B9, 0x6A09_E667)]
}

/// The slope of the first of pair `pair` of the microfacets of a texel that uses `COUNT`. The second one's is opposite, so
/// that a texel's mean slope is not disturbed. At each radius, directions are spread evenly over half a turn.
#[inline(always)]
fn slope<const COUNT: usize>(
    slopes: &[[Vec2; DIRECTIONS]; 4],
    [turn, radius]: [u32; 2],
    pair: usize,
) -> Vec2 {
    // Directions that a pair may be turned by without meeting the next one of its radius.
    let turned = |free: usize| ((u64::from(turn) * free as u64) >> 32) as usize;
    let (radius, direction) = match COUNT {
        16 => {
            let radius = pair / 2;
            (radius, turned(DIRECTIONS / 2) + DIRECTIONS / 2 * (pair % 2) + DIRECTIONS / 4 * (radius % 2))
        }
        8 => (pair, turned(DIRECTIONS) + DIRECTIONS / 4 * [0, 2, 1, 3][pair % 4]),
        4 => (2 * pair + (radius >> 31) as usize, turned(DIRECTIONS) + DIRECTIONS / 2 * pair),
        _ => ((radius >> 30) as usize, turned(DIRECTIONS)),
    };
    slopes[radius % 4][direction % DIRECTIONS]
}

/// Fits the `count` footprints of group `group` of the block and puts them at `at` and behind it.
#[inline(always)]
fn fit_group<F: Fit>(
    block: &Block,
    group: usize,
    count: usize,
    weighted: bool,
    microfacets: &mut Vec<Microfacet>,
    at: usize,
    out: &mut TexelSpan,
) {
    let samples = block.group(group);
    let mut linear = linear_sums(samples);
    if weighted {
        linear.normalise(samples);
    }
    let (frame, start) = linear_frames(&linear);
    match microfacets_per_texel(samples.len()) {
        16 => scatter::<16>(samples, block.taps, &frame, microfacets),
        8 => scatter::<8>(samples, block.taps, &frame, microfacets),
        4 => scatter::<4>(samples, block.taps, &frame, microfacets),
        _ => scatter::<2>(samples, block.taps, &frame, microfacets),
    }
    let (m, a) = towards_linear(start, F::fit(microfacets, start));

    let (n, [xx, xy, yy]) = surfaces(&frame, &linear.mean, m, a);
    for (plane, lanes) in [
        (&mut out.nx, n.x),
        (&mut out.ny, n.y),
        (&mut out.nz, n.z),
        (&mut out.axx, xx),
        (&mut out.axy, xy),
        (&mut out.ayy, yy),
    ] {
        plane[at..at + count].copy_from_slice(&lanes.0[..count]);
    }

    // Constant footprints and eigenvalues outside [0, 1] are rare: lanes look for them together.
    let one = F8::splat(1.0);
    let within = (xx * yy - xy * xy).min_of((one - xx) * (one - yy) - xy * xy).min_of(one - xx);
    let mut plain = true;
    for l in 0..LANES {
        plain &= (within.0[l] > 0.0) & (linear.varies[l] != 0);
    }
    if plain {
        return;
    }
    for l in 0..count {
        let (n, a) = if linear.varies[l] == 0 {
            block.first.texel(group * LANES + l)
        } else {
            let (n, a) = out.texel(at + l);
            (n, a.clamp_eigen(0.0, 1.0))
        };
        out.set(at + l, n, a);
    }
}

/// At most `most` texels looked at along one axis: for each stratum its first tap and the one behind its last.
fn strata(taps: &Taps, most: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (len, count) = (taps.len(), taps.len().min(most));
    (0..count).map(move |i| (i * len / count, (i + 1) * len / count))
}

/// One tap of a stratum, drawn by a hash of `salt`, and the stratum's weight.
#[inline(always)]
fn draw(taps: &Taps, (begin, end): (usize, usize), salt: u32) -> (u32, f32) {
    if end - begin == 1 {
        return taps[begin];
    }
    // A multiplicative hash; its upper half is the fraction of the stratum.
    let fraction = u64::from(salt.wrapping_mul(0x9E37_79B9) ^ (salt >> 7).wrapping_mul(0x85EB_CA6B)) >> 8;
    let pick = begin + ((fraction * (end - begin) as u64) >> 24) as usize;
    (taps[pick].0, taps[begin..end].iter().map(|tap| tap.1).sum())
}

/// Sample `i` of at most `most` along x of a footprint in row `row`: its column and weight.
#[inline(always)]
fn pick(taps: &Taps, most: usize, row: u32, i: usize) -> (u32, f32) {
    if taps.len() <= most {
        // Shorter footprints, next to a longer one of an odd-sized level, repeat a texel without weight.
        taps.get(i).copied().unwrap_or((taps[0].0, 0.0))
    } else {
        let stratum = (i * taps.len() / most, (i + 1) * taps.len() / most);
        draw(taps, stratum, row * 131 + i as u32)
    }
}

/// What the linear filter finds out about a footprint.
struct Linear {
    /// Averages of the SGGX matrices, `[xx, xy, xz, yy, yz, zz]`.
    sums: [F8; 6],
    /// The average normals.
    mean: V8,
    /// Zero in lanes whose footprint is the same texel everywhere: it comes out as it went in.
    varies: [u32; LANES],
}

impl Linear {
    /// Makes averages of sums whose weights do not add up to one.
    #[inline(always)]
    fn normalise(&mut self, samples: &[Sample]) {
        let mut total = F8::default();
        for sample in samples {
            total += sample.weight;
        }
        let inv = total.recip();
        self.sums = self.sums.map(|sum| sum * inv);
        self.mean = self.mean * inv;
    }
}

#[inline(always)]
fn linear_sums(samples: &[Sample]) -> Linear {
    // M_n A M_n^T + n n^T, since the basis holds the columns of M_n A^(1/2) and n.
    let mut sums = [F8::default(); 6];
    let mut mean = V8::default();
    let mut varies = [0; LANES];
    let [first_p, first_q, first_n] = samples[0].basis;
    for sample in samples {
        let [p, q, n] = &sample.basis;
        let w = sample.weight;
        sums[0] += (p.x * p.x + q.x * q.x + n.x * n.x) * w;
        sums[1] += (p.x * p.y + q.x * q.y + n.x * n.y) * w;
        sums[2] += (p.x * p.z + q.x * q.z + n.x * n.z) * w;
        sums[3] += (p.y * p.y + q.y * q.y + n.y * n.y) * w;
        sums[4] += (p.y * p.z + q.y * q.z + n.y * n.z) * w;
        sums[5] += (p.z * p.z + q.z * q.z + n.z * n.z) * w;
        mean = mean + *n * w;
        for (l, varies) in varies.iter_mut().enumerate() {
            let differ = |v: &F8, first: &F8| v.0[l].to_bits() ^ first.0[l].to_bits();
            *varies |= differ(&p.x, &first_p.x)
                | differ(&p.y, &first_p.y)
                | differ(&p.z, &first_p.z)
                | differ(&q.x, &first_q.x)
                | differ(&q.y, &first_q.y)
                | differ(&q.z, &first_q.z)
                | differ(&n.x, &first_n.x)
                | differ(&n.y, &first_n.y);
        }
    }
    Linear { sums, mean, varies }
}

/// The columns of `M_n0` of the linear results' normals, and their squared roughness as slopes seen from n0,
/// `[xx, xy, yy]`.
#[inline(always)]
fn linear_frames(Linear { sums, mean, .. }: &Linear) -> ([V8; 3], [F8; 3]) {
    let [xx, xy, xz, yy, yz, zz] = sums;
    let mut n = V8::default();
    let matrices = [&xx.0, &xy.0, &xz.0, &yy.0, &yz.0, &zz.0];
    sggx_normals(matrices, [&mean.x.0, &mean.y.0, &mean.z.0], [&mut n.x.0, &mut n.y.0, &mut n.z.0]);

    // The slopes of the matrix in that frame, whose mean slope is rounding.
    let [x, y, n] = frames(n);
    let (sx, sy, sn) = (transform(sums, x), transform(sums, y), transform(sums, n));
    let inv = n.dot(sn).recip();
    let (mx, my) = (x.dot(sn) * inv, y.dot(sn) * inv);
    let a = [x.dot(sx) * inv - mx * mx, x.dot(sy) * inv - mx * my, y.dot(sy) * inv - my * my];
    ([x, y, n], a)
}

/// The product of symmetric matrices `[xx, xy, xz, yy, yz, zz]` with vectors.
#[inline(always)]
fn transform([xx, xy, xz, yy, yz, zz]: &[F8; 6], v: V8) -> V8 {
    V8 {
        x: *xx * v.x + *xy * v.y + *xz * v.z,
        y: *xy * v.x + *yy * v.y + *yz * v.z,
        z: *xz * v.x + *yz * v.y + *zz * v.z,
    }
}

/// Normals and squared roughness `[xx, xy, yy]` of slope distributions seen in the lanes' frames; eigenvalues
/// may exceed one.
#[inline(always)]
fn surfaces([x, y, n0]: &[V8; 3], mean: &V8, [mx, my]: [F8; 2], a: [F8; 3]) -> (V8, [F8; 3]) {
    // Their SGGX matrices, `[A 0; 0 0] + c c^T` with `c = (m, 1)` in the frame.
    let c = *x * mx + *y * my + *n0;
    let (ax, ay) = (*x * a[0] + *y * a[1], *x * a[1] + *y * a[2]);
    let xx = x.x * ax.x + y.x * ay.x + c.x * c.x;
    let xy = x.x * ax.y + y.x * ay.y + c.x * c.y;
    let xz = x.x * ax.z + y.x * ay.z + c.x * c.z;
    let yy = x.y * ax.y + y.y * ay.y + c.y * c.y;
    let yz = x.y * ax.z + y.y * ay.z + c.y * c.z;
    let zz = x.z * ax.z + y.z * ay.z + c.z * c.z;
    let matrices = [&xx.0, &xy.0, &xz.0, &yy.0, &yz.0, &zz.0];

    let mut n = V8::default();
    sggx_normals(matrices, [&mean.x.0, &mean.y.0, &mean.z.0], [&mut n.x.0, &mut n.y.0, &mut n.z.0]);
    // Where a single microfacet outweighs its footprint, the mean normal may lie in the plane of eigenvalue zero.
    // The microfacet of mean slope has no part in it.
    let area = n.dot(transform(&[xx, xy, xz, yy, yz, zz], n)) - F8::splat(MIN_AREA) * (xx + yy + zz);
    for l in (0..LANES).filter(|l| area.0[*l] < 0.0) {
        let s = Sym3 { xx: xx.0[l], xy: xy.0[l], xz: xz.0[l], yy: yy.0[l], yz: yz.0[l], zz: zz.0[l] };
        let axis = sggx_principal_axis(s, c.lane(l).normalize());
        (n.x.0[l], n.y.0[l], n.z.0[l]) = (axis * 1.0_f32.copysign(axis.z)).into();
    }

    let [mut axx, mut axy, mut ayy] = [F8::default(); 3];
    sggx_roughness(matrices, [&n.x.0, &n.y.0, &n.z.0], [&mut axx.0, &mut axy.0, &mut ayy.0]);
    (n, [axx, axy, ayy])
}

/// Turns the samples into microfacets, `COUNT` each, seen in the lanes' frames.
#[inline(always)]
fn scatter<const COUNT: usize>(
    samples: &[Sample],
    taps: usize,
    frame: &[V8; 3],
    microfacets: &mut Vec<Microfacet>,
) {
    let slopes = &*SLOPES;
    microfacets.resize(samples.len() * COUNT, Microfacet::default());
    let mut out = microfacets.as_chunks_mut::<COUNT>().0.iter_mut();
    for (j, row) in samples.chunks_exact(taps).enumerate() {
        for ((i, sample), out) in row.iter().enumerate().zip(&mut out) {
            let [x, y, n] = &sample.basis;
            let (x, y, n) = (x.in_frame(frame), y.in_frame(frame), n.in_frame(frame));
            let turn = turn(i, j);
            for (pair, out) in out.as_chunks_mut().0.iter_mut().enumerate() {
                let slope = slope::<COUNT>(slopes, turn, pair);
                let offset = x * F8::splat(slope.x) + y * F8::splat(slope.y);
                *out = [seen(n + offset, sample.weight), seen(n - offset, sample.weight)];
            }
        }
    }
}

/// A microfacet of a texel of this weight. One that n0 cannot see has no slope and weighs nothing.
#[inline(always)]
fn seen(h: V8, weight: F8) -> Microfacet {
    let inv = h.z.max(MIN_COSINE).recip();
    Microfacet { x: h.x * inv, y: h.y * inv, weight: h.z.max(0.0) * weight }
}

/// The fits as far as they are smooth, the linear results as far as one of both is rough: the share of the fit is
/// `g / (g + (r / ROUGH)^5)`, where r is half the trace of the rougher one's squared roughness and `g = 1 - r`.
///
/// Where microfacets of one texel reach from horizon to horizon, most of those that a fit looks at reflect no light that
/// anyone sees, and averages of whole matrices are nearer to the truth. And the normal of a rough lobe lies 1 / g times as
/// far from n0 as its mean slope: in V grooves, whose walls a fit would choose one of, it must not.
#[inline(always)]
fn towards_linear(start: [F8; 3], (m, a): Lobes) -> Lobes {
    let rough = (start[0] + start[2]).max_of(a[0] + a[2]) * F8::splat(0.5);
    let gap = (F8::splat(1.0) - rough).max(0.0);
    let share = rough * F8::splat(1.0 / ROUGH);
    let squared = share * share;
    let kept = gap / (gap + squared * squared * share).max(f32::MIN_POSITIVE);
    let xx = start[0] + (a[0] - start[0]) * kept;
    let xy = start[1] + (a[1] - start[1]) * kept;
    let yy = start[2] + (a[2] - start[2]) * kept;
    ([m[0] * kept, m[1] * kept], [xx, xy, yy])
}

/// The inverses of A, kept away from singular, `[xx, 2 xy, yy]`.
#[inline(always)]
pub(super) fn inverse([xx, xy, yy]: [F8; 3]) -> [F8; 3] {
    let (xx, yy) = (xx.max(MIN_A), yy.max(MIN_A));
    let inv = (xx * yy - xy * xy).max(MIN_A * MIN_A).recip();
    [yy * inv, -(xy + xy) * inv, xx * inv]
}

/// A after a step towards `next` made `length` times as long, where that does not leave the positive definite matrices.
#[inline(always)]
pub(super) fn stepped(a: [F8; 3], next: [F8; 3], length: F8) -> [F8; 3] {
    let xx = a[0] + (next[0] - a[0]) * length;
    let xy = a[1] + (next[1] - a[1]) * length;
    let yy = a[2] + (next[2] - a[2]) * length;
    let indefinite = (xx * yy - xy * xy).min_of(xx) - F8::splat(MIN_A * MIN_A);
    [
        indefinite.where_negative(next[0], xx),
        indefinite.where_negative(next[1], xy),
        indefinite.where_negative(next[2], yy),
    ]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use kinran_image::{Channels, Image, Pixels};
    use kinran_scene::Wrap;
    use proptest::prelude::*;

    use super::*;
    use crate::aniso::{Kernel, NormalMap, RoughnessMaps, ScalarMap, dpd, footprints, ml};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// Of footprints of one size, as all within a level of even sides are.
        #[test]
        fn texels_depend_on_the_band_they_are_fitted_in(
            size in (1_u32..6, 1_u32..6),
            level in 1_usize..4,
            band in 1_usize..20,
            seed in any::<u32>(),
        ) {
            let size = (16 * size.0, 16 * size.1);
            let mut state = seed | 1;
            let mut noise = || {
                let samples = (0..size.0 * size.1 * 3).map(|_| {
                    state ^= state << 13;
                    state ^= state >> 17;
                    state ^= state << 5;
                    64 + (state >> 25) as u8
                });
                let samples = Pixels::U8(samples.collect());
                Arc::new(Image::new(size.0, size.1, Channels::Rgb, samples).unwrap())
            };
            let maps = SurfaceMaps {
                normal: NormalMap::new(noise(), false),
                roughness: RoughnessMaps::Isotropic(ScalarMap::channel(noise(), 0)),
                wrap: [Wrap::Repeat; 2],
                weights: None,
            };
            let of = |side| footprints(side, level + 1, Kernel::Box, Wrap::Repeat).swap_remove(level - 1);
            let (columns, rows) = (of(size.0), of(size.1));
            let fit = |rows: &[Taps], dpd: bool| {
                let mut out = TexelSpan::default();
                if dpd {
                    dpd::fit_band(&maps, &columns, rows, &mut out);
                } else {
                    ml::fit_band(&maps, &columns, rows, &mut out);
                }
                [out.nx, out.ny, out.nz, out.axx, out.axy, out.ayy]
            };
            for dpd in [false, true] {
                let mut banded: [Vec<f32>; 6] = Default::default();
                for rows in rows.chunks(band) {
                    for (all, more) in banded.iter_mut().zip(fit(rows, dpd)) {
                        all.extend(more);
                    }
                }
                prop_assert_eq!(banded, fit(&rows, dpd));
            }
        }
    }
}
