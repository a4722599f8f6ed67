//! The specular probe: the environment's mean radiance over areas of all sizes.

use glam::Vec3;
use kinran_scene::Environment;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Radiance of every texel of every level down to a single row, level 0 first, row by row from the top. A texel holds the
/// mean, over solid angle, of the texels of the level above that it covers, by the share it covers of each.
pub(super) fn levels(environment: &Environment) -> Vec<Vec<Vec3>> {
    let (width, height) = (environment.width(), environment.height());
    let texel = |i: usize| environment.texel(i % width, i / width);
    let mut levels: Vec<Vec<Vec3>> = vec![(0..width * height).into_par_iter().map(texel).collect()];
    for level in 1..=height.ilog2() {
        let above = (width >> (level - 1), height >> (level - 1));
        levels.push(halved(&levels[levels.len() - 1], above, (width >> level, height >> level)));
    }
    levels
}

fn halved(texels: &[Vec3], (width, height): (usize, usize), (columns, rows): (usize, usize)) -> Vec<Vec3> {
    let across: Vec<_> = (0..columns).map(|x| covered(x, width, columns)).collect();
    let solid_angle = |y: usize| libm::sinf(PI * (y as f32 + 0.5) / height as f32);
    let row = |y: usize| {
        let down: Vec<_> = covered(y, height, rows).map(|(y, share)| (y, share * solid_angle(y))).collect();
        let whole: f32 = down.iter().map(|(_, share)| share).sum();
        across
            .iter()
            .map(move |columns| {
                let sum = down.iter().map(|&(y, down)| {
                    columns.clone().map(|(x, across)| across * texels[y * width + x]).sum::<Vec3>() * down
                });
                let wide: f32 = columns.clone().map(|(_, share)| share).sum();
                sum.sum::<Vec3>() / (wide * whole)
            })
            .collect::<Vec<_>>()
    };
    (0..rows).into_par_iter().flat_map_iter(row).collect()
}

/// The texels of a line of `fine` that texel `i` of `coarse` covers, and the share it covers of each.
fn covered(i: usize, fine: usize, coarse: usize) -> impl Iterator<Item = (usize, f32)> + Clone {
    let (start, end) = (i as f32 * fine as f32 / coarse as f32, (i + 1) as f32 * fine as f32 / coarse as f32);
    (start as usize..(end.ceil() as usize).min(fine))
        .map(move |x| (x, end.min(x as f32 + 1.0) - start.max(x as f32)))
}
