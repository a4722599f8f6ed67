//! From scene radiance to display values.
//!
//! ```
//! use kinran_render::tonemap::{Tonemap, to_srgb8};
//!
//! // Twice the light of white has no room on a display; ACES leaves some for it.
//! let bright = [[2.0; 3]];
//! assert_eq!(to_srgb8(&bright, 0.0, Tonemap::None), [[255; 3]]);
//! assert!(to_srgb8(&bright, 0.0, Tonemap::Aces)[0][0] < 255);
//! ```

use glam::{Mat3, Vec3, vec3};
use kinran_image::srgb::srgb_from_linear;

/// How radiance is brought into the range of a display.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Tonemap {
    /// Clamped to [0, 1].
    None,
    /// The ACES reference rendering and output transforms as fitted by Stephen Hill (BakingLab, `ACES.hlsl`).
    /// It maps 0.18 to 0.106; some engines divide the exposure by 0.6 before it, this one does not.
    Aces,
    /// AgX by Troy Sobotka, base look, with the sixth-degree curve fitted by Benjamin Wrensch
    /// (<https://iolite-engine.com/blog_posts/minimal_agx_implementation>): less saturated highlights and
    /// no hue skews.
    AgX,
}

/// The sRGB encoding of a linear value in [0, 1] (IEC 61966-2-1). Values outside are clamped; NaN becomes 0.
pub fn srgb_oetf(linear: f32) -> f32 {
    // NaN is not above zero.
    if linear > 0.0 { srgb_from_linear(linear.min(1.0)) } else { 0.0 }
}

/// Linear display light in [0, 1] for the scene radiance `radiance`, linear Rec. 709.
pub fn tonemap(radiance: Vec3, curve: Tonemap) -> Vec3 {
    let radiance = radiance.max(Vec3::ZERO);
    match curve {
        Tonemap::None => radiance,
        Tonemap::Aces => aces(radiance),
        Tonemap::AgX => agx(radiance),
    }
    .clamp(Vec3::ZERO, Vec3::ONE)
}

/// Display-encoded 8-bit sRGB of every pixel: radiance times `2^exposure_ev`, tonemapped, encoded and
/// rounded to nearest.
pub fn to_srgb8(radiance: &[[f32; 3]], exposure_ev: f32, curve: Tonemap) -> Vec<[u8; 3]> {
    let exposure = libm::exp2f(exposure_ev);
    radiance
        .iter()
        .map(|&c| {
            let display = tonemap(Vec3::from(c) * exposure, curve);
            display.to_array().map(|x| (srgb_oetf(x) * 255.0 + 0.5) as u8)
        })
        .collect()
}

fn aces(x: Vec3) -> Vec3 {
    // sRGB => XYZ => D65_2_D60 => AP1 => RRT_SAT, and ODT_SAT => XYZ => D60_2_D65 => sRGB.
    let input = Mat3::from_cols(
        vec3(0.59719, 0.07600, 0.02840),
        vec3(0.35458, 0.90834, 0.13383),
        vec3(0.04823, 0.01566, 0.83777),
    );
    let output = Mat3::from_cols(
        vec3(1.60475, -0.10208, -0.00327),
        vec3(-0.53108, 1.10813, -0.07276),
        vec3(-0.07367, -0.00605, 1.07602),
    );
    // The rational curve tends to 1 / 0.983729; beyond f32's square root its squares would overflow.
    let v = (input * x).min(Vec3::splat(1e15));
    let a = v * (v + 0.024_578_6) - 0.000_090_537;
    let b = v * (0.983_729 * v + 0.432_951) + 0.238_081;
    output * (a / b)
}

fn agx(x: Vec3) -> Vec3 {
    let inset = Mat3::from_cols(
        vec3(0.842_479_06, 0.042_328_242, 0.042_375_655),
        vec3(0.078_433_6, 0.878_468_64, 0.078_433_6),
        vec3(0.079_223_745, 0.079_166_13, 0.879_143),
    );
    let outset = Mat3::from_cols(
        vec3(1.196_879, -0.052_896_852, -0.052_971_636),
        vec3(-0.098_020_88, 1.151_903_1, -0.098_043_45),
        vec3(-0.099_029_74, -0.098_961_18, 1.151_073_7),
    );

    // Log encoding over 16.5 stops around mid grey.
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let ev = (inset * x).to_array().map(|v| libm::log2f(v.max(f32::MIN_POSITIVE)));
    let t = ((Vec3::from(ev) - MIN_EV) / (MAX_EV - MIN_EV)).clamp(Vec3::ZERO, Vec3::ONE);

    let t2 = t * t;
    let t4 = t2 * t2;
    let curve =
        15.5 * t4 * t2 - 40.14 * t4 * t + 31.96 * t4 - 6.868 * t2 * t + 0.4298 * t2 + 0.1191 * t - 0.00232;

    // The curve ends in display values of a pure 2.2 power; back to linear light.
    let display = (outset * curve).max(Vec3::ZERO);
    Vec3::from(display.to_array().map(|v| libm::powf(v, 2.2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(wanted: f32, got: f32, tolerance: f32, input: &str) {
        assert!((wanted - got).abs() <= tolerance, "{input}: wanted {wanted} ± {tolerance}, got {got}");
    }

    #[test]
    fn srgb_known_values_and_the_joint() {
        assert_eq!(srgb_oetf(0.0), 0.0);
        assert_eq!(srgb_oetf(f32::NAN), 0.0);
        assert_near(1.0, srgb_oetf(1.0), 1e-6, "1");
        assert_near(1.0, srgb_oetf(7.0), 1e-6, "7");
        // 0.21586 is the linear light of code 128.
        assert_near(128.0 / 255.0, srgb_oetf(0.215_860_5), 1e-5, "0.21586");
        assert_near(srgb_oetf(0.003_130_7), srgb_oetf(0.003_130_9), 1e-5, "the joint");
    }

    #[test]
    fn mid_grey_lands_where_the_papers_say() {
        // Hill's curve on grey, whose matrices' rows sum to one: (x(x+.0245786)-.000090537)/(x(.983729x+.432951)+.238081).
        assert_near(0.105_6, tonemap(Vec3::splat(0.18), Tonemap::Aces).y, 1e-4, "ACES 0.18");
        // AgX puts mid grey on half of the display value; the polynomial is good to 0.2 % on average.
        assert_near(0.5, tonemap(Vec3::splat(0.18), Tonemap::AgX).y.powf(1.0 / 2.2), 5e-3, "AgX 0.18");
        assert_eq!(tonemap(Vec3::splat(0.18), Tonemap::None), Vec3::splat(0.18));
    }

    #[test]
    fn greys_stay_grey_and_the_curve_never_falls() {
        for curve in [Tonemap::None, Tonemap::Aces, Tonemap::AgX] {
            let mut previous = -1.0;
            for i in 0..4000 {
                let x = libm::exp2f(-14.0 + 24.0 * i as f32 / 4000.0);
                let y = tonemap(Vec3::splat(x), curve);
                assert!(
                    y.is_finite() && y.min_element() >= 0.0 && y.max_element() <= 1.0,
                    "{curve:?} {x}: {y}"
                );
                assert!((y - y.y).abs().max_element() < 2e-3, "{curve:?} {x}: not grey {y}");
                assert!(y.y >= previous - 1e-6, "{curve:?} falls at {x}: {previous} to {}", y.y);
                previous = y.y;
            }
            assert!(previous > 0.95, "{curve:?} ends at {previous}");
        }
    }

    #[test]
    fn hostile_radiance_stays_in_range() {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, f32::MAX, 1e-40] {
            for curve in [Tonemap::None, Tonemap::Aces, Tonemap::AgX] {
                let y = to_srgb8(&[[x, 0.5, 0.5]], 0.0, curve)[0];
                let z = tonemap(vec3(x, 0.5, 0.5), curve);
                assert!(z.is_finite(), "{curve:?} of {x} is {z} ({y:?})");
            }
        }
    }

    #[test]
    fn exposure_counts_in_stops() {
        let one_stop = to_srgb8(&[[0.1; 3]], 1.0, Tonemap::None);
        assert_eq!(one_stop, to_srgb8(&[[0.2; 3]], 0.0, Tonemap::None));
    }
}
