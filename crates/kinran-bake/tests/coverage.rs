//! Alpha of what is cut out: the area that is left of it at every level.

use kinran_bake::aniso::Kernel;
use kinran_bake::{Rgba8Level, keep_coverage, plain_levels};
use kinran_image::{Channels, Image, Pixels, Transfer, untold};
use kinran_scene::Wrap;

/// Blades of grass, a texel or two wide, that cross a square and its borders.
fn grass(size: (u32, u32), blades: u32) -> Image {
    let mut samples = vec![0; (size.0 * size.1 * 4) as usize];
    for (i, texel) in samples.chunks_exact_mut(4).enumerate() {
        let (x, y) = ((i as u32 % size.0) as f32, (i as u32 / size.0) as f32);
        let distance = |blade: u32| {
            let lean = (blade as f32 * 2.4).sin();
            let middle = blade as f32 / blades as f32 * size.0 as f32 + lean * y * 0.3;
            let apart = (x - middle).rem_euclid(size.0 as f32);
            apart.min(size.0 as f32 - apart)
        };
        let nearest = (0..blades).map(distance).fold(f32::MAX, f32::min);
        let alpha = ((1.6 - nearest).clamp(0.0, 1.0) * 255.0).round() as u8;
        texel.copy_from_slice(&[(x as u32 % 256) as u8, 90, 20, alpha]);
    }
    Image::new(size.0, size.1, Channels::Rgba, Pixels::U8(samples)).unwrap()
}

/// The share of a level that a renderer draws: alpha at 16 × 16 places a texel, bilinear, at the cutoff or above.
fn drawn(level: &Rgba8Level, cutoff: f64, wrap: Wrap) -> f64 {
    let (width, height) = (level.width as i64, level.height as i64);
    let index = |i: i64, n: i64| match wrap {
        Wrap::Repeat => i.rem_euclid(n),
        Wrap::Clamp => i.clamp(0, n - 1),
        Wrap::Mirror => [i.rem_euclid(2 * n), 2 * n - 1 - i.rem_euclid(2 * n)].into_iter().min().unwrap(),
    };
    let alpha = |x: i64, y: i64| {
        let at = index(y, height) * width + index(x, width);
        f64::from(level.rgba8[at as usize * 4 + 3]) / 255.0
    };
    let mut count = 0;
    for (j, i) in (0..16 * height).flat_map(|j| (0..16 * width).map(move |i| (j, i))) {
        let (u, v) = ((i as f64 + 0.5) / 16.0 - 0.5, (j as f64 + 0.5) / 16.0 - 0.5);
        let (x, y) = (u.floor() as i64, v.floor() as i64);
        let (s, t) = (u - u.floor(), v - v.floor());
        let above = alpha(x, y) * (1.0 - s) + alpha(x + 1, y) * s;
        let below = alpha(x, y + 1) * (1.0 - s) + alpha(x + 1, y + 1) * s;
        count += i32::from(above * (1.0 - t) + below * t >= cutoff);
    }
    f64::from(count) / (256 * width * height) as f64
}

#[test]
fn leaves_thin_out_from_afar() {
    let cases = [
        ((256, 256), 9, 0.5, Kernel::Box, Wrap::Repeat),
        ((128, 256), 5, 0.3, Kernel::Tent, Wrap::Clamp),
        ((200, 120), 7, 0.8, Kernel::Box, Wrap::Mirror),
    ];
    for (size, blades, cutoff, kernel, wrap) in cases {
        let image = grass(size, blades);
        let plain = plain_levels(&image, size, Transfer::Srgb, kernel, [wrap; 2], &untold).unwrap();
        let mut kept = plain.clone();
        keep_coverage(&image, cutoff, kernel, [wrap; 2], &mut kept, &untold).unwrap();
        let what = format!("{size:?}, {blades} blades, cutoff {cutoff}, {kernel:?}, {wrap:?}");
        assert_eq!(kept[0], plain[0], "{what}: level 0 is as authored");
        let wanted = drawn(&plain[0], f64::from(cutoff), wrap);
        let mut lost = 0;
        for (i, (plain, kept)) in plain.iter().zip(&kept).enumerate().skip(1) {
            let color = |level: &Rgba8Level| -> Vec<[u8; 3]> {
                level.rgba8.chunks_exact(4).map(|t| [t[0], t[1], t[2]]).collect()
            };
            assert_eq!(color(kept), color(plain), "{what}, level {i}: colours are averages");
            let (before, after) =
                (drawn(plain, f64::from(cutoff), wrap), drawn(kept, f64::from(cutoff), wrap));
            lost += i32::from((before - wanted).abs() > 0.5 * wanted);
            // Eight bits of an alpha near the cutoff move its outline by less than 1 % of the square; of fewer texels than four a
            // side no outline of the right area can be had.
            if kept.width.min(kept.height) >= 4 {
                let apart = (after - wanted).abs();
                assert!(
                    apart < 0.01,
                    "{what}, level {i}: {after} is drawn, wanted {wanted}, the average has {before}"
                );
            } else {
                assert!(
                    (after - wanted).abs() <= (before - wanted).abs() + 0.01,
                    "{what}, level {i}: {after} is drawn, farther from {wanted} than the average's {before}"
                );
            }
        }
        assert!(lost >= 3, "{what}: averages lose their area on {lost} levels only: a test of nothing");
    }
}

/// Bytes of all that is not cut out stay.
#[test]
fn alpha_that_needs_no_change_is_changed() {
    let size = (32, 32);
    let opaque = Image::new(32, 32, Channels::Rgb, Pixels::U8(vec![70; 32 * 32 * 3])).unwrap();
    let faint = Image::new(32, 32, Channels::Rgba, Pixels::U8([9, 9, 9, 80].repeat(32 * 32))).unwrap();
    let halves: Vec<u8> = (0..32 * 32).flat_map(|i| [9, 9, 9, if i % 32 < 16 { 0 } else { 255 }]).collect();
    let halves = Image::new(32, 32, Channels::Rgba, Pixels::U8(halves)).unwrap();
    for (name, image, cutoff) in [
        ("opaque", opaque, 0.5),
        ("all of it a hole", faint.clone(), 0.5),
        ("cutoff 0", faint, 0.0),
        ("halves", halves, 0.5),
    ] {
        let wrap = [Wrap::Clamp; 2];
        let plain = plain_levels(&image, size, Transfer::Srgb, Kernel::Box, wrap, &untold).unwrap();
        let mut kept = plain.clone();
        keep_coverage(&image, cutoff, Kernel::Box, wrap, &mut kept, &untold).unwrap();
        assert_eq!(kept[..5], plain[..5], "{name}");
    }
}
