//! Normals and tangents that a document leaves out (glTF 2.0 section 3.7.2.1).
//!
//! [1] Morten S. Mikkelsen. Simulation of Wrinkled Surfaces Revisited. 2008.
//! [2] Tom Duff et al. Building an Orthonormal Basis, Revisited. JCGT 6(1), 2017.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use crate::Primitive;

/// Gives each triangle vertices of its own with the triangle's normal, as the specification demands of
/// primitives without normals; counter-clockwise is the front. A degenerate triangle gets +z.
pub(crate) fn flatten(primitive: &mut Primitive) {
    let corners: Vec<usize> = primitive.triangles.iter().flatten().map(|&i| i as usize).collect();
    gather(primitive, &corners);
    primitive.normals = (primitive.positions.chunks_exact(3))
        .flat_map(|p| {
            // In f64, where the squares of the smallest and the largest f32 lengths are both normal.
            let [a, b, c] = [p[0], p[1], p[2]].map(Vec3::as_dvec3);
            [(b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |n| n.as_vec3()); 3]
        })
        .collect();
}

/// MikkTSpace tangents [1] of the given UV set. Vertices whose triangles disagree are split, all others
/// stay shared, vertices without a triangle go.
///
/// glTF's v runs downwards while its normal maps' green points up, so the bitangent runs against v and
/// the sign is the opposite of what MikkTSpace says for these UVs.
pub(crate) fn generate(primitive: &mut Primitive, uv_set: usize) {
    let triangles = std::mem::take(&mut primitive.triangles);
    let mut corners = Corners {
        primitive,
        uvs: &primitive.uvs[uv_set],
        triangles: &triangles,
        tangents: vec![None; triangles.len() * 3],
    };
    generate_tangents(&mut corners).expect("GenerateTangentSpaceError has no values");
    let tangents: Vec<Vec4> = (triangles.iter().flatten().zip(corners.tangents))
        .map(|(&vertex, tangent)| match tangent {
            Some(tangent) if tangent.truncate().is_normalized() => tangent,
            _ => arbitrary(primitive.normals[vertex as usize]),
        })
        .collect();

    let mut vertices = Vec::new();
    let mut vertex_tangents = Vec::new();
    let mut known: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let welded: Vec<u32> = (triangles.iter().flatten().zip(tangents))
        .map(|(&vertex, tangent)| {
            *known.entry((vertex, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
                vertices.push(vertex as usize);
                vertex_tangents.push(tangent);
                vertices.len() as u32 - 1
            })
        })
        .collect();
    gather(primitive, &vertices);
    primitive.tangents = vertex_tangents;
    primitive.triangles = welded.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
}

/// A tangent perpendicular to a unit normal: the direction nearest to +y, so that those of neighbouring vertices nearly agree
/// and what is interpolated in their frames, such as curvature, keeps its meaning. Where the normal is +y or -y there is
/// none, and any will do (Duff 2017).
pub fn arbitrary(normal: Vec3) -> Vec4 {
    let along = Vec3::Y - normal * normal.y;
    let tangent =
        if along.length_squared() > 1e-8 { along.normalize() } else { normal.any_orthonormal_vector() };
    tangent.extend(1.0)
}

/// Replaces the vertices by the listed ones of the old; when the list is one of corners, the triangles
/// become consecutive.
fn gather(primitive: &mut Primitive, vertices: &[usize]) {
    fn pick<T: Copy>(from: &mut Vec<T>, vertices: &[usize]) {
        if !from.is_empty() {
            *from = vertices.iter().map(|&v| from[v]).collect();
        }
    }
    pick(&mut primitive.positions, vertices);
    pick(&mut primitive.normals, vertices);
    pick(&mut primitive.tangents, vertices);
    pick(&mut primitive.uvs[0], vertices);
    pick(&mut primitive.uvs[1], vertices);
    pick(&mut primitive.colors, vertices);
    if let Some(curvature) = &mut primitive.curvature {
        pick(&mut curvature.codes, vertices);
    }
    if primitive.source.vertices.is_empty() {
        primitive.source.vertices = vertices.iter().map(|&v| v as u32).collect();
    } else {
        pick(&mut primitive.source.vertices, vertices);
    }
    primitive.triangles = (0..vertices.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
}

struct Corners<'a> {
    primitive: &'a Primitive,
    uvs: &'a [Vec2],
    triangles: &'a [[u32; 3]],
    tangents: Vec<Option<Vec4>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.triangles[face][corner] as usize
    }
}

/// The same bits on every machine, unlike the system's `acos`.
struct PortableOps;

impl Ops for PortableOps {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        libm::acos(f64::from(x)) as f32
    }
}

impl Geometry<PortableOps> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].to_array()
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        self.tangents[face * 3 + corner] = tangent.map(|tangent| {
            let [x, y, z, sign] = tangent.tangent_encoded();
            Vec4::new(x, y, z, -sign)
        });
    }
}
