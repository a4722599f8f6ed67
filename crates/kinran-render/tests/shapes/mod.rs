//! Small scenes for tests and benches.

use glam::{Affine3A, Vec2, Vec3, vec2, vec3, vec4};
use kinran_scene::{Instance, Light, LightKind, Material, Primitive, Scene, Source};

/// A square of side 2 in the xy plane, facing +z, u to the right and v down.
pub(crate) fn square(material: usize) -> Primitive {
    let corners = [vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0)];
    Primitive {
        positions: corners.iter().map(|c| c.extend(0.0)).collect(),
        normals: vec![Vec3::Z; 4],
        tangents: vec![vec4(1.0, 0.0, 0.0, 1.0); 4],
        uvs: [corners.iter().map(|c| vec2(0.5 + 0.5 * c.x, 0.5 - 0.5 * c.y)).collect(), Vec::new()],
        colors: Vec::new(),
        curvature: None,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        source: Source::default(),
    }
}

/// A unit sphere with exact vertex normals.
pub(crate) fn sphere(rings: u32) -> Primitive {
    let columns = 2 * rings;
    let vertices: Vec<(Vec3, Vec3, Vec2)> = (0..=rings)
        .flat_map(|i| (0..=columns).map(move |j| (i, j)))
        .map(|(i, j)| {
            let uv = vec2(j as f32 / columns as f32, i as f32 / rings as f32);
            let (theta, phi) = (uv.y * std::f32::consts::PI, uv.x * std::f32::consts::TAU);
            let normal = vec3(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos());
            (normal, vec3(phi.cos(), 0.0, -phi.sin()), uv)
        })
        .collect();
    let quads = (0..rings).flat_map(|i| (0..columns).map(move |j| i * (columns + 1) + j));
    Primitive {
        positions: vertices.iter().map(|v| v.0).collect(),
        normals: vertices.iter().map(|v| v.0.normalize()).collect(),
        tangents: vertices.iter().map(|v| v.1.extend(1.0)).collect(),
        uvs: [vertices.iter().map(|v| v.2).collect(), Vec::new()],
        colors: Vec::new(),
        curvature: None,
        triangles: quads
            .flat_map(|a| [[a, a + columns + 1, a + columns + 2], [a, a + columns + 2, a + 1]])
            .collect(),
        material: 0,
        source: Source::default(),
    }
}

/// A material without textures.
pub(crate) fn material(base_color: Vec3, metallic: f32, roughness: f32) -> Material {
    Material {
        name: "test".into(),
        base_color_factor: base_color.extend(1.0),
        metallic_factor: metallic,
        roughness_factor: roughness,
        ..Material::default()
    }
}

/// Every primitive once, where it is.
pub(crate) fn scene(primitives: Vec<Primitive>, materials: Vec<Material>) -> Scene {
    let instances = (0..primitives.len())
        .map(|primitive| Instance { primitive, transform: Affine3A::IDENTITY })
        .collect();
    Scene { primitives, instances, materials, ..Scene::default() }
}

/// A white directional light.
pub(crate) fn directional(direction: Vec3, lux: f32) -> Light {
    Light {
        kind: LightKind::Directional,
        color: Vec3::splat(lux),
        position: Vec3::ZERO,
        direction: direction.normalize(),
        range: f32::INFINITY,
    }
}
