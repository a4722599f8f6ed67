//! Detail maps, in the order of their modules.

use super::*;
use kinran_shading::detail;

/// A shift of hue, saturation and value.
fn shift() -> Argument {
    argument(&[[0.0, 1.0, 1.0], [0.5, 0.0, 2.0], [-0.25, 2.0, 0.5]], |r| {
        vec![r.f32() * 2.0 - 1.0, r.f32() * 2.0, r.f32() * 2.0]
    })
}

fn matrix() -> Argument {
    argument(&[[1.0, 0.0, 0.0, 1.0], [0.0, -4.0, 4.0, 0.0]], |r| {
        (0..4).map(|_| r.f32() * 8.0 - 4.0).collect()
    })
}

/// Signs along both axes.
fn mirror() -> Argument {
    argument(&[[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]], |_| vec![-1.0, 1.0])
}

/// A place among tiles.
fn place() -> Argument {
    argument(&[[0.5, 0.5], [1.0, -1.0], [-0.25, 3.75], [2.0, 0.0]], |r| {
        vec![r.f32() * 20.0 - 10.0, r.f32() * 20.0 - 10.0]
    })
}

fn contrast() -> Argument {
    argument(&[[1.0], [0.0], [10.0]], |r| vec![r.f32() * 4.0])
}

pub(super) fn cases() -> Vec<Case> {
    let case = |function, arguments: Vec<Argument>, twin| Case {
        function,
        arguments,
        twin,
        canonical: as_they_are,
        absolute: 1e-6,
        relative: 4e-6,
        reason: ROUNDING,
    };
    vec![
        // overlay
        case("overlay", vec![unit(), unit()], |x| vec![detail::overlay(x[0], x[1])]),
        case("overlay_color", vec![triple(), triple()], |x| of3(detail::overlay_color(v3(x), v3(&x[3..])))),
        case("smooth_overlay", vec![unit(), unit()], |x| vec![detail::smooth_overlay(x[0], x[1])]),
        case("smooth_overlay_color", vec![triple(), triple()], |x| {
            of3(detail::smooth_overlay_color(v3(x), v3(&x[3..])))
        }),
        // normal
        case("rnm", vec![hemisphere(), hemisphere()], |x| of3(detail::rnm(v3(x), v3(&x[3..])))),
        // over
        case("detail_over", vec![triple(), triple(), unit()], |x| {
            of3(detail::detail_over(v3(x), v3(&x[3..]), x[6]))
        }),
        // hsv
        Case {
            absolute: 1e-5,
            reason: "six times the rounding of a hue of up to two turns",
            ..case("hsv_shift", vec![triple(), shift()], |x| of3(detail::hsv_shift(v3(x), v3(&x[3..]))))
        },
        // layer
        case("detail_from_texel", vec![triple()], |x| of3(detail::detail_from_texel(v3(x)))),
        Case {
            absolute: 2e-5,
            reason: "products up to 40 cancel",
            ..case("detail_uv", vec![place(), matrix(), place()], |x| {
                let matrix = glam::Mat2::from_cols(v2(&x[2..]), v2(&x[4..]));
                of2(detail::detail_uv(v2(x), matrix, v2(&x[6..])))
            })
        },
        case("detail_mirror", vec![place()], |x| of2(detail::detail_mirror(v2(x)))),
        case("detail_mask", vec![unit(), contrast()], |x| vec![detail::detail_mask(x[0], x[1])]),
        case("detail_turn_normal", vec![hemisphere(), axis(), mirror()], |x| {
            of3(detail::detail_turn_normal(v3(x), v2(&x[3..]), v2(&x[5..])))
        }),
        Case {
            canonical: |_, texel| {
                let a = rust::aniso_decode_matrix(v3(texel));
                vec![a.xx, a.xy, a.yy]
            },
            absolute: 4e-6,
            reason: "rho of a lobe whose roughness along an axis vanishes means nothing: compared as matrices",
            ..case("detail_turn_aniso", vec![triple(), axis(), mirror()], |x| {
                of3(detail::detail_turn_aniso(v3(x), v2(&x[3..]), v2(&x[5..])))
            })
        },
    ]
}
