//! One surface out of vertices that UV and normal seams have split.

use glam::Vec3;

/// Vertices of one position whose normals are farther apart than this stay apart: 120°, the two sides of a sheet that
/// was modelled twice, not an edge however sharp. Chosen by eye.
const SAME_SURFACE: f32 = -0.5;

/// Points and the triangles between them; one point for all vertices of one place.
#[derive(Clone, Debug)]
pub(crate) struct Welded {
    pub(crate) positions: Vec<Vec3>,
    /// Point of each vertex.
    pub(crate) point_of: Vec<u32>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Welded {
    /// A power of two that makes the largest coordinate about one, whatever the unit is; exact to multiply with.
    pub(crate) fn unit_scale(&self) -> f32 {
        let largest = self.positions.iter().fold(0.0f32, |m, p| m.max(p.abs().max_element()));
        // A power that single precision holds, as is its square.
        libm::scalbnf(1.0, -libm::frexpf(largest).1.clamp(-60, 60))
    }
}

/// Joins vertices of bitwise equal positions (0 and -0 are equal) whose `normals`, where there are any, do not oppose
/// each other. Points stand in the order of their first vertices.
pub(crate) fn weld(positions: &[Vec3], normals: Option<&[Vec3]>, triangles: &[[u32; 3]]) -> Welded {
    const NONE: u32 = u32::MAX;
    let slots = (2 * positions.len()).next_power_of_two().max(2);
    let mut table = vec![NONE; slots];
    let mut first_vertex: Vec<u32> = Vec::with_capacity(positions.len());
    let mut point_of = Vec::with_capacity(positions.len());
    for (vertex, &position) in positions.iter().enumerate() {
        let key = (position + 0.0).to_array().map(f32::to_bits);
        // Multiplications of Fibonacci hashing, by 2^64 over the golden ratio.
        let mut hash = u64::from(key[0]);
        for part in &key[1..] {
            hash = (hash ^ (hash >> 29)).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ u64::from(*part);
        }
        hash = hash.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mut slot = (hash >> 32) as usize & (slots - 1);
        let point = loop {
            let point = table[slot];
            if point == NONE {
                table[slot] = first_vertex.len() as u32;
                first_vertex.push(vertex as u32);
                break table[slot];
            }
            let other = first_vertex[point as usize] as usize;
            if positions[other] == position && normals.is_none_or(|n| n[vertex].dot(n[other]) > SAME_SURFACE)
            {
                break point;
            }
            slot = (slot + 1) & (slots - 1);
        };
        point_of.push(point);
    }
    Welded {
        positions: first_vertex.iter().map(|&v| positions[v as usize]).collect(),
        triangles: triangles.iter().map(|t| t.map(|v| point_of[v as usize])).collect(),
        point_of,
    }
}

/// For every point the triangles around it.
pub(crate) struct Fans {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Fans {
    pub(crate) fn new(points: usize, triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0u32; points + 1];
        for &point in triangles.as_flattened() {
            starts[point as usize + 1] += 1;
        }
        for i in 0..points {
            starts[i + 1] += starts[i];
        }
        let mut at = starts.clone();
        let mut list = vec![0u32; triangles.len() * 3];
        for (i, triangle) in triangles.iter().enumerate() {
            for &point in triangle {
                list[at[point as usize] as usize] = i as u32;
                at[point as usize] += 1;
            }
        }
        Self { starts, triangles: list }
    }

    /// Indices of the triangles around a point, in ascending order; one that has the point twice stands twice.
    pub(crate) fn around(&self, point: usize) -> &[u32] {
        &self.triangles[self.starts[point] as usize..self.starts[point + 1] as usize]
    }
}

/// The two other corners of a triangle, in its sense of turning.
pub(crate) fn others(triangle: [u32; 3], point: u32) -> (u32, u32) {
    let [a, b, c] = triangle;
    if a == point {
        (b, c)
    } else if b == point {
        (c, a)
    } else {
        (a, b)
    }
}
