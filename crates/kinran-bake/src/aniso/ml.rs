//! `ml`: the maximum-likelihood GGX lobe of a footprint.
//!
//! GGX slopes follow a bivariate Student-t with two degrees of freedom, so the lobe that maximises the
//! likelihood of a footprint's microfacets (that minimises the Kullback–Leibler divergence from their
//! distribution) is the one optimum of a fixed-point iteration [1]; the step used here is the parameter
//! expanded one [2], made longer ([`STEP_LENGTHS`]), which has the same optimum and needs fewer steps.
//!
//! With slopes s of weight W (`microfacets.rs`), from the linear result,
//!
//! ```text
//! q = (s-m)^T A^-1 (s-m),  u = W / (1 + q),  m = Σ u s / Σ u,  A = 2 Σ u (s-m)(s-m)^T / Σ u.
//! ```
//!
//! [1] Kent, Tyler, Vardi. A curious likelihood identity for the multivariate t-distribution. 1994.
//! [2] Liu, Rubin, Wu. Parameter expansion to accelerate EM. Biometrika 1998.

use super::footprint::Taps;
use super::lanes::{F8, LANES};
use super::maps::{SurfaceMaps, TexelSpan};
use super::microfacets::{self, Fit, Lobes, Microfacet, inverse, stepped};

/// Most steps of the iteration. Random metal and cloth takes two to four; mirrors of strong normals take more.
const MAX_STEPS: usize = 6;

/// By how much steps are lengthened, in turn: `1 / (1 - rate)` for rates of 3/8 and 0. A step of length one leaves
/// nothing of an error of A's trace and 1/3 of any other where the footprint is a GGX lobe itself, and between nothing
/// and 0.4 on mixtures of lobes, as measured. What is left where the iteration ends is bounded by `tests/ml_summary.rs`.
const STEP_LENGTHS: [f32; 2] = [1.6, 1.0];

/// By how much the last step is lengthened: between both, it leaves a quarter of the error at most.
const LAST_LENGTH: f32 = 1.25;

/// The iteration ends when no element of A has changed by more than this share of its trace.
const CONVERGED: f32 = 1e-2;

/// Fits some rows of a level: `columns` are the footprints of their texels along x, `rows` those along y.
pub(crate) fn fit_band(maps: &SurfaceMaps, columns: &[Taps], rows: &[Taps], out: &mut TexelSpan) {
    microfacets::fit_band::<MostLikely>(maps, columns, rows, out);
}

/// Sums over microfacets of u times `[1, x, y, xx, xy, yy]`, with slopes relative to the mean m. The mixed element of the
/// inverse of A is doubled.
#[inline(always)]
fn moments(microfacets: &[Microfacet], [mx, my]: [F8; 2], [ixx, ixy, iyy]: [F8; 3]) -> [F8; 6] {
    let (F8(mx), F8(my), F8(ixx), F8(ixy), F8(iyy)) = (mx, my, ixx, ixy, iyy);
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

struct MostLikely;

impl Fit for MostLikely {
    /// The fixed point of the iteration.
    #[inline(always)]
    fn fit(microfacets: &[Microfacet], start: [F8; 3]) -> Lobes {
        let mut m = [F8::default(); 2];
        let mut a = start;
        for step in 0..MAX_STEPS {
            let sum = moments(microfacets, m, inverse(a));

            // The sums are about the old mean; the moments about the new one follow by the shift.
            let inv = sum[0].max(f32::MIN_POSITIVE).recip();
            let (dx, dy) = (sum[1] * inv, sum[2] * inv);
            let two = F8::splat(2.0);
            let next = [
                two * (sum[3] * inv - dx * dx),
                two * (sum[4] * inv - dx * dy),
                two * (sum[5] * inv - dy * dy),
            ];
            let tolerance = (next[0] + next[2]) * F8::splat(CONVERGED);
            let mut settled = true;
            for l in 0..LANES {
                let within = |k: usize| (next[k].0[l] - a[k].0[l]).abs() <= tolerance.0[l];
                settled &= within(0) & within(1) & within(2);
            }

            let length = F8::splat(if settled { LAST_LENGTH } else { STEP_LENGTHS[step % 2] });
            a = stepped(a, next, length);
            m = [m[0] + dx * length, m[1] + dy * length];
            if settled {
                break;
            }
        }
        (m, a)
    }
}
