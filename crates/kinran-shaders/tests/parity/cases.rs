//! Which twin each shader function has, what to feed both, and how far they may differ.

mod detail;
mod fuzz;
mod skin;

use fastrand::Rng;
use glam::{Mat3, Vec2, Vec3, vec2, vec3};
use kinran_shading::{self as rust, Sym2, Sym3, sh};

/// A shader function and its twin.
pub(crate) struct Case {
    /// The shader function's name.
    pub(crate) function: &'static str,
    /// What feeds its arguments, in order.
    pub(crate) arguments: Vec<Argument>,
    /// The Rust function, on flattened numbers.
    pub(crate) twin: fn(&[f32]) -> Vec<f32>,
    /// Turns inputs and outputs into numbers that both must share, where the outputs themselves need not agree.
    pub(crate) canonical: fn(&[f32], &[f32]) -> Vec<f32>,
    /// Largest difference, in the output's unit.
    pub(crate) absolute: f32,
    /// Largest difference per output.
    pub(crate) relative: f32,
    /// Why so much.
    pub(crate) reason: &'static str,
}

/// Values of one argument.
#[derive(Clone)]
pub(crate) struct Argument {
    /// Both ends of the closed range that the functions' docs state, and values of interest.
    edges: Vec<Vec<f32>>,
    random: fn(&mut Rng) -> Vec<f32>,
}

impl Case {
    /// All combinations of edges.
    pub(crate) fn corners(&self) -> Vec<Vec<f32>> {
        let mut corners = vec![Vec::new()];
        for argument in &self.arguments {
            corners = (corners.iter())
                .flat_map(|before| argument.edges.iter().map(|edge| [&before[..], edge].concat()))
                .collect();
        }
        corners
    }

    /// `count` inputs: all combinations of edges (as many as fit into half of them), then random ones. The same for
    /// every run.
    pub(crate) fn inputs(&self, count: usize) -> Vec<Vec<f32>> {
        let mut rng = Rng::with_seed(2020);
        let combinations: usize = self.arguments.iter().map(|a| a.edges.len()).product();
        (0..count)
            .map(|i| {
                let edge = i < combinations.min(count / 2);
                // Of too many combinations, a random choice.
                let mut rest = if combinations > count / 2 { rng.usize(..combinations) } else { i };
                let mut numbers = Vec::new();
                for argument in &self.arguments {
                    if edge {
                        numbers.extend(&argument.edges[rest % argument.edges.len()]);
                        rest /= argument.edges.len();
                    } else {
                        numbers.extend((argument.random)(&mut rng));
                    }
                }
                numbers
            })
            .collect()
    }
}

fn argument<const N: usize>(edges: &[[f32; N]], random: fn(&mut Rng) -> Vec<f32>) -> Argument {
    Argument { edges: edges.iter().map(|e| e.to_vec()).collect(), random }
}

// Arguments.

/// A number from 0 to 1.
fn unit() -> Argument {
    argument(&[[0.0], [1.0], [0.5], [1.0 / 255.0], [1e-6]], |rng| vec![rng.f32()])
}

/// A cosine of a direction above the horizon or on it.
fn cosine() -> Argument {
    argument(&[[0.0], [1e-4], [1.0], [0.5], [0.999_999]], |rng| vec![rng.f32().max(1e-4)])
}

/// A GGX roughness.
fn alpha() -> Argument {
    argument(&[[rust::ALPHA_MIN], [0.04], [0.3], [1.0]], |rng| vec![rng.f32().max(rust::ALPHA_MIN)])
}

/// A random unit vector.
fn random_direction(rng: &mut Rng) -> Vec3 {
    let (z, phi) = (rng.f32() * 2.0 - 1.0, rng.f32() * core::f32::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    vec3(r * phi.cos(), r * phi.sin(), z).normalize()
}

/// A unit vector above the horizon or on it.
fn hemisphere() -> Argument {
    argument(
        &[
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.6, 0.0, 0.8],
            [0.0, -0.8, 0.6],
            [0.8, 0.6, 1e-4],
            [0.48, -0.6, 0.64],
        ],
        |rng| {
            let d = random_direction(rng);
            vec![d.x, d.y, d.z.abs().max(1e-4)]
        },
    )
}

/// A unit vector.
fn direction() -> Argument {
    argument(
        &[
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.6, 0.0, 0.8],
            [0.0, 0.6, -0.8],
        ],
        |rng| random_direction(rng).to_array().to_vec(),
    )
}

/// A unit vector in the plane.
fn axis() -> Argument {
    argument(&[[1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [0.6, -0.8], [-0.8, 0.6]], |rng| {
        let phi = rng.f32() * core::f32::consts::TAU;
        vec![phi.cos(), phi.sin()]
    })
}

/// A vector in the plane, up to length 2.
fn plane() -> Argument {
    argument(&[[0.0, 0.0], [1.0, 0.0], [0.0, -1.5], [1e-3, 1e-3]], |rng| {
        vec![rng.f32() * 2.8 - 1.4, rng.f32() * 2.8 - 1.4]
    })
}

/// A colour or texel.
fn triple() -> Argument {
    argument(
        &[
            [0.0, 0.0, 0.0],
            [1.0, 1.0, 1.0],
            [0.04, 0.04, 0.04],
            [1.0, 0.5, 0.0],
            [0.5, 128.0 / 255.0, 0.5],
            [0.3, 0.5, 0.3],
            [1.0, 0.5, 1.0],
            [0.0, 0.5, 0.0],
            [0.02, 1.0, 0.3],
        ],
        |rng| vec![rng.f32(), rng.f32(), rng.f32()],
    )
}

fn random_roughness(rng: &mut Rng) -> Sym2 {
    let (t, b, phi) = (rng.f32().max(0.02), rng.f32().max(0.02), rng.f32() * core::f32::consts::TAU);
    rust::aniso_from_alphas(t.max(b), t.min(b), vec2(phi.cos(), phi.sin()))
}

/// A squared roughness matrix (xx, xy, yy) whose determinant has digits left.
fn roughness() -> Argument {
    argument(
        &[
            [1.0, 0.0, 1.0],
            [0.25, 0.0, 0.01],
            [0.01, 0.0, 0.25],
            [0.2, 0.1, 0.1],
            [0.2, -0.1, 0.1],
            [1.6e-5, 0.0, 1.6e-5],
        ],
        |rng| {
            let a = random_roughness(rng);
            vec![a.xx, a.xy, a.yy]
        },
    )
}

/// Any symmetric positive semi-definite 2×2 matrix, zero and singular ones included.
fn semi_definite() -> Argument {
    let mut argument = roughness();
    argument
        .edges
        .extend([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 4.0], [1.0, 1.0, 1.0]].map(|e| e.to_vec()));
    argument
}

fn columns(s: Sym3) -> Vec<f32> {
    vec![s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz]
}

/// An SGGX matrix: the mean over a few texels.
fn random_sggx(rng: &mut Rng) -> Sym3 {
    let texels = rng.usize(1..6);
    let spread = rng.f32() * 0.5;
    let sum = (0..texels).fold(Sym3::default(), |sum, _| {
        let d = random_direction(rng);
        let n = vec3(d.x * spread, d.y * spread, 1.0).normalize();
        sum + rust::sggx_from_ggx(n, random_roughness(rng))
    });
    sum * (1.0 / texels as f32)
}

fn sggx() -> Argument {
    let edge = |n: Vec3, xx, yy| columns(rust::sggx_from_ggx(n, Sym2 { xx, xy: 0.0, yy }));
    let mut argument = argument::<9>(&[], |rng| columns(random_sggx(rng)));
    argument.edges = vec![
        edge(Vec3::Z, 0.25, 0.01),
        edge(Vec3::Z, 1.0, 1.0),
        edge(vec3(0.6, 0.0, 0.8), 0.04, 0.04),
        edge(vec3(0.0, -0.28, 0.96), 0.09, 0.5),
    ];
    argument
}

/// Nine colours.
fn harmonics() -> Argument {
    let mut argument = argument::<27>(&[], |rng| (0..27).map(|_| rng.f32() * 2.0 - 1.0).collect());
    argument.edges = vec![vec![0.0; 27], (0..27).map(|i| if i < 3 { 3.0 } else { 0.0 }).collect()];
    argument
}

/// A small count, as a number.
fn steps() -> Argument {
    argument(&[[0.0], [1.0], [8.0]], |rng| vec![rng.usize(0..16) as f32])
}

// Numbers into types and back.

fn v2(x: &[f32]) -> Vec2 {
    vec2(x[0], x[1])
}

fn v3(x: &[f32]) -> Vec3 {
    vec3(x[0], x[1], x[2])
}

fn s2(x: &[f32]) -> Sym2 {
    Sym2 { xx: x[0], xy: x[1], yy: x[2] }
}

fn s3(x: &[f32]) -> Sym3 {
    Sym3 { xx: x[0], xy: x[1], xz: x[2], yy: x[4], yz: x[5], zz: x[8] }
}

fn sh9(x: &[f32]) -> sh::Sh9 {
    core::array::from_fn(|i| v3(&x[3 * i..]))
}

fn of3(v: Vec3) -> Vec<f32> {
    v.to_array().to_vec()
}

fn of2(v: Vec2) -> Vec<f32> {
    v.to_array().to_vec()
}

fn of_sym2(a: Sym2) -> Vec<f32> {
    vec![a.xx, a.xy, a.yy]
}

fn of_mat3(m: Mat3) -> Vec<f32> {
    m.to_cols_array().to_vec()
}

// Canonical forms.

fn as_they_are(_: &[f32], outputs: &[f32]) -> Vec<f32> {
    outputs.to_vec()
}

/// Eigenvalues and the matrix they make with the axis, which is arbitrary where they meet.
fn rebuilt_eigen(_: &[f32], o: &[f32]) -> Vec<f32> {
    let mut canonical = vec![o[0], o[1], v2(&o[2..]).length()];
    canonical.extend(of_sym2(Sym2::from_eigen(o[0], o[1], v2(&o[2..]))));
    canonical
}

/// Roughnesses, the matrix they make with their directions, and that these form a frame: directions are arbitrary
/// where the roughnesses meet.
fn rebuilt_aniso(_: &[f32], o: &[f32]) -> Vec<f32> {
    let (t, b) = (v3(&o[2..]), v3(&o[5..]));
    let s = Sym3::outer(t) * (o[0] * o[0]) + Sym3::outer(b) * (o[1] * o[1]);
    let mut canonical = vec![o[0], 0.05 * o[1].ln(), t.length(), b.length(), t.dot(b)];
    canonical.extend(columns(s));
    canonical
}

/// The Rayleigh quotient of the axis found, and its overlap with the start: the axis itself is ill-conditioned where
/// eigenvalues are close.
fn axis_quality(i: &[f32], o: &[f32]) -> Vec<f32> {
    let (s, n) = (s3(i), v3(o));
    vec![s.quadratic(n) / s.trace(), n.length(), (n.dot(v3(&i[9..])) >= 0.0) as u8 as f32]
}

/// The SGGX matrix, scaled to its own S_nn, that the surface found stands for: normal and frame are ill-conditioned
/// where eigenvalues are close, their matrix is not.
fn rebuilt_surface(i: &[f32], o: &[f32]) -> Vec<f32> {
    let (n, a) = (v3(o), s2(&o[3..]));
    let scale = s3(i).quadratic(n);
    vec![n.length(), scale, scale * a.trace(), scale * scale * a.det()]
}

const ROUNDING: &str = "a few roundings; Vulkan allows 2.5 ulp to a division and 2 to an inverse root";

/// Every function, in the order of the modules.
pub(crate) fn cases() -> Vec<Case> {
    let case = |function, arguments: Vec<Argument>, twin| Case {
        function,
        arguments,
        twin,
        canonical: as_they_are,
        absolute: 1e-6,
        relative: 4e-6,
        reason: ROUNDING,
    };
    let mut cases = vec![
        // sym
        case("sym2_from_eigen", vec![unit(), unit(), axis()], |x| {
            of_sym2(Sym2::from_eigen(x[0], x[1], v2(&x[2..])))
        }),
        case("sym2_outer", vec![plane()], |x| of_sym2(Sym2::outer(v2(x)))),
        case("sym2_det", vec![semi_definite()], |x| vec![s2(x).det()]),
        case("sym2_trace", vec![semi_definite()], |x| vec![s2(x).trace()]),
        case("sym2_quadratic", vec![semi_definite(), plane()], |x| vec![s2(x).quadratic(v2(&x[3..]))]),
        Case {
            canonical: rebuilt_eigen,
            ..case("sym2_eigen", vec![semi_definite()], |x| {
                let (l1, l2, axis) = s2(x).eigen();
                vec![l1, l2, axis.x, axis.y]
            })
        },
        case(
            "sym2_clamp_eigen",
            vec![
                semi_definite(),
                argument(&[[0.0]], |r| vec![r.f32() * 0.1]),
                argument(&[[1.0]], |r| vec![0.5 + r.f32()]),
            ],
            |x| of_sym2(s2(x).clamp_eigen(x[3], x[4])),
        ),
        case("sym2_sqrt", vec![semi_definite()], |x| of_sym2(s2(x).sqrt())),
        case("sym3_scale", vec![sggx(), argument(&[[0.0], [-1.0]], |r| vec![r.f32() * 4.0 - 2.0])], |x| {
            columns(s3(x) * x[9])
        }),
        case(
            "sym3_add_diagonal",
            vec![sggx(), argument(&[[0.0], [-1.0]], |r| vec![r.f32() * 4.0 - 2.0])],
            |x| {
                let (s, d) = (s3(x), x[9]);
                columns(Sym3 { xx: s.xx + d, yy: s.yy + d, zz: s.zz + d, ..s })
            },
        ),
        case("sym3_quadratic", vec![sggx(), direction()], |x| vec![s3(x).quadratic(v3(&x[9..]))]),
        case("sym3_trace", vec![sggx()], |x| vec![s3(x).trace()]),
        case("sym3_adjugate", vec![sggx()], |x| columns(s3(x).adjugate())),
        case("sym3_det", vec![sggx()], |x| vec![s3(x).det()]),
        // frame
        Case {
            absolute: 2e-6,
            reason: "1 + n.z loses digits towards -z, equally on both sides",
            ..case("m_n", vec![direction()], |x| of_mat3(rust::m_n(v3(x))))
        },
        Case {
            absolute: 4e-4,
            reason: "z is the root of a difference: one ulp of 1 - x² - y² is 3.5e-4 at the horizon",
            ..case(
                "normal_from_xy",
                vec![
                    argument(&[[0.0], [1.0], [-1.0], [0.6]], |r| vec![r.f32() * 2.0 - 1.0]),
                    argument(&[[0.0], [1.0], [-0.8]], |r| vec![r.f32() * 2.0 - 1.0]),
                ],
                |x| of3(rust::normal_from_xy(x[0], x[1])),
            )
        },
        // ggx
        case("ggx_d", vec![cosine(), alpha()], |x| vec![rust::ggx_d(x[0], x[1])]),
        case("ggx_aniso_d", vec![hemisphere(), alpha(), alpha()], |x| {
            vec![rust::ggx_aniso_d(v3(x), x[3], x[4])]
        }),
        Case {
            relative: 4e-4,
            reason: "the quadratic form cancels where h lies along the smaller roughness: 25² ulp at alphas (0.5, 0.02)",
            ..case("ggx_matrix_d", vec![hemisphere(), roughness()], |x| {
                vec![rust::ggx_matrix_d(v3(x), s2(&x[3..]))]
            })
        },
        case("smith_v_of_terms", vec![unit(), unit()], |x| vec![0.5 / (x[0] + x[1]).max(1e-12)]),
        case("smith_v", vec![cosine(), cosine(), alpha()], |x| vec![rust::smith_v(x[0], x[1], x[2])]),
        case("smith_aniso_v", vec![hemisphere(), hemisphere(), alpha(), alpha()], |x| {
            vec![rust::smith_aniso_v(v3(x), v3(&x[3..]), x[6], x[7])]
        }),
        case("smith_matrix_v", vec![hemisphere(), hemisphere(), roughness()], |x| {
            vec![rust::smith_matrix_v(v3(x), v3(&x[3..]), s2(&x[6..]))]
        }),
        case("smith_aniso_g1", vec![hemisphere(), alpha(), alpha()], |x| {
            vec![rust::smith_aniso_g1(v3(x), x[3], x[4])]
        }),
        case("schlick_f", vec![triple(), unit()], |x| of3(rust::schlick_f(v3(x), x[3]))),
        Case {
            absolute: 2e-3,
            reason: "Vulkan allows sine and cosine an error of 2^-11",
            ..case(
                "ggx_vndf_sample",
                vec![
                    hemisphere(),
                    alpha(),
                    alpha(),
                    argument(&[[0.0, 0.0], [0.5, 0.5], [0.25, 0.9]], |r| vec![r.f32(), r.f32()]),
                ],
                |x| of3(rust::ggx_vndf_sample(v3(x), x[3], x[4], v2(&x[5..]))),
            )
        },
        case("ggx_vndf_pdf", vec![hemisphere(), direction(), alpha(), alpha()], |x| {
            vec![rust::ggx_vndf_pdf(v3(x), v3(&x[3..]), x[6], x[7])]
        }),
        // sggx
        case("sggx_from_ggx", vec![hemisphere(), roughness()], |x| {
            columns(rust::sggx_from_ggx(v3(x), s2(&x[3..])))
        }),
        case("sggx_projected_area", vec![sggx(), direction()], |x| {
            vec![rust::sggx_projected_area(s3(x), v3(&x[9..]))]
        }),
        Case {
            relative: 0.05,
            reason: "the determinant cancels: 1e-5 over the smallest eigenvalue, which is 0.0004 here",
            ..case("sggx_d", vec![sggx(), direction()], |x| vec![rust::sggx_d(s3(x), v3(&x[9..]))])
        },
        Case {
            absolute: 4e-6,
            ..case("slopes_from_sggx", vec![sggx()], |x| {
                let (m, a) = rust::slopes_from_sggx(s3(x));
                vec![m.x, m.y, a.xx, a.xy, a.yy]
            })
        },
        case("sggx_from_slopes", vec![plane(), semi_definite()], |x| {
            columns(rust::sggx_from_slopes(v2(x), s2(&x[2..])))
        }),
        Case {
            absolute: 2e-5,
            reason: "roundings add up over fifteen steps",
            ..case("sggx_power_iteration", vec![sggx(), hemisphere(), steps()], |x| {
                of3(rust::sggx_power_iteration(s3(x), v3(&x[9..]), x[12] as u32))
            })
        },
        case(
            "sggx_overlap",
            vec![argument(&[[2.0], [-2.0]], |r| vec![1.2 + r.f32()]), unit(), unit()],
            |x| vec![(x[2] + x[0] * x[1] + x[0] * x[0] - 3.0) / (3.0 * x[0] * x[0] - 3.0)],
        ),
        Case {
            canonical: axis_quality,
            absolute: 1e-3,
            reason: "the residual is 5e-4 of the trace at worst, on the verge of a coincidence of eigenvalues",
            ..case("sggx_principal_axis", vec![sggx(), hemisphere()], |x| {
                of3(rust::sggx_principal_axis(s3(x), v3(&x[9..])))
            })
        },
        Case {
            canonical: rebuilt_surface,
            absolute: 1e-3,
            reason: "as sggx_principal_axis",
            ..case("ggx_from_sggx_unclamped", vec![sggx(), hemisphere()], |x| {
                let (n, a) = rust::ggx_from_sggx_unclamped(s3(x), v3(&x[9..]));
                vec![n.x, n.y, n.z, a.xx, a.xy, a.yy]
            })
        },
        Case {
            canonical: rebuilt_surface,
            absolute: 1e-3,
            reason: "as sggx_principal_axis",
            ..case("ggx_from_sggx", vec![sggx(), hemisphere()], |x| {
                let (n, a) = rust::ggx_from_sggx(s3(x), v3(&x[9..]));
                vec![n.x, n.y, n.z, a.xx, a.xy, a.yy]
            })
        },
        // aniso
        case("alpha_from_roughness", vec![unit()], |x| vec![rust::alpha_from_roughness(x[0])]),
        case("alpha_from_gloss", vec![unit()], |x| vec![rust::alpha_from_gloss(x[0])]),
        case("aniso_encode", vec![semi_definite()], |x| of3(rust::aniso_encode(s2(x)))),
        case("aniso_decode_matrix", vec![triple()], |x| of_sym2(rust::aniso_decode_matrix(v3(x)))),
        Case {
            canonical: rebuilt_aniso,
            absolute: 5e-4,
            reason: "the axis comes from cos² of its angle, whose rounding is 2.5e-4 rad at worst; alpha_b² is a \
                     difference, within 2 % of ALPHA_MIN² of the right one beside alpha_t = 1",
            ..case(
                "aniso_decode",
                vec![
                    triple(),
                    argument(&[[1.0, 0.0, 0.0]], |_| vec![0.6, 0.0, 0.8]),
                    argument(&[[0.0, 1.0, 0.0]], |_| vec![0.0, 1.0, 0.0]),
                ],
                |x| {
                    let d = rust::aniso_decode(v3(x), v3(&x[3..]), v3(&x[6..]));
                    let mut numbers = vec![d.alpha_t, d.alpha_b];
                    numbers.extend(of3(d.tangent));
                    numbers.extend(of3(d.bitangent));
                    numbers
                },
            )
        },
        case("aniso_from_alphas", vec![alpha(), alpha(), axis()], |x| {
            of_sym2(rust::aniso_from_alphas(x[0], x[1], v2(&x[2..])))
        }),
        case("axis_from_direction", vec![axis(), hemisphere()], |x| {
            of2(rust::axis_from_direction(v2(x), v3(&x[2..])))
        }),
        case("direction_from_axis", vec![axis(), hemisphere()], |x| {
            of2(rust::direction_from_axis(v2(x), v3(&x[2..])))
        }),
        case("alphas_from_khr_anisotropy", vec![unit(), unit()], |x| {
            let (t, b) = rust::alphas_from_khr_anisotropy(x[0], x[1]);
            vec![t, b]
        }),
        Case {
            absolute: 3e-4,
            reason: "the strength is the root of a difference",
            ..case("khr_anisotropy_from_alphas", vec![alpha(), alpha()], |x| {
                let (roughness, strength) = rust::khr_anisotropy_from_alphas(x[0], x[1]);
                vec![roughness, strength]
            })
        },
        // beckmann
        case("sigma_from_alpha", vec![alpha()], |x| vec![rust::sigma_from_alpha(x[0])]),
        case("alpha_from_sigma", vec![alpha()], |x| vec![rust::alpha_from_sigma(x[0])]),
        Case {
            relative: 2e-3,
            reason: "Vulkan allows exp(x) an error of 3 + 2|x| ulp, and the argument's own rounding grows with it",
            ..case("beckmann_aniso_d", vec![hemisphere(), alpha(), alpha()], |x| {
                vec![rust::beckmann_aniso_d(v3(x), x[3], x[4])]
            })
        },
        case("slope_from_normal", vec![hemisphere()], |x| of2(rust::slope_from_normal(v3(x)))),
        case("normal_from_slope", vec![plane()], |x| of3(rust::normal_from_slope(v2(x)))),
        // multiscatter
        case("ggx_albedo_alpha", vec![hemisphere(), alpha(), alpha()], |x| {
            vec![rust::ggx_albedo_alpha(v3(x), x[3], x[4])]
        }),
        Case {
            relative: 4e-5,
            reason: "both polynomials cancel near alpha = 0",
            ..case("ggx_directional_albedo", vec![unit(), alpha()], |x| {
                vec![rust::ggx_directional_albedo(x[0], x[1])]
            })
        },
        Case {
            relative: 1e-4,
            reason: "as ggx_directional_albedo, divided by 0.3",
            ..case("multiscatter_compensation", vec![triple(), hemisphere(), alpha(), alpha()], |x| {
                of3(rust::multiscatter_compensation(v3(x), v3(&x[3..]), x[6], x[7]))
            })
        },
    ];
    // sh
    cases.extend([
        case("sh_basis", vec![direction()], |x| sh::sh_basis(v3(x)).to_vec()),
        case("sh_evaluate", vec![harmonics(), direction()], |x| of3(sh::sh_evaluate(&sh9(x), v3(&x[27..])))),
        case("sh_convolve_cosine", vec![harmonics()], |x| {
            sh::sh_convolve_cosine(&sh9(x)).iter().flat_map(|v| v.to_array()).collect()
        }),
        case("sh_irradiance", vec![harmonics(), direction()], |x| {
            of3(sh::sh_irradiance(&sh9(x), v3(&x[27..])))
        }),
    ]);
    cases.extend(detail::cases());
    cases.extend(fuzz::cases());
    cases.extend(skin::cases());
    cases
}
