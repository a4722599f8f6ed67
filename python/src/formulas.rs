//! The formulas of `kinran-shading` over arrays. Names, parameters and texts are those of the shader library, whose
//! functions are the same.

use glam::{Vec2, Vec3, Vec4};
use kinran_shading::detail::{
    detail_over, detail_over_inverse, overlay, overlay_inverse, rnm, rnm_inverse, smooth_overlay,
    smooth_overlay_inverse,
};
use kinran_shading::fuzz::{
    fibre_d, fibre_direction, fibre_p_s, fibre_phase, fibre_projected_area, fuzz_alpha, fuzz_brdf, fuzz_g,
    fuzz_passage, fuzz_q, fuzz_reciprocal_brdf, fuzz_velvet_brdf, velvet_k, velvet_phase,
};
use kinran_shading::skin::curvature::{curvature_decode, curvature_encode, curvature_from_light};
use kinran_shading::skin::lighting::{skin_lut_uv, skin_normal, skin_specular};
use kinran_shading::{
    Sym2, Sym3, alpha_from_gloss, alpha_from_roughness, aniso_decode_matrix, aniso_encode, aniso_from_alphas,
    axis_from_direction, beckmann_aniso_d, direction_from_axis, ggx_aniso_d, ggx_d, ggx_directional_albedo,
    ggx_from_sggx, ggx_matrix_d, ggx_vndf_pdf, ggx_vndf_sample, multiscatter_compensation, normal_from_slope,
    normal_from_xy, schlick_f, sggx_d, sggx_from_ggx, sggx_projected_area, slope_from_normal, smith_aniso_g1,
    smith_aniso_v, smith_matrix_v, smith_v,
};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

/// A number or several, as floats one behind the other.
trait Value: Copy {
    const WIDTH: usize;
    fn get(floats: &[f32]) -> Self;
    fn put(self, floats: &mut [f32]);
}

impl Value for f32 {
    const WIDTH: usize = 1;
    fn get(floats: &[f32]) -> Self {
        floats[0]
    }
    fn put(self, floats: &mut [f32]) {
        floats[0] = self;
    }
}

macro_rules! vectors {
    ($($vector:ident $width:literal),*) => { $(
        impl Value for $vector {
            const WIDTH: usize = $width;
            fn get(floats: &[f32]) -> Self {
                $vector::from_slice(floats)
            }
            fn put(self, floats: &mut [f32]) {
                self.write_to_slice(floats);
            }
        }
    )* };
}
vectors!(Vec2 2, Vec3 3, Vec4 4);

impl Value for Sym2 {
    const WIDTH: usize = 3;
    fn get(floats: &[f32]) -> Self {
        Sym2 { xx: floats[0], xy: floats[1], yy: floats[2] }
    }
    fn put(self, floats: &mut [f32]) {
        floats.copy_from_slice(&[self.xx, self.xy, self.yy]);
    }
}

impl Value for Sym3 {
    const WIDTH: usize = 6;
    fn get(floats: &[f32]) -> Self {
        let [xx, xy, xz, yy, yz, zz] = [0, 1, 2, 3, 4, 5].map(|i| floats[i]);
        Sym3 { xx, xy, xz, yy, yz, zz }
    }
    fn put(self, floats: &mut [f32]) {
        floats.copy_from_slice(&[self.xx, self.xy, self.xz, self.yy, self.yz, self.zz]);
    }
}

impl<A: Value, B: Value> Value for (A, B) {
    const WIDTH: usize = A::WIDTH + B::WIDTH;
    fn get(floats: &[f32]) -> Self {
        let (a, b) = floats.split_at(A::WIDTH);
        (A::get(a), B::get(b))
    }
    fn put(self, floats: &mut [f32]) {
        let (a, b) = floats.split_at_mut(A::WIDTH);
        self.0.put(a);
        self.1.put(b);
    }
}

/// A parameter: as many values as results, or one for all.
#[derive(Clone, Copy)]
struct Column<'a> {
    floats: &'a [f32],
    width: usize,
    is_one: bool,
}

impl Column<'_> {
    fn get<T: Value>(&self, i: usize) -> T {
        let start = if self.is_one { 0 } else { i * self.width };
        T::get(&self.floats[start..start + T::WIDTH])
    }
}

/// A formula with the names and widths of its parameters, and the width of its result.
struct Formula {
    name: &'static str,
    parameters: &'static [(&'static str, usize)],
    width: usize,
    /// Fills results from the first one on.
    run: fn(&[Column<'_>], usize, &mut [f32]),
}

macro_rules! formulas {
    ($($name:ident($($parameter:ident: $kind:ty),*) -> $result:ty;)*) => {
        const FORMULAS: &[Formula] = &[$(Formula {
            name: stringify!($name),
            parameters: &[$((stringify!($parameter), <$kind>::WIDTH)),*],
            width: <$result>::WIDTH,
            run: |columns, first, results| {
                for (i, result) in results.chunks_exact_mut(<$result>::WIDTH).enumerate() {
                    let mut columns = columns.iter();
                    let value: $result = $name($({
                        let column = columns.next().expect("their number is checked");
                        column.get::<$kind>(first + i)
                    }),*);
                    value.put(result);
                }
            },
        }),*];
    };
}

formulas! {
    alpha_from_gloss(gloss: f32) -> f32;
    alpha_from_roughness(roughness: f32) -> f32;
    aniso_encode(s: Sym2) -> Vec3;
    aniso_decode_matrix(texel: Vec3) -> Sym2;
    aniso_from_alphas(alpha_t: f32, alpha_b: f32, axis: Vec2) -> Sym2;
    axis_from_direction(direction: Vec2, n: Vec3) -> Vec2;
    direction_from_axis(axis: Vec2, n: Vec3) -> Vec2;
    ggx_d(n_h: f32, alpha: f32) -> f32;
    ggx_aniso_d(h: Vec3, alpha_t: f32, alpha_b: f32) -> f32;
    ggx_matrix_d(h: Vec3, a: Sym2) -> f32;
    smith_v(n_u: f32, n_v: f32, alpha: f32) -> f32;
    smith_aniso_v(u: Vec3, v: Vec3, alpha_t: f32, alpha_b: f32) -> f32;
    smith_matrix_v(u: Vec3, v: Vec3, a: Sym2) -> f32;
    smith_aniso_g1(v: Vec3, alpha_t: f32, alpha_b: f32) -> f32;
    schlick_f(f0: Vec3, v_h: f32) -> Vec3;
    ggx_vndf_sample(v: Vec3, alpha_t: f32, alpha_b: f32, xi: Vec2) -> Vec3;
    ggx_vndf_pdf(v: Vec3, h: Vec3, alpha_t: f32, alpha_b: f32) -> f32;
    ggx_directional_albedo(n_v: f32, alpha: f32) -> f32;
    multiscatter_compensation(f0: Vec3, v: Vec3, alpha_t: f32, alpha_b: f32) -> Vec3;
    beckmann_aniso_d(h: Vec3, sigma_t: f32, sigma_b: f32) -> f32;
    slope_from_normal(n: Vec3) -> Vec2;
    normal_from_slope(slope: Vec2) -> Vec3;
    normal_from_xy(x: f32, y: f32) -> Vec3;
    sggx_from_ggx(n: Vec3, a: Sym2) -> Sym3;
    ggx_from_sggx(s: Sym3, mean_normal: Vec3) -> (Vec3, Sym2);
    sggx_projected_area(s: Sym3, w: Vec3) -> f32;
    sggx_d(s: Sym3, h: Vec3) -> f32;
    fuzz_alpha(spread: f32) -> f32;
    fibre_direction(tilt: f32, azimuth: f32) -> Vec3;
    fibre_d(t_h: f32, alpha: f32) -> f32;
    fibre_projected_area(t_w: f32, alpha: f32) -> f32;
    fibre_phase(u_v: f32, t_u: f32, t_v: f32, alpha: f32) -> f32;
    fibre_p_s(n_u: f32, t_u: f32, t_n: f32, alpha: f32) -> f32;
    fuzz_passage(density: f32, n_w: f32) -> f32;
    fuzz_brdf(u: Vec3, v: Vec3, t: Vec3, density: f32, alpha: f32) -> f32;
    fuzz_reciprocal_brdf(u: Vec3, v: Vec3, t: Vec3, density: f32, alpha: f32) -> f32;
    fuzz_velvet_brdf(u: Vec3, v: Vec3, t: Vec3, density: f32, k: f32) -> f32;
    fuzz_g(density: f32, n_v: f32) -> f32;
    fuzz_q(density: f32) -> f32;
    velvet_k(spread: f32) -> f32;
    velvet_phase(u_v: f32, t_u: f32, t_v: f32, k: f32) -> f32;
    curvature_encode(tensor: Sym2, mean: f32, range: f32) -> Vec4;
    curvature_decode(texel: Vec4, range: f32) -> (Sym2, f32);
    curvature_from_light(tensor: Sym2, u_tb: Vec2) -> f32;
    skin_lut_uv(n_u: f32, curvature: f32, inverse_range: f32) -> Vec2;
    skin_normal(n: Vec3, n_mesh: Vec3, blur: f32) -> Vec3;
    skin_specular(n_h: f32, n_u: f32, n_v: f32, alpha_one: f32, alpha_two: f32, share: f32) -> f32;
    overlay(s: f32, d: f32) -> f32;
    overlay_inverse(t: f32, d: f32) -> f32;
    smooth_overlay(s: f32, d: f32) -> f32;
    smooth_overlay_inverse(t: f32, d: f32) -> f32;
    rnm(base: Vec3, detail: Vec3) -> Vec3;
    rnm_inverse(target: Vec3, detail: Vec3) -> Vec3;
    detail_over(s: Vec3, detail: Vec3, alpha: f32) -> Vec3;
    detail_over_inverse(target: Vec3, detail: Vec3, alpha: f32) -> Vec3;
}

/// Texts of what the shader library has no need of: inverses are for bakes.
const INVERSES: [(&str, &str); 4] = [
    ("overlay_inverse", "The s for which `overlay(s, d)` is t, 0 to 1; the nearest where there is none."),
    ("smooth_overlay_inverse", "The s for which `smooth_overlay(s, d)` is t, 0 to 1."),
    (
        "rnm_inverse",
        "The base for which `rnm(base, detail)` is target, or under the horizon is nearest to it; unit vectors.",
    ),
    ("detail_over_inverse", "The s for which `detail_over(s, detail, alpha)` is target, 0 to 1."),
];

/// Floats that a thread does at a time; chosen by eye, so that the start of a thread costs little.
const PIECE: usize = 1 << 14;

/// Every formula: name, names and widths of its parameters, width of its result, and its text.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub(crate) fn formulas() -> Vec<(&'static str, Vec<(&'static str, usize)>, usize, String)> {
    let text = |name: &str| {
        if let Some((_, text)) = INVERSES.iter().find(|(known, _)| *known == name) {
            return (*text).to_owned();
        }
        let start = format!("fn {name}(");
        let module = kinran_shaders::wesl::MODULES.iter().find(|module| module.text.contains(&start));
        let before = module.and_then(|module| module.text.split_once(&start)).map_or("", |(text, _)| text);
        let comment: Vec<&str> =
            before.lines().rev().map_while(|line| line.strip_prefix("///")).map(str::trim).collect();
        comment.into_iter().rev().collect::<Vec<_>>().join("\n")
    };
    FORMULAS.iter().map(|f| (f.name, f.parameters.to_vec(), f.width, text(f.name))).collect()
}

/// A formula over `count` values of each parameter, or one for all of them; flat arrays in and out.
#[pyfunction]
pub(crate) fn formula<'py>(
    py: Python<'py>,
    name: &str,
    columns: Vec<PyReadonlyArray1<'py, f32>>,
    count: usize,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let wrong = |what: &str| PyValueError::new_err(format!("{name}: {what}"));
    let formula = FORMULAS.iter().find(|f| f.name == name).ok_or_else(|| wrong("is no formula"))?;
    if columns.len() != formula.parameters.len() {
        return Err(wrong("wants another number of parameters"));
    }
    let mut parameters = Vec::with_capacity(columns.len());
    for (array, (_, width)) in columns.iter().zip(formula.parameters) {
        let floats = array.as_slice().map_err(|_| wrong("wants arrays without gaps"))?;
        let is_one = floats.len() == *width;
        if !is_one && floats.len() != count * width {
            return Err(wrong("wants as many values of each parameter, or one"));
        }
        parameters.push(Column { floats, width: *width, is_one });
    }
    let mut results = vec![0.0; count * formula.width];
    py.detach(|| {
        let piece = PIECE * formula.width;
        let pieces = results.par_chunks_mut(piece).enumerate();
        pieces.for_each(|(i, results)| (formula.run)(&parameters, i * PIECE, results));
    });
    Ok(PyArray1::from_vec(py, results))
}
