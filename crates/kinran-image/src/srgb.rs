//! The sRGB curve (IEC 61966-2-1), as defined and by tables: a power a sample costs more than most of what is done with it.
//!
//! ```
//! use kinran_image::srgb::{byte_from_linear, linear_from_byte};
//!
//! // Half the light is not half the code.
//! assert_eq!(byte_from_linear(0.5), 188);
//! assert!((linear_from_byte(128) - 0.2159).abs() < 1e-4);
//! ```

use std::sync::LazyLock;

/// Linear light of a code in [0, 1].
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// The code of linear light in [0, 1].
pub fn srgb_from_linear(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

static LINEAR_OF_BYTES: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));

static LINEAR_OF_CODES: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..=u16::MAX).map(|code| linear_from_srgb(f32::from(code) / 65535.0)).collect());

/// Linear light of an 8-bit code.
#[inline(always)]
pub fn linear_from_byte(code: u8) -> f32 {
    LINEAR_OF_BYTES[usize::from(code)]
}

/// Linear light of every 16-bit code; those of 8 bits are every 257th of them.
pub fn linear_of_codes() -> &'static [f32] {
    &LINEAR_OF_CODES
}

/// Linear light half-way (in code) below each 8-bit code, and the code of every 1024th of the root of linear light.
struct Codes {
    thresholds: [f32; 257],
    first: [u8; STEPS + 2],
    codes: [f32; STEPS + 2],
}

/// Steps of the root of linear light: between two of them the code is straight to 6e-6.
const STEPS: usize = 1024;

static CODES: LazyLock<Codes> = LazyLock::new(|| {
    let thresholds = std::array::from_fn(|code| match code {
        0 => -1.0,
        256 => f32::INFINITY,
        code => linear_from_srgb((code as f32 - 0.5) / 255.0),
    });
    let at = |step: usize| {
        let root = step as f32 / STEPS as f32;
        srgb_from_linear(root * root)
    };
    let first = std::array::from_fn(|step| {
        let lowest = (step as f32 / STEPS as f32).powi(2);
        (0..=255).rev().find(|&code| thresholds[usize::from(code)] <= lowest).unwrap_or(0)
    });
    Codes { thresholds, first, codes: std::array::from_fn(at) }
});

/// The 8-bit code nearest to linear light in [0, 1].
pub fn byte_from_linear(v: f32) -> u8 {
    let codes = &*CODES;
    let mut code = codes.first[(v.clamp(0.0, 1.0).sqrt() * STEPS as f32) as usize];
    while v < codes.thresholds[usize::from(code)] && code > 0 {
        code -= 1;
    }
    while code < 255 && v >= codes.thresholds[usize::from(code) + 1] {
        code += 1;
    }
    code
}

/// The code of linear light in [0, 1], within 6e-6 of the definition.
#[inline(always)]
pub fn code_from_linear(v: f32) -> f32 {
    let codes = &*CODES;
    let at = v.clamp(0.0, 1.0).sqrt() * STEPS as f32;
    let step = at as usize;
    let (a, b) = (codes.codes[step], codes.codes[step + 1]);
    a + (b - a) * (at - step as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Codes and linear light of IEC 61966-2-1, the latter the floats next to what NumPy gives in double precision.
    #[test]
    fn the_curve_is_off_at_known_values_or_its_joint() {
        for (code, linear) in [
            (0.0, 0.0),
            (0.02, 0.001_547_987_6),
            (0.04045, 0.003_130_805),
            (0.1, 0.010_022_826),
            (0.5, 0.214_041_14),
            (188.0 / 255.0, 0.502_886_5),
            (1.0, 1.0),
        ] {
            let got = linear_from_srgb(code);
            assert!((got - linear).abs() < 2e-7, "linear light of {code}: wanted {linear}, got {got}");
            let got = srgb_from_linear(linear);
            assert!((got - code).abs() < 1e-6, "code of {linear}: wanted {code}, got {got}");
        }
    }

    #[test]
    fn tables_stray_from_the_definition() {
        for i in 0..=200_000 {
            let v = i as f32 / 200_000.0;
            let want = srgb_from_linear(v);
            let got = code_from_linear(v);
            assert!((want - got).abs() < 6e-6, "{v}: wanted {want}, got {got}");
            let (byte, near) = (byte_from_linear(v), want * 255.0);
            assert!((f32::from(byte) - near).abs() <= 0.5 + 1e-3, "{v}: wanted {near}, got {byte}");
        }
        for code in 0..=255 {
            assert_eq!(byte_from_linear(linear_from_byte(code)), code);
            let wide = linear_of_codes()[257 * usize::from(code)];
            assert_eq!(linear_from_byte(code), wide, "code {code} of 8 and of 16 bits");
        }
    }
}
