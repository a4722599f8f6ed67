//! The tables that a renderer lights a scene's skin with.

use std::sync::Arc;

use clap::ValueEnum;
use kinran_bake::skin_lut::{Profile, Table, ambient_table, punctual_table};
use kinran_render::reference::{RenderScene, RenderSkin, SkinCurvature, SkinTable, SkinTables};
use kinran_scene::{Scene, Skin, SkinProfile};
use kinran_shading::skin::curvature::CURVATURE_RANGE;
use kinran_shading::skin::profile::{Gaussian, SKIN};
use kinran_shading::{ALPHA_MIN, alpha_from_roughness};

use crate::Error;

/// Texels of the punctual table, and of the ambient one across.
const SIZE: (usize, usize) = (512, 128);

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

/// Gives every material of `scene` that is skin its tables in `prepared`; materials of the same profile share them.
///
/// # Errors
/// Where a profile is none.
pub fn attach_skin(scene: &Scene, prepared: &mut RenderScene, curvature: SkinCurvature) -> Result<(), Error> {
    let curved = scene.primitives.iter().any(|p| p.curvature.is_some());
    let range = if curved { prepared.geometry.curvature_range() } else { CURVATURE_RANGE };
    let mut known: Vec<(&Skin, Arc<SkinTables>)> = Vec::new();
    for (i, material) in scene.materials.iter().enumerate() {
        let Some(skin) = &material.skin else { continue };
        let same = |other: &&Skin| other.profile == skin.profile && other.scatter_scale == skin.scatter_scale;
        let tables = match known.iter().find(|(other, _)| same(other)) {
            Some((_, tables)) => tables.clone(),
            None => {
                let tables = Arc::new(tables(skin, &material.name, range)?);
                known.push((skin, tables.clone()));
                tables
            }
        };
        prepared.materials[i].skin = Some(RenderSkin {
            tables,
            curvature,
            normal_blur: skin.normal_blur,
            second_alpha: alpha_from_roughness(skin.second_roughness).max(ALPHA_MIN),
            second_share: skin.second_share,
        });
    }
    Ok(())
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

fn tables(skin: &Skin, material: &str, range: f32) -> Result<SkinTables, Error> {
    let profile = profile(skin);
    let radial = profile.radial().map_err(|e| Error::Usage(format!("material \"{material}\": {e}")))?;
    let table = |table: Table| SkinTable {
        width: table.width,
        height: table.height,
        texels: table.entries.into_iter().map(Into::into).collect(),
    };
    Ok(SkinTables {
        punctual: table(punctual_table(radial, SIZE.0, SIZE.1, f64::from(range))),
        ambient: table(ambient_table(radial, SIZE.0, f64::from(range))),
        range,
    })
}
