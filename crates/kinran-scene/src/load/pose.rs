//! Skins: meshes as their joints hold them in the rest pose (glTF 2.0 section 3.7.3.3).

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

use super::Loader;
use crate::{Error, Pose, Primitive, json};

/// The scene's primitives of a mesh, by the skin that poses it; `None` is the mesh as it is.
pub(super) type Poses = BTreeMap<Option<usize>, Range<usize>>;

/// What the last row of an inverse bind matrix may be off 0 0 0 1: rounding of an inverse in single precision.
const LAST_ROW_ROUNDING: f64 = 1e-4;

impl Loader<'_> {
    /// The skins that nodes show each mesh with; the mesh as it is where there are none.
    pub(super) fn skins_of_meshes(&self) -> Vec<Poses> {
        let mut poses = vec![Poses::new(); self.root.meshes.len()];
        for node in &self.root.nodes {
            if let Some(poses) = node.mesh.and_then(|mesh| poses.get_mut(mesh)) {
                poses.insert(node.skin.filter(|_| self.needs.rest_pose), 0..0);
            }
        }
        for poses in poses.iter_mut().filter(|poses| poses.is_empty()) {
            poses.insert(None, 0..0);
        }
        poses
    }

    /// For each joint of a skin the matrix from the mesh to the world.
    pub(super) fn joints(&mut self, skin: usize) -> Result<Vec<DAffine3>, Error> {
        let root = self.root;
        let rig = (root.skins.get(skin)).ok_or_else(|| self.error(format!("skin {skin} does not exist")))?;
        let what = format!("skin {skin}");
        let inverse_binds = match rig.inverse_bind_matrices {
            Some(accessor) => self.accessors.floats::<16>(accessor, &what)?,
            None => vec![DMat4::IDENTITY.as_mat4().to_cols_array(); rig.joints.len()],
        };
        if inverse_binds.len() < rig.joints.len() {
            return Err(self.error(format!(
                "{what} has {} joints and {} inverse bind matrices; there must be as many",
                rig.joints.len(),
                inverse_binds.len()
            )));
        }
        if self.worlds.is_empty() {
            self.worlds = self.node_worlds()?;
        }
        (rig.joints.iter().zip(inverse_binds))
            .enumerate()
            .map(|(i, (&node, inverse_bind))| {
                let world = (self.worlds.get(node).copied().flatten()).ok_or_else(|| {
                    self.error(format!(
                        "{what}: joint {i} is node {node}, which does not exist or is its own parent"
                    ))
                })?;
                let inverse_bind = DMat4::from_cols_array(&inverse_bind.map(f64::from));
                if !inverse_bind.row(3).abs_diff_eq(DVec4::W, LAST_ROW_ROUNDING) {
                    return Err(
                        self.error(format!("{what}: the last row of inverse bind matrix {i} is not 0 0 0 1"))
                    );
                }
                Ok(world * DAffine3::from_mat4(inverse_bind))
            })
            .collect()
    }

    /// The places of all nodes in the world, whether a scene shows them or not; `None` for those in a circle.
    fn node_worlds(&self) -> Result<Vec<Option<DAffine3>>, Error> {
        let nodes = &self.root.nodes;
        let mut is_child = vec![false; nodes.len()];
        for &child in nodes.iter().flat_map(|node| &node.children) {
            if let Some(flag) = is_child.get_mut(child) {
                *flag = true;
            }
        }
        let mut worlds = vec![None; nodes.len()];
        let roots = (0..nodes.len()).filter(|&n| !is_child[n]);
        let mut stack: Vec<(usize, DAffine3)> = roots.map(|n| (n, DAffine3::IDENTITY)).collect();
        while let Some((n, parent)) = stack.pop() {
            let Some(node) = nodes.get(n).filter(|_| worlds[n].is_none()) else { continue };
            let world = parent * self.local_transform(node, &format!("node {n}"))?;
            worlds[n] = Some(world);
            stack.extend(node.children.iter().map(|&child| (child, world)));
        }
        Ok(worlds)
    }

    /// `primitive` as the joints of skin number `skin` hold it, about [`Pose::origin`]; `None` where it has no `JOINTS_0`.
    pub(super) fn posed(
        &mut self,
        primitive: &Primitive,
        attributes: &json::Attributes,
        (skin, joints): (usize, &[DAffine3]),
        what: &str,
    ) -> Result<Option<Primitive>, Error> {
        let matrices = self.skin_matrices(attributes, joints, what)?;
        if matrices.is_empty() {
            self.warn(format!(
                "{what} has no JOINTS_0 and WEIGHTS_0; it is placed by its node, without its skin"
            ));
            return Ok(None);
        }
        let count = attributes.position.and_then(|accessor| Some(self.root.accessors.get(accessor)?.count));
        if count != Some(matrices.len() as u64) {
            return Err(self.error(format!(
                "{what}: JOINTS_0 has {} elements and POSITION {}; they must be as many",
                matrices.len(),
                count.unwrap_or(0)
            )));
        }
        let vertex = |i: usize| primitive.source.vertices.get(i).map_or(i, |&vertex| vertex as usize);
        let mut posed = primitive.clone();
        // Far from the world's origin single precision would not hold what is fine. All meshes of a skin are about one place,
        // so that they stay one surface.
        let sum: DVec3 = joints.iter().map(|joint| joint.translation).sum();
        let origin = (sum / joints.len().max(1) as f64).as_vec3();
        let (mut size, mut mirrored) = (0.0, 0.0);
        for i in 0..primitive.positions.len() {
            let matrix = matrices[vertex(i)];
            let linear = matrix.matrix3;
            let determinant = linear.determinant();
            size += determinant.abs().cbrt();
            mirrored += determinant.signum();
            let position = matrix.transform_point3(primitive.positions[i].as_dvec3());
            posed.positions[i] = (position - origin.as_dvec3()).as_vec3();
            // What is only moved and scaled keeps its directions bit by bit.
            let scale = linear.x_axis.x;
            if scale > 0.0 && linear == DMat3::from_diagonal(DVec3::splat(scale)) {
                continue;
            }
            let normal = normal_matrix(linear) * primitive.normals[i].as_dvec3();
            posed.normals[i] = normal.try_normalize().map_or(primitive.normals[i], DVec3::as_vec3);
            let tangent = primitive.tangents[i];
            let along = (linear * tangent.truncate().as_dvec3()).try_normalize();
            posed.tangents[i] = along.map_or(tangent, |along| along.as_vec3().extend(tangent.w));
        }
        if let Some(at) = posed.positions.iter().position(|p| !(p.is_finite() && origin.is_finite())) {
            return Err(self.error(format!("{what}: skin {skin} moves vertex {} to infinity", vertex(at))));
        }
        let scale = size / primitive.positions.len() as f64;
        // Front faces stay counter-clockwise under joints that mirror.
        let mirrored = mirrored < 0.0;
        if mirrored {
            posed.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            posed.tangents.iter_mut().for_each(|tangent| tangent.w = -tangent.w);
        }
        posed.source.pose =
            Some(Pose { skin, origin, scale, mirrored, tangents: primitive.tangents.clone() });
        Ok(Some(posed))
    }

    /// Gives the primitives of a mesh that one skin holds one scale, by which the unit of curvature goes.
    pub(super) fn share_scale(posed: &mut [Primitive]) {
        let (mut sum, mut count) = (0.0, 0.0);
        for primitive in posed.iter() {
            if let Some(pose) = &primitive.source.pose {
                sum += pose.scale * primitive.positions.len() as f64;
                count += primitive.positions.len() as f64;
            }
        }
        for primitive in posed {
            let Some(pose) = &mut primitive.source.pose else { continue };
            pose.scale = sum / count;
            if let Some(curvature) = primitive.curvature.as_mut().filter(|_| pose.scale > 0.0) {
                curvature.millimetres /= pose.scale as f32;
            }
        }
    }

    /// For each of the document's vertices the mean of its joints' matrices; empty where it names none.
    fn skin_matrices(
        &mut self,
        attributes: &json::Attributes,
        joints: &[DAffine3],
        what: &str,
    ) -> Result<Vec<DAffine3>, Error> {
        let mut sums: Vec<(f64, DMat3, DVec3)> = Vec::new();
        for set in 0.. {
            let accessor = |name: &str| {
                let value = attributes.others.get(&format!("{name}_{set}"))?;
                usize::try_from(value.as_u64()?).ok()
            };
            let (Some(indices), Some(weights)) = (accessor("JOINTS"), accessor("WEIGHTS")) else { break };
            let indices = self.accessors.floats::<4>(indices, &format!("{what}: JOINTS_{set}"))?;
            let weights = self.accessors.floats::<4>(weights, &format!("{what}: WEIGHTS_{set}"))?;
            if indices.len() != weights.len() || (set > 0 && indices.len() != sums.len()) {
                return Err(self.error(format!(
                    "{what}: JOINTS_{set} has {} elements and WEIGHTS_{set} {}; there must be one for each vertex",
                    indices.len(),
                    weights.len()
                )));
            }
            sums.resize(indices.len(), (0.0, DMat3::ZERO, DVec3::ZERO));
            for (vertex, (indices, weights)) in indices.iter().zip(&weights).enumerate() {
                for (&index, &weight) in indices.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
                    let joint = joints.get(index as usize).ok_or_else(|| {
                        self.error(format!(
                            "{what}: vertex {vertex} hangs on joint {index}, and its skin has {} joints",
                            joints.len()
                        ))
                    })?;
                    let (sum, linear, translation) = &mut sums[vertex];
                    let weight = f64::from(weight);
                    *sum += weight;
                    *linear += joint.matrix3 * weight;
                    *translation += joint.translation * weight;
                }
            }
        }
        let loose = sums.iter().filter(|(sum, ..)| *sum <= 0.0).count();
        if loose > 0 {
            self.warn(format!(
                "{what}: {loose} vertices have no weight; they follow the first joint of their skin"
            ));
        }
        let first = joints.first().copied().unwrap_or(DAffine3::IDENTITY);
        let mean = |(sum, linear, translation): (f64, DMat3, DVec3)| {
            if sum <= 0.0 {
                return first;
            }
            // Weights stored in few bits do not add up to one.
            DAffine3 { matrix3: linear * sum.recip(), translation: translation / sum }
        };
        Ok(sums.into_iter().map(mean).collect())
    }
}

/// What turns normals as `linear` turns surfaces, up to a factor above zero; there is one for a singular matrix too.
fn normal_matrix(linear: DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = linear;
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if linear.determinant() < 0.0 { -cofactors } else { cofactors }
}
