//! `dpd`: the GGX lobe of least density power divergence from a footprint.
//!
//! Likelihood asks that no microfacet be improbable, so `ml` widens its lobe for the few that lie far out; what a person
//! sees is how high the highlight stands, and where. The density power divergence [1] between the footprint's slope
//! density g and the lobe's f,
//!
//! ```text
//! ∫ f^(1+β) - (1 + 1/β) ∫ g f^β + const,
//! ```
//!
//! leads from likelihood (β → 0) to the mean squared difference of both densities (β = 1). Here β is 1/4: half-way in
//! shaded error, and small enough that crossing threads do not end as one of them.
//!
//! With `f = 1 / (π √det A (1 + q)²)`, `q = (s-m)^T A^-1 (s-m)`, the integral is `(π² det A)^(-β/2) / (1 + 2β)`. Where the
//! derivatives vanish, with weights W that add up to one and `k = 1 + 1/β`,
//!
//! ```text
//! u = W (1+q)^-(1+2β),  T = Σ W (1+q)^-2β,  m = Σ u s / Σ u,  A = 4 k Σ u (s-m)(s-m)^T / (k T - 1 / (1+2β)):
//! ```
//!
//! a fixed point, iterated from the linear result. `tests/dpd.rs` finds the same lobe by another way.
//!
//! [1] Basu, Harris, Hjort, Jones. Robust and efficient estimation by minimising a density power divergence. Biometrika 1998.

use super::footprint::Taps;
use super::lanes::{F8, LANES};
use super::maps::{SurfaceMaps, TexelSpan};
use super::microfacets::{self, Fit, Lobes, Microfacet, inverse, stepped};

/// Steps of the iteration: a third one takes another hundredth off the error of random metal and cloth, and a third of the
/// time.
const STEPS: usize = 2;

/// By how much steps are lengthened. Where the footprint is a lobe itself, a step of length one leaves 17/28 of an error of
/// A's trace and 3/7 of any other error (integrals of Beta functions); a step of `2 / (11/28 + 4/7)` leaves 0.185 of
/// either.
const STEP_LENGTH: f32 = 2.074;

/// `4 k` for β = 1/4, 20, times what makes a lobe that is seen as microfacets at four radii a fixed point, 0.9763: with
/// `v = 1 - u` of the radii in `microfacets.rs`, `(5 v̄½ - 2/3) / (10 mean((1 - v) v½))`.
const SCALE: f32 = 19.526;

/// Smallest `5 T - 2/3`, which is 8/3 for a lobe: lets A grow fivefold in a step at most, where it is far too small.
const MIN_T: f32 = 0.5;

/// Smallest weight of a footprint, far below that of one microfacet; its reciprocal is finite.
const MIN_WEIGHT: f32 = 1e-30;

/// Fits some rows of a level: `columns` are the footprints of their texels along x, `rows` those along y.
pub(crate) fn fit_band(maps: &SurfaceMaps, columns: &[Taps], rows: &[Taps], out: &mut TexelSpan) {
    microfacets::fit_band::<LeastDivergence>(maps, columns, rows, out);
}

/// Sums over microfacets: u times `[1, x, y, xx, xy, yy]`, with slopes relative to the mean m, and T. The mixed element of
/// the inverse of A is doubled.
#[inline(always)]
fn moments(microfacets: &[Microfacet], [mx, my]: [F8; 2], [ixx, ixy, iyy]: [F8; 3]) -> [F8; 7] {
    let (F8(mx), F8(my), F8(ixx), F8(ixy), F8(iyy)) = (mx, my, ixx, ixy, iyy);
    let mut sum = [[0.0; LANES]; 7];
    for h in microfacets {
        for l in 0..LANES {
            let (x, y) = (h.x.0[l] - mx[l], h.y.0[l] - my[l]);
            // Rounding can take it below zero where A is all but singular.
            let q = x * (x * ixx[l] + y * ixy[l]) + y * y * iyy[l];
            let root = recip_sqrt(1.0 + if q > 0.0 { q } else { 0.0 });
            let t = h.weight.0[l] * root;
            let u = t * (root * root);
            let (ux, uy) = (u * x, u * y);
            sum[0][l] += u;
            sum[1][l] += ux;
            sum[2][l] += uy;
            sum[3][l] += ux * x;
            sum[4][l] += ux * y;
            sum[5][l] += uy * y;
            sum[6][l] += t;
        }
    }
    let [u, ux, uy, uxx, uxy, uyy, t] = sum;
    [F8(u), F8(ux), F8(uy), F8(uxx), F8(uxy), F8(uyy), F8(t)]
}

/// `1 / sqrt(x)` of normal numbers, within 5e-6 of itself: a line through its logarithm, the bits of a float being nearly
/// that, and two of Newton's steps. No division and no root, which would take half of the filter's time, and the same bits
/// on every machine, unlike the processors' own approximations.
#[inline(always)]
fn recip_sqrt(x: f32) -> f32 {
    let half = 0.5 * x;
    let y = f32::from_bits(0x5F37_59DF - (x.to_bits() >> 1));
    let y = y * (1.5 - half * y * y);
    y * (1.5 - half * y * y)
}

struct LeastDivergence;

impl Fit for LeastDivergence {
    /// The lobe after all steps.
    #[inline(always)]
    fn fit(microfacets: &[Microfacet], start: [F8; 3]) -> Lobes {
        let mut weight = F8::default();
        for h in microfacets {
            weight += h.weight;
        }
        let mut m = [F8::default(); 2];
        let mut a = start;
        for _ in 0..STEPS {
            let [u, ux, uy, uxx, uxy, uyy, t] = moments(microfacets, m, inverse(a));

            // The sums are about the old mean; the moments about the new one follow by the shift.
            let inv = u.max(f32::MIN_POSITIVE).recip();
            let (dx, dy) = (ux * inv, uy * inv);
            // Where n0 sees no microfacet, all sums are zero.
            let least = (weight * F8::splat(MIN_T)).max(MIN_WEIGHT);
            let surplus = t * F8::splat(5.0) - weight * F8::splat(2.0 / 3.0);
            let scale = F8::splat(SCALE) / ((surplus - least).max(0.0) + least);
            let next = [(uxx - ux * dx) * scale, (uxy - ux * dy) * scale, (uyy - uy * dy) * scale];

            let length = F8::splat(STEP_LENGTH);
            a = stepped(a, next, length);
            m = [m[0] + dx * length, m[1] + dy * length];
        }
        (m, a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_is_off_by_more_than_its_docs_say() {
        for i in 0..100_000 {
            let x = 1.0 + 1e-4 * f64::from(i) * f64::from(i);
            let (got, wanted) = (f64::from(recip_sqrt(x as f32)), 1.0 / f64::from(x as f32).sqrt());
            assert!((got / wanted - 1.0).abs() < 5e-6, "x {x}: wanted {wanted}, got {got}");
        }
    }
}
