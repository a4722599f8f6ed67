//! Ray against triangles.

use glam::{Mat3, Mat3A, Vec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
    ray::{Ray, RayHit},
};

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance along the ray's unit direction.
    pub distance: f32,
    /// Index of the triangle, in the order given to [`Bvh::new`].
    pub triangle: u32,
    /// Weights of the triangle's three vertices, non-negative, their sum one.
    pub barycentric: Vec3,
}

/// A bounding volume hierarchy over triangles.
pub struct Bvh {
    /// `None` without triangles.
    hierarchy: Option<Bvh2>,
    /// In the order of the hierarchy's leaves.
    corners: Vec<[Vec3A; 3]>,
}

/// A triangle's box, grown so that a ray through its edge cannot miss it by rounding: the slab test is good to
/// three roundings (Ize. Robust BVH Ray Traversal. JCGT 2013), 4e-7 of the largest coordinate covers them.
struct PaddedBox(Aabb);

impl Boundable for PaddedBox {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Bvh {
    /// A hierarchy over triangles given by their corners; finite, at most 2^30.
    pub fn new(triangles: &[[Vec3; 3]]) -> Self {
        let boxes: Vec<PaddedBox> = triangles
            .iter()
            .map(|t| {
                let aabb = Aabb::from_points(&t.map(Vec3A::from));
                let pad = 4e-7 * aabb.min.abs().max(aabb.max.abs()).max_element();
                PaddedBox(Aabb::new(aabb.min - pad, aabb.max + pad))
            })
            .collect();
        if boxes.is_empty() {
            return Bvh { hierarchy: None, corners: Vec::new() };
        }
        let hierarchy = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Default::default());
        let corners =
            hierarchy.primitive_indices.iter().map(|&i| triangles[i as usize].map(Vec3A::from)).collect();
        Bvh { hierarchy: Some(hierarchy), corners }
    }

    /// The nearest triangle along the ray between `min` and `max`, both exclusive. `direction` is unit length.
    pub fn closest_hit(&self, origin: Vec3, direction: Vec3, min: f32, max: f32) -> Option<Hit> {
        let hierarchy = self.hierarchy.as_ref()?;
        let shear = Shear::new(origin, direction);
        let mut found: Option<Hit> = None;
        let ray = Ray::new(origin.into(), direction.into(), min, max);
        hierarchy.ray_traverse(ray, &mut RayHit::none(), |ray, leaf| {
            match shear.intersect(&self.corners[leaf], min, ray.tmax) {
                Some((distance, barycentric)) => {
                    found = Some(Hit { distance, triangle: hierarchy.primitive_indices[leaf], barycentric });
                    distance
                }
                None => f32::INFINITY,
            }
        });
        found
    }

    /// Whether any triangle lies on the ray between `min` and `max`, both exclusive. `direction` is unit length.
    pub fn any_hit(&self, origin: Vec3, direction: Vec3, min: f32, max: f32) -> bool {
        let Some(hierarchy) = &self.hierarchy else { return false };
        let shear = Shear::new(origin, direction);
        let ray = Ray::new(origin.into(), direction.into(), min, max);
        !hierarchy.ray_traverse_miss(ray, |_, leaf| {
            let hit = shear.intersect(&self.corners[leaf], min, max);
            hit.map_or(f32::INFINITY, |(distance, _)| distance)
        })
    }
}

/// The watertight test of Woop, Benthin, Wald (Watertight Ray/Triangle Intersection. JCGT 2013): the ray becomes
/// the z axis by a permutation and a shear, so that neighbours judge their common edge by the same numbers.
struct Shear {
    origin: Vec3A,
    /// Permutation and shear; a vertex goes the same way in every triangle that has it.
    to_ray: Mat3A,
    /// Brings the sheared z to distances.
    scale: f32,
}

impl Shear {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];
        let z = direction.abs().max_position();
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            (x, y) = (y, x);
        }
        let row = |k: usize| AXES[k] - AXES[z] * (direction[k] / direction[z]);
        let to_ray = Mat3::from_cols(row(x), row(y), AXES[z]).transpose();
        Shear { origin: origin.into(), to_ray: to_ray.into(), scale: direction[z].recip() }
    }

    #[inline(always)]
    fn intersect(&self, [a, b, c]: &[Vec3A; 3], min: f32, max: f32) -> Option<(f32, Vec3)> {
        let a = self.to_ray * (*a - self.origin);
        let b = self.to_ray * (*b - self.origin);
        let c = self.to_ray * (*c - self.origin);

        let mut edges = Vec3::new(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        if edges.cmpeq(Vec3::ZERO).any() {
            // A ray through an edge is decided in double precision.
            let cross = |p: Vec3A, q: Vec3A| {
                (f64::from(p.x) * f64::from(q.y) - f64::from(p.y) * f64::from(q.x)) as f32
            };
            edges = Vec3::new(cross(c, b), cross(a, c), cross(b, a));
        }
        if edges.min_element() < 0.0 && edges.max_element() > 0.0 {
            return None;
        }
        let det = edges.element_sum();
        if det == 0.0 {
            return None;
        }

        let barycentric = edges / det;
        let distance = barycentric.dot(Vec3::new(a.z, b.z, c.z)) * self.scale;
        (distance > min && distance < max).then_some((distance, barycentric))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sampler::sample_2d;
    use glam::vec3;

    fn random_vec3(index: u32, pair: u32) -> Vec3 {
        sample_2d(index, pair, 1).extend(sample_2d(index, pair + 1, 1).x) * 2.0 - 1.0
    }

    /// Möller–Trumbore in double precision over all triangles.
    fn brute_force(triangles: &[[Vec3; 3]], origin: Vec3, direction: Vec3) -> Option<(f64, u32)> {
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let hit = |(i, t): (usize, &[Vec3; 3])| {
            let [a, b, c] = t.map(|p| p.as_dvec3());
            let (e1, e2) = (b - a, c - a);
            let p = d.cross(e2);
            let det = e1.dot(p);
            let s = o - a;
            let u = s.dot(p) / det;
            let q = s.cross(e1);
            let v = d.dot(q) / det;
            let t = e2.dot(q) / det;
            (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, i as u32))
        };
        triangles.iter().enumerate().filter_map(hit).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    #[test]
    fn agrees_with_brute_force_on_random_triangles() {
        let triangles: Vec<[Vec3; 3]> = (0..500)
            .map(|i| {
                let centre = random_vec3(i, 0);
                [10, 20, 30].map(|pair| centre + 0.2 * random_vec3(i, pair))
            })
            .collect();
        let bvh = Bvh::new(&triangles);
        let mut hits = 0;
        for i in 0..4000 {
            let (origin, direction) = (2.0 * random_vec3(i, 40), random_vec3(i, 50).normalize());
            let wanted = brute_force(&triangles, origin, direction);
            let got = bvh.closest_hit(origin, direction, 0.0, f32::INFINITY);
            assert_eq!(
                wanted.map(|w| w.1),
                got.map(|g| g.triangle),
                "ray {i} from {origin} along {direction}: {wanted:?} {got:?}"
            );
            assert_eq!(bvh.any_hit(origin, direction, 0.0, f32::INFINITY), got.is_some(), "ray {i}");
            if let (Some((t, _)), Some(hit)) = (wanted, got) {
                hits += 1;
                assert!(
                    (t - f64::from(hit.distance)).abs() < 1e-4,
                    "ray {i}: distance {t}, got {}",
                    hit.distance
                );
                let corners = triangles[hit.triangle as usize];
                let point: Vec3 = (0..3).map(|k| corners[k] * hit.barycentric[k]).sum();
                let wanted = origin + hit.distance * direction;
                assert!((point - wanted).length() < 1e-4, "ray {i}: at {wanted}, barycentric says {point}");
                assert!(
                    !bvh.any_hit(origin, direction, 0.0, hit.distance),
                    "ray {i}: its own hit shadows it"
                );
            }
        }
        assert!(hits > 500, "only {hits} rays hit anything");
    }

    /// A closed mesh far from the origin: every ray from inside must end on it, also through its edges and corners.
    #[test]
    fn a_closed_mesh_leaks_no_ray() {
        let centre = vec3(1000.0, -300.0, 70.0);
        let rings = 24;
        let vertex = |i: u32, j: u32| {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * (j % rings) as f32 / rings as f32,
            );
            centre + vec3(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
        };
        let mut triangles = Vec::new();
        for i in 0..rings {
            for j in 0..rings {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                triangles.push([a, b, c]);
                triangles.push([a, c, d]);
            }
        }
        let bvh = Bvh::new(&triangles);
        let shoot = |target: Vec3, what: &str| {
            let direction = (target - centre).normalize();
            let hit = bvh.closest_hit(centre, direction, 0.0, f32::INFINITY);
            assert!(hit.is_some(), "a ray along {direction} leaks through {what} at {target}");
        };
        for (i, t) in triangles.iter().enumerate() {
            for k in 0..3 {
                shoot(t[k], "a corner");
                for f in [0.5, 0.25, 1.0 / 3.0] {
                    shoot(t[k].lerp(t[(k + 1) % 3], f), "an edge");
                }
            }
            shoot(centre + random_vec3(i as u32, 60), "a face");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            shoot(centre + axis, "an axis");
            shoot(centre - axis, "an axis");
        }
    }

    #[test]
    fn nothing_is_hit_where_nothing_is() {
        let bvh = Bvh::new(&[]);
        assert_eq!(bvh.closest_hit(Vec3::ZERO, Vec3::Z, 0.0, f32::INFINITY), None);
        assert!(!bvh.any_hit(Vec3::ZERO, Vec3::Z, 0.0, f32::INFINITY));
        let degenerate = Bvh::new(&[[Vec3::ONE; 3], [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X]]);
        assert_eq!(degenerate.closest_hit(-Vec3::ONE, Vec3::ONE.normalize(), 0.0, f32::INFINITY), None);
    }
}
