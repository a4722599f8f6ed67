//! The tables that a renderer lights a scene's skin with.

use std::sync::Arc;

use clap::ValueEnum;
use glam::Vec3;
use kinran_bake::curvature::uniform_scale;
use kinran_bake::skin_lut::{Profile, Table, ambient_table, penumbra_table, punctual_table};
use kinran_render::reference::{RenderScene, RenderSkin, SkinCurvature, SkinTable, SkinTables};
use kinran_scene::{Scene, Skin, SkinProfile};
use kinran_shading::skin::curvature::CURVATURE_RANGE;
use kinran_shading::skin::lighting::SKIN_NORMAL_BLUR;
use kinran_shading::skin::profile::{Gaussian, SKIN};
use kinran_shading::{ALPHA_MIN, alpha_from_roughness};

use crate::values::{number, vector};
use crate::{Error, Progress};

/// Texels of the punctual table, and of the ambient one across.
pub(crate) const SIZE: (usize, usize) = (512, 128);

/// Texels of the table of penumbras.
const PENUMBRA_SIZE: (usize, usize) = (64, 64);

/// Which curvature skin is lit with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SkinCurvatureName {
    /// None: light does not scatter
    Zero,
    /// The mean, whatever the light's direction
    Mean,
    /// Towards the light, as in the talk
    #[default]
    Directional,
    /// Towards the light, normalised
    Normalized,
}

impl From<SkinCurvatureName> for SkinCurvature {
    fn from(name: SkinCurvatureName) -> Self {
        match name {
            SkinCurvatureName::Zero => SkinCurvature::Zero,
            SkinCurvatureName::Mean => SkinCurvature::Mean,
            SkinCurvatureName::Directional => SkinCurvature::Directional,
            SkinCurvatureName::Normalized => SkinCurvature::Normalized,
        }
    }
}

/// Flags about materials that are skin.
#[derive(clap::Args, Clone, Debug, Default)]
#[command(next_help_heading = "Skin")]
pub struct SkinArgs {
    /// Which curvature skin is lit with
    #[arg(long, value_enum, default_value_t)]
    pub skin_curvature: SkinCurvatureName,

    /// Width across the light, in mm, over which shadows on skin are filtered and in which light scatters; 0 for hard
    /// shadows. The default is the material's
    #[arg(long, value_name = "MM", value_parser = |t: &str| number(t, 0.0..=1000.0))]
    pub skin_penumbra: Option<f32>,

    /// Normals that red, green and blue scatter with: `map` for the normal map's, `profile` for blurred ones by how far
    /// each scatters, or a share of the mesh's normal for each. The default is the material's
    #[arg(long, value_name = "map|profile|R,G,B", value_parser = normals)]
    pub skin_normals: Option<Vec3>,
}

fn normals(text: &str) -> Result<Vec3, String> {
    match text {
        "map" => Ok(Vec3::ZERO),
        "profile" => Ok(SKIN_NORMAL_BLUR),
        shares => match vector(shares) {
            Ok(v) if v.min_element() >= 0.0 && v.max_element() <= 1.0 => Ok(v),
            _ => Err("write map, profile, or three shares from 0 to 1 such as 0.7,0.2,0".into()),
        },
    }
}

/// Gives every material of `scene` that is skin its tables in `prepared`; materials of the same profile share them.
///
/// # Errors
/// Where a profile is none.
pub fn attach_skin(
    scene: &Scene,
    prepared: &mut RenderScene,
    args: &SkinArgs,
    progress: &Progress,
) -> Result<(), Error> {
    let curved = scene.primitives.iter().any(|p| p.curvature.is_some());
    let range = if curved { prepared.geometry.curvature_range() } else { CURVATURE_RANGE };
    let mut known: Vec<(&Skin, Arc<SkinTables>)> = Vec::new();
    for (i, material) in scene.materials.iter().enumerate() {
        let Some(skin) = &material.skin else { continue };
        let same = |other: &&Skin| other.profile == skin.profile && other.scatter_scale == skin.scatter_scale;
        let tables = match known.iter().find(|(other, _)| same(other)) {
            Some((_, tables)) => tables.clone(),
            None => {
                let tables = Arc::new(tables(skin, &material.name, range, progress)?);
                known.push((skin, tables.clone()));
                tables
            }
        };
        prepared.materials[i].skin = Some(RenderSkin {
            tables,
            curvature: args.skin_curvature.into(),
            normal_blur: args.skin_normals.unwrap_or(skin.normal_blur),
            penumbra: args.skin_penumbra.unwrap_or(skin.penumbra),
            millimetres: millimetres(scene, i),
            second_alpha: alpha_from_roughness(skin.second_roughness).max(ALPHA_MIN),
            second_share: skin.second_share,
        });
    }
    Ok(())
}

/// A table as the renderers take it.
pub(crate) fn skin_table(table: Table) -> SkinTable {
    let texels = table.entries.into_iter().map(Into::into).collect();
    SkinTable { width: table.width, height: table.height, texels }
}

/// Millimetres in the world's unit where a material is: as curvature was baked, else a metre.
fn millimetres(scene: &Scene, material: usize) -> f32 {
    let baked = scene.instances.iter().find_map(|instance| {
        let primitive = &scene.primitives[instance.primitive];
        let curvature = primitive.curvature.as_ref().filter(|_| primitive.material == material)?;
        let m = instance.transform.matrix3;
        let (scale, _) = uniform_scale([m.x_axis.into(), m.y_axis.into(), m.z_axis.into()]);
        (scale > 0.0).then_some(curvature.millimetres / scale as f32)
    });
    baked.unwrap_or(1000.0)
}

/// A sentence for each material that is skin on a mesh without curvature.
pub fn missing_curvature(scene: &Scene) -> Vec<String> {
    let flat =
        |material: usize| scene.primitives.iter().any(|p| p.material == material && p.curvature.is_none());
    (scene.materials.iter().enumerate())
        .filter(|(i, material)| material.skin.is_some() && flat(*i))
        .map(|(_, material)| {
            format!(
                "material \"{}\" is skin on a mesh without _CURVATURE, where light does not scatter; \
                 kinran bake writes it",
                material.name
            )
        })
        .collect()
}

/// A skin's profile, its lengths scaled.
pub fn profile(skin: &Skin) -> Profile {
    let k = f64::from(skin.scatter_scale);
    match &skin.profile {
        SkinProfile::Human => {
            Profile::Gaussians(SKIN.iter().map(|g| Gaussian { variance: g.variance * k * k, ..*g }).collect())
        }
        SkinProfile::Gaussians(sum) => Profile::Gaussians(
            sum.iter().map(|&(variance, weight)| Gaussian { variance: variance * k * k, weight }).collect(),
        ),
        SkinProfile::Burley(d) => Profile::Burley(d.map(|d| d * k)),
    }
}

/// The tables of a skin, punctual light from `range` of curvature on.
///
/// # Errors
/// Where its profile is none.
pub(crate) fn tables(
    skin: &Skin,
    material: &str,
    range: f32,
    progress: &Progress,
) -> Result<SkinTables, Error> {
    let profile = profile(skin);
    let radial = profile.radial().map_err(|e| Error::Usage(format!("material \"{material}\": {e}")))?;
    let table = skin_table;
    let stage = progress.stage("integrating tables of skin", (SIZE.0 * SIZE.1) as u64);
    let tick = |points| stage.tick(points);
    Ok(SkinTables {
        punctual: table(punctual_table(radial, SIZE.0, SIZE.1, f64::from(range), &tick)?),
        ambient: table(ambient_table(radial, SIZE.0, f64::from(range))),
        penumbra: table(penumbra_table(radial, PENUMBRA_SIZE.0, PENUMBRA_SIZE.1, 1.0)),
        range,
    })
}
