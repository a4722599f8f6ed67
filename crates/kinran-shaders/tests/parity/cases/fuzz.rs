//! Fuzz, in the order of its modules.

use super::*;
use kinran_shading::fuzz::{self, FuzzView};

/// Roughness of fibres.
fn fibre_alpha() -> Argument {
    argument(&[[fuzz::FUZZ_ALPHA_MIN], [0.447], [1.0]], |r| vec![r.f32().max(fuzz::FUZZ_ALPHA_MIN)])
}

fn density() -> Argument {
    argument(&[[0.0], [0.05], [0.5], [3.0]], |r| vec![r.f32()])
}

/// Schlick's k.
fn asymmetry() -> Argument {
    argument(&[[0.0], [0.5], [0.99]], |r| vec![r.f32() * 0.99])
}

/// A cosine of either sign.
fn signed_cosine() -> Argument {
    argument(&[[0.0], [1.0], [-1.0], [0.5]], |r| vec![r.f32() * 2.0 - 1.0])
}

/// Cosine of a direction above the horizon or on it; no less than 1e-3 to a shader's light loop.
fn lit_cosine() -> Argument {
    argument(&[[0.0], [1e-3], [1.0], [0.5]], |r| vec![r.f32().max(1e-3)])
}

/// u·v, t·u and t·v of three directions, where light and view share a hemisphere.
fn phase_cosines() -> Argument {
    let edges = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [-1.0, 1.0, -1.0],
        [-0.5, 0.3, 0.2],
    ];
    argument(&edges, |r| {
        let (u, v, t) = (random_direction(r), random_direction(r), random_direction(r));
        vec![u.dot(v).max(-0.9), t.dot(u), t.dot(v)]
    })
}

/// n·u, t·u and t·n of two directions above the horizon.
fn fibre_cosines() -> Argument {
    let edges = [
        [1.0, 1.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.01, 0.0, 1.0],
        [0.5, 0.6, 0.8],
    ];
    argument(&edges, |r| {
        let (u, t) = (random_direction(r), random_direction(r));
        let u = vec3(u.x, u.y, u.z.abs().max(1e-3)).normalize();
        vec![u.z, t.dot(u), t.z]
    })
}

/// A direction above the horizon, by a degree at least, or on it.
fn above() -> Argument {
    let edges = [
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.6, 0.0, 0.8],
        [0.0, -0.8, 0.6],
        [0.48, -0.6, 0.64],
    ];
    argument(&edges, |r| {
        let d = random_direction(r);
        vec3(d.x, d.y, d.z.abs().max(0.02)).normalize().to_array().to_vec()
    })
}

/// Fitted coefficients.
fn coefficients<const N: usize>() -> Argument {
    let mut argument = argument::<N>(&[], |r| (0..N).map(|_| r.f32() * 2.0 - 1.0).collect());
    argument.edges = vec![vec![0.0; N], (0..N).map(|i| if i == 0 { 0.5 } else { 0.0 }).collect()];
    argument
}

/// Members of a [`FuzzView`].
fn view() -> Argument {
    let mut argument = argument::<7>(&[], |r| {
        let (n_v, t_v) = (r.f32().max(0.01), r.f32() * 2.0 - 1.0);
        of_view(fuzz::fuzz_view(n_v, t_v, r.f32().max(0.01), r.f32().max(0.1)))
    });
    argument.edges = [
        (1.0, 1.0, 0.5, 0.95),
        (0.05, 0.0, 0.1, 0.1),
        (0.0, 0.0, 0.0, 0.1),
        (0.0, 1.0, 3.0, 1.0),
        (1.0, -1.0, 0.0, 0.1),
    ]
    .map(|(n_v, t_v, density, alpha)| of_view(fuzz::fuzz_view(n_v, t_v, density, alpha)))
    .to_vec();
    argument
}

fn of_view(v: FuzzView) -> Vec<f32> {
    vec![v.n_v, v.t_v, v.escaped, v.exponent, v.squeeze, v.root, v.root_along]
}

fn random_numbers() -> Argument {
    const LAST: f32 = 1.0 - f32::EPSILON / 2.0;
    argument(&[[0.0, 0.0], [LAST, LAST], [0.5, 0.5], [0.25, 0.9]], |r| vec![r.f32(), r.f32()])
}

fn array<const N: usize>(x: &[f32]) -> [f32; N] {
    core::array::from_fn(|i| x[i])
}

const EXPONENTIAL: &str = "Vulkan allows exp2(x) an error of 3 + 2|x| ulp";
const SINE: &str = "Vulkan allows sine and cosine an error of 2^-11";

pub(super) fn cases() -> Vec<Case> {
    let case = |function, arguments: Vec<Argument>, twin| Case {
        function,
        arguments,
        twin,
        canonical: as_they_are,
        absolute: 1e-6,
        relative: 1e-5,
        reason: ROUNDING,
    };
    let exponential = |function, arguments: Vec<Argument>, twin| Case {
        absolute: 1e-5,
        relative: 1e-4,
        reason: EXPONENTIAL,
        ..case(function, arguments, twin)
    };
    vec![
        // phase
        case("fuzz_alpha", vec![unit()], |x| vec![fuzz::fuzz_alpha(x[0])]),
        case("velvet_k", vec![unit()], |x| vec![fuzz::velvet_k(x[0])]),
        Case {
            absolute: 2e-3,
            reason: SINE,
            ..case(
                "fibre_direction",
                vec![
                    argument(&[[0.0], [core::f32::consts::FRAC_PI_2]], |r| vec![r.f32() * 1.57]),
                    signed_cosine(),
                ],
                |x| of3(fuzz::fibre_direction(x[0], x[1])),
            )
        },
        case("fibre_d", vec![signed_cosine(), fibre_alpha()], |x| vec![fuzz::fibre_d(x[0], x[1])]),
        case("fibre_projected_area", vec![signed_cosine(), fibre_alpha()], |x| {
            vec![fuzz::fibre_projected_area(x[0], x[1])]
        }),
        Case {
            relative: 4e-5,
            reason: "w² m⁻² takes four times their rounding",
            ..case("fibre_phase", vec![phase_cosines(), fibre_alpha()], |x| {
                vec![fuzz::fibre_phase(x[0], x[1], x[2], x[3])]
            })
        },
        case("velvet_normalization", vec![asymmetry()], |x| vec![fuzz::velvet_normalization(x[0])]),
        Case {
            relative: 2e-3,
            reason: "1 - k sin(t, h) cancels where h lies across the fibres: 1e-7 over 0.01, twice",
            ..case("velvet_phase", vec![phase_cosines(), asymmetry()], |x| {
                vec![fuzz::velvet_phase(x[0], x[1], x[2], x[3])]
            })
        },
        // layer
        exponential("fuzz_passage", vec![density(), lit_cosine()], |x| vec![fuzz::fuzz_passage(x[0], x[1])]),
        case("fuzz_layer", vec![unit(), unit(), lit_cosine(), lit_cosine()], |x| {
            vec![fuzz::fuzz_layer(x[0], x[1], x[2], x[3])]
        }),
        exponential("fuzz_brdf", vec![above(), above(), above(), density(), fibre_alpha()], |x| {
            vec![fuzz::fuzz_brdf(v3(x), v3(&x[3..]), v3(&x[6..]), x[9], x[10])]
        }),
        Case {
            relative: 2e-3,
            reason: "as velvet_phase",
            ..exponential("fuzz_velvet_brdf", vec![above(), above(), above(), density(), asymmetry()], |x| {
                vec![fuzz::fuzz_velvet_brdf(v3(x), v3(&x[3..]), v3(&x[6..]), x[9], x[10])]
            })
        },
        exponential("fuzz_reciprocal_brdf", vec![above(), above(), above(), density(), fibre_alpha()], |x| {
            vec![fuzz::fuzz_reciprocal_brdf(v3(x), v3(&x[3..]), v3(&x[6..]), x[9], x[10])]
        }),
        exponential("fuzz_view", vec![lit_cosine(), signed_cosine(), density(), fibre_alpha()], |x| {
            of_view(fuzz::fuzz_view(x[0], x[1], x[2], x[3]))
        }),
        Case {
            absolute: 1e-4,
            reason: "1 - exp2 leaves 6e-8 of a lobe that is 800 at its sharpest, which is all there is at a density of zero",
            ..exponential(
                "fuzz_light",
                vec![
                    view(),
                    lit_cosine(),
                    signed_cosine(),
                    argument(&[[1.0], [0.0], [-1.0]], |r| vec![r.f32() * 1.9 - 0.9]),
                ],
                |x| {
                    let view = FuzzView {
                        n_v: x[0],
                        t_v: x[1],
                        escaped: x[2],
                        exponent: x[3],
                        squeeze: x[4],
                        root: x[5],
                        root_along: x[6],
                    };
                    let light = fuzz::fuzz_light(view, x[7], x[8], x[9]);
                    vec![light.lobe, light.penetrated]
                },
            )
        },
        case("fuzz_attenuation", vec![unit(), unit(), unit(), triple()], |x| {
            of3(fuzz::fuzz_attenuation(x[0], x[1], x[2], v3(&x[3..])))
        }),
        case("fuzz_smooth_normal", vec![above(), above(), unit()], |x| {
            of3(fuzz::fuzz_smooth_normal(v3(x), v3(&x[3..]), x[6]))
        }),
        // p_s
        Case {
            absolute: 1e-5,
            ..case(
                "fibre_p_s_step",
                vec![
                    argument(&[[1.0]], |r| vec![0.8 + 0.2 * r.f32()]),
                    argument(&[[0.0]], |r| vec![-0.2 * r.f32()]),
                    argument(&[[0.0]], |r| vec![-0.4 * r.f32()]),
                    argument(&[[0.0]], |r| vec![r.f32()]),
                ],
                |x| {
                    let (l, constant, linear, square) = (x[0], x[1], x[2], x[3]);
                    let value = ((l + square) * l + linear) * l + constant;
                    let slope = (3.0 * l + 2.0 * square) * l + linear;
                    let inside = 4.0 * slope * slope - 6.0 * value * (6.0 * l + 2.0 * square);
                    vec![l - 3.0 * value / (slope + inside.max(0.0).sqrt()).max(1e-20)]
                },
            )
        },
        Case {
            absolute: 2e-3,
            reason: "the slope at the root is a difference; it vanishes where two roots meet, at alpha 0.1",
            ..case("fibre_p_s", vec![fibre_cosines(), fibre_alpha()], |x| {
                vec![fuzz::fibre_p_s(x[0], x[1], x[2], x[3])]
            })
        },
        case("fuzz_p_s", vec![coefficients::<6>(), unit(), signed_cosine()], |x| {
            vec![fuzz::fuzz_p_s(array(x), x[6], x[7])]
        }),
        // ambient
        exponential("fuzz_g", vec![density(), lit_cosine()], |x| vec![fuzz::fuzz_g(x[0], x[1])]),
        Case {
            relative: 1e-4,
            reason: "the denominator may cancel for random coefficients",
            ..case(
                "fuzz_g_talk",
                vec![
                    argument(&[[-0.67, 0.08, 0.82, -0.44]], |r| {
                        vec![r.f32() - 1.0, r.f32() * 0.5, 0.6 + 0.3 * r.f32(), -0.4 * r.f32()]
                    }),
                    density(),
                    lit_cosine(),
                ],
                |x| vec![fuzz::fuzz_g_talk(array(x), x[4], x[5])],
            )
        },
        exponential("fuzz_q", vec![density()], |x| vec![fuzz::fuzz_q(x[0])]),
        case("fuzz_q_talk", vec![coefficients::<2>(), density()], |x| {
            vec![fuzz::fuzz_q_talk(array(x), x[2])]
        }),
        case("fuzz_ambient_factor", vec![coefficients::<8>(), unit(), signed_cosine()], |x| {
            vec![fuzz::fuzz_ambient_factor(array(x), x[8], x[9])]
        }),
        Case {
            absolute: 1e-4,
            reason: "near upright views and fibres the sines cancel: 1e-7 over 0.02 squared",
            ..case(
                "fuzz_ambient_place",
                vec![
                    argument(&[[0.0], [0.5], [0.9], [1.0]], |r| vec![r.f32() * 0.98]),
                    signed_cosine(),
                    argument(&[[0.5], [0.0], [1.0]], |r| vec![r.f32() * 0.98]),
                ],
                |x| of2(fuzz::fuzz_ambient_place(x[0], x[1], x[2])),
            )
        },
        case("fuzz_ambient_tabulated", vec![plane(), density(), lit_cosine()], |x| {
            vec![fuzz::fuzz_ambient_tabulated(v2(x), x[2], x[3])]
        }),
        case("fuzz_ambient_direction", vec![coefficients::<4>(), above(), above(), above()], |x| {
            of3(fuzz::fuzz_ambient_direction(array(x), v3(&x[4..]), v3(&x[7..]), v3(&x[10..])))
        }),
        case("fuzz_ambient_radiance", vec![harmonics(), direction()], |x| {
            of3(fuzz::fuzz_ambient_radiance(&sh9(x), v3(&x[27..])))
        }),
        case("fuzz_ambient_mean", vec![harmonics(), direction()], |x| {
            of3(fuzz::fuzz_ambient_mean(&sh9(x), v3(&x[27..])))
        }),
        case("fuzz_ambient_attenuation", vec![unit(), unit(), unit(), triple()], |x| {
            of3(fuzz::fuzz_ambient_attenuation(x[0], x[1], x[2], v3(&x[3..])))
        }),
        // deferred
        case("fuzz_wrap", vec![signed_cosine()], |x| vec![fuzz::fuzz_wrap(x[0])]),
        exponential("fuzz_deferred_escape", vec![lit_cosine()], |x| vec![fuzz::fuzz_deferred_escape(x[0])]),
        exponential(
            "fuzz_deferred",
            vec![
                signed_cosine(),
                lit_cosine(),
                argument(&[[0.0], [1.0], [-1.0]], |r| vec![r.f32() * 1.9 - 0.9]),
                unit(),
            ],
            |x| vec![fuzz::fuzz_deferred(x[0], x[1], x[2], x[3])],
        ),
        case("fuzz_deferred_color", vec![triple(), unit()], |x| of3(fuzz::fuzz_deferred_color(v3(x), x[3]))),
        case(
            "fuzziness_code",
            vec![
                argument(&[[0.0], [1.0], [0.5], [-1.0], [2.0]], |r| vec![r.f32()]),
                argument(&[[0.0], [1.0]], |r| vec![r.u32(..2) as f32]),
            ],
            |x| vec![fuzz::fuzziness_code(x[0], x[1])],
        ),
        case(
            "fuzziness_from_code",
            vec![argument(&[[0.0], [255.0], [127.0]], |r| vec![r.u32(..256) as f32])],
            |x| vec![fuzz::fuzziness_from_code(x[0])],
        ),
        // sampling
        Case {
            absolute: 8e-3,
            reason: SINE,
            ..case("fuzz_sample", vec![above(), above(), fibre_alpha(), random_numbers()], |x| {
                of3(fuzz::fuzz_sample(v3(x), v3(&x[3..]), x[6], v2(&x[7..])))
            })
        },
        Case {
            relative: 4e-5,
            reason: "as fibre_phase",
            ..case("fuzz_pdf", vec![above(), above(), above(), fibre_alpha()], |x| {
                vec![fuzz::fuzz_pdf(v3(x), v3(&x[3..]), v3(&x[6..]), x[9])]
            })
        },
        case("fuzz_over_base_shares", vec![unit(), unit(), unit()], |x| {
            of3(fuzz::fuzz_over_base_shares(x[0], x[1], x[2]))
        }),
        Case {
            absolute: 8e-3,
            reason: SINE,
            ..case(
                "fuzz_over_base_sample",
                vec![
                    above(),
                    above(),
                    fibre_alpha(),
                    alpha(),
                    alpha(),
                    argument(&[[0.5, 0.25, 0.25]], |_| vec![0.4, 0.35, 0.25]),
                    random_numbers(),
                ],
                |x| {
                    of3(fuzz::fuzz_over_base_sample(
                        v3(x),
                        v3(&x[3..]),
                        x[6],
                        x[7],
                        x[8],
                        v3(&x[9..]),
                        v2(&x[12..]),
                    ))
                },
            )
        },
        Case {
            relative: 4e-5,
            reason: "as fibre_phase",
            ..case(
                "fuzz_over_base_pdf",
                vec![
                    above(),
                    above(),
                    above(),
                    fibre_alpha(),
                    alpha(),
                    alpha(),
                    argument(&[[0.5, 0.25, 0.25]], |_| vec![0.4, 0.35, 0.25]),
                ],
                |x| {
                    vec![fuzz::fuzz_over_base_pdf(
                        v3(x),
                        v3(&x[3..]),
                        v3(&x[6..]),
                        x[9],
                        x[10],
                        x[11],
                        v3(&x[12..]),
                    )]
                },
            )
        },
    ]
}
