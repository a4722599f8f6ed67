//! Colour, metalness and lobe of a surface, filtered together.

use std::sync::Arc;

use kinran_bake::aniso::{Reflectance, ReflectanceMaps, SurfaceMaps};
use kinran_bake::metal::{Apart, apart, base_and_metal};
use kinran_bake::{compress_levels, keep_coverage};

use kinran_image::{Role, Texture, Transfer};

use super::mip_texels;
use crate::content::Content;
use crate::options::TextureOptions;
use crate::{Error, Stage, Task};

/// A surface that knows what it reflects.
pub(super) struct Together {
    /// Its maps, with weights where its texels do not all reflect the same.
    pub(super) maps: SurfaceMaps,
    /// Base colour, where its levels are chosen together with those of metalness.
    pub(super) color: Option<Texture>,
    /// Levels of metalness; none where they are averaged.
    pub(super) metallic: Vec<Vec<u8>>,
}

/// Filters base colour and metalness of a surface, and weighs its texels; as it is where nothing is said of what it reflects.
/// The base colour is cut out at `cutoff` where there is one.
pub(super) fn together(
    maps: &SurfaceMaps,
    reflectance: Option<&Reflectance>,
    cutoff: Option<f32>,
    name: &str,
    how: &TextureOptions,
    task: Task<'_>,
) -> Result<Together, Error> {
    let mut together = Together { maps: maps.clone(), color: None, metallic: Vec::new() };
    let Some(reflectance) = reflectance else { return Ok(together) };
    let surface = maps.size();
    if together.maps.weights.is_none() {
        together.maps.weights = reflectance.weights(surface).map(Arc::new);
    }
    if apart(reflectance, surface).is_none() {
        let own = reflectance.size();
        let size = (own.0.max(surface.0), own.1.max(surface.1));
        let texels = mip_texels(size) + mip_texels(own);
        let choosing = task.begin(Stage::Averaging(Content::Color), name, texels)?;
        let mut pair = match base_and_metal(reflectance, surface, how.kernel, &|texels| choosing.tick(texels))
        {
            Ok(pair) => pair,
            Err(Apart::Cancelled(stopped)) => return Err(stopped.into()),
            Err(_) => return Ok(together),
        };
        let base = match &reflectance.maps {
            ReflectanceMaps::Metallic { base, .. } => base.image.as_deref(),
            ReflectanceMaps::Specular(_) => None,
        };
        if let (Some(cutoff), Some(image)) = (cutoff, base) {
            keep_coverage(image, cutoff, how.kernel, reflectance.wrap, &mut pair.color, &|_| {
                choosing.tick(0)
            })?;
        }
        let encoding = how.encoding(Role::Color, how.color_format);
        let tick = |texels| choosing.tick(texels);
        together.color = Some(compress_levels(&pair.color, Transfer::Srgb, encoding, &tick)?);
        together.metallic = pair.metallic;
    }
    Ok(together)
}

/// A sentence where base colour and metalness are averaged one by one though both vary.
pub(super) fn why_apart(name: &str, reflectance: &Reflectance, maps: &SurfaceMaps) -> Option<String> {
    let apart = apart(reflectance, maps.size())?;
    let is_loss = matches!(apart, Apart::Dielectric | Apart::Sizes(..));
    is_loss.then(|| format!("{name}: base colour and metalness are averaged one by one: {apart}"))
}
