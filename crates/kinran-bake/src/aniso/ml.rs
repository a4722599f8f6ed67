//! `ml`: the maximum-likelihood GGX lobe of a footprint.
//!
//! GGX slopes follow a bivariate Student-t with two degrees of freedom, so the lobe that maximises the
//! likelihood of a footprint's microfacets (that minimises the Kullback–Leibler divergence from their
//! distribution) is the one optimum of a fixed-point iteration [1]; the step used here is the parameter
//! expanded one [2], made longer ([`STEP_LENGTHS`]), which has the same optimum and needs fewer steps.
//!
//! Each texel gives up to 16 microfacets, [`UNIT_SLOPES`] mapped by its normal and roughness. Seen in the
//! frame of the footprint's linear result n0, microfacet h has slope `s = h.xy/h.z` and weight `W = h.z`:
//! its area as the mesh sees it. Then, from the linear result,
//!
//! ```text
//! q = (s-m)^T A^-1 (s-m),  u = W / (1 + q),  m = Σ u s / Σ u,  A = 2 Σ u (s-m)(s-m)^T / Σ u.
//! ```
//!
//! Every level is fitted to microfacets of level 0. Footprints of more than 25 texels use fewer
//! microfacets a texel, and those of more than 32 × 32 texels a stratified choice of texels: a summary, whose
//! error against all microfacets is stated at [`MAX_AXIS_TEXELS`] and bounded by a test.
//!
//! [1] Kent, Tyler, Vardi. A curious likelihood identity for the multivariate t-distribution. 1994.
//! [2] Liu, Rubin, Wu. Parameter expansion to accelerate EM. Biometrika 1998.

use std::array::from_fn;

use glam::Vec2;
use kinran_shading::{Sym2, Sym3, UNIT_SLOPES, sggx_principal_axis};

use super::footprint::Taps;
use super::lanes::{F8, LANES, V8};
use super::maps::{SurfaceMaps, TexelSpan};
use super::moments::{sggx_normals, sggx_roughness};

/// Texels of a footprint looked at along each axis. Longer footprints are cut into this many strata and one
/// texel is drawn from each, at a different place in every row so that no weave lines up with it.
///
/// Error of this summary against all texels with 16 microfacets each, on random and brushed textures of 64² and
/// 128² texels: levels 1 and 2 within 0.5 % of alpha and 0.06°, levels 3 and 4 within 8 % (median 1.5 %) and
/// 0.9°, further levels within 8 % (median 3 %) and 3°. Weaves and stripes whose period is a power of two: levels 1
/// and 2 within 0.5 % and 0.1°, levels 3 and 4 within 8 % and 0.9°, further levels within 10 % and 3°.
pub const MAX_AXIS_TEXELS: usize = 32;

/// Most steps of the iteration. Random metal and cloth takes two to four; mirrors of strong normals take more.
const MAX_STEPS: usize = 6;

/// By how much steps are lengthened, in turn: `1 / (1 - rate)` for rates of 3/8 and 0. A step of length one leaves
/// nothing of an error of A's trace and 1/3 of any other where the footprint is a GGX lobe itself, and between nothing
/// and 0.4 on mixtures of lobes, as measured. What is left where the iteration ends is bounded by `tests/ml_summary.rs`:
/// levels 1 and 2 use all microfacets.
const STEP_LENGTHS: [f32; 2] = [1.6, 1.0];

/// By how much the last step is lengthened: between both, it leaves a quarter of the error at most.
const LAST_LENGTH: f32 = 1.25;

/// The iteration ends when no element of A has changed by more than this share of its trace.
const CONVERGED: f32 = 1e-2;

/// See [`steady_means`]. Chosen by the tilt that rough surfaces keep: it takes 2 % off the mean slope at alpha 0.5, seven
/// tenths at 0.95 and nearly all at 0.99, where 1024 microfacets alone leave three quarters of the tilt to chance.
const ROUND: f32 = 0.3;

/// Smallest squared roughness in the iteration, against division by a vanishing determinant: 1/8 of the
/// smallest step of an 8-bit aniso channel, squared.
const MIN_A: f32 = 2.4e-7;

/// Smallest cosine to n0 at which a microfacet still has a slope; chosen by eye.
const MIN_COSINE: f32 = 1e-3;

/// Smallest eigenvalue of a normal, as a share of the SGGX matrix's trace: ten times the rounding of single
/// precision.
const MIN_AREA: f32 = 1e-6;

/// Fits some rows of a level: `columns` are the footprints of their texels along x, `rows` those along y.
pub(crate) fn fit_band(maps: &SurfaceMaps, columns: &[Taps], rows: &[Taps], out: &mut TexelSpan) {
    out.resize(columns.len() * rows.len());
    pulp::Arch::new().dispatch(FitBand { maps, columns, rows, out });
}

struct FitBand<'a> {
    maps: &'a SurfaceMaps,
    columns: &'a [Taps],
    rows: &'a [Taps],
    out: &'a mut TexelSpan,
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
struct Microfacet {
    x: F8,
    y: F8,
    weight: F8,
}

impl pulp::WithSimd for FitBand<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { maps, columns, rows, out } = self;
        let width = columns.len();
        let mut block = Block::default();
        let mut microfacets = Vec::new();
        let mut x0 = 0;
        while x0 < width {
            let end = block_end(columns, &rows[0], x0);
            let columns = &columns[x0..end];
            block.begin(columns);
            for (y, rows) in rows.iter().enumerate() {
                block.decode(maps, columns, rows);
                for (group, columns) in columns.chunks(LANES).enumerate() {
                    let at = y * width + x0 + group * LANES;
                    fit_group(&block, group, columns.len(), &mut microfacets, at, out);
                }
            }
            x0 = end;
        }
    }
}

/// Texels of level 0 decoded at a time, when one group of lanes does not need more: their samples take 160 KiB.
const BLOCK_TEXELS: u32 = 4096;

/// End of the texels from `x` on, whole groups of lanes, that are decoded together.
fn block_end(columns: &[Taps], rows: &Taps, x: usize) -> usize {
    let most = BLOCK_TEXELS / rows.len().min(MAX_AXIS_TEXELS) as u32;
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
        self.taps = longest(columns).min(MAX_AXIS_TEXELS);
        self.pick(columns, 0);
    }

    /// Makes the samples of the footprints that have these rows.
    #[inline(always)]
    fn decode(&mut self, maps: &SurfaceMaps, columns: &[Taps], rows: &Taps) {
        let (first, len) = self.columns;
        self.rows.clear();
        let salt = |j| j as u32 * 977 + rows[0].0;
        self.rows.extend(strata(rows).enumerate().map(|(j, stratum)| draw(rows, stratum, salt(j))));

        let row_len = columns.len().div_ceil(LANES) * self.taps;
        self.samples.resize(self.rows.len() * row_len, Sample::default());
        self.gathered.iter_mut().for_each(|plane| plane.resize(row_len, F8::default()));
        for j in 0..self.rows.len() {
            let (row, row_weight) = self.rows[j];
            maps.decode_span(maps.size(), row, first, len, &mut self.span);
            // Taps that are drawn are others in every row.
            if longest(columns) > MAX_AXIS_TEXELS {
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
                    let (column, weight) = pick(&group[l.min(group.len() - 1)], row, i);
                    weights.0[l] = weight;
                    column - self.columns.0
                }));
                self.weights.push(weights);
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

/// Microfacets a texel contributes, by the number of texels looked at. All 16 for the 16 texels of the second
/// level: with 4 each, a fifth of the gain over the linear filter is lost. About 1024 a footprint from there on.
fn microfacets_per_texel(texels: usize) -> usize {
    match texels {
        0..=25 => 16,
        26..=100 => 8,
        101..=300 => 4,
        301..=600 => 2,
        _ => 1,
    }
}

/// The slope of the first of pair `pair` of the microfacets of a texel with this `pattern`, of which it uses `COUNT`.
/// The second one's is opposite, so that a texel's mean slope is not disturbed; only a single microfacet has none.
/// Radii alternate between the two pairs of directions, and neighbouring patterns use others.
#[inline(always)]
fn slope<const COUNT: usize>(pattern: usize, pair: usize) -> Vec2 {
    let (radius, direction) = match COUNT {
        16 => (pair / 2, pair),
        8 => (pair, pattern + pair),
        4 => (2 * pair + pattern / 2 % 2, pattern + pair),
        2 => (pattern / 2, pattern),
        _ => (pattern / 4, pattern),
    };
    UNIT_SLOPES[4 * (radius % 4) + direction % 4]
}

/// Fits the `count` footprints of group `group` of the block and puts them at `at` and behind it.
#[inline(always)]
fn fit_group(
    block: &Block,
    group: usize,
    count: usize,
    microfacets: &mut Vec<Microfacet>,
    at: usize,
    out: &mut TexelSpan,
) {
    let samples = block.group(group);
    let linear = linear_sums(samples);
    let (frame, start) = linear_frames(&linear);
    match microfacets_per_texel(samples.len()) {
        16 => scatter::<16>(samples, block.taps, &frame, microfacets),
        8 => scatter::<8>(samples, block.taps, &frame, microfacets),
        4 => scatter::<4>(samples, block.taps, &frame, microfacets),
        2 => scatter::<2>(samples, block.taps, &frame, microfacets),
        _ => scatter::<1>(samples, block.taps, &frame, microfacets),
    }
    let (m, a) = maximise(microfacets, start);

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

/// Texels looked at along one axis: for each stratum its first tap and the one behind its last.
fn strata(taps: &Taps) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (len, count) = (taps.len(), taps.len().min(MAX_AXIS_TEXELS));
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

/// Sample `i` along x of a footprint in row `row`: its column and weight.
#[inline(always)]
fn pick(taps: &Taps, row: u32, i: usize) -> (u32, f32) {
    if taps.len() <= MAX_AXIS_TEXELS {
        // Shorter footprints, next to a longer one of an odd-sized level, repeat a texel without weight.
        taps.get(i).copied().unwrap_or((taps[0].0, 0.0))
    } else {
        let stratum = (i * taps.len() / MAX_AXIS_TEXELS, (i + 1) * taps.len() / MAX_AXIS_TEXELS);
        draw(taps, stratum, row * 131 + i as u32)
    }
}

/// Which microfacets the texel at row `j` and column `i` of the samples gives, 0 to 15, see [`slope`].
///
/// A net over the bits of both indices, found by search over weaves, stripes and twills of periods 2 to 16:
/// threads must not line up with patterns. With `i % 4 + 4 (j % 4)` alpha was off by up to 31 % on them.
#[inline(always)]
fn pattern(i: usize, j: usize) -> usize {
    let (x, y) = (|k: usize| (i >> k) & 1, |k: usize| (j >> k) & 1);
    let b0 = x(0) ^ y(1) ^ x(2) ^ y(2) ^ x(4);
    let b1 = x(1) ^ y(0) ^ y(2) ^ x(3) ^ y(4);
    let b2 = y(0) ^ x(1) ^ x(2) ^ y(3);
    let b3 = y(1) ^ x(0) ^ y(2) ^ x(3) ^ x(2);
    b0 | b1 << 1 | b2 << 2 | b3 << 3
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
    microfacets.resize(samples.len() * COUNT, Microfacet::default());
    let mut out = microfacets.as_chunks_mut::<COUNT>().0.iter_mut();
    for (j, row) in samples.chunks_exact(taps).enumerate() {
        for ((i, sample), out) in row.iter().enumerate().zip(&mut out) {
            let [x, y, n] = &sample.basis;
            let (x, y, n) = (x.in_frame(frame), y.in_frame(frame), n.in_frame(frame));
            let pattern = pattern(i, j);
            let offset = |pair| {
                let slope = slope::<COUNT>(pattern, pair);
                x * F8::splat(slope.x) + y * F8::splat(slope.y)
            };
            if COUNT == 1 {
                out[0] = seen(n + offset(0), sample.weight);
            } else {
                for (pair, out) in out.as_chunks_mut().0.iter_mut().enumerate() {
                    let offset = offset(pair);
                    *out = [seen(n + offset, sample.weight), seen(n - offset, sample.weight)];
                }
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

/// Sums over microfacets of u times `[1, x, y, xx, xy, yy]`, with slopes relative to the mean. `estimate` is the
/// mean and the inverse of A, whose mixed element is doubled.
#[inline(always)]
fn moments(microfacets: &[Microfacet], estimate: [F8; 5]) -> [F8; 6] {
    let [F8(mx), F8(my), F8(ixx), F8(ixy), F8(iyy)] = estimate;
    let mut sum = [[0.0; LANES]; 6];
    for h in microfacets {
        for l in 0..LANES {
            let (x, y) = (h.x.0[l] - mx[l], h.y.0[l] - my[l]);
            // Rounding can take it below zero where A is all but singular, and a weight at -1 has no bound.
            let q = x * (x * ixx[l] + y * ixy[l]) + y * y * iyy[l];
            let q = if q > 0.0 { q } else { 0.0 };
            let u = h.weight.0[l] / (1.0 + q);
            let (ux, uy) = (u * x, u * y);
            sum[0][l] += u;
            sum[1][l] += ux;
            sum[2][l] += uy;
            sum[3][l] += ux * x;
            sum[4][l] += ux * y;
            sum[5][l] += uy * y;
        }
    }
    let [u, ux, uy, uxx, uxy, uyy] = sum;
    [F8(u), F8(ux), F8(uy), F8(uxx), F8(uxy), F8(uyy)]
}

/// The fixed point of the iteration: mean slopes and squared roughness `[xx, xy, yy]`.
#[inline(always)]
fn maximise(microfacets: &[Microfacet], start: [F8; 3]) -> ([F8; 2], [F8; 3]) {
    let mut m = [F8::default(); 2];
    let mut a = start;
    for step in 0..MAX_STEPS {
        // Inverse of A, kept away from singular.
        let (xx, yy) = (a[0].max(MIN_A), a[2].max(MIN_A));
        let det = (xx * yy - a[1] * a[1]).max(MIN_A * MIN_A);
        let inv_det = det.recip();
        let sum = moments(microfacets, [m[0], m[1], yy * inv_det, -(a[1] + a[1]) * inv_det, xx * inv_det]);

        // The sums are about the old mean; the moments about the new one follow by the shift.
        let inv = sum[0].max(f32::MIN_POSITIVE).recip();
        let (dx, dy) = (sum[1] * inv, sum[2] * inv);
        let two = F8::splat(2.0);
        let next =
            [two * (sum[3] * inv - dx * dx), two * (sum[4] * inv - dx * dy), two * (sum[5] * inv - dy * dy)];
        let tolerance = (next[0] + next[2]) * F8::splat(CONVERGED);
        let mut settled = true;
        for l in 0..LANES {
            let within = |k: usize| (next[k].0[l] - a[k].0[l]).abs() <= tolerance.0[l];
            settled &= within(0) & within(1) & within(2);
        }

        // A longer step must not leave the positive definite matrices.
        let length = F8::splat(if settled { LAST_LENGTH } else { STEP_LENGTHS[step % 2] });
        let [xx, xy, yy] = a;
        let longer =
            [xx + (next[0] - xx) * length, xy + (next[1] - xy) * length, yy + (next[2] - yy) * length];
        let det = longer[0] * longer[2] - longer[1] * longer[1];
        let indefinite = det.min_of(longer[0]) - F8::splat(MIN_A * MIN_A);
        for ((a, next), longer) in a.iter_mut().zip(next).zip(longer) {
            *a = indefinite.where_negative(next, longer);
        }
        m = [m[0] + dx * length, m[1] + dy * length];
        if settled {
            break;
        }
    }
    (steady_means(m, a), a)
}

/// Pulls the mean slopes of all but round lobes towards the linear filter's normal: by `g / (g + ROUND a²)` along
/// each axis of A, where a is its squared roughness and `g = |1 - a|`. The lobe's normal lies 1 / g times as far from
/// n0 as its mean slope, and so does the error that comes from looking at some of the microfacets only.
#[inline(always)]
fn steady_means([mx, my]: [F8; 2], [xx, xy, yy]: [F8; 3]) -> [F8; 2] {
    let half = F8::splat(0.5);
    let (mean, difference) = ((xx + yy) * half, (xx - yy) * half);
    let radius = (difference * difference + xy * xy).sqrt();
    let kept = |a: F8| {
        let gap = (F8::splat(1.0) - a).abs();
        gap / (gap + F8::splat(ROUND) * a * a).max(f32::MIN_POSITIVE)
    };
    let (kept_1, kept_2) = (kept(mean + radius), kept(mean - radius));

    // The function of A as a straight line through its values at both eigenvalues.
    let slope = (kept_1 - kept_2) * half / radius.max(MIN_A);
    let middle = (kept_1 + kept_2) * half;
    let (along_x, along_y, mixed) = (middle + slope * difference, middle - slope * difference, slope * xy);
    [mx * along_x + my * mixed, mx * mixed + my * along_y]
}
