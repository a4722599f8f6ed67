//! Skin, in the order of its modules.

use super::*;
use kinran_shading::skin::curvature::{
    curvature_decode, curvature_encode, curvature_from_light, curvature_from_light_normalized,
};
use kinran_shading::skin::lighting::{skin_irradiance, skin_lut_uv, skin_normal, skin_specular};

/// Four bytes as numbers.
fn code() -> Argument {
    argument(&[[0.0, 128.0 / 255.0, 0.0, 0.0], [1.0, 1.0 / 255.0, 1.0, 1.0], [0.5, 1.0, 0.2, 0.4]], |r| {
        vec![r.f32(), r.f32(), r.f32(), r.f32()]
    })
}

/// A largest curvature.
fn range() -> Argument {
    argument(&[[0.5], [0.01], [4.0]], |r| vec![0.05 + r.f32()])
}

/// Tangent and bitangent components of a direction.
fn in_plane() -> Argument {
    argument(&[[0.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.6, 0.0], [0.0, 0.01]], |r| {
        let d = random_direction(r);
        vec![d.x, d.y]
    })
}

/// A mesh's normal, less than 180° from those of [`hemisphere`].
fn mesh_normal() -> Argument {
    argument(&[[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.6, 0.0, 0.8]], |rng| {
        let d = random_direction(rng);
        vec3(d.x, d.y, d.z.abs() + 0.01).normalize().to_array().to_vec()
    })
}

pub(super) fn cases() -> Vec<Case> {
    let case = |function, arguments: Vec<Argument>, twin| Case {
        function,
        arguments,
        twin,
        canonical: as_they_are,
        absolute: 2e-6,
        relative: 8e-6,
        reason: ROUNDING,
    };
    vec![
        Case {
            absolute: 4e-6,
            reason: "rho is a quotient by a root, which Vulkan allows 2.5 ulp each",
            ..case("curvature_encode", vec![semi_definite(), unit(), range()], |x| {
                curvature_encode(s2(x), x[3], x[4]).to_array().to_vec()
            })
        },
        case("curvature_decode", vec![code(), range()], |x| {
            let (tensor, mean) = curvature_decode(glam::Vec4::from_slice(x), x[4]);
            vec![tensor.xx, tensor.xy, tensor.yy, mean]
        }),
        case("curvature_from_light", vec![semi_definite(), in_plane()], |x| {
            vec![curvature_from_light(s2(x), v2(&x[3..]))]
        }),
        case("curvature_from_light_normalized", vec![semi_definite(), in_plane()], |x| {
            vec![curvature_from_light_normalized(s2(x), v2(&x[3..]))]
        }),
        case(
            "skin_lut_uv",
            vec![argument(&[[-1.0], [0.0], [1.0]], |r| vec![r.f32() * 2.0 - 1.0]), unit(), range()],
            |x| of2(skin_lut_uv(x[0], x[1], x[2])),
        ),
        Case {
            absolute: 1e-5,
            ..case("skin_irradiance", vec![harmonics(), direction(), triple(), triple()], |x| {
                of3(skin_irradiance(&sh9(x), v3(&x[27..]), v3(&x[30..]), v3(&x[33..])))
            })
        },
        case("skin_specular", vec![cosine(), cosine(), cosine(), alpha(), alpha(), unit()], |x| {
            vec![skin_specular(x[0], x[1], x[2], x[3], x[4], x[5])]
        }),
        case("skin_normal", vec![hemisphere(), mesh_normal(), unit()], |x| {
            of3(skin_normal(v3(x), v3(&x[3..]), x[6]))
        }),
    ]
}
