//! The tables as a picture with axes.

use kinran_bake::skin_lut::Table;
use kinran_bake::srgb_from_linear;

use crate::picture::{Color, INK, PAPER, Picture};

/// All colours and lengths are chosen by eye.
const FAINT: Color = [170, 172, 180];
const GRID: Color = [52, 54, 60];
const CHANNELS: [Color; 3] = [[240, 96, 88], [112, 204, 112], [104, 148, 250]];

/// Side of a panel, and pixels around and between them.
const SIDE: u32 = 360;
const MARGIN: u32 = 88;
const TOP: u32 = 84;

/// The punctual table as it looks, cuts through it at three curvatures, and the ambient factors.
pub(crate) fn plot(title: &str, punctual: &Table, ambient: &Table, range: f32) -> Picture {
    let mut picture = Picture::new(3 * (SIDE + MARGIN) + MARGIN / 2, TOP + SIDE + 98, PAPER);
    picture.text((MARGIN, 32), 26.0, INK, title);
    let left = |panel: u32| MARGIN + panel * (SIDE + MARGIN);
    let curvatures = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| (t, format!("{:.3}", t * range)));
    let cosines = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| (t, format!("{:+.1}", 2.0 * t - 1.0)));
    let parts = [0.0, 0.25, 0.5, 0.75, 1.0].map(|t| (t, format!("{t:.2}")));

    // The table, flat at the bottom, as plots have it.
    picture.text((left(0), TOP - 14), 18.0, FAINT, "punctual light");
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (u, v) = ((x as f32 + 0.5) / SIDE as f32, 1.0 - (y as f32 + 0.5) / SIDE as f32);
            let encode = |c: f32| (srgb_from_linear(c.clamp(0.0, 1.0)) * 255.0).round() as u8;
            let at = (TOP + y) as usize * picture.width as usize + (left(0) + x) as usize;
            picture.pixels[at] = punctual.sample(u, v).map(encode);
        }
    }
    axes(&mut picture, left(0), &cosines, &curvatures, ["n·u", "curvature, 1/mm"]);

    // Cuts.
    let cuts = [0.1, 0.4, 1.0];
    let names = cuts.map(|v| format!("{:.3}", v * range)).join(", ");
    picture.text((left(1), TOP - 14), 18.0, FAINT, &format!("at curvatures {names}"));
    grid(&mut picture, left(1));
    axes(&mut picture, left(1), &cosines, &parts, ["n·u", "light that leaves"]);
    for v in cuts {
        for (c, color) in CHANNELS.into_iter().enumerate() {
            let strength = 0.45 + 0.55 * v;
            curve(&mut picture, left(1), mix(PAPER, color, strength), |u| punctual.sample(u, v)[c]);
        }
    }

    // Ambient factors.
    picture.text((left(2), TOP - 14), 18.0, FAINT, "ambient: band 1, band 2 darker");
    grid(&mut picture, left(2));
    axes(&mut picture, left(2), &curvatures, &parts, ["mean curvature, 1/mm", "what remains"]);
    for (v, strength) in [(0.25, 1.0), (0.75, 0.6)] {
        for (c, color) in CHANNELS.into_iter().enumerate() {
            curve(&mut picture, left(2), mix(PAPER, color, strength), |u| ambient.sample(u, v)[c]);
        }
    }
    picture
}

fn mix(a: Color, b: Color, t: f32) -> Color {
    std::array::from_fn(|c| (f32::from(a[c]) + t * (f32::from(b[c]) - f32::from(a[c]))).round() as u8)
}

fn grid(picture: &mut Picture, left: u32) {
    for i in 0..=4 {
        let at = i * (SIDE - 1) / 4;
        for k in 0..SIDE {
            let width = picture.width as usize;
            picture.pixels[(TOP + at) as usize * width + (left + k) as usize] = GRID;
            picture.pixels[(TOP + k) as usize * width + (left + at) as usize] = GRID;
        }
    }
}

fn axes(
    picture: &mut Picture,
    left: u32,
    across: &[(f32, String)],
    up: &[(f32, String)],
    [x_name, y_name]: [&str; 2],
) {
    for (t, label) in across {
        let x = left as f32 + t * SIDE as f32 - 5.0 * label.chars().count() as f32;
        picture.text((x.max(0.0) as u32, TOP + SIDE + 24), 17.0, FAINT, label);
    }
    for (t, label) in up {
        let y = TOP as f32 + (1.0 - t) * SIDE as f32 + 4.0;
        let x = left - 8 - 11 * label.chars().count() as u32;
        picture.text((x, y as u32), 17.0, FAINT, label);
    }
    picture.text((left, TOP + SIDE + 56), 19.0, INK, &format!("across: {x_name}"));
    picture.text((left, TOP + SIDE + 80), 19.0, INK, &format!("up: {y_name}"));
}

/// A curve of values from 0 to 1, two pixels wide, as coverage by vertical distance over the slope.
fn curve(picture: &mut Picture, left: u32, color: Color, f: impl Fn(f32) -> f32) {
    for x in 0..SIDE {
        let at = |x: f32| (1.0 - f(x / SIDE as f32)) * (SIDE - 1) as f32;
        let (y, slope) = (at(x as f32 + 0.5), at(x as f32 + 1.0) - at(x as f32));
        let reach = (1.0 + slope * slope).sqrt();
        let rows = ((y - 2.0 * reach).floor() as i64).max(0)
            ..=((y + 2.0 * reach).ceil() as i64).min(i64::from(SIDE) - 1);
        for row in rows {
            let coverage = (1.5 - (row as f32 - y).abs() / reach).clamp(0.0, 1.0);
            let at = (i64::from(TOP) + row) as usize * picture.width as usize + (left + x) as usize;
            picture.pixels[at] = mix(picture.pixels[at], color, coverage);
        }
    }
}
