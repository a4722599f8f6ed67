//! Real documents made by others.

mod common;

use common::{DOCUMENTS, sample_assets};
use glam::{Vec3, Vec4};
use kinran_scene::{Primitive, Scene};

fn is_unit(v: Vec3) -> bool {
    (v.length() - 1.0).abs() < 1e-5
}

#[test]
fn sample_assets_do_not_load_whole() {
    let Some(assets) = sample_assets() else { return };
    for (file, in_meshes, placed, materials) in DOCUMENTS {
        let scene = Scene::load(assets.join("meshes").join(file)).unwrap();
        let got: usize = scene.primitives.iter().map(|p| p.triangles.len()).sum();
        assert_eq!(in_meshes, got, "{file}: triangles in meshes");
        assert_eq!(placed, scene.triangle_count(), "{file}: triangles placed");
        assert_eq!(materials, scene.materials.len(), "{file}: materials");
        for (i, primitive) in scene.primitives.iter().enumerate() {
            let n = primitive.positions.len();
            assert_eq!(n, primitive.normals.len(), "{file}: normals of primitive {i}");
            assert_eq!(n, primitive.tangents.len(), "{file}: tangents of primitive {i}");
            assert!(primitive.triangles.iter().flatten().all(|&v| (v as usize) < n), "{file}: primitive {i}");
            for (v, (&normal, &tangent)) in primitive.normals.iter().zip(&primitive.tangents).enumerate() {
                assert!(is_unit(normal), "{file}: normal {v} of primitive {i} is {normal}");
                assert!(
                    is_unit(tangent.truncate()) && tangent.w.abs() == 1.0,
                    "{file}: tangent {v} of primitive {i} is {tangent}"
                );
            }
        }
        for material in &scene.materials {
            for texture in material.textures() {
                assert!(scene.images[texture.image].is_some(), "{file}: image {}", texture.image);
            }
        }
        let camera = scene.default_camera(1.5).unwrap();
        assert!(camera.transform.is_finite(), "{file}: camera {:?}", camera.transform);
    }
}

/// These assets' tangents come from their authors' MikkTSpace, which is not ours. (The barn lamp's metal
/// is not among them: its exporter made tangents of another kind.)
#[test]
fn tangents_of_sample_assets_are_not_their_authors_mikktspace() {
    let Some(assets) = sample_assets() else { return };
    for file in [
        "anisotropy_disc_test/AnisotropyDiscTest.glb",
        "anisotropy_rotation_test/AnisotropyRotationTest.glb",
        "anisotropy_strength_test/AnisotropyStrengthTest.glb",
    ] {
        let path = assets.join("meshes").join(file);
        let authored = Scene::load(&path).unwrap();
        // The same document with its TANGENT attributes hidden under a name of the same length.
        let bytes = replace(&std::fs::read(&path).unwrap(), b"\"TANGENT\"", b"\"_ANGENT\"");
        let generated = Scene::from_bytes(&path, &bytes, &|uri| unreachable!("{uri}")).unwrap();
        for (i, (a, b)) in authored.primitives.iter().zip(&generated.primitives).enumerate() {
            for (corner, (want, got)) in corner_tangents(a).zip(corner_tangents(b)).enumerate() {
                // 1 degree: the authors' positions and normals were in double precision.
                assert!(
                    want.truncate().dot(got.truncate()) > 0.999_85 && want.w == got.w,
                    "{file}: primitive {i}, corner {corner}: wanted {want}, got {got}"
                );
            }
        }
    }
}

fn corner_tangents(primitive: &Primitive) -> impl Iterator<Item = Vec4> {
    primitive.triangles.iter().flatten().map(|&v| primitive.tangents[v as usize])
}

fn replace(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let mut at = 0;
    while let Some(found) = out[at..].windows(from.len()).position(|window| window == from) {
        out[at + found..at + found + to.len()].copy_from_slice(to);
        at += found + to.len();
    }
    out
}
