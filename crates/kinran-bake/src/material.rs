//! The surface of a glTF material.

use std::sync::Arc;

use kinran_image::Image;
use kinran_scene::{Material, Scene, TextureRef, Wrap};

use crate::aniso::{NormalMap, RoughnessMaps, ScalarMap, SurfaceMaps};

/// Normals and roughness of a material as the filters take them, and how its UVs are laid out.
#[derive(Clone, Debug)]
pub struct MaterialSurface {
    /// The maps.
    pub maps: SurfaceMaps,
    /// A texture reference whose UV set, transform and wrapping all of the maps share.
    pub place: TextureRef,
}

/// Why a material has no surface to filter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoSurface {
    /// It has neither a normal map nor an anisotropy map: the mesh's normals and an isotropic roughness.
    Plain,
    /// Its maps lie on the mesh in different ways and cannot become one texture; the sentence says which.
    Apart(String),
}

/// The surface of material number `material`, when it has a normal map or an anisotropy map.
///
/// # Errors
/// [`NoSurface`] otherwise, and where the maps do not share UV set, transform and wrapping.
///
/// # Panics
/// When there is no such material.
pub fn material_surface(scene: &Scene, material: usize) -> Result<MaterialSurface, NoSurface> {
    let m = &scene.materials[material];
    let anisotropy = m.anisotropy.as_ref().filter(|a| a.strength > 0.0);
    let anisotropy_texture = anisotropy.and_then(|a| a.texture.as_ref());
    let Some(place) = m.normal.as_ref().or(anisotropy_texture) else {
        return Err(NoSurface::Plain);
    };
    for (name, other) in [
        ("anisotropyTexture", anisotropy_texture),
        ("metallicRoughnessTexture", m.metallic_roughness.as_ref()),
    ] {
        if let Some(other) = other.filter(|o| !same_place(o, place)) {
            return Err(NoSurface::Apart(apart(m, name, other, place)));
        }
    }

    let image = |place: &TextureRef| -> Option<Arc<Image>> { scene.images.get(place.image)?.clone() };
    let normal = m.normal.as_ref().and_then(image).map_or_else(NormalMap::flat, |image| NormalMap {
        scale: m.normal_scale,
        ..NormalMap::new(image, false)
    });
    let roughness = ScalarMap {
        image: m.metallic_roughness.as_ref().and_then(image).map(|image| (image, 1)),
        factor: m.roughness_factor,
    };
    let roughness = match anisotropy {
        Some(a) => RoughnessMaps::Khr {
            roughness,
            strength: a.strength,
            rotation: a.rotation,
            texture: anisotropy_texture.and_then(image),
        },
        None => RoughnessMaps::Isotropic(roughness),
    };
    Ok(MaterialSurface { maps: SurfaceMaps { normal, roughness, wrap: place.wrap }, place: place.clone() })
}

fn same_place(a: &TextureRef, b: &TextureRef) -> bool {
    (a.uv_set, a.transform, a.wrap) == (b.uv_set, b.transform, b.wrap)
}

fn apart(material: &Material, name: &str, other: &TextureRef, place: &TextureRef) -> String {
    let wraps = |wrap: [Wrap; 2]| format!("{:?}/{:?}", wrap[0], wrap[1]).to_lowercase();
    let difference = if other.uv_set != place.uv_set {
        format!("UV set {} against {}", other.uv_set, place.uv_set)
    } else if other.transform != place.transform {
        "another KHR_texture_transform".into()
    } else {
        format!("wrapping {} against {}", wraps(other.wrap), wraps(place.wrap))
    };
    format!(
        "material \"{}\": {name} lies on the mesh in another way than its normal map ({difference}); its maps are left as they are",
        material.name
    )
}
