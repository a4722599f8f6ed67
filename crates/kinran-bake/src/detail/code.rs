//! sRGB codes and back, by tables: a power a sample would cost more than the solver.

use std::sync::LazyLock;

use crate::mips::{linear_from_srgb, srgb_from_linear};

static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| linear_from_srgb(code as f32 / 255.0)));

/// Linear light of an 8-bit sRGB code.
#[inline(always)]
pub(crate) fn linear_from_byte(code: u8) -> f32 {
    LINEAR[usize::from(code)]
}

/// Linear light half-way (in code) below each code, and the code of every 1024th of the root of linear light.
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

/// The 8-bit sRGB code nearest to linear light in [0, 1].
pub(crate) fn byte_from_linear(v: f32) -> u8 {
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

/// The sRGB code of linear light in [0, 1], within 6e-6 of the definition.
#[inline(always)]
pub(crate) fn code_from_linear(v: f32) -> f32 {
    let codes = &*CODES;
    let at = v.clamp(0.0, 1.0).sqrt() * STEPS as f32;
    let step = at as usize;
    let (a, b) = (codes.codes[step], codes.codes[step + 1]);
    a + (b - a) * (at - step as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_say_what_the_definition_says() {
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
        }
    }
}
