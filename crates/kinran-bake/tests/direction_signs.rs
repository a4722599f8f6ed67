//! A lobe has no sign, a direction map that is sampled has: neighbours that point apart average to nothing.

use std::sync::Arc;

use glam::{Vec2, vec2};
use kinran_bake::aniso::{
    NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps, SurfaceOptions, bake_surface,
};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, untold};
use kinran_scene::Wrap;

const SIDE: u32 = 64;

/// Directions all around a centre, red and green, full strength in blue.
fn radial() -> Arc<Image> {
    let mut pixels = Vec::new();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let d = vec2(x as f32 + 0.5, y as f32 + 0.5) - 0.5 * SIDE as f32;
            let d = d.normalize() * 0.5 + 0.5;
            pixels.extend([d.x, d.y, 1.0].map(|v| (v * 255.0 + 0.5) as u8));
        }
    }
    Arc::new(Image::new(SIDE, SIDE, Channels::Rgb, Pixels::U8(pixels)).unwrap())
}

/// Pairs of neighbours in a row that point apart.
fn opposed(texels: &[[f32; 4]], width: usize) -> usize {
    let direction = |t: &[f32; 4]| Vec2::new(t[0] * 2.0 - 1.0, t[1] * 2.0 - 1.0);
    texels
        .chunks_exact(width)
        .flat_map(|row| row.windows(2))
        .filter(|pair| direction(&pair[0]).dot(direction(&pair[1])) < 0.0)
        .count()
}

#[test]
fn a_full_circle_of_directions_gains_a_seam() {
    for rotation in [0.0, 0.7, 2.5] {
        let maps = SurfaceMaps {
            normal: NormalMap::flat(),
            roughness: RoughnessMaps::Khr {
                roughness: ScalarMap::constant(0.4),
                strength: 0.8,
                rotation,
                texture: Some(radial()),
            },
            wrap: [Wrap::Clamp; 2],
            weights: None,
        };
        let encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
        let request = SheetRequest { sheet: Sheet::KhrAnisotropy, encoding, packed_with: None };
        let baked = bake_surface(&maps, SurfaceOptions::default(), &[request], &untold).unwrap();
        for level in 0..4 {
            let texels = baked.textures[0].decode_level(level).unwrap();
            let width = (SIDE >> level) as usize;
            // Only the two rows next to the centre cross it between texels that really point apart.
            let got = opposed(&texels, width);
            assert!(
                got <= 2,
                "rotation {rotation}, level {level}: wanted at most 2 opposed pairs, got {got}"
            );
        }
        // The directions are the painted ones, turned.
        let texels = baked.textures[0].decode_level(0).unwrap();
        let (x, y) = (50, 20);
        let t = texels[y * SIDE as usize + x];
        let got = vec2(t[0] * 2.0 - 1.0, t[1] * 2.0 - 1.0);
        let painted = (vec2(x as f32 + 0.5, y as f32 + 0.5) - 0.5 * SIDE as f32).normalize();
        let wanted = Vec2::from_angle(rotation).rotate(painted);
        assert!((got - wanted).length() < 0.012, "rotation {rotation}: wanted {wanted}, got {got}");
    }
}
