//! Coefficients of fuzz for one tilt and one spread of its fibres, with their errors.
//!
//! What the shader library's `fuzz_p_s`, `fuzz_ambient_factor`, `fuzz_ambient_direction` and
//! `fuzz_ambient_attenuation` ask for, fitted in double precision when a material is built: a few
//! milliseconds. Beside them stand the fits of the talk, to compare with.
//!
//! ```
//! use kinran_bake::fuzz_fit::{Phase, fuzz_fit};
//!
//! let upright = fuzz_fit(Phase::Fibre, 0.0, 0.5);
//! assert!(upright.p_s.rms_error < 0.05, "{:?}", upright.p_s);
//! ```

mod exact;
mod least_squares;
mod table;

use std::sync::LazyLock;

use glam::{DVec3, dvec3};
use kinran_shading::fuzz::{fuzz_alpha, fuzz_g, fuzz_p_s, velvet_k};
use schemars::JsonSchema;
use serde::Serialize;

pub use exact::{
    Fibres, Gathered, Phase, exponential_integral, fibre_p_s_exact, g_exact, gathered, p_s_exact, q_exact,
    sent_up,
};
pub use table::{AmbientTable, TABLE_SIZE, ambient_table, ambient_texels};

use exact::gauss_legendre;
use least_squares::{least_squares, minimax};

/// Densities over which the ambient fits hold.
pub const DENSITIES: [f64; 5] = [0.05, 0.1, 0.2, 0.35, 0.5];

/// Smallest cosine of view and normal for which the ambient fits were made.
pub const N_V_MIN: f64 = 0.1;

/// Coefficients and what they are off by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Fitted<const N: usize> {
    /// In the order of the shader function.
    #[serde(serialize_with = "array")]
    #[schemars(with = "Vec<f32>")]
    pub coefficients: [f32; N],
    /// Largest difference from the exact value over the range of the fit.
    pub max_error: f32,
    /// Root of the mean squared difference.
    pub rms_error: f32,
    /// Smallest and largest value over the exact one.
    pub ratio: [f32; 2],
}

fn array<S: serde::Serializer, const N: usize>(values: &[f32; N], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(values)
}

/// All fits of one tilt and one spread.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FuzzFit {
    /// How fibres scatter.
    pub phase: Phase,
    /// Degrees from the normal.
    pub tilt: f32,
    /// 0 to 1.
    pub spread: f32,
    /// Roughness of the fibres.
    pub alpha: f32,
    /// Schlick's k.
    pub k: f32,
    /// `fuzz_p_s`: the talk's six terms, least squares over the hemisphere. Combed fibres make energy with them
    /// ([`FuzzFit::returned`]).
    pub p_s: Fitted<6>,
    /// The same terms for `B(v) = ∫ p(u, v) du`, which the talk takes for `1 - P_s(v)`.
    pub b: Fitted<6>,
    /// R: the mean of P_s over uniform irradiance, exact. Its errors are those of the light scattered down to the
    /// base, `(1 - Q) R`, over densities of 0.05 to 0.5.
    pub r: Fitted<1>,
    /// `fuzz_ambient_factor`: least worst relative error of all ambient light of uniform surroundings, over
    /// densities of 0.05 to 0.5 and n·v of 0.1 to 1. `ratio` is that of the product with `fuzz_g`, the errors
    /// are the factor's.
    pub ambient: Fitted<8>,
    /// `fuzz_ambient_direction`; errors are lengths of vectors.
    pub direction: Fitted<4>,
    /// `fuzz_g_talk`, for n·v of 0.1 to 1 and densities of 0.01 to 0.5; the same for all fibres.
    pub g: Fitted<4>,
    /// `fuzz_q_talk`, for densities of 0 to 0.5; the same for all fibres.
    pub q: Fitted<2>,
}

/// Fits everything for fibres at `tilt` radians from the normal, 0 to π/2, and a `spread` of 0 to 1.
pub fn fuzz_fit(phase: Phase, tilt: f64, spread: f64) -> FuzzFit {
    let (alpha, k) = (fuzz_alpha(spread as f32), velvet_k(spread as f32));
    let t = dvec3(libm::sin(tilt), 0.0, libm::cos(tilt));
    let (p_s, b, r) = directional(phase, t, alpha.into());
    let (ambient, direction) = ambient(phase, t, alpha.into());
    FuzzFit {
        phase,
        tilt: tilt.to_degrees() as f32,
        spread: spread as f32,
        alpha,
        k,
        p_s,
        b,
        r,
        ambient,
        direction,
        g: *TALK_G,
        q: *TALK_Q,
    }
}

impl FuzzFit {
    /// The largest share of a light that a layer of white fibres over white Lambert sends back with the coefficients of
    /// `p_s`, over lights down to 3° above the horizon and densities of 0.02 to 3: energy is made where it is above one.
    /// With the exact P_s it is 0.97 at most.
    pub fn returned(&self) -> f64 {
        const DENSITIES: [f64; 9] = [0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 1.0, 2.0, 3.0];
        const STEPS: u32 = 20;
        let tilt = f64::from(self.tilt).to_radians();
        let t = dvec3(libm::sin(tilt), 0.0, libm::cos(tilt));
        let step = |i: u32| f64::from(i) / f64::from(STEPS);
        let passed = DENSITIES.map(q_exact);
        let mut most = 0.0f64;
        for i in 0..=STEPS {
            for j in 0..=STEPS {
                let (n_u, phi) = (0.05 + 0.95 * step(i), std::f64::consts::PI * step(j));
                let r = libm::sqrt(1.0 - n_u * n_u);
                let u = dvec3(r * libm::cos(phi), r * libm::sin(phi), n_u);
                let p_s = f64::from(fuzz_p_s(self.p_s.coefficients, n_u as f32, t.dot(u) as f32));
                let up = sent_up(self.phase, u, t, self.alpha.into(), &DENSITIES);
                for ((density, q), up) in DENSITIES.iter().zip(passed).zip(up) {
                    let penetrated = libm::exp(-density / n_u);
                    let below = penetrated + (1.0 - penetrated) * p_s;
                    most = most.max(up + below * q);
                }
            }
        }
        most
    }
}

/// The talk's six terms.
fn six(x: f64, c: f64) -> [f64; 6] {
    [1.0, x, c, x * x, x * c, c * c]
}

/// Ours.
fn eight(x: f64, c: f64) -> [f64; 8] {
    [1.0, x, c, x * x, x * c, c * c, c * c * c, c * c * c * c]
}

/// Directions above the horizon on one side of the fibres' plane, a mirror for all that is fitted, with weights
/// that integrate over the whole hemisphere.
fn half_hemisphere(rows: usize, columns: usize) -> Vec<(DVec3, f64)> {
    let mut nodes = Vec::with_capacity(rows * columns);
    for (z, weight) in gauss_legendre(rows, 0.0, 1.0) {
        for column in 0..columns {
            let phi = std::f64::consts::PI * (column as f64 + 0.5) / columns as f64;
            let r = libm::sqrt(1.0 - z * z);
            let w = dvec3(r * libm::cos(phi), r * libm::sin(phi), z);
            nodes.push((w, weight * 2.0 * std::f64::consts::PI / columns as f64));
        }
    }
    nodes
}

/// P_s, B and R.
fn directional(phase: Phase, t: DVec3, alpha: f64) -> (Fitted<6>, Fitted<6>, Fitted<1>) {
    let nodes = half_hemisphere(20, 20);
    let p_s: Vec<f64> = nodes.iter().map(|&(u, _)| p_s_exact(phase, u, t, alpha)).collect();
    let downward = |density: Option<f64>| -> f64 {
        let scattered = |x: f64| density.map_or(1.0, |d| -libm::expm1(-d / x));
        let sum: f64 =
            nodes.iter().zip(&p_s).map(|(&(u, weight), p)| scattered(u.z) * p * u.z * weight).sum();
        sum / std::f64::consts::PI
    };
    let r = downward(None);
    let r = stated([r], DENSITIES.map(|d| ((1.0 - q_exact(d)) * r, downward(Some(d)))).into_iter());
    let rows: Vec<_> = nodes.iter().map(|&(w, weight)| (six(w.z, t.dot(w)), weight)).collect();
    let fitted = |exact: &[f64], clamp: bool| {
        let equations = rows.iter().zip(exact).map(|(&(row, weight), &value)| (row, value, weight));
        let coefficients = least_squares(equations);
        let limit = |x: f64| if clamp { x.clamp(0.0, 1.0) } else { x };
        errors(
            coefficients,
            rows.iter().zip(exact).map(|(&(row, weight), &value)| (row, value, weight)),
            limit,
        )
    };
    let few = half_hemisphere(12, 12);
    let fibres = Fibres::new(phase, t, alpha);
    let b: Vec<f64> = few.iter().map(|&(v, _)| fibres.gathered(v, &[]).phase).collect();
    let few_rows: Vec<_> =
        few.iter().zip(&b).map(|(&(v, weight), &b)| (six(v.z, t.dot(v)), b, weight)).collect();
    let b = errors(least_squares(few_rows.iter().copied()), few_rows.iter().copied(), |x| x);
    (fitted(&p_s, true), b, r)
}

fn errors<const N: usize>(
    coefficients: [f64; N],
    equations: impl Iterator<Item = ([f64; N], f64, f64)>,
    limit: impl Fn(f64) -> f64,
) -> Fitted<N> {
    let (mut worst, mut squares, mut weights) = (0.0f64, 0.0, 0.0);
    let mut ratio = [f64::INFINITY, 0.0f64];
    for (row, exact, weight) in equations {
        let got = limit(row.iter().zip(&coefficients).map(|(x, c)| x * c).sum());
        worst = worst.max((got - exact).abs());
        squares += weight * (got - exact) * (got - exact);
        weights += weight;
        if exact > 0.0 {
            ratio = [ratio[0].min(got / exact), ratio[1].max(got / exact)];
        }
    }
    Fitted {
        coefficients: coefficients.map(|c| c as f32),
        max_error: worst as f32,
        rms_error: libm::sqrt(squares / weights) as f32,
        ratio: ratio.map(|r| r as f32),
    }
}

/// The factor on G and the mean direction of what a view gathers.
fn ambient(phase: Phase, t: DVec3, alpha: f64) -> (Fitted<8>, Fitted<4>) {
    // Views: as many near grazing, where G changes fast, as above.
    const N_V: [f64; 10] = [N_V_MIN, 0.13, 0.18, 0.25, 0.35, 0.5, 0.65, 0.8, 0.92, 1.0];
    const AZIMUTHS: u32 = 13;
    let fibres = Fibres::new(phase, t, alpha);
    let mut factors = Vec::new();
    let mut directions = Vec::new();
    for x in N_V {
        for azimuth in 0..AZIMUTHS {
            let phi = std::f64::consts::PI * f64::from(azimuth) / f64::from(AZIMUTHS - 1);
            let r = libm::sqrt(1.0 - x * x);
            let v = dvec3(r * libm::cos(phi), r * libm::sin(phi), x);
            let c = t.dot(v);
            let gathered = fibres.gathered(v, &DENSITIES);
            for (&density, (light, moment)) in DENSITIES.iter().zip(gathered.layers) {
                let g = f64::from(fuzz_g(density as f32, x as f32));
                factors.push((eight(x, c), light / g, 1.0));
                let mean = moment / light;
                for i in 0..3 {
                    let n = f64::from(u8::from(i == 2));
                    directions.push(([n, v[i], t[i], c * t[i]], mean[i], 1.0));
                }
            }
        }
    }
    let factor = errors(minimax(&factors), factors.iter().copied(), |x| x.max(0.0));
    let coefficients = least_squares(directions.iter().copied());
    let mut direction = errors(coefficients, directions.iter().copied(), |x| x);

    // Of a vector, not of its components.
    let off = |rows: &[([f64; 4], f64, f64)]| {
        let of_row = |(row, exact, _): &([f64; 4], f64, f64)| {
            let got: f64 = row.iter().zip(&coefficients).map(|(x, c)| x * c).sum();
            (got - exact) * (got - exact)
        };
        libm::sqrt(rows.iter().map(of_row).sum())
    };
    direction.max_error = directions.chunks_exact(3).map(off).fold(0.0, f64::max) as f32;
    direction.rms_error *= libm::sqrtf(3.0);
    (factor, direction)
}

/// The talk's form of G, least squares of the relative error by linearising it about the last solution.
static TALK_G: LazyLock<Fitted<4>> = LazyLock::new(|| {
    let nodes = || {
        (0..50).flat_map(|i| (0..46).map(move |j| (0.01 + 0.01 * f64::from(i), 0.1 + 0.02 * f64::from(j))))
    };
    let exact: Vec<f64> = nodes().map(|(d, x)| g_exact(d, x)).collect();
    let below = |c: &[f64; 4], d: f64, x: f64| d + x * (c[2] + c[3] * x * x);
    let mut c = [0.0, 0.0, 1.0, 0.0];
    for _ in 0..20 {
        c = least_squares(nodes().zip(&exact).map(|((d, x), &g)| {
            let scale = 1.0 / (g * below(&c, d, x));
            ([d * x, d * x * x, -g * x, -g * x * x * x].map(|a| a * scale), (g * d - d) * scale, 1.0)
        }));
    }
    let value = |d: f64, x: f64| d * (1.0 + x * (c[0] + c[1] * x)) / below(&c, d, x);
    stated(c, nodes().zip(&exact).map(|((d, x), &g)| (value(d, x), g)))
});

/// The talk's form of Q.
static TALK_Q: LazyLock<Fitted<2>> = LazyLock::new(|| {
    let nodes = || (1..=50).map(|i| 0.01 * f64::from(i));
    let c = least_squares(nodes().map(|d| ([d, d * d], q_exact(d) - 1.0, 1.0)));
    stated(c, nodes().map(|d| (1.0 + c[0] * d + c[1] * d * d, q_exact(d))))
});

/// Errors of values over exact ones, equally weighted.
fn stated<const N: usize>(coefficients: [f64; N], values: impl Iterator<Item = (f64, f64)>) -> Fitted<N> {
    let (mut worst, mut squares, mut count) = (0.0f64, 0.0, 0.0);
    let mut ratio = [f64::INFINITY, 0.0f64];
    for (got, exact) in values {
        worst = worst.max((got - exact).abs());
        squares += (got - exact) * (got - exact);
        count += 1.0;
        ratio = [ratio[0].min(got / exact), ratio[1].max(got / exact)];
    }
    Fitted {
        coefficients: coefficients.map(|c| c as f32),
        max_error: worst as f32,
        rms_error: libm::sqrt(squares / count) as f32,
        ratio: ratio.map(|r| r as f32),
    }
}
