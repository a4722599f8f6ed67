//! The pair of base colour b and metalness m nearest to what a footprint scatters and reflects.
//!
//! With the means d of what scatters and f of what reflects,
//!
//! ```text
//! min  Σ (b (1-m) - d)² + (b m + φ (1-m) - f)²,   0 ≤ b, m ≤ what factors allow, sums over red, green and blue.
//! ```
//!
//! For a given m, with `s = 1 - m` and `g = f - φ s`, b is the projection of (d, g) on (s, m): `b = (s d + m g) / (s² + m²)`.
//! What is left is a function of m alone. It may have two minima (dark colours: φ is neither scattered nor b's), so it is looked
//! at all over and then more and more closely ([`search`]).

/// The most that textures can say: their factors.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) base: [f32; 3],
    pub(super) metallic: f32,
}

/// Averages over a footprint.
pub(super) struct Means {
    /// `b (1 - m)`.
    pub(super) scattered: [f32; 3],
    /// `b m`.
    pub(super) of_metal: [f32; 3],
    /// m.
    pub(super) metallic: f32,
}

impl Means {
    /// What reflects, where F0 of what is not metal is `dielectric`.
    pub(super) fn reflected(&self, dielectric: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|c| self.of_metal[c] + dielectric[c] * (1.0 - self.metallic))
    }

    /// The mean base colour, where with the mean metalness it scatters and reflects what the footprint does.
    pub(super) fn exact(&self) -> Option<[f32; 3]> {
        let averages: [f32; 3] = std::array::from_fn(|c| self.scattered[c] + self.of_metal[c]);
        let cross = |c: usize| self.of_metal[c] - averages[c] * self.metallic;
        (2.0 * (0..3).map(|c| cross(c) * cross(c)).sum::<f32>() < EXACT).then_some(averages)
    }
}

/// Sum of squared errors of both colours below which the averages of b and m stay: each within a twentieth of the step of an
/// 8-bit code at its darkest.
const EXACT: f32 = 1e-9;

/// Metalness is looked at in steps of an eighth first.
const STEPS: usize = 8;

/// Then in smaller ones, down to 1/1024, a quarter of a step of 8 bits.
const FINEST: f32 = 1.0 / 1024.0;

/// The metalness of least error up to `most`, and what goes with it; `best` gives both for a metalness. `mean` is looked at
/// first.
pub(super) fn search<T>(mean: f32, most: f32, best: impl Fn(f32) -> (T, f32)) -> (T, f32) {
    let mut m = mean.min(most);
    let (mut found, mut error) = best(m);
    let mut look = |m: &mut f32, at: f32| {
        let (other, e) = best(at);
        if e < error {
            (*m, found, error) = (at, other, e);
        }
    };
    for i in 0..=STEPS {
        look(&mut m, most * i as f32 / STEPS as f32);
    }
    let mut step = most / (2 * STEPS) as f32;
    while step >= FINEST {
        let middle = m;
        look(&mut m, (middle - step).max(0.0));
        look(&mut m, (middle + step).min(most));
        step *= 0.5;
    }
    (found, m)
}

/// Base colour and metalness that together are nearest to what a footprint scatters and reflects. `dielectric` is F0 of what is
/// not metal.
pub(super) fn pair(means: &Means, dielectric: [f32; 3], limits: Limits) -> ([f32; 3], f32) {
    if let Some(averages) = means.exact() {
        return (averages, means.metallic);
    }
    let (d, f) = (means.scattered, means.reflected(dielectric));
    // The base colour for a metalness, and their error.
    search(means.metallic, limits.metallic, |m| {
        let s = 1.0 - m;
        let inv = 1.0 / (s * s + m * m);
        let (mut base, mut error) = ([0.0; 3], 0.0);
        for c in 0..3 {
            let g = f[c] - dielectric[c] * s;
            let b = ((s * d[c] + m * g) * inv).clamp(0.0, limits.base[c]);
            let (e_d, e_g) = (b * s - d[c], b * m - g);
            error += e_d * e_d + e_g * e_g;
            base[c] = b;
        }
        (base, error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform in [0, 1).
    fn uniform(state: &mut u32) -> f64 {
        *state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        f64::from(*state >> 8) / 16_777_216.0
    }

    /// Footprints of two to four materials, gold on cloth and dark ones among them, against every 1/2000 of metalness, in double
    /// precision.
    #[test]
    fn another_pair_is_nearer_to_what_a_footprint_shows() {
        let mut state = 5;
        let (mut plain, mut mended) = (0.0, 0.0);
        for i in 0..3000 {
            let f0 = [0.04, 0.04, if i % 7 == 0 { 0.02 } else { 0.04 }];
            let limits = match i % 5 {
                0 => Limits { base: [0.9, 1.0, 0.7], metallic: 0.8 },
                _ => Limits { base: [1.0; 3], metallic: 1.0 },
            };
            let (mut d, mut metal, mut m_mean) = ([0.0; 3], [0.0; 3], 0.0);
            let count = 2 + i % 3;
            for _ in 0..count {
                let dark = if uniform(&mut state) < 0.4 { 0.05 } else { 1.0 };
                let m = match uniform(&mut state) {
                    v if v < 0.4 => 0.0,
                    v if v < 0.8 => f64::from(limits.metallic),
                    _ => uniform(&mut state) * f64::from(limits.metallic),
                };
                m_mean += m / count as f64;
                for c in 0..3 {
                    let b = dark * uniform(&mut state) * f64::from(limits.base[c]);
                    d[c] += b * (1.0 - m) / count as f64;
                    metal[c] += b * m / count as f64;
                }
            }
            let f: [f64; 3] = std::array::from_fn(|c| metal[c] + f64::from(f0[c]) * (1.0 - m_mean));
            let error = |b: [f64; 3], m: f64| -> f64 {
                let term = |c: usize| {
                    let reflected = b[c] * m + f64::from(f0[c]) * (1.0 - m);
                    (b[c] * (1.0 - m) - d[c]).powi(2) + (reflected - f[c]).powi(2)
                };
                (0..3).map(term).sum()
            };
            // The best of a line of base colours, by thirds: no formula of the module.
            let mut wanted = f64::INFINITY;
            for step in 0..=2000 {
                let m = f64::from(limits.metallic) * f64::from(step) / 2000.0;
                let b = std::array::from_fn(|c| {
                    let (mut lo, mut hi) = (0.0, f64::from(limits.base[c]));
                    for _ in 0..40 {
                        let (p, q) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                        let at = |v: f64| {
                            let reflected = v * m + f64::from(f0[c]) * (1.0 - m);
                            (v * (1.0 - m) - d[c]).powi(2) + (reflected - f[c]).powi(2)
                        };
                        if at(p) < at(q) { hi = q } else { lo = p }
                    }
                    0.5 * (lo + hi)
                });
                wanted = wanted.min(error(b, m));
            }
            let means = Means {
                scattered: d.map(|v| v as f32),
                of_metal: metal.map(|v| v as f32),
                metallic: m_mean as f32,
            };
            let (b, m) = pair(&means, f0, limits);
            let got = error(b.map(f64::from), f64::from(m));
            assert!(got <= wanted + 2e-5, "footprint {i}: wanted {wanted:e}, got {got:e} by {b:?}, {m}");
            assert!(m <= limits.metallic && (0..3).all(|c| b[c] <= limits.base[c] + 1e-6), "{b:?}, {m}");
            let averages: [f64; 3] = std::array::from_fn(|c| d[c] + metal[c]);
            plain += error(averages, m_mean);
            mended += got;
        }
        assert!(mended < 0.5 * plain, "sum of squared errors: {mended}, of plain averages {plain}");
    }

    /// One texel's pair is that texel's.
    #[test]
    fn a_footprint_of_one_material_becomes_another() {
        let mut state = 11;
        for i in 0..2000 {
            let m = [0.0, 1.0, uniform(&mut state) as f32][i % 3];
            let b: [f32; 3] = std::array::from_fn(|_| uniform(&mut state) as f32);
            let means = Means { scattered: b.map(|b| b - b * m), of_metal: b.map(|b| b * m), metallic: m };
            let (got, got_m) = pair(&means, [0.04; 3], Limits { base: [1.0; 3], metallic: 1.0 });
            let off = (0..3).map(|c| (got[c] - b[c]).abs()).fold((got_m - m).abs(), f32::max);
            assert!(off < 1e-6, "wanted {b:?}, {m}, got {got:?}, {got_m}");
        }
    }
}
