//! What the fits are fitted to, in double precision.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::DVec3;
use kinran_shading::fuzz::velvet_normalization;
use schemars::JsonSchema;
use serde::Serialize;

/// How fibres scatter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// SGGX fibres, `kinran_shading::fuzz::fibre_phase`.
    Fibre,
    /// Schlick's phase about the fibre, `kinran_shading::fuzz::velvet_phase`, with `k = 1 - alpha²`.
    Velvet,
}

impl Phase {
    /// Parts of the phase function that depend on the light only, and on the half vector only: from `s_sqr`, the square of
    /// `t·(u+v)`, and `w`, that of |u + v|.
    #[inline(always)]
    fn of_light(self, t_u: f64, alpha: f64) -> f64 {
        match self {
            Phase::Fibre => 1.0 / (4.0 * PI * (1.0 - t_u * t_u * (1.0 - alpha * alpha)).sqrt()),
            Phase::Velvet => 1.0 / (4.0 * PI),
        }
    }

    #[inline(always)]
    fn of_half(self, s_sqr: f64, w: f64, alpha: f64) -> f64 {
        let a2 = alpha * alpha;
        match self {
            Phase::Fibre => {
                let q = w / (s_sqr * (1.0 - a2) + a2 * w);
                a2 * alpha * q * q
            }
            Phase::Velvet => {
                let k = 1.0 - a2;
                let q = 1.0 - k * (1.0 - s_sqr / w).max(0.0).sqrt();
                (1.0 - k * k) / (q * q)
            }
        }
    }

    fn scale(self, alpha: f64) -> f64 {
        match self {
            Phase::Fibre => 1.0,
            Phase::Velvet => velvet_normalization((1.0 - alpha * alpha) as f32).into(),
        }
    }
}

/// Nodes and weights of the Gauss–Legendre rule with `n` points on [lo, hi].
pub(super) fn gauss_legendre(n: usize, lo: f64, hi: f64) -> Vec<(f64, f64)> {
    (0..n)
        .map(|i| {
            // Newton's method on P_n from Tricomi's estimate of the root.
            let mut x = libm::cos(PI * (i as f64 + 0.75) / (n as f64 + 0.5));
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

/// Lights above the horizon: rows of equal height, each a ring.
struct Lights {
    rows: Vec<(f64, f64)>,
    ring: Vec<(f64, f64)>,
}

static LIGHTS: LazyLock<Lights> = LazyLock::new(|| {
    const COLUMNS: usize = 144;
    let turn = |i: usize| 2.0 * PI * (i as f64 + 0.5) / COLUMNS as f64;
    Lights {
        rows: gauss_legendre(56, 0.0, 1.0),
        ring: (0..COLUMNS).map(|i| (libm::cos(turn(i)), libm::sin(turn(i)))).collect(),
    }
});

/// What a view gathers from uniform light of radiance one.
#[derive(Clone, Debug, PartialEq)]
pub struct Gathered {
    /// `B(v) = ∫ p(u, v) du` over the hemisphere.
    pub phase: f64,
    /// For each density `∫ p g du`, the layer's ambient light, and `∫ p g u du`.
    pub layers: Vec<(f64, DVec3)>,
}

/// [`Fibres::gathered`] for one view.
pub fn gathered(phase: Phase, v: DVec3, t: DVec3, alpha: f64, densities: &[f64]) -> Gathered {
    Fibres::new(phase, t, alpha).gathered(v, densities)
}

/// Fibres in light from all around, with all that no view changes.
pub struct Fibres {
    phase: Phase,
    t: DVec3,
    alpha: f64,
    rows: Vec<Row>,
}

/// Lights of one height.
struct Row {
    z: f64,
    weight: f64,
    ring: Vec<LightOnFibres>,
}

struct LightOnFibres {
    u: DVec3,
    t_u: f64,
    /// What [`Phase::of_light`] makes of it, with the rest of the integral's weight.
    scale: f64,
}

impl Fibres {
    /// Fibres along the unit vector `t`.
    pub fn new(phase: Phase, t: DVec3, alpha: f64) -> Self {
        let Lights { rows, ring } = &*LIGHTS;
        let scale = phase.scale(alpha) / ring.len() as f64 * 2.0 * PI;
        let rows = rows.iter().map(|&(z, weight)| {
            let r = (1.0 - z * z).sqrt();
            let light = |&(cos, sin): &(f64, f64)| {
                let u = DVec3::new(r * cos, r * sin, z);
                let t_u = t.dot(u);
                LightOnFibres { u, t_u, scale: phase.of_light(t_u, alpha) * scale }
            };
            Row { z, weight, ring: ring.iter().map(light).collect() }
        });
        Fibres { phase, t, alpha, rows: rows.collect() }
    }

    /// Integrals over all lights for the unit view `v` above the horizon, by quadrature over 56 × 144 lights: within
    /// 2e-3 for an alpha of 0.1, 1e-5 from 0.3 on.
    pub fn gathered(&self, v: DVec3, densities: &[f64]) -> Gathered {
        let t_v = self.t.dot(v);
        let mut phase = 0.0;
        let mut layers = vec![(0.0, DVec3::ZERO); densities.len()];
        for Row { z, weight, ring } in &self.rows {
            let (mut total, mut along) = (0.0, DVec3::ZERO);
            for &LightOnFibres { u, t_u, scale } in ring {
                let s = t_u + t_v;
                let w = (2.0 + 2.0 * u.dot(v)).max(1e-12);
                let p = scale * self.phase.of_half(s * s, w, self.alpha);
                total += p;
                along += u * p;
            }
            phase += total * weight;
            for (layer, density) in layers.iter_mut().zip(densities) {
                let g = -libm::expm1(-density * (1.0 / z + 1.0 / v.z)) * z / (z + v.z) * weight;
                layer.0 += total * g;
                layer.1 += along * g;
            }
        }
        Gathered { phase, layers }
    }
}

/// P_s in closed form for SGGX fibres, `kinran_shading::fuzz::fibre_p_s` in double precision.
pub fn fibre_p_s_exact(n_u: f64, t_u: f64, t_n: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let k = 1.0 - a2;
    let b0 = -a2 * n_u;
    let b1 = -(a2 + k * (1.0 - t_u * t_u - t_n * t_n));
    let b2 = a2 * n_u + 2.0 * k * t_u * t_n;
    let slope = |l: f64| (3.0 * l + 2.0 * b2) * l + b1;
    let mut l = 1.0;
    for _ in 0..6 {
        let value = ((l + b2) * l + b1) * l + b0;
        let root = (4.0 * slope(l) * slope(l) - 6.0 * value * (6.0 * l + 2.0 * b2)).max(0.0).sqrt();
        l -= 3.0 * value / (slope(l) + root).max(1e-40);
    }
    let area_sqr = 1.0 - k * t_u * t_u;
    let upward = l * ((l + n_u) * (l + a2 * n_u / area_sqr)).max(0.0).sqrt() / slope(l).max(1e-40);
    (1.0 - upward).clamp(0.0, 1.0)
}

/// The share of light from `u` that goes down: in closed form for fibres, by quadrature below the horizon for
/// velvet. What velvet's phase does not scatter at all, up to an eighth across the fibres and more along them, goes
/// nowhere; the talk's `1 - ∫ p` would send it down.
pub fn p_s_exact(phase: Phase, u: DVec3, t: DVec3, alpha: f64) -> f64 {
    if phase == Phase::Fibre {
        return fibre_p_s_exact(u.z, t.dot(u), t.z, alpha);
    }
    let Lights { rows, ring } = &*LIGHTS;
    let t_u = t.dot(u);
    let mut sum = 0.0;
    for &(z, weight) in rows {
        let r = (1.0 - z * z).sqrt();
        for &(cos, sin) in ring {
            let v = DVec3::new(r * cos, r * sin, -z);
            let s = t_u + t.dot(v);
            let w = (2.0 + 2.0 * u.dot(v)).max(1e-12);
            sum += phase.of_light(t_u, alpha) * phase.of_half(s * s, w, alpha) * weight;
        }
    }
    sum * phase.scale(alpha) * 2.0 * PI / ring.len() as f64
}

/// The share of a light from the unit vector `u` above the horizon that the layer itself sends up, for fibres of albedo one:
/// `∫ f(u, v) (v·n) dv`, for each density, by the quadrature of [`Fibres::gathered`].
pub fn sent_up(phase: Phase, u: DVec3, t: DVec3, alpha: f64, densities: &[f64]) -> Vec<f64> {
    let Lights { rows, ring } = &*LIGHTS;
    let t_u = t.dot(u);
    let scale = phase.of_light(t_u, alpha) * phase.scale(alpha) * 2.0 * PI / ring.len() as f64;
    let mut sums = vec![0.0; densities.len()];
    for &(z, weight) in rows {
        let r = (1.0 - z * z).sqrt();
        let scattered = |&(cos, sin): &(f64, f64)| {
            let v = DVec3::new(r * cos, r * sin, z);
            let s = t_u + t.dot(v);
            phase.of_half(s * s, (2.0 + 2.0 * u.dot(v)).max(1e-12), alpha)
        };
        let total = scale * weight * ring.iter().map(scattered).sum::<f64>();
        for (sum, density) in sums.iter_mut().zip(densities) {
            *sum += total * -libm::expm1(-density * (1.0 / z + 1.0 / u.z)) * z / (z + u.z);
        }
    }
    sums
}

/// The exponential integral E1 for x > 0 (Abramowitz and Stegun 5.1.11, 5.1.22).
pub fn exponential_integral(x: f64) -> f64 {
    if x <= 1.0 {
        const EULER: f64 = 0.577_215_664_901_532_9;
        let mut sum = -EULER - libm::log(x);
        let mut term = -1.0;
        for k in 1..24 {
            term *= -x / f64::from(k);
            sum += term / f64::from(k);
        }
        return sum;
    }
    // More terms of the continued fraction for small x.
    let terms = (40.0 + 120.0 / x) as u32;
    let tail = (1..terms).rev().fold(0.0, |tail, k| f64::from(k) / (1.0 + f64::from(k) / (x + tail)));
    libm::exp(-x) / (x + tail)
}

/// `(1/2π) ∫ g du` in closed form, for a density > 0 and a view at cosine `x` > 0:
/// `1 - x ln(1 + 1/x) - e^(-d/x) (E_2(d) - x E_1(d)) - x E_1(d (1 + 1/x))`.
pub fn g_exact(density: f64, x: f64) -> f64 {
    let e1 = exponential_integral(density);
    let e2 = libm::exp(-density) - density * e1;
    let passed = libm::exp(-density / x) * (e2 - x * e1);
    1.0 - x * libm::log(1.0 + 1.0 / x) - passed - x * exponential_integral(density * (1.0 + 1.0 / x))
}

/// `2 E_3(d)`, the share of uniform irradiance that passes a layer of density > 0.
pub fn q_exact(density: f64) -> f64 {
    let e = libm::exp(-density);
    e - density * (e - density * exponential_integral(density))
}
