//! `ml`: the maximum-likelihood GGX lobe of a footprint.
//!
//! GGX slopes follow a bivariate Student-t with two degrees of freedom, so the lobe that maximises the
//! likelihood of a footprint's microfacets (that minimises the Kullback–Leibler divergence from their
//! distribution) is the one optimum of a fixed-point iteration [1]; the step used here is the parameter
//! expanded one [2], which has the same optimum and needs fewer steps.
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

use glam::{Mat3, Vec2, Vec3, vec2, vec3};
use kinran_shading::{
    Sym2, Sym3, UNIT_SLOPES, m_n, microfacet_basis, sggx_from_slopes, sggx_principal_axis, slopes_from_sggx,
};

use super::footprint::Taps;
use super::lanes::{F16, LANES, V16};
use super::maps::{SurfaceMaps, TexelSpan};
use super::moments::{sggx_normals, sggx_roughness};

/// Texels of a footprint looked at along each axis. Longer footprints are cut into this many strata and one
/// texel is drawn from each, at a different place in every row so that no weave lines up with it.
///
/// Error of this summary against all texels with 16 microfacets each, on random and brushed textures of 64² and
/// 128² texels: levels 1 and 2 within 1.3 % of alpha and 0.2°, levels 3 and 4 within 9 % (median 1.4 %) and
/// 0.9°, further levels within 10 % (median 5 %) and 2.9°. Weaves and stripes whose period is a power of two: levels
/// 3 and 4 within 3 % and 0.4°, further levels within 9 % and 2.9°.
pub const MAX_AXIS_TEXELS: usize = 32;

/// Most steps of the iteration. Measured on the footprints of the filter test: the gain over the linear filter
/// is 24 to 26 % after four steps, 25 to 26 % after six, and the same after forty.
const MAX_STEPS: usize = 6;

/// The iteration ends when no element of A has changed by more than this share of its trace.
const CONVERGED: f32 = 1e-2;

/// Smallest squared roughness in the iteration, against division by a vanishing determinant: 1/8 of the
/// smallest step of an 8-bit aniso channel, squared.
const MIN_A: f32 = 2.4e-7;

/// Smallest cosine to n0 at which a microfacet still has a slope; chosen by eye.
const MIN_COSINE: f32 = 1e-3;

/// Smallest eigenvalue of a normal, as a share of the SGGX matrix's trace: ten times the rounding of single
/// precision.
const MIN_AREA: f32 = 1e-6;

/// Fits one row of a level: `columns` are the footprints of its texels along x, `rows` the one along y.
pub(crate) fn fit_row(maps: &SurfaceMaps, columns: &[Taps], rows: &Taps, out: &mut TexelSpan) {
    pulp::Arch::new().dispatch(FitRow { maps, columns, rows, out });
}

struct FitRow<'a> {
    maps: &'a SurfaceMaps,
    columns: &'a [Taps],
    rows: &'a Taps,
    out: &'a mut TexelSpan,
}

/// One texel of each lane's footprint.
#[derive(Clone, Copy, Default)]
struct Sample {
    /// Images of the unit slopes' axes, and the normal: `h = p X + q Y + n`.
    basis: [V16; 3],
    weight: F16,
    /// First of the microfacets of [`UNIT_SLOPES`] used, see [`microfacets_of`].
    pattern: usize,
}

/// One microfacet of each lane's footprint in the frame of the lane's n0.
#[derive(Clone, Copy, Default)]
struct Microfacet {
    x: F16,
    y: F16,
    weight: F16,
}

#[derive(Default)]
struct Scratch {
    block: Block,
    picks: Vec<([u32; LANES], F16)>,
    samples: Vec<Sample>,
    microfacets: Vec<Microfacet>,
}

impl pulp::WithSimd for FitRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { maps, columns, rows, out } = self;
        let mut scratch = Scratch::default();
        let mut x = 0;
        while x < columns.len() {
            let end = block_end(columns, x);
            scratch.block.decode(maps, &columns[x..end], rows);
            for group in (x..end).step_by(LANES) {
                let columns = &columns[group..end.min(group + LANES)];
                if S::F32_LANES >= LANES {
                    fit_group::<LANES>(columns, group, &mut scratch, out);
                } else {
                    fit_group::<{ LANES / 2 }>(columns, group, &mut scratch, out);
                }
            }
            x = end;
        }
    }
}

/// Columns of level 0 decoded at a time, when one group of lanes does not need more.
const BLOCK_COLUMNS: u32 = 512;

/// End of the texels from `x` on, whole groups of lanes, that are decoded together.
fn block_end(columns: &[Taps], x: usize) -> usize {
    let mut end = (x + LANES).min(columns.len());
    let first = columns[x][0].0;
    while end < columns.len() {
        let next = (end + LANES).min(columns.len());
        let last = columns[next - 1].last().map_or(0, |tap| tap.0);
        // A footprint that wraps around the border may begin before the block does.
        if last < first || last - first >= BLOCK_COLUMNS {
            break;
        }
        end = next;
    }
    end
}

/// The texels of level 0 that some neighbouring output texels need.
#[derive(Default)]
struct Block {
    /// First column.
    first: u32,
    /// Columns.
    len: usize,
    /// Rows drawn, one from each stratum, and their weights.
    rows: Vec<(u32, f32)>,
    /// [`microfacet_basis`] of every texel, row after row, nine floats a texel.
    bases: Vec<[f32; 9]>,
    /// The first row's texels.
    top: TexelSpan,
    span: TexelSpan,
}

impl Block {
    #[inline(always)]
    fn decode(&mut self, maps: &SurfaceMaps, columns: &[Taps], rows: &Taps) {
        let taps = || columns.iter().flatten().map(|tap| tap.0);
        self.first = taps().min().unwrap_or(0);
        self.len = (taps().max().unwrap_or(0) - self.first + 1) as usize;
        self.rows.clear();
        let salt = |j| j as u32 * 977 + rows[0].0;
        self.rows.extend(strata(rows).enumerate().map(|(j, stratum)| draw(rows, stratum, salt(j))));
        self.bases.resize(self.rows.len() * self.len, [0.0; 9]);
        let size = maps.size();
        for (j, &(row, _)) in self.rows.iter().enumerate() {
            let span = if j == 0 { &mut self.top } else { &mut self.span };
            maps.decode_span(size, row, self.first, self.len, span);
            let (nx, ny, nz) = (&span.nx[..self.len], &span.ny[..self.len], &span.nz[..self.len]);
            let (axx, axy, ayy) = (&span.axx[..self.len], &span.axy[..self.len], &span.ayy[..self.len]);
            let bases = &mut self.bases[j * self.len..(j + 1) * self.len];
            for (i, out) in bases.iter_mut().enumerate() {
                let a = Sym2 { xx: axx[i], xy: axy[i], yy: ayy[i] };
                let [x, y, n] = microfacet_basis(vec3(nx[i], ny[i], nz[i]), a);
                *out = [x.x, x.y, x.z, y.x, y.y, y.z, n.x, n.y, n.z];
            }
        }
    }
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

/// Microfacet `k` of the `COUNT` of 16 that a texel with this `pattern` uses. Opposite ones stay together down
/// to two, so that a texel's mean slope is not disturbed, radii alternate between the two pairs of directions,
/// and neighbouring patterns use others.
#[inline(always)]
fn microfacet<const COUNT: usize>(pattern: usize, k: usize) -> Vec2 {
    let (radius, direction) = match COUNT {
        16 => (k / 4, k % 4),
        8 => (k / 2, pattern + k / 2 + 2 * (k % 2)),
        4 => (2 * (k / 2) + (pattern / 2) % 2, pattern + k / 2 + 2 * (k % 2)),
        2 => (pattern / 2, pattern + 2 * k),
        _ => (pattern / 4, pattern),
    };
    UNIT_SLOPES[4 * (radius % 4) + direction % 4]
}

/// Fits up to [`LANES`] neighbours; `WIDTH` is how many lanes a vector of the processor has.
#[inline(always)]
fn fit_group<const WIDTH: usize>(columns: &[Taps], x0: usize, scratch: &mut Scratch, out: &mut TexelSpan) {
    let lane_columns: [&Taps; LANES] = from_fn(|l| &columns[l.min(columns.len() - 1)]);
    let Scratch { block, picks, samples, microfacets } = scratch;
    gather(block, lane_columns, picks, samples);
    let (sums, mean) = linear_sums(samples);
    let (frame, start) = linear_frames(&sums, &mean);
    match microfacets_per_texel(samples.len()) {
        16 => scatter::<16>(samples, &frame, microfacets),
        8 => scatter::<8>(samples, &frame, microfacets),
        4 => scatter::<4>(samples, &frame, microfacets),
        2 => scatter::<2>(samples, &frame, microfacets),
        _ => scatter::<1>(samples, &frame, microfacets),
    }
    let (m, a) = maximise::<WIDTH>(microfacets, start);

    let (normals, roughness) = surfaces(&frame, &mean, m, a);
    let constant = constant_texels(block, lane_columns, samples);
    for (l, constant) in constant.iter().enumerate().take(columns.len()) {
        let (n, a) = constant.unwrap_or_else(|| {
            let a = Sym2 { xx: roughness[0].0[l], xy: roughness[1].0[l], yy: roughness[2].0[l] };
            (normals.lane(l), a.clamp_eigen(0.0, 1.0))
        });
        out.set(x0 + l, n, a);
    }
}

/// Texels looked at along one axis: for each stratum its first tap and the one behind its last.
fn strata(taps: &Taps) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (len, count) = (taps.len(), taps.len().min(MAX_AXIS_TEXELS));
    (0..count).map(move |i| (i * len / count, (i + 1) * len / count))
}

/// The first of [`strata`].
fn first_stratum(taps: &Taps) -> (usize, usize) {
    (0, taps.len() / taps.len().min(MAX_AXIS_TEXELS))
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

/// Which microfacets the texel at row `j` and column `i` of the samples gives, 0 to 15, see [`microfacet`].
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

/// Tap `i` of each lane's footprint in row `row`, from the block's first column on, and its weight.
#[inline(always)]
fn pick(block: &Block, columns: [&Taps; LANES], row: u32, i: usize) -> ([u32; LANES], F16) {
    let mut picked = ([0; LANES], F16::default());
    for (l, taps) in columns.iter().enumerate() {
        // Shorter footprints, next to a longer one of an odd-sized level, repeat a texel without weight.
        let (column, weight) = if taps.len() <= MAX_AXIS_TEXELS {
            taps.get(i).copied().unwrap_or((taps[0].0, 0.0))
        } else {
            let stratum = (i * taps.len() / MAX_AXIS_TEXELS, (i + 1) * taps.len() / MAX_AXIS_TEXELS);
            draw(taps, stratum, row * 131 + i as u32)
        };
        (picked.0[l], picked.1.0[l]) = (column - block.first, weight);
    }
    picked
}

/// Collects the texels of a group's footprints.
#[inline(always)]
fn gather(
    block: &Block,
    columns: [&Taps; LANES],
    picks: &mut Vec<([u32; LANES], F16)>,
    samples: &mut Vec<Sample>,
) {
    let longest = columns.iter().map(|taps| taps.len()).max().unwrap_or(0);
    samples.clear();
    for (j, &(row, row_weight)) in block.rows.iter().enumerate() {
        // Taps that are drawn are others in every row.
        if j == 0 || longest > MAX_AXIS_TEXELS {
            picks.clear();
            picks.extend((0..longest.min(MAX_AXIS_TEXELS)).map(|i| pick(block, columns, row, i)));
        }
        let bases = &block.bases[j * block.len..(j + 1) * block.len];
        for (i, (column, weight)) in picks.iter().enumerate() {
            let mut basis = [V16::default(); 3];
            for (l, &column) in column.iter().enumerate() {
                let v = &bases[column as usize];
                for (k, axis) in basis.iter_mut().enumerate() {
                    (axis.x.0[l], axis.y.0[l], axis.z.0[l]) = (v[3 * k], v[3 * k + 1], v[3 * k + 2]);
                }
            }
            let weight = *weight * F16::splat(row_weight);
            samples.push(Sample { basis, weight, pattern: pattern(i, j) });
        }
    }
}

/// The linear filter's averages, `[xx, xy, xz, yy, yz, zz]` of the matrix and the normal.
#[inline(always)]
fn linear_sums(samples: &[Sample]) -> ([F16; 6], V16) {
    // M_n A M_n^T + n n^T, since the basis holds the columns of M_n A^(1/2) and n.
    let mut sums = [F16::default(); 6];
    let mut mean = V16::default();
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
    }
    // Opposite normals on the horizon leave nothing but rounding, which is z here.
    mean.z = mean.z.max(1e-6);
    let length = F16(from_fn(|l| mean.dot(mean).0[l].sqrt()));
    (sums, mean * length.recip())
}

/// The columns of `M_n0` of the linear results' normals, and their squared roughness as slopes seen from n0,
/// `[xx, xy, yy]`.
#[inline(always)]
fn linear_frames(sums: &[F16; 6], mean: &V16) -> ([V16; 3], [F16; 3]) {
    let mut n = *mean;
    sggx_normals(sums.each_ref().map(|v| &v.0), [&mut n.x.0, &mut n.y.0, &mut n.z.0]);

    let mut frame = [V16::default(); 3];
    let mut roughness = [F16::default(); 3];
    let [x, y, z] = &mut frame;
    let [axx, axy, ayy] = &mut roughness;
    let [xx, xy, xz, yy, yz, zz] = sums;
    for l in 0..LANES {
        let m = m_n(n.lane(l));
        (x.x.0[l], x.y.0[l], x.z.0[l]) = (m.x_axis.x, m.x_axis.y, m.x_axis.z);
        (y.x.0[l], y.y.0[l], y.z.0[l]) = (m.y_axis.x, m.y_axis.y, m.y_axis.z);
        (z.x.0[l], z.y.0[l], z.z.0[l]) = (m.z_axis.x, m.z_axis.y, m.z_axis.z);
        let s =
            Sym3 { xx: xx.0[l], xy: xy.0[l], xz: xz.0[l], yy: yy.0[l], yz: yz.0[l], zz: zz.0[l] }.in_frame(m);
        let a = slopes_from_sggx(s).1;
        (axx.0[l], axy.0[l], ayy.0[l]) = (a.xx, a.xy, a.yy);
    }
    (frame, roughness)
}

/// Normals and squared roughness `[xx, xy, yy]` of slope distributions seen in the lanes' frames; eigenvalues
/// may exceed one.
#[inline(always)]
fn surfaces(frame: &[V16; 3], mean: &V16, m: [F16; 2], a: [F16; 3]) -> (V16, [F16; 3]) {
    let mut matrices = [F16::default(); 6];
    let [xx, xy, xz, yy, yz, zz] = &mut matrices;
    let [x, y, z] = frame;
    for l in 0..LANES {
        let a = Sym2 { xx: a[0].0[l], xy: a[1].0[l], yy: a[2].0[l] };
        let slopes = sggx_from_slopes(vec2(m[0].0[l], m[1].0[l]), a);
        let transposed = Mat3::from_cols(
            vec3(x.x.0[l], y.x.0[l], z.x.0[l]),
            vec3(x.y.0[l], y.y.0[l], z.y.0[l]),
            vec3(x.z.0[l], y.z.0[l], z.z.0[l]),
        );
        let s = slopes.in_frame(transposed);
        (xx.0[l], xy.0[l], xz.0[l]) = (s.xx, s.xy, s.xz);
        (yy.0[l], yz.0[l], zz.0[l]) = (s.yy, s.yz, s.zz);
    }

    let [xx, xy, xz, yy, yz, zz] = &matrices;
    let mut n = *mean;
    sggx_normals(matrices.each_ref().map(|v| &v.0), [&mut n.x.0, &mut n.y.0, &mut n.z.0]);
    for l in 0..LANES {
        let s = Sym3 { xx: xx.0[l], xy: xy.0[l], xz: xz.0[l], yy: yy.0[l], yz: yz.0[l], zz: zz.0[l] };
        // Where a single microfacet outweighs its footprint, the mean normal may lie in the plane of eigenvalue
        // zero. The microfacet of mean slope has no part in it.
        if s.quadratic(n.lane(l)) < MIN_AREA * s.trace() {
            let centre = (frame[0] * m[0] + frame[1] * m[1] + frame[2]).lane(l).normalize();
            let axis = sggx_principal_axis(s, centre);
            (n.x.0[l], n.y.0[l], n.z.0[l]) = (axis * 1.0_f32.copysign(axis.z)).into();
        }
    }

    let mut roughness = [F16::default(); 3];
    sggx_roughness(
        matrices.each_ref().map(|v| &v.0),
        [&n.x.0, &n.y.0, &n.z.0],
        roughness.each_mut().map(|v| &mut v.0),
    );
    (n, roughness)
}

/// The one texel that a lane's footprint consists of, where it is constant: it comes out as it went in.
#[inline(always)]
fn constant_texels(
    block: &Block,
    columns: [&Taps; LANES],
    samples: &[Sample],
) -> [Option<(Vec3, Sym2)>; LANES] {
    let mut change = F16::default();
    for sample in samples {
        for (axis, first) in sample.basis.iter().zip(&samples[0].basis) {
            change += (axis.x - first.x).abs() + (axis.y - first.y).abs() + (axis.z - first.z).abs();
        }
    }
    from_fn(|l| {
        let (column, _) = draw(columns[l], first_stratum(columns[l]), block.rows[0].0 * 131);
        (change.0[l] == 0.0).then(|| block.top.texel((column - block.first) as usize))
    })
}

/// Turns the samples into microfacets, `COUNT` each, seen in the lanes' frames.
#[inline(always)]
fn scatter<const COUNT: usize>(samples: &[Sample], frame: &[V16; 3], microfacets: &mut Vec<Microfacet>) {
    microfacets.clear();
    for sample in samples {
        let [x, y, n] =
            sample.basis.map(|v| V16 { x: v.dot(frame[0]), y: v.dot(frame[1]), z: v.dot(frame[2]) });
        for k in 0..COUNT {
            let slope = microfacet::<COUNT>(sample.pattern, k);
            let h = x * F16::splat(slope.x) + y * F16::splat(slope.y) + n;
            // Microfacets that n0 cannot see have no slope; they weigh nothing.
            let inv = h.z.max(MIN_COSINE).recip();
            let weight = h.z.max(0.0) * sample.weight;
            microfacets.push(Microfacet { x: h.x * inv, y: h.y * inv, weight });
        }
    }
}

/// Sums over microfacets of u times `[1, x, y, xx, xy, yy]`, with slopes relative to the mean, in `N` lanes from
/// `first` on: as many as a vector has, or the twelve vectors that are needed again in every round do not fit into
/// the registers. `estimate` is the mean and the inverse of A, whose mixed element is doubled.
#[inline(always)]
fn add_moments<const N: usize>(
    microfacets: &[Microfacet],
    estimate: &[F16; 5],
    first: usize,
    sums: &mut [F16; 6],
) {
    let part = |v: &F16| -> [f32; N] { from_fn(|l| v.0[first + l]) };
    let [mx, my, ixx, ixy, iyy] = estimate.each_ref().map(part);
    let mut sum = [[0.0; N]; 6];
    for h in microfacets {
        let (hx, hy, weight) = (part(&h.x), part(&h.y), part(&h.weight));
        for l in 0..N {
            let (x, y) = (hx[l] - mx[l], hy[l] - my[l]);
            // Rounding can take it below zero where A is all but singular, and a weight at -1 has no bound.
            let q = x * (x * ixx[l] + y * ixy[l]) + y * y * iyy[l];
            let q = if q > 0.0 { q } else { 0.0 };
            let u = weight[l] / (1.0 + q);
            let (ux, uy) = (u * x, u * y);
            sum[0][l] += u;
            sum[1][l] += ux;
            sum[2][l] += uy;
            sum[3][l] += ux * x;
            sum[4][l] += ux * y;
            sum[5][l] += uy * y;
        }
    }
    for (all, part) in sums.iter_mut().zip(&sum) {
        all.0[first..first + N].copy_from_slice(part);
    }
}

/// The fixed point of the iteration: mean slopes and squared roughness `[xx, xy, yy]`.
#[inline(always)]
fn maximise<const WIDTH: usize>(microfacets: &[Microfacet], start: [F16; 3]) -> ([F16; 2], [F16; 3]) {
    let mut m = [F16::default(); 2];
    let mut a = start;
    for _ in 0..MAX_STEPS {
        // Inverse of A, kept away from singular.
        let (xx, yy) = (a[0].max(MIN_A), a[2].max(MIN_A));
        let det = (xx * yy - a[1] * a[1]).max(MIN_A * MIN_A);
        let inv_det = det.recip();
        let (ixx, ixy, iyy) = (yy * inv_det, -(a[1] + a[1]) * inv_det, xx * inv_det);

        let mut sum = [F16::default(); 6];
        let estimate = [m[0], m[1], ixx, ixy, iyy];
        if WIDTH >= LANES {
            add_moments::<LANES>(microfacets, &estimate, 0, &mut sum);
        } else {
            add_moments::<{ LANES / 2 }>(microfacets, &estimate, 0, &mut sum);
            add_moments::<{ LANES / 2 }>(microfacets, &estimate, LANES / 2, &mut sum);
        }

        // The sums are about the old mean; the moments about the new one follow by the shift.
        let inv = sum[0].max(f32::MIN_POSITIVE).recip();
        let (dx, dy) = (sum[1] * inv, sum[2] * inv);
        let two = F16::splat(2.0);
        let next =
            [two * (sum[3] * inv - dx * dx), two * (sum[4] * inv - dx * dy), two * (sum[5] * inv - dy * dy)];
        m = [m[0] + dx, m[1] + dy];
        let tolerance = (next[0] + next[2]) * F16::splat(CONVERGED);
        let settled = (0..LANES).all(|l| (0..3).all(|k| (next[k].0[l] - a[k].0[l]).abs() <= tolerance.0[l]));
        a = next;
        if settled {
            break;
        }
    }
    (m, a)
}
