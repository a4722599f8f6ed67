//! Speed of the formulas on one core, in lobes (or texels, or matrices) a second.
//!
//! `cargo bench -p kinran-shading`. Every function gets the same 4096 random inputs, in order, so a figure
//! holds the function in a loop over data in cache: what a shader of a renderer sees. The alphas are spread
//! evenly from mirror to chalk; no function takes longer for some of them.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::{Vec2, Vec3, vec2, vec3};
use kinran_shading::{
    ALPHA_MIN, Sym2, Sym3, aniso_decode, aniso_decode_matrix, aniso_encode, aniso_from_alphas, ggx_aniso_d,
    ggx_d, ggx_from_sggx, ggx_from_sggx_unclamped, ggx_matrix_d, ggx_vndf_pdf, ggx_vndf_sample,
    multiscatter_compensation, schlick_f, sggx_from_ggx, sggx_power_iteration, sggx_principal_axis,
    smith_aniso_v, smith_matrix_v, smith_v,
};

fn main() {
    divan::main();
}

const COUNT: usize = 4096;

/// What a pixel is shaded from.
#[derive(Clone, Copy)]
struct Input {
    u: Vec3,
    v: Vec3,
    h: Vec3,
    alpha_t: f32,
    alpha_b: f32,
    a: Sym2,
    texel: Vec3,
    s: Sym3,
    xi: Vec2,
}

/// Points of the additive recurrence R_d, which fills the unit cube evenly.
///
/// Roberts. The Unreasonable Effectiveness of Quasirandom Sequences. 2018.
fn point<const D: usize>(i: usize) -> [f32; D] {
    // The positive root of x^(d+1) = x + 1.
    let root = (0..64).fold(2.0_f64, |x, _| (1.0 + x).powf(1.0 / (D as f64 + 1.0)));
    std::array::from_fn(|k| (0.5 + i as f64 * root.powi(-(k as i32 + 1))).fract() as f32)
}

fn direction(xi: Vec2) -> Vec3 {
    (Vec2::from_angle(std::f32::consts::TAU * xi.x) * (1.0 - xi.y * xi.y).sqrt()).extend(xi.y)
}

fn inputs() -> Vec<Input> {
    (0..COUNT)
        .map(|i| {
            let [u0, u1, v0, v1, a, b, c, x, y] = point::<9>(i);
            let (u, v) = (direction(vec2(u0, u1.max(1e-3))), direction(vec2(v0, v1.max(1e-3))));
            let (alpha_t, alpha_b) = (a.max(b).max(ALPHA_MIN), a.min(b).max(ALPHA_MIN));
            let a = aniso_from_alphas(alpha_t, alpha_b, Vec2::from_angle(std::f32::consts::TAU * c));
            let s = sggx_from_ggx(u, a) * 0.5 + sggx_from_ggx(vec3(u.y, v.y, 1.0).normalize(), a) * 0.5;
            Input {
                u,
                v,
                h: (u + v).normalize(),
                alpha_t,
                alpha_b,
                a,
                texel: aniso_encode(a),
                s,
                xi: vec2(x, y),
            }
        })
        .collect()
}

/// Times `f` over all inputs.
fn run<T>(bencher: Bencher<'_, '_>, f: impl Fn(&Input) -> T + Sync) {
    let inputs = inputs();
    bencher.counter(ItemsCount::new(COUNT)).bench(|| {
        for input in black_box(&inputs[..]) {
            black_box(f(input));
        }
    });
}

const F0: Vec3 = Vec3::new(0.9, 0.6, 0.3);

#[divan::bench]
fn dvf_isotropic(bencher: Bencher<'_, '_>) {
    run(bencher, |i| {
        schlick_f(F0, i.v.dot(i.h)) * (ggx_d(i.h.z, i.alpha_t) * smith_v(i.u.z, i.v.z, i.alpha_t))
    });
}

#[divan::bench]
fn dvf_anisotropic(bencher: Bencher<'_, '_>) {
    run(bencher, |i| {
        let d = ggx_aniso_d(i.h, i.alpha_t, i.alpha_b);
        schlick_f(F0, i.v.dot(i.h)) * (d * smith_aniso_v(i.u, i.v, i.alpha_t, i.alpha_b))
    });
}

#[divan::bench]
fn dvf_matrix(bencher: Bencher<'_, '_>) {
    run(bencher, |i| schlick_f(F0, i.v.dot(i.h)) * (ggx_matrix_d(i.h, i.a) * smith_matrix_v(i.u, i.v, i.a)));
}

#[divan::bench]
fn dvf_matrix_from_texel(bencher: Bencher<'_, '_>) {
    run(bencher, |i| {
        let a = aniso_decode_matrix(i.texel).clamp_eigen(ALPHA_MIN * ALPHA_MIN, 1.0);
        schlick_f(F0, i.v.dot(i.h)) * (ggx_matrix_d(i.h, a) * smith_matrix_v(i.u, i.v, a))
    });
}

#[divan::bench]
fn vndf_sample(bencher: Bencher<'_, '_>) {
    run(bencher, |i| ggx_vndf_sample(i.v, i.alpha_t, i.alpha_b, i.xi));
}

#[divan::bench]
fn vndf_pdf(bencher: Bencher<'_, '_>) {
    run(bencher, |i| ggx_vndf_pdf(i.v, i.h, i.alpha_t, i.alpha_b));
}

#[divan::bench]
fn multiscatter(bencher: Bencher<'_, '_>) {
    run(bencher, |i| multiscatter_compensation(F0, i.v, i.alpha_t, i.alpha_b));
}

#[divan::bench]
fn texel_encode(bencher: Bencher<'_, '_>) {
    run(bencher, |i| aniso_encode(i.a));
}

#[divan::bench]
fn texel_decode(bencher: Bencher<'_, '_>) {
    run(bencher, |i| aniso_decode(i.texel, Vec3::X, Vec3::Y));
}

#[divan::bench]
fn sggx_build(bencher: Bencher<'_, '_>) {
    run(bencher, |i| sggx_from_ggx(i.u, i.a));
}

#[divan::bench]
fn sggx_extract(bencher: Bencher<'_, '_>) {
    run(bencher, |i| ggx_from_sggx(i.s, i.u));
}

/// Normals of `COUNT` matrices stored by component, a loop that the compiler may vectorise.
fn run_columns(bencher: Bencher<'_, '_>, f: impl Fn(Sym3, Vec3) -> Vec3 + Sync) {
    let columns = inputs().into_iter().map(|i| {
        let Sym3 { xx, xy, xz, yy, yz, zz } = i.s;
        [xx, xy, xz, yy, yz, zz, i.u.x, i.u.y, i.u.z]
    });
    let rows: Vec<[f32; 9]> = columns.collect();
    let columns: [Vec<f32>; 9] = std::array::from_fn(|k| rows.iter().map(|row| row[k]).collect());
    bencher
        .counter(ItemsCount::new(COUNT))
        .with_inputs(|| [vec![0.0; COUNT], vec![0.0; COUNT], vec![0.0; COUNT]])
        .bench_local_refs(|[x, y, z]| {
            let [xx, xy, xz, yy, yz, zz, nx, ny, nz] = black_box(&columns).each_ref().map(|c| &c[..COUNT]);
            let (x, y, z) = (&mut x[..COUNT], &mut y[..COUNT], &mut z[..COUNT]);
            for i in 0..COUNT {
                let s = Sym3 { xx: xx[i], xy: xy[i], xz: xz[i], yy: yy[i], yz: yz[i], zz: zz[i] };
                let n = f(s, vec3(nx[i], ny[i], nz[i]));
                (x[i], y[i], z[i]) = (n.x, n.y, n.z);
            }
        });
}

#[divan::bench]
fn principal_axis_columns(bencher: Bencher<'_, '_>) {
    run_columns(bencher, sggx_principal_axis);
}

#[divan::bench]
fn sggx_extract_columns(bencher: Bencher<'_, '_>) {
    run_columns(bencher, |s, n| {
        let (n, a) = ggx_from_sggx_unclamped(s, n);
        vec3(n.x, n.y, a.xx + a.xy + a.yy)
    });
}

#[divan::bench]
fn power_iteration_8_columns(bencher: Bencher<'_, '_>) {
    run_columns(bencher, |s, _| sggx_power_iteration(s, Vec3::Z, 8));
}
