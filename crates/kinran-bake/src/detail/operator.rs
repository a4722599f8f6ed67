//! Ways to blend a detail, what undoes them, and the runs of texels that both are worked out for.

#![allow(
    clippy::needless_range_loop,
    reason = "loops over lanes of known length are what compilers vectorise"
)]

use kinran_shading::detail::{
    overlay_inverse, overlay_slope, smooth_overlay_inverse, smooth_overlay_inverse_end,
    smooth_overlay_inverse_start, smooth_overlay_inverse_step, smooth_overlay_slope,
};

/// Texels solved at a time: loops of known length are what compilers vectorise.
pub(crate) const RUN: usize = 64;

/// How colour and data are blended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Blend {
    /// The talk's smooth overlay.
    #[default]
    Smooth,
    /// Plain overlay.
    Plain,
}

/// The inverse of a blend and its slope.
pub(crate) trait Operator: Copy {
    fn inverse(self, t: f32, d: f32) -> f32;
    fn slope(self, s: f32, d: f32) -> f32;

    /// The inverse of a run.
    #[inline(always)]
    fn inverse_run(self, t: &[f32; RUN], d: &[f32; RUN]) -> [f32; RUN] {
        let mut s = [0.0; RUN];
        for i in 0..RUN {
            s[i] = self.inverse(t[i], d[i]);
        }
        s
    }
}

/// The talk's.
#[derive(Clone, Copy)]
pub(crate) struct Smooth;

/// Overlay as it is.
#[derive(Clone, Copy)]
pub(crate) struct Plain;

/// Alpha blending with an opacity.
#[derive(Clone, Copy)]
pub(crate) struct Over(pub(crate) f32);

impl Operator for Over {
    #[inline(always)]
    fn inverse(self, t: f32, d: f32) -> f32 {
        if self.0 < 1.0 { (d + (t - d) / (1.0 - self.0)).clamp(0.0, 1.0) } else { t }
    }
    #[inline(always)]
    fn slope(self, _: f32, _: f32) -> f32 {
        1.0 - self.0
    }
}

impl Operator for Smooth {
    #[inline(always)]
    fn inverse(self, t: f32, d: f32) -> f32 {
        smooth_overlay_inverse(t, d)
    }
    #[inline(always)]
    fn inverse_run(self, t: &[f32; RUN], d: &[f32; RUN]) -> [f32; RUN] {
        let mut x = [0.0; RUN];
        for i in 0..RUN {
            x[i] = smooth_overlay_inverse_start(t[i], d[i]);
        }
        for i in 0..RUN {
            x[i] = smooth_overlay_inverse_step(x[i], t[i], d[i]);
        }
        for i in 0..RUN {
            x[i] = smooth_overlay_inverse_end(x[i], t[i], d[i]);
        }
        x
    }
    #[inline(always)]
    fn slope(self, s: f32, d: f32) -> f32 {
        smooth_overlay_slope(s, d)
    }
}

impl Operator for Plain {
    #[inline(always)]
    fn inverse(self, t: f32, d: f32) -> f32 {
        overlay_inverse(t, d)
    }
    #[inline(always)]
    fn slope(self, s: f32, d: f32) -> f32 {
        overlay_slope(s, d)
    }
}

/// A run from `x0` on; beyond the row's end there are zeros.
#[inline(always)]
pub(crate) fn run_of(row: &[f32], x0: usize) -> [f32; RUN] {
    match row[x0..].first_chunk() {
        Some(run) => *run,
        None => {
            let mut run = [0.0; RUN];
            run[..row.len() - x0].copy_from_slice(&row[x0..]);
            run
        }
    }
}
