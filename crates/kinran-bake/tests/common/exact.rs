//! The formulas once more, in f64 and by other means than the crate's: no line is shared with it.
#![allow(clippy::needless_range_loop, reason = "matrices read best by index")]

use glam::Vec3;
use kinran_scene::Wrap;
use kinran_shading::Sym2;

pub type V3 = [f64; 3];
pub type M3 = [[f64; 3]; 3];
/// A normal and `[xx, xy, yy]`.
pub type Exact = (V3, [f64; 3]);

pub fn exact((n, a): (Vec3, Sym2)) -> Exact {
    let n = n.to_array().map(f64::from);
    (scaled(n, 1.0 / dot(n, n).sqrt()), [a.xx, a.xy, a.yy].map(f64::from))
}

pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn scaled(a: V3, s: f64) -> V3 {
    a.map(|v| v * s)
}

pub fn unit(a: V3) -> V3 {
    scaled(a, 1.0 / dot(a, a).sqrt())
}

pub fn mul(a: M3, b: M3) -> M3 {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

pub fn transposed(a: M3) -> M3 {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// The shortest arc from z to `n` by Rodrigues' formula, `R = I + K + K² / (1 + n.z)` with K the cross
/// product with z × n. Rows of the result are rows.
pub fn m_n(n: V3) -> M3 {
    let (x, y) = (-n[1], n[0]);
    let k = [[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]];
    let k2 = mul(k, k);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| f64::from(u8::from(i == j)) + k[i][j] + k2[i][j] / (1.0 + n[2]))
    })
}

/// `M_n [A 0; 0 1] M_n^T`.
pub fn sggx((n, a): Exact) -> M3 {
    let m = m_n(n);
    mul(mul(m, [[a[0], a[1], 0.0], [a[1], a[2], 0.0], [0.0, 0.0, 1.0]]), transposed(m))
}

/// Eigenvalues and eigenvectors (columns) by Jacobi's rotations.
pub fn jacobi(mut s: M3) -> (V3, M3) {
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..60 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if s[p][q].abs() < 1e-300 {
                continue;
            }
            let theta = (s[q][q] - s[p][p]) / (2.0 * s[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let c = 1.0 / t.hypot(1.0);
            let mut r = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            (r[p][p], r[q][q], r[p][q], r[q][p]) = (c, c, t * c, -t * c);
            s = mul(mul(transposed(r), s), r);
            v = mul(v, r);
        }
    }
    ([s[0][0], s[1][1], s[2][2]], v)
}

/// Normal and squared roughness of a matrix: the eigenvector nearest to `mean`, eigenvalues at most one.
pub fn extract(s: M3, mean: V3) -> Exact {
    let (_, v) = jacobi(s);
    let column = |k: usize| [v[0][k], v[1][k], v[2][k]];
    let k = (0..3)
        .max_by(|&a, &b| dot(column(a), mean).abs().total_cmp(&dot(column(b), mean).abs()))
        .expect("three columns");
    let n = column(k);
    let n = if n[2] < 0.0 { scaled(n, -1.0) } else { n };
    let m = m_n(n);
    let local = mul(mul(transposed(m), s), m);
    let a = [local[0][0], local[0][1], local[1][1]].map(|v| v / local[2][2]);
    (n, clamped(a))
}

/// Eigenvalues `(larger, smaller)` and the angle of the larger one's axis.
pub fn eigen2(a: [f64; 3]) -> (f64, f64, f64) {
    let (mean, half) = (0.5 * (a[0] + a[2]), 0.5 * (a[0] - a[2]));
    let radius = half.hypot(a[1]);
    (mean + radius, mean - radius, 0.5 * a[1].atan2(half))
}

pub fn from_eigen2(l1: f64, l2: f64, angle: f64) -> [f64; 3] {
    let (s, c) = angle.sin_cos();
    [l1 * c * c + l2 * s * s, (l1 - l2) * s * c, l1 * s * s + l2 * c * c]
}

/// Eigenvalues brought down to one.
pub fn clamped(a: [f64; 3]) -> [f64; 3] {
    let (l1, l2, angle) = eigen2(a);
    if l1 <= 1.0 { a } else { from_eigen2(1.0, l2.min(1.0), angle) }
}

/// Principal roughnesses, larger first.
pub fn alphas(a: [f64; 3]) -> [f64; 2] {
    let (l1, l2, _) = eigen2(a);
    [l1.max(0.0).sqrt(), l2.max(0.0).sqrt()]
}

/// Angle between unit vectors, degrees.
pub fn degrees(a: V3, b: V3) -> f64 {
    let d: V3 = std::array::from_fn(|k| a[k] - b[k]);
    (2.0 * (0.5 * dot(d, d).sqrt()).asin()).to_degrees()
}

/// D of `h` by the inverse of S: `1 / (π sqrt|S| (h^T S^-1 h)²)`.
pub fn ggx_d(s: M3, h: V3) -> f64 {
    let cofactor = |i: usize, j: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (c, d) = ((j + 1) % 3, (j + 2) % 3);
        s[a][c] * s[b][d] - s[a][d] * s[b][c]
    };
    let det: f64 = (0..3).map(|j| s[0][j] * cofactor(0, j)).sum();
    let q: f64 = (0..3).map(|i| (0..3).map(|j| h[i] * h[j] * cofactor(i, j)).sum::<f64>()).sum::<f64>() / det;
    1.0 / (std::f64::consts::PI * det.sqrt() * q * q)
}

/// Where the texel at `i` is found in a row of `len` texels.
pub fn beyond(i: i64, len: i64, wrap: Wrap) -> usize {
    let inside = match wrap {
        Wrap::Repeat => ((i % len) + len) % len,
        Wrap::Clamp => i.max(0).min(len - 1),
        Wrap::Mirror => {
            let mut i = i;
            while i < 0 || i >= len {
                i = if i < 0 { -1 - i } else { 2 * len - 1 - i };
            }
            i
        }
    };
    inside as usize
}

/// For each texel of every level of an axis, the weights of all texels of level 0: texels of a level are
/// averages of the area they cover in the level before.
pub fn box_weights(size: usize) -> Vec<Vec<Vec<f64>>> {
    let mut levels = vec![identity(size)];
    for _ in 0..16 {
        let finer = levels.last().expect("begins with one");
        let (fine, coarse) = (finer.len(), (finer.len() / 2).max(1));
        let ratio = fine as f64 / coarse as f64;
        let level = (0..coarse)
            .map(|x| {
                let (begin, end) = (x as f64 * ratio, (x + 1) as f64 * ratio);
                let mut weights = vec![0.0; size];
                for (i, taps) in finer.iter().enumerate() {
                    let covered = (end.min(i as f64 + 1.0) - begin.max(i as f64)).max(0.0);
                    for (w, tap) in weights.iter_mut().zip(taps) {
                        *w += covered / ratio * tap;
                    }
                }
                weights
            })
            .collect();
        levels.push(level);
    }
    levels
}

pub fn identity(size: usize) -> Vec<Vec<f64>> {
    (0..size).map(|i| (0..size).map(|j| f64::from(u8::from(i == j))).collect()).collect()
}
