//! The factor of ambient light as a table, for combed fibres that a polynomial cannot follow.

use glam::{DVec3, dvec3, vec2};
use kinran_shading::fuzz::{FUZZ_TABLE_SIZE, fuzz_alpha, fuzz_ambient_place, fuzz_ambient_tabulated, fuzz_g};

use super::N_V_MIN;
use super::exact::{Fibres, Phase};
use super::least_squares::least_squares;

/// Nodes of a table along each of its sides.
pub const TABLE_SIZE: usize = FUZZ_TABLE_SIZE as usize;

/// Densities that a texel is fitted over.
const DENSITIES: [f64; 3] = [0.05, 0.2, 0.5];

/// What `fuzz_ambient_tabulated` reads, for one tilt and one spread.
#[derive(Clone, Debug, PartialEq)]
pub struct AmbientTable {
    /// [`TABLE_SIZE`] rows of as many texels, nodes at the middles of texels, the outer ones at the ends of their ranges: x
    /// runs with n·v, y with the cosine of the azimuth, both as `fuzz_ambient_place` gives them.
    pub texels: Vec<[f32; 2]>,
    /// Smallest and largest value over the exact one, between nodes too, for n·v of 0.1 to 1 and densities of 0.05
    /// to 0.5.
    pub ratio: [f32; 2],
}

/// A table and its error. With two numbers a texel, one of them for the layer's density, it is right where the eight
/// coefficients of the polynomial fail: the lobe of fibres combed flat is as narrow as their alpha.
pub fn ambient_table(phase: Phase, tilt: f64, spread: f64) -> AmbientTable {
    let t = dvec3(libm::sin(tilt), 0.0, libm::cos(tilt));
    let fibres = Fibres::new(phase, t, fuzz_alpha(spread as f32).into());
    let texels = ambient_texels(phase, tilt, spread);

    // Between nodes.
    let mut ratio = [f64::INFINITY, 0.0f64];
    let table = AmbientTable { texels, ratio: [0.0; 2] };
    for i in 0..9 {
        let x = N_V_MIN + (1.0 - N_V_MIN) * f64::from(i) / 8.0;
        for j in 0..=12 {
            let v = view(x, f64::from(j) / 12.0);
            let exact = fibres.gathered(v, &DENSITIES);
            for (&d, (light, _)) in DENSITIES.iter().zip(exact.layers) {
                let got = f64::from(fuzz_g(d as f32, x as f32)) * table.factor(v, t, d);
                ratio = [ratio[0].min(got / light), ratio[1].max(got / light)];
            }
        }
    }
    AmbientTable { ratio: ratio.map(|r| r as f32), ..table }
}

/// The texels of a table alone, for fibres at `tilt` radians from the normal.
pub fn ambient_texels(phase: Phase, tilt: f64, spread: f64) -> Vec<[f32; 2]> {
    let t = dvec3(libm::sin(tilt), 0.0, libm::cos(tilt));
    let fibres = Fibres::new(phase, t, fuzz_alpha(spread as f32).into());
    let last = (TABLE_SIZE - 1) as f64;
    let mut texels = Vec::with_capacity(TABLE_SIZE * TABLE_SIZE);
    for row in 0..TABLE_SIZE {
        for column in 0..TABLE_SIZE {
            // A view along the horizon is a limit.
            let (x, y) = ((column as f64 / last).max(1e-3), row as f64 / last);
            let gathered = fibres.gathered(view(x, y), &DENSITIES);
            let [thin, dense] =
                least_squares(DENSITIES.iter().zip(gathered.layers).map(|(&d, (light, _))| {
                    let factor = light / f64::from(fuzz_g(d as f32, x as f32));
                    ([1.0 / factor, d / (d + x) / factor], 1.0, 1.0)
                }));
            texels.push([thin as f32, dense as f32]);
        }
    }
    texels
}

/// The view of a place in the table, fibres leaning to +x.
fn view(x: f64, y: f64) -> DVec3 {
    let cos = 2.0 * y - 1.0;
    let r = libm::sqrt((1.0 - x * x).max(0.0));
    dvec3(r * cos, r * libm::sqrt(1.0 - cos * cos), x)
}

impl AmbientTable {
    /// What a shader makes of the table: bilinear, clamped at its borders.
    fn factor(&self, v: DVec3, t: DVec3, density: f64) -> f64 {
        let place = fuzz_ambient_place(v.z as f32, t.dot(v) as f32, t.z as f32);
        let last = (TABLE_SIZE - 1) as f32;
        let at = (place * TABLE_SIZE as f32 - 0.5).clamp(vec2(0.0, 0.0), vec2(last, last));
        let cell = at.floor().min(vec2(last - 1.0, last - 1.0));
        let f = at - cell;
        let texel = |dx: usize, dy: usize| {
            let [a, b] = self.texels[(cell.y as usize + dy) * TABLE_SIZE + cell.x as usize + dx];
            vec2(a, b)
        };
        let row = |dy| texel(0, dy).lerp(texel(1, dy), f.x);
        fuzz_ambient_tabulated(row(0).lerp(row(1), f.y), density as f32, v.z as f32).into()
    }
}
