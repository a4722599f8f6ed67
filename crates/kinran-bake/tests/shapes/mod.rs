//! Surfaces whose curvature is known everywhere.
#![allow(dead_code, reason = "tests and benches use their own share of this module")]

use glam::{DVec2, DVec3, Vec3, dvec2, dvec3};

/// A mesh over a grid of parameters, and what is true at each vertex.
#[derive(Clone)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Principal curvatures, the larger first.
    pub(crate) curvatures: Vec<(f64, f64)>,
    /// Whether a vertex is away from the surface's border.
    pub(crate) inner: Vec<bool>,
}

/// SplitMix64 (Steele, Lea, Flood 2014), from -1 to 1.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A grid of `nu` by `nv` cells; parameters run from 0 to 1, each vertex moved by up to `jitter` of a cell; `wraps` says
/// which parameter is periodic. `at` gives position, normal and principal curvatures.
pub(crate) fn grid(
    (nu, nv): (usize, usize),
    wraps: (bool, bool),
    jitter: f64,
    at: impl Fn(DVec2) -> (DVec3, DVec3, (f64, f64)),
) -> Shape {
    let (columns, rows) = (nu + usize::from(!wraps.0), nv + usize::from(!wraps.1));
    let mut noise = Noise(7);
    let mut shape = Shape {
        positions: Vec::new(),
        normals: Vec::new(),
        triangles: Vec::new(),
        curvatures: Vec::new(),
        inner: Vec::new(),
    };
    for j in 0..rows {
        for i in 0..columns {
            let border_u = !wraps.0 && (i == 0 || i == nu);
            let border_v = !wraps.1 && (j == 0 || j == nv);
            let (du, dv) = (jitter * noise.next(), jitter * noise.next());
            let u = (i as f64 + if border_u { 0.0 } else { du }) / nu as f64;
            let v = (j as f64 + if border_v { 0.0 } else { dv }) / nv as f64;
            let (position, normal, curvatures) = at(dvec2(u, v));
            shape.positions.push(position.as_vec3());
            shape.normals.push(normal.as_vec3());
            shape.curvatures.push(curvatures);
            let far = |i: usize, n: usize, wraps: bool| wraps || (3..n - 2).contains(&i);
            shape.inner.push(far(i, nu, wraps.0) && far(j, nv, wraps.1));
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let index = |i: usize, j: usize| ((j % rows) * columns + i % columns) as u32;
            let (a, b, c, d) = (index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
            shape.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    shape
}

use std::f64::consts::TAU;

/// About z, radii `big` and `small`.
pub(crate) fn torus(cells: (usize, usize), big: f64, small: f64, jitter: f64) -> Shape {
    grid(cells, (true, true), jitter, |uv| {
        let (a, b) = (TAU * uv.x, TAU * uv.y);
        let n = dvec3(a.cos() * b.cos(), a.sin() * b.cos(), b.sin());
        let ring = dvec3(a.cos(), a.sin(), 0.0) * big;
        (ring + small * n, n, (1.0 / small, b.cos() / (big + small * b.cos())))
    })
}

/// Along z.
pub(crate) fn cylinder(cells: (usize, usize), radius: f64, height: f64, jitter: f64) -> Shape {
    grid(cells, (true, false), jitter, |uv| {
        let a = TAU * uv.x;
        let n = dvec3(a.cos(), a.sin(), 0.0);
        (radius * n + dvec3(0.0, 0.0, height * uv.y), n, (1.0 / radius, 0.0))
    })
}

/// `z = -c (x² - y²) / 2` over [-1, 1]², normal up.
pub(crate) fn saddle(cells: (usize, usize), c: f64, jitter: f64) -> Shape {
    grid(cells, (false, false), jitter, |uv| {
        let (x, y) = (2.0 * uv.x - 1.0, 2.0 * uv.y - 1.0);
        let (p, q) = (-c * x, c * y);
        let n = dvec3(-p, -q, 1.0).normalize();
        // The shape operator of a graph.
        let w = 1.0 + p * p + q * q;
        let (e, g) = (1.0 + p * p, 1.0 + q * q);
        let (l, m) = (c / w.sqrt(), -c / w.sqrt());
        let mean = 0.5 * (l * g + m * e) / w;
        let gauss = l * m / w;
        let root = (mean * mean - gauss).max(0.0).sqrt();
        (dvec3(x, y, -0.5 * c * (x * x - y * y)), n, (mean + root, mean - root))
    })
}

/// Half axes a, b, c; poles left open.
pub(crate) fn ellipsoid(cells: (usize, usize), axes: DVec3, jitter: f64) -> Shape {
    grid(cells, (true, false), jitter, |uv| {
        let (phi, theta) =
            (TAU * uv.x, 0.1 * std::f64::consts::PI + 0.8 * std::f64::consts::PI * (1.0 - uv.y));
        let s = dvec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let p = s * axes;
        let gradient = p / (axes * axes);
        let n = gradient.normalize();
        // Gaussian and mean curvature of a quadric surface.
        let g2 = gradient.length_squared();
        let product = axes.x * axes.y * axes.z;
        let gauss = 1.0 / (product * product * g2 * g2);
        let mean = (axes.length_squared() - p.length_squared()) / (2.0 * product * product * g2.powf(1.5));
        let root = (mean * mean - gauss).max(0.0).sqrt();
        (p, n, (mean + root, mean - root))
    })
}

/// A cube's sides, subdivided, projected on a sphere, each vertex moved along it by `jitter` of a cell; sides share
/// vertices by position only.
pub(crate) fn sphere(cells: usize, radius: f64, jitter: f64) -> Shape {
    let mut shape = Shape {
        positions: Vec::new(),
        normals: Vec::new(),
        triangles: Vec::new(),
        curvatures: Vec::new(),
        inner: Vec::new(),
    };
    for side in 0..6 {
        let mut noise = Noise(side as u64);
        let first = shape.positions.len() as u32;
        for j in 0..=cells {
            for i in 0..=cells {
                let edge = i == 0 || j == 0 || i == cells || j == cells;
                let (du, dv) = if edge { (0.0, 0.0) } else { (jitter * noise.next(), jitter * noise.next()) };
                let x = 2.0 * (i as f64 + du) / cells as f64 - 1.0;
                let y = 2.0 * (j as f64 + dv) / cells as f64 - 1.0;
                let p = match side {
                    0 => dvec3(x, y, 1.0),
                    1 => dvec3(-x, y, -1.0),
                    2 => dvec3(1.0, x, y),
                    3 => dvec3(-1.0, -x, y),
                    4 => dvec3(y, 1.0, x),
                    _ => dvec3(-y, -1.0, x),
                };
                let n = p.normalize();
                shape.positions.push((radius * n).as_vec3());
                shape.normals.push(n.as_vec3());
                shape.curvatures.push((1.0 / radius, 1.0 / radius));
                shape.inner.push(true);
            }
        }
        for j in 0..cells as u32 {
            for i in 0..cells as u32 {
                let row = cells as u32 + 1;
                let a = first + j * row + i;
                shape.triangles.extend([[a, a + 1, a + row + 1], [a, a + row + 1, a + row]]);
            }
        }
    }
    shape
}
