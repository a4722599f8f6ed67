//! Skin by pre-integration: the tables, and a point that is lit with them.

use super::geometry::SurfacePoint;
use glam::{Mat3, Vec2, Vec3, vec2, vec3};
use kinran_shading::Sym2;
use kinran_shading::skin::curvature::{
    curvature_decode, curvature_from_light, curvature_from_light_normalized,
};
use kinran_shading::skin::lighting::{skin_lut_uv, skin_normal};
use std::sync::Arc;

/// Which curvature skin is lit with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SkinCurvature {
    /// None: skin as Lambert's surface.
    Zero,
    /// The mean of the principal curvatures, whatever the light's direction.
    Mean,
    /// Towards the light, as in the talk, which does not normalise the light's projection.
    #[default]
    Directional,
    /// Towards the light, normalised.
    Normalized,
}

/// A table of RGB, values in the middle of texels.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinTable {
    /// Texels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` texels.
    pub texels: Vec<Vec3>,
}

impl SkinTable {
    /// Linear interpolation at `uv` from 0 to 1, clamped at the edges, as a GPU reads it.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let place = |x: f32, n: usize| {
            let x = (x * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let i = (x as usize).min(n.saturating_sub(2));
            (i, (i + 1).min(n - 1), x - i as f32)
        };
        let ((x0, x1, tx), (y0, y1, ty)) = (place(uv.x, self.width), place(uv.y, self.height));
        let at = |x: usize, y: usize| self.texels[y * self.width + x];
        at(x0, y0).lerp(at(x1, y0), tx).lerp(at(x0, y1).lerp(at(x1, y1), tx), ty)
    }
}

/// What the skin of one profile is lit with.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinTables {
    /// Of punctual light: n·u from -1 to 1 across, curvature from 0 to `range` down.
    pub punctual: SkinTable,
    /// Of ambient light: mean curvature from 0 to `range` across, bands 1 and 2 down.
    pub ambient: SkinTable,
    /// Of shadows' penumbras: the filtered shadow from 0 to 1 across, one over the penumbra's width from 0 to 1/mm down.
    pub penumbra: SkinTable,
    /// Largest curvature, 1/mm.
    pub range: f32,
}

/// A material's skin.
#[derive(Clone, Debug)]
pub struct RenderSkin {
    /// Of its profile.
    pub tables: Arc<SkinTables>,
    /// Which curvature counts.
    pub curvature: SkinCurvature,
    /// How far the diffuse normal of each channel turns towards the mesh's.
    pub normal_blur: Vec3,
    /// Width across the light, in millimetres, over which shadows are filtered and in which light scatters; 0 for shadows as
    /// they are.
    pub penumbra: f32,
    /// Millimetres in the world's unit of length.
    pub millimetres: f32,
    /// GGX roughness of a second lobe of gloss.
    pub second_alpha: f32,
    /// Its weight, 0 to 1.
    pub second_share: f32,
}

/// A point of skin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SkinPoint {
    tangent: Vec3,
    bitangent: Vec3,
    tensor: Sym2,
    mean: f32,
    /// The mesh's.
    mesh_normal: Vec3,
    /// Of red, green and blue.
    normals: [Vec3; 3],
    pub(crate) second_alpha: f32,
    pub(crate) second_share: f32,
}

impl SkinPoint {
    /// Where the line along `u`, `offset` beside the point, meets the point's tangent plane: so far along `u`. At a tenth of
    /// a right angle's sine, chosen by eye, planes that are nearly seen edge-on stop running away.
    pub(crate) fn rise(&self, u: Vec3, offset: Vec3) -> f32 {
        -offset.dot(self.mesh_normal) / self.mesh_normal.dot(u).max(0.1)
    }

    /// Whether the mesh turns away from a light along `u`. The table says how far light comes around it then; a shadow
    /// ray would only meet the mesh itself.
    pub(crate) fn turns_away(&self, u: Vec3) -> bool {
        self.mesh_normal.dot(u) <= 0.0
    }
}

impl RenderSkin {
    /// A point with shading normal `n`, seen from its front.
    pub(crate) fn at(&self, point: &SurfacePoint, n: Vec3, curvature_range: f32) -> SkinPoint {
        let Mat3 { x_axis, y_axis, z_axis } = point.tangent_frame;
        let mesh = z_axis.normalize_or(n);
        let (tensor, mean) = curvature_decode(point.curvature, curvature_range);
        SkinPoint {
            tangent: x_axis.normalize_or_zero(),
            bitangent: y_axis.normalize_or_zero(),
            tensor,
            mean,
            mesh_normal: mesh,
            normals: self.normal_blur.to_array().map(|blur| skin_normal(n, mesh, blur)),
            second_alpha: self.second_alpha,
            second_share: self.second_share,
        }
    }

    /// What part of a light along `u`, in the world, leaves the skin again, times π. Where the mesh turns away, bumps do not
    /// turn it back into a light that they cannot see.
    pub(crate) fn punctual(&self, at: &SkinPoint, u: Vec3) -> Vec3 {
        let most = if at.turns_away(u) { 0.0 } else { 1.0 };
        let u_tb = vec2(u.dot(at.tangent), u.dot(at.bitangent));
        let curvature = match self.curvature {
            SkinCurvature::Zero => return Vec3::from_array(at.normals.map(|n| n.dot(u).clamp(0.0, most))),
            SkinCurvature::Mean => at.mean,
            SkinCurvature::Directional => curvature_from_light(at.tensor, u_tb),
            SkinCurvature::Normalized => curvature_from_light_normalized(at.tensor, u_tb),
        };
        let inverse_range = self.tables.range.recip();
        let read =
            |n: Vec3| self.tables.punctual.sample(skin_lut_uv(n.dot(u).min(most), curvature, inverse_range));
        if at.normals[0] == at.normals[1] && at.normals[1] == at.normals[2] {
            return read(at.normals[0]);
        }
        Vec3::from_array([0, 1, 2].map(|c| read(at.normals[c])[c]))
    }

    /// Side of the square across a light, in the world's unit, over which shadows are filtered.
    pub(crate) fn penumbra_width(&self) -> f32 {
        self.penumbra / self.millimetres
    }

    /// What part of a light skin gets in a penumbra that a filtered shadow of `lit` places it in.
    pub(crate) fn in_penumbra(&self, lit: Vec3) -> Vec3 {
        let row = self.penumbra.recip();
        let read = |c: usize| self.tables.penumbra.sample(vec2(lit[c], row))[c];
        vec3(read(0), read(1), read(2))
    }

    /// What the profile leaves of bands 1 and 2 of ambient light.
    pub(crate) fn ambient(&self, at: &SkinPoint) -> (Vec3, Vec3) {
        if self.curvature == SkinCurvature::Zero {
            return (Vec3::ONE, Vec3::ONE);
        }
        let u = at.mean / self.tables.range;
        (self.tables.ambient.sample(vec2(u, 0.25)), self.tables.ambient.sample(vec2(u, 0.75)))
    }
}
