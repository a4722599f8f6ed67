//! What the tests share: random numbers, quadrature, an eigen solver and GGX, all in double precision and
//! none of it derived from the code under test.
#![allow(dead_code, reason = "every test file uses its own share of this module")]

pub(crate) mod chi_squared;

use glam::{DMat3, DVec2, DVec3, Vec3, dvec2, dvec3};
use kinran_shading::{Sym2, Sym3, aniso_from_alphas, sggx_from_ggx};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// SplitMix64: the same numbers on every machine.
///
/// Steele, Lea, Flood. Fast Splittable Pseudorandom Number Generators. OOPSLA 2014.
pub(crate) struct Rng(u64);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Rng(seed)
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [0, 1) and exactly representable in single precision, so below 1 there too.
    pub(crate) fn unit_f32(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform in [lo, hi).
    pub(crate) fn range(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * self.unit()
    }

    /// Two independent standard normal deviates (Box–Muller).
    pub(crate) fn normal_pair(&mut self) -> DVec2 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        DVec2::from_angle(TAU * self.unit()) * radius
    }

    /// A unit vector of the plane.
    pub(crate) fn axis(&mut self) -> DVec2 {
        DVec2::from_angle(TAU * self.unit())
    }

    /// A unit vector with z in [lo, hi).
    pub(crate) fn direction(&mut self, lo: f64, hi: f64) -> DVec3 {
        let z = self.range(lo, hi);
        self.axis().extend(0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
    }
}

/// The cases of a property test of ours: `count` of them, all from one seed.
pub(crate) fn cases(seed: u64, count: usize) -> impl Iterator<Item = Rng> {
    let mut seeds = Rng::new(seed);
    (0..count).map(move |_| Rng::new(seeds.bits()))
}

/// Nodes and weights of the Gauss–Legendre rule with `n` points on [lo, hi].
pub(crate) fn gauss_legendre(n: usize, lo: f64, hi: f64) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            // Newton's method on P_n from Tricomi's estimate of the root.
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut derivative = 0.0;
            for _ in 0..8 {
                let (mut p0, mut p1) = (1.0, x);
                for k in 2..=n {
                    let k = k as f64;
                    (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
                }
                derivative = n as f64 * (x * p1 - p0) / (x * x - 1.0);
                x -= p1 / derivative;
            }
            let weight = 1.0 / ((1.0 - x * x) * derivative * derivative);
            (lo + (hi - lo) * 0.5 * (1.0 - x), (hi - lo) * weight)
        })
        .collect()
}

/// Directions and solid angles that integrate over the sphere, the pole at the unit vector `pole` and a seam
/// on its equator, where `|pole·h|` has its kink. `n` rows in each half, `2n` columns.
pub(crate) fn sphere(pole: DVec3, n: usize) -> Vec<(DVec3, f64)> {
    let (x, y) = pole.any_orthonormal_pair();
    let mut nodes = Vec::with_capacity(4 * n * n);
    for (lo, hi) in [(-1.0, 0.0), (0.0, 1.0)] {
        for (z, weight) in gauss_legendre(n, lo, hi) {
            for column in 0..2 * n {
                let e =
                    DVec2::from_angle(TAU * (column as f64 + 0.5) / (2 * n) as f64) * (1.0 - z * z).sqrt();
                nodes.push((x * e.x + y * e.y + pole * z, weight * TAU / (2 * n) as f64));
            }
        }
    }
    nodes
}

/// Microfacet normals and solid angles that integrate over those normals of the upper hemisphere which `v`
/// sees, dense where a GGX lobe of the given roughness is: `n²` of them. For `v` = z these are all.
///
/// In slopes divided by the alphas the lobe is round and `v·h = 0` is a straight line, so that a rule in
/// Cartesian coordinates along that line meets no kink. Both axes run through a tangent, which takes the
/// plane to a square.
pub(crate) fn visible_normals(v: DVec3, alpha_t: f64, alpha_b: f64, n: usize) -> Vec<(DVec3, f64)> {
    let stretched = dvec2(alpha_t * v.x, alpha_b * v.y);
    let along = stretched.normalize_or(DVec2::X);
    let horizon = -f64::atan2(v.z, stretched.length());
    let rule_x = gauss_legendre(n, horizon, FRAC_PI_2);
    let rule_y = gauss_legendre(n, -FRAC_PI_2, FRAC_PI_2);
    let mut nodes = Vec::with_capacity(n * n);
    for &(psi, weight_x) in &rule_x {
        let (x, dx) = (psi.tan(), weight_x / psi.cos().powi(2));
        let width = (1.0 + x * x).sqrt();
        for &(chi, weight_y) in &rule_y {
            let (y, dy) = (width * chi.tan(), width * weight_y / chi.cos().powi(2));
            let slope = along * x + along.perp() * y;
            let h = dvec3(alpha_t * slope.x, alpha_b * slope.y, 1.0).normalize();
            nodes.push((h, alpha_t * alpha_b * h.z.powi(3) * dx * dy));
        }
    }
    nodes
}

/// `u` reflected: the light that the facet `h` sends to `v`.
pub(crate) fn reflect(v: DVec3, h: DVec3) -> DVec3 {
    h * (2.0 * v.dot(h)) - v
}

/// Anisotropic GGX as Walter 2007 and Heitz 2014 write it, in double precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ggx {
    pub(crate) alpha_t: f64,
    pub(crate) alpha_b: f64,
}

impl Ggx {
    /// `1 / (π at ab ((hx/at)² + (hy/ab)² + hz²)²)`.
    pub(crate) fn d(self, h: DVec3) -> f64 {
        let q = (h.x / self.alpha_t).powi(2) + (h.y / self.alpha_b).powi(2) + h.z * h.z;
        1.0 / (PI * self.alpha_t * self.alpha_b * q * q)
    }

    /// Smith's Λ.
    pub(crate) fn lambda(self, w: DVec3) -> f64 {
        let t = ((self.alpha_t * w.x).powi(2) + (self.alpha_b * w.y).powi(2)) / (w.z * w.z);
        0.5 * t / ((1.0 + t).sqrt() + 1.0)
    }

    pub(crate) fn g1(self, v: DVec3) -> f64 {
        1.0 / (1.0 + self.lambda(v))
    }

    pub(crate) fn g2(self, u: DVec3, v: DVec3) -> f64 {
        1.0 / (1.0 + self.lambda(u) + self.lambda(v))
    }

    /// Share of a white furnace that comes back to `v` at F = 1, by quadrature with `n²` nodes.
    pub(crate) fn albedo(self, v: DVec3, n: usize) -> f64 {
        // ∫ D G2 / (4 u·n v·n) u·n du over lights is ∫ D G2 v·h / v·n dh over facets.
        visible_normals(v, self.alpha_t, self.alpha_b, n)
            .into_iter()
            .map(|(h, solid_angle)| {
                let u = reflect(v, h);
                if u.z <= 0.0 { 0.0 } else { self.d(h) * self.g2(u, v) * v.dot(h) / v.z * solid_angle }
            })
            .sum()
    }
}

/// A unit view at cosine `n_v` whose azimuth is `phi`.
pub(crate) fn view(n_v: f64, phi: f64) -> DVec3 {
    (DVec2::from_angle(phi) * (1.0 - n_v * n_v).sqrt()).extend(n_v)
}

/// The full matrix of a [`Sym3`].
pub(crate) fn dense(s: Sym3) -> DMat3 {
    let [xx, xy, xz, yy, yz, zz] = [s.xx, s.xy, s.xz, s.yy, s.yz, s.zz].map(f64::from);
    DMat3::from_cols(dvec3(xx, xy, xz), dvec3(xy, yy, yz), dvec3(xz, yz, zz))
}

/// Eigenvalues and unit eigenvectors of a symmetric matrix by Jacobi rotations, largest eigenvalue first.
///
/// Golub, Van Loan. Matrix Computations. Section 8.5.
pub(crate) fn jacobi_eigen(matrix: DMat3) -> [(f64, DVec3); 3] {
    let (mut a, mut v) = (matrix, DMat3::IDENTITY);
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let apq = a.col(q)[p];
            if apq == 0.0 {
                continue;
            }
            let tau = (a.col(q)[q] - a.col(p)[p]) / (2.0 * apq);
            let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = t * c;
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = c;
            rotation.col_mut(q)[q] = c;
            rotation.col_mut(q)[p] = s;
            rotation.col_mut(p)[q] = -s;
            a = rotation.transpose() * a * rotation;
            v *= rotation;
        }
    }
    let mut pairs = [0, 1, 2].map(|i| (a.col(i)[i], v.col(i)));
    pairs.sort_by(|l, r| r.0.total_cmp(&l.0));
    pairs
}

/// Angle in degrees between two directions of any length, exact also where it is tiny.
pub(crate) fn degrees_between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// What a footprint's texels are drawn from: alphas uniform in a range and slopes normal with a deviation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Material {
    pub(crate) name: &'static str,
    pub(crate) alpha: (f64, f64),
    pub(crate) slope_deviation: f64,
}

/// Metal, cloth, a bumpy and a rough surface.
pub(crate) const MATERIALS: [Material; 4] = [
    Material { name: "metal", alpha: (0.05, 0.3), slope_deviation: 0.1 },
    Material { name: "fabric", alpha: (0.3, 0.6), slope_deviation: 0.15 },
    Material { name: "strong normals", alpha: (0.3, 0.6), slope_deviation: 0.45 },
    Material { name: "rough", alpha: (0.7, 0.95), slope_deviation: 0.2 },
];

impl Material {
    /// A texel: unit normal and squared roughness.
    pub(crate) fn texel(self, rng: &mut Rng) -> (Vec3, Sym2) {
        let n = (rng.normal_pair() * self.slope_deviation).extend(1.0).normalize();
        let (a, b) = (rng.range(self.alpha.0, self.alpha.1), rng.range(self.alpha.0, self.alpha.1));
        (n.as_vec3(), aniso_from_alphas(a.max(b) as f32, a.min(b) as f32, rng.axis().as_vec2()))
    }

    /// Mean SGGX matrix and mean normal of 16 texels.
    pub(crate) fn footprint(self, rng: &mut Rng) -> (Sym3, Vec3) {
        let mut s = Sym3::default();
        let mut n = Vec3::ZERO;
        for _ in 0..16 {
            let (normal, a) = self.texel(rng);
            s = s + sggx_from_ggx(normal, a) * (1.0 / 16.0);
            n += normal;
        }
        (s, n.normalize())
    }
}
