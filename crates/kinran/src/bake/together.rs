//! Colour, metalness and lobe of a surface, filtered together.

use std::sync::Arc;

use kinran_bake::aniso::{Kernel, Reflectance, ReflectanceMaps, SurfaceMaps};
use kinran_bake::metal::{Apart, BaseAndMetal, apart, base_and_metal};
use kinran_bake::{Rgba8Level, compress_levels, keep_coverage};
use kinran_image::{Role, Texture, Transfer};

use super::mip_texels;
use crate::content::Content;
use crate::options::TextureOptions;
use crate::{Error, Stage, Task};

/// A surface that knows what it reflects.
#[derive(Clone, Debug)]
pub struct Together {
    /// Its maps, with weights where its texels do not all reflect the same.
    pub maps: SurfaceMaps,
    /// Base colour and metalness of its levels, where they are chosen together.
    pub pair: Option<BaseAndMetal>,
}

/// Weighs the texels of a surface, and chooses base colour and metalness of its levels, where they can be, with a specular colour
/// where it is to be `separate`; the maps as they are where nothing is said of what they reflect. The base colour is cut out at
/// `cutoff` where there is one. `name` is that of the material.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn together(
    maps: &SurfaceMaps,
    reflectance: Option<&Reflectance>,
    cutoff: Option<f32>,
    separate: bool,
    name: &str,
    kernel: Kernel,
    task: Task<'_>,
) -> Result<Together, Error> {
    let mut together = Together { maps: maps.clone(), pair: None };
    let Some(reflectance) = reflectance else { return Ok(together) };
    let surface = maps.size();
    if together.maps.weights.is_none() {
        together.maps.weights = reflectance.weights(surface).map(Arc::new);
    }
    if apart(reflectance, surface).is_none() {
        let own = reflectance.size();
        let size = (own.0.max(surface.0), own.1.max(surface.1));
        let choosing = task.begin(Stage::Averaging(Content::Color), name, mip_texels(size))?;
        let tick = |texels| choosing.tick(texels);
        let mut pair = match base_and_metal(reflectance, surface, kernel, separate, &tick) {
            Ok(pair) => pair,
            Err(Apart::Cancelled(stopped)) => return Err(stopped.into()),
            Err(_) => return Ok(together),
        };
        let base = match &reflectance.maps {
            ReflectanceMaps::Metallic { base, .. } => base.image.as_deref(),
            ReflectanceMaps::Specular(_) => None,
        };
        if let (Some(cutoff), Some(image)) = (cutoff, base) {
            let tick = |_| choosing.tick(0);
            keep_coverage(image, cutoff, kernel, reflectance.wrap, &mut pair.color, &tick)?;
        }
        together.pair = Some(pair);
    }
    Ok(together)
}

/// Levels of a colour that was chosen together with metalness, as a texture.
pub(super) fn color_texture(
    levels: &[Rgba8Level],
    content: Content,
    name: &str,
    how: &TextureOptions,
    task: Task<'_>,
) -> Result<Texture, Error> {
    let texels = levels.iter().map(|level| u64::from(level.width) * u64::from(level.height));
    let compressing = task.begin(Stage::Averaging(content), name, texels.sum())?;
    let encoding = how.encoding(Role::Color, how.color_format);
    Ok(compress_levels(levels, Transfer::Srgb, encoding, &|texels| compressing.tick(texels))?)
}

/// A sentence where base colour and metalness are averaged one by one though both vary.
pub fn why_apart(name: &str, reflectance: &Reflectance, maps: &SurfaceMaps) -> Option<String> {
    let apart = apart(reflectance, maps.size())?;
    let is_loss = matches!(apart, Apart::Dielectric | Apart::Sizes(..));
    is_loss.then(|| format!("{name}: base colour and metalness are averaged one by one: {apart}"))
}
