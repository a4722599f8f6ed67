//! The surface of a glTF material.

use std::sync::Arc;

use kinran_image::Image;
use kinran_scene::{Material, Scene, TextureRef, Wrap};

use crate::aniso::{
    ColorMap, Dielectric, NormalMap, Reflectance, ReflectanceMaps, RoughnessMaps, ScalarMap, SurfaceMaps,
};

/// Normals and roughness of a material as the filters take them, and how its UVs are laid out.
#[derive(Clone, Debug)]
pub struct MaterialSurface {
    /// The maps.
    pub maps: SurfaceMaps,
    /// A texture reference whose UV set, transform and wrapping all of the maps share; `None` where there is no map, and
    /// factors alone say what the surface is.
    pub place: Option<TextureRef>,
}

/// Why a material has no surface to filter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NoSurface {
    /// It has neither a normal nor a roughness map and is isotropic: the mesh's normals, and one roughness everywhere.
    Plain,
    /// Its maps lie on the mesh in different ways and cannot become one texture; the sentence says which.
    Apart(String),
}

/// The surface of material number `material`, when it has a normal or a roughness map or is anisotropic, by a map or by
/// factors.
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
    let roughness_texture = m.metallic_roughness.as_ref();
    let has_image = |place: &TextureRef| scene.images.get(place.image).is_some_and(Option::is_some);
    if m.normal.is_none() && anisotropy.is_none() && !roughness_texture.is_some_and(has_image) {
        return Err(NoSurface::Plain);
    }
    let maps = [
        ("normalTexture", m.normal.as_ref()),
        ("anisotropyTexture", anisotropy_texture),
        ("metallicRoughnessTexture", roughness_texture),
    ];
    let mut maps = maps.into_iter().filter_map(|(name, place)| Some((name, place?)));
    let first = maps.next();
    if let Some(first) = first
        && let Some(other) = maps.find(|(_, other)| !other.lies_as(first.1))
    {
        return Err(NoSurface::Apart(apart(m, other, first)));
    }
    let place = first.map(|(_, place)| place);

    let image = |place: &TextureRef| -> Option<Arc<Image>> { scene.images.get(place.image)?.clone() };
    let normal = m
        .normal
        .as_ref()
        .and_then(image)
        .map_or_else(NormalMap::flat, |image| NormalMap::gltf(image, m.normal_scale));
    let roughness = ScalarMap {
        image: roughness_texture.and_then(image).map(|image| (image, 1)),
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
    let wrap = place.map_or([Wrap::Repeat; 2], |place| place.wrap);
    Ok(MaterialSurface {
        maps: SurfaceMaps { normal, roughness, wrap, weights: None },
        place: place.cloned(),
    })
}

/// What the texels of a material reflect, where its maps lie as its surface does. `None` where it is the same everywhere or
/// an image is not there; a sentence where maps lie apart, or where something else says what reflects.
///
/// # Errors
/// The sentence.
///
/// # Panics
/// When there is no such material.
pub fn material_reflectance(
    scene: &Scene,
    material: usize,
    surface: &MaterialSurface,
) -> Result<Option<Reflectance>, String> {
    let m = &scene.materials[material];
    let Some(place) = surface.place.as_ref().filter(|_| m.reflecting().next().is_some()) else {
        return Ok(None);
    };
    const GLOSS: &str = "KHR_materials_pbrSpecularGlossiness";
    if m.ignored_extensions.iter().any(|name| name == GLOSS) {
        return Err(format!(
            "material \"{}\": {GLOSS} says what reflects; its maps are filtered one by one",
            m.name
        ));
    }
    let image = |place: &TextureRef| -> Option<Arc<Image>> { scene.images.get(place.image)?.clone() };
    if m.reflecting().any(|map| image(map).is_none()) {
        return Ok(None);
    }
    let map = |name, map: &Option<TextureRef>| match map {
        Some(map) if !map.lies_as(place) => Err(format!(
            "material \"{}\": {name} lies on the mesh in another way than the surface's maps; they are filtered one by one",
            m.name
        )),
        map => Ok(map.as_ref().and_then(image)),
    };
    let scalar = |image: Option<Arc<Image>>, channel, factor| ScalarMap {
        image: image.map(|image| (image, channel)),
        factor,
    };
    let dielectric = m.dielectric.clone().unwrap_or_default();
    let maps = ReflectanceMaps::Metallic {
        base: ColorMap {
            image: map("baseColorTexture", &m.base_color)?,
            factor: m.base_color_factor.truncate(),
        },
        metallic: scalar(m.metallic_roughness.as_ref().and_then(image), 2, m.metallic_factor),
        dielectric: Dielectric {
            f0: dielectric.f0(),
            strength: scalar(map("specularTexture", &dielectric.strength_texture)?, 3, dielectric.strength),
            color: ColorMap {
                image: map("specularColorTexture", &dielectric.color)?,
                factor: dielectric.color_factor,
            },
        },
    };
    Ok(Some(Reflectance { maps, wrap: place.wrap }))
}

fn apart(
    material: &Material,
    (name, other): (&str, &TextureRef),
    (first, place): (&str, &TextureRef),
) -> String {
    let wraps = |wrap: [Wrap; 2]| format!("{:?}/{:?}", wrap[0], wrap[1]).to_lowercase();
    let difference = if other.uv_set != place.uv_set {
        format!("UV set {} against {}", other.uv_set, place.uv_set)
    } else if other.wrap == place.wrap {
        "another KHR_texture_transform".into()
    } else {
        format!("wrapping {} against {}", wraps(other.wrap), wraps(place.wrap))
    };
    format!(
        "material \"{}\": {name} lies on the mesh in another way than {first} ({difference}); its maps are left as they are",
        material.name
    )
}
