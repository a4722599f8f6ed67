//! What several tests need.

#[path = "../../../sample_assets.rs"]
mod sample_assets;

pub(crate) use sample_assets::sample_assets;

/// File, triangles in meshes as the assets' README counts them, triangles as placed in the scene, materials.
pub(crate) const DOCUMENTS: [(&str, usize, usize, usize); 11] = [
    ("anisotropy_barn_lamp/AnisotropyBarnLamp.gltf", 10_203, 10_203, 3),
    ("anisotropy_disc_test/AnisotropyDiscTest.glb", 2_788, 2_788, 12),
    ("anisotropy_rotation_test/AnisotropyRotationTest.glb", 7_476, 13_876, 6),
    ("anisotropy_strength_test/AnisotropyStrengthTest.glb", 97_240, 97_240, 50),
    ("chess_knight/knight.glb", 11_184, 11_184, 1),
    ("curtain/curtain_open.gltf", 9_216, 9_216, 1),
    ("horse_statue_01/horse_statue_01_1k.gltf", 22_388, 22_388, 2),
    ("lee_perry_smith/LeePerrySmith.gltf", 17_684, 17_684, 1),
    ("normal_tangent_test/NormalTangentTest.glb", 7_774, 7_774, 1),
    ("sheen_chair/SheenChair.gltf", 39_936, 39_936, 6),
    ("sofa_03/sofa_03_1k.gltf", 8_004, 8_004, 2),
];
