//! Detail maps by inversion: operators that lay a tiled detail `d` over a synthesized map `s`, and their inverses,
//! which find the `s` that gives an authored target `t` (slides: Detail Maps).
//!
//! | map | operator | inverse |
//! | --- | --- | --- |
//! | colour, roughness, specular, occlusion, metallic | [`smooth_overlay`] or [`overlay`], per channel | always |
//! | normal | [`rnm`], the synthesized normal as base | always, above the horizon |
//! | aniso | [`detail_over`], alpha given | where `t` lies in reach of alpha |
//!
//! Colour is linear light, as a sampler with sRGB decoding returns it; `s` itself is stored without sRGB. Then
//! the steps of 8 bits around s = 1/2 are finer than those of the target's own sRGB code: there
//! `d srgb(t) = 0.83 srgb(t) ds` where overlay on codes has up to `2 ds`.
//!
//! ```
//! use kinran_shading::detail::{smooth_overlay, smooth_overlay_inverse};
//!
//! let (target, detail) = (0.3, 0.6);
//! let s = smooth_overlay_inverse(target, detail);
//! assert!((smooth_overlay(s, detail) - target).abs() < 1e-5);
//! ```

mod hsv;
mod layer;
mod normal;
mod over;
mod overlay;

pub use hsv::hsv_shift;
pub use layer::{
    detail_from_texel, detail_mask, detail_mirror, detail_turn_aniso, detail_turn_normal, detail_uv,
};
pub use normal::{rnm, rnm_inverse};
pub use over::{detail_over, detail_over_inverse};
pub use overlay::{
    overlay, overlay_color, overlay_inverse, overlay_slope, smooth_overlay, smooth_overlay_color,
    smooth_overlay_inverse, smooth_overlay_inverse_end, smooth_overlay_inverse_start,
    smooth_overlay_inverse_step, smooth_overlay_slope,
};
