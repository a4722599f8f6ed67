//! A scene as the renderer needs it.

use super::{
    BoundTexture, FuzzFits, Geometry, MipLevel, MipTexture, RenderDetail, RenderDetailLayer, RenderFuzz,
    RenderSkin,
};
use crate::Error;
use glam::{Vec3, Vec4, Vec4Swizzles, vec2};
use kinran_image::{Channels, Image, Pixels, Texture, Transfer};
use kinran_scene::{
    AlphaMode, Detail, DetailMap, Environment, Fuzz, FuzzDirection, FuzzLayer, FuzzPhase, Light, Material,
    Scene, TextureRef,
};
use kinran_shading::fuzz::fibre_direction;
use kinran_shading::sh::{Sh9, sh_convolve_cosine, sh_evaluate};
use kinran_shading::skin::lighting::skin_irradiance;
use std::{borrow::Cow, collections::HashMap, sync::Arc};

/// Normals and roughness of a surface. Which filter made their mips is not the renderer's business.
#[derive(Clone, Debug)]
pub struct SurfaceTextures {
    /// R and G hold x and y of the tangent-space normal, mapped from [-1, 1] to [0, 1], +Y up, any normal
    /// scale applied. z is reconstructed after filtering, as shaders do with BC5.
    pub normal: BoundTexture,
    /// What RGB hold is said by `encoding`. It is filtered as it is encoded, then decoded.
    pub aniso: BoundTexture,
    /// How squared roughness is held.
    pub encoding: AnisoEncoding,
    /// Base colour and metalness that were filtered with them.
    pub colors: Option<ColorTextures>,
}

/// Base colour and metalness, in the place of a material's own; for surfaces of [`AnisoEncoding::Texel`], which ask no other
/// texture for roughness.
#[derive(Clone, Debug)]
pub struct ColorTextures {
    /// Linear RGBA.
    pub base_color: BoundTexture,
    /// B metallic.
    pub metallic: BoundTexture,
    /// What reflects that is not metal, where that was filtered with them too.
    pub dielectric: Option<RenderDielectric>,
}

impl SurfaceTextures {
    /// Textures in Kinran's own form.
    pub fn new(normal: BoundTexture, aniso: BoundTexture) -> Self {
        SurfaceTextures { normal, aniso, encoding: AnisoEncoding::Texel, colors: None }
    }
}

/// How a texture holds anisotropic roughness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnisoEncoding {
    /// An aniso texel (see [`kinran_shading::aniso_encode`]): squared roughness in the frame `M_n x, M_n y` of the normal.
    Texel,
    /// `KHR_materials_anisotropy`: RG a direction in the tangent plane, B a strength; roughness is the material's.
    Khr {
        /// 0 to 1, multiplied with B.
        strength: f32,
        /// Radians, added to the direction.
        rotation: f32,
    },
}

/// Light that a thin surface scatters to its other side; see [`kinran_scene::DiffuseTransmission`].
#[derive(Clone, Debug)]
pub struct Translucency {
    /// Share of the scattered light, multiplied with A of `map`.
    pub factor: f32,
    /// A is a share.
    pub map: Option<BoundTexture>,
    /// Linear colour, multiplied with `color`.
    pub color_factor: Vec3,
    /// Linear RGB.
    pub color: Option<BoundTexture>,
}

/// What of a surface reflects that is not metal; see [`kinran_scene::Dielectric`].
#[derive(Clone, Debug)]
pub struct RenderDielectric {
    /// Linear reflectance at normal incidence, multiplied with RGB of `map`, then one at most.
    pub f0: Vec3,
    /// Share of it all, 0 to 1, multiplied with A of `map`.
    pub strength: f32,
    /// Linear RGB is a colour, A a share.
    pub map: Option<BoundTexture>,
}

/// A material with its textures.
#[derive(Clone, Debug)]
pub struct RenderMaterial {
    /// Normals and roughness; `None` where the mesh's normals and an isotropic roughness will do.
    pub surface: Option<SurfaceTextures>,
    /// Linear RGBA, multiplied with `base_color`.
    pub base_color_factor: Vec4,
    /// Linear RGBA.
    pub base_color: Option<BoundTexture>,
    /// Multiplied with B of `metallic_roughness`.
    pub metallic_factor: f32,
    /// Perceptual roughness, multiplied with G of `metallic_roughness`. Unused where there is a `surface` of
    /// [`AnisoEncoding::Texel`].
    pub roughness_factor: f32,
    /// G perceptual roughness, B metallic.
    pub metallic_roughness: Option<BoundTexture>,
    /// R occlusion.
    pub occlusion: Option<BoundTexture>,
    /// 0 to 1: how much of `occlusion` counts.
    pub occlusion_strength: f32,
    /// Linear radiance, multiplied with `emissive`.
    pub emissive_factor: Vec3,
    /// Linear RGB.
    pub emissive: Option<BoundTexture>,
    /// Pre-integrated skin in place of the Lambert lobe. [`RenderScene::new`] leaves it out: whoever has the tables sets it.
    pub skin: Option<RenderSkin>,
    /// What reflects that is not metal; `None` is glTF's default, 4 % of white light.
    pub dielectric: Option<RenderDielectric>,
    /// Light that passes through diffusely.
    pub translucency: Option<Translucency>,
    /// What alpha does.
    pub alpha_mode: AlphaMode,
    /// Both sides are lit; otherwise back faces are invisible.
    pub double_sided: bool,
    /// The share of the light that is not reflected which passes through unbent, tinted by the base colour: 1 is thin clear
    /// glass.
    pub transmission: f32,
    /// Fibres over all that.
    pub fuzz: Option<RenderFuzz>,
    /// Maps blended from tiles, in the place of those above.
    pub detail: Option<RenderDetail>,
}

impl RenderMaterial {
    fn surface_colors(&self) -> Option<&ColorTextures> {
        self.surface.as_ref()?.colors.as_ref()
    }

    /// Its base colour as it is drawn: that of its surface, or its own.
    pub(crate) fn drawn_base_color(&self) -> Option<&BoundTexture> {
        self.surface_colors().map(|colors| &colors.base_color).or(self.base_color.as_ref())
    }

    /// The same for metalness.
    pub(crate) fn drawn_metallic_roughness(&self) -> Option<&BoundTexture> {
        self.surface_colors().map(|colors| &colors.metallic).or(self.metallic_roughness.as_ref())
    }

    /// The same for what reflects that is not metal.
    pub(crate) fn drawn_dielectric(&self) -> Option<&RenderDielectric> {
        self.surface_colors().and_then(|colors| colors.dielectric.as_ref()).or(self.dielectric.as_ref())
    }
}

/// Light from all around and its order-2 irradiance.
pub struct Surroundings {
    /// Radiance and its sampling.
    pub environment: Environment,
    pub(crate) radiance: Sh9,
    pub(crate) irradiance: Sh9,
}

impl Surroundings {
    /// Projects the environment on spherical harmonics.
    pub fn new(environment: Environment) -> Self {
        let radiance = environment.spherical_harmonics();
        let irradiance = sh_convolve_cosine(&radiance);
        Surroundings { environment, radiance, irradiance }
    }

    /// Irradiance on a surface with unit normal `n`, never negative.
    pub fn irradiance(&self, n: Vec3) -> Vec3 {
        sh_evaluate(&self.irradiance, n).max(Vec3::ZERO)
    }

    /// Irradiance of skin with unit normal `n` that leaves `h_one` and `h_two` of bands 1 and 2, never negative.
    pub fn skin_irradiance(&self, n: Vec3, h_one: Vec3, h_two: Vec3) -> Vec3 {
        skin_irradiance(&self.radiance, n, h_one, h_two).max(Vec3::ZERO)
    }
}

/// All that [`render`](super::render) draws. Cloning shares geometry and textures, so that one scene can be
/// drawn with several [`SurfaceTextures`].
#[derive(Clone)]
pub struct RenderScene {
    /// World-space triangles.
    pub geometry: Arc<Geometry>,
    /// Materials, indexed as in the [`Scene`].
    pub materials: Vec<RenderMaterial>,
    /// Punctual lights.
    pub lights: Vec<Light>,
    /// Light from all around; `None` is darkness.
    pub surroundings: Option<Arc<Surroundings>>,
}

impl RenderScene {
    /// Prepares a scene. `surfaces` holds one entry for each of the scene's materials.
    ///
    /// Colours and masks that have runtime textures are drawn with their mips, others with box-filtered ones.
    ///
    /// # Errors
    /// Those of [`Geometry::new`], and [`Error::Scene`] when `surfaces` is not as long as the materials or a
    /// texture's image is missing.
    pub fn new(
        scene: &Scene,
        surfaces: Vec<Option<SurfaceTextures>>,
        environment: Option<Environment>,
    ) -> Result<Self, Error> {
        if surfaces.len() != scene.materials.len() {
            return Err(Error::Scene(format!(
                "{} surfaces were given for {} materials; give one (or none) for each",
                surfaces.len(),
                scene.materials.len()
            )));
        }
        let mut loader = TextureLoader { scene, loaded: HashMap::new() };
        let materials = scene.materials.iter().zip(surfaces).map(|(m, surface)| loader.material(m, surface));
        let materials = materials.collect::<Result<_, _>>()?;
        Ok(RenderScene {
            geometry: Arc::new(Geometry::new(scene)?),
            materials,
            lights: scene.lights.clone(),
            surroundings: environment.map(|e| Arc::new(Surroundings::new(e))),
        })
    }

    /// Gives every layer of fibres the coefficients that `fit` makes for its phase and spread.
    ///
    /// # Errors
    /// The first one of `fit`; no layer is changed then.
    pub fn fit_fuzz<E>(&mut self, fit: impl Fn(FuzzPhase, f32) -> Result<Arc<FuzzFits>, E>) -> Result<(), E> {
        let of_material = |material: &RenderMaterial| match &material.fuzz.as_ref()?.fuzz {
            Fuzz::Layer(layer) => Some(fit(layer.phase, layer.spread)),
            _ => None,
        };
        let fits = self.materials.iter().map(|material| of_material(material).transpose());
        let fits = fits.collect::<Result<Vec<_>, E>>()?;
        for (material, fits) in self.materials.iter_mut().zip(fits) {
            if let (Some(fuzz), Some(fits)) = (&mut material.fuzz, fits) {
                fuzz.fits = Some(fits);
            }
        }
        Ok(())
    }
}

/// One texture of two that lie on the mesh in one way: RGB of the first, A of the second, white where there is none.
fn color_and_share(color: Option<BoundTexture>, share: Option<BoundTexture>) -> Option<BoundTexture> {
    let place = color.as_ref().or(share.as_ref())?.clone();
    let [color, share] = [color, share].map(|bound| bound.map(|bound| bound.texture));
    let is_opaque = |texture: &MipTexture| {
        texture.levels.iter().all(|level| level.texels.iter().all(|texel| texel[3] == 1.0))
    };
    if let (Some(color), None) = (&color, &share)
        && is_opaque(color)
    {
        return Some(place);
    }
    let size = |texture: &Option<Arc<MipTexture>>| texture.as_ref().map_or(0, |t| t.levels[0].texels.len());
    let finest = if size(&color) >= size(&share) { &color } else { &share };
    let levels = &finest.as_ref().unwrap_or(&place.texture).levels;
    let levels = levels.iter().map(|MipLevel { width, height, .. }| {
        // Levels of other sizes are enlarged bilinearly.
        let level = |texture: &MipTexture| {
            let is_as_large = |level: &MipLevel| level.width <= *width && level.height <= *height;
            texture.levels.iter().position(is_as_large).unwrap_or(texture.levels.len() - 1)
        };
        let texel = |i: u32| {
            let (x, y) = ((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            let uv = vec2(x / *width as f32, y / *height as f32);
            let at = |texture: &Option<Arc<MipTexture>>| {
                texture.as_ref().map_or(Vec4::ONE, |t| t.sample_level(uv, level(t)))
            };
            at(&color).xyz().extend(at(&share).w).to_array()
        };
        MipLevel { width: *width, height: *height, texels: (0..width * height).map(texel).collect() }
    });
    let texture = MipTexture { levels: levels.collect(), wrap: place.texture.wrap, encoded: None };
    Some(BoundTexture { texture: Arc::new(texture), ..place })
}

/// A runtime texture, with the transfer of its slot where its file says none.
fn said(texture: &Texture, slot: Transfer) -> Cow<'_, Texture> {
    if texture.transfer != Transfer::Unsaid {
        return Cow::Borrowed(texture);
    }
    let transfer = texture.transfer.of_content(slot == Transfer::Srgb);
    Cow::Owned(Texture { transfer, ..texture.clone() })
}

/// Makes each image's mips once, however many materials use it.
struct TextureLoader<'a> {
    scene: &'a Scene,
    loaded: HashMap<(usize, Transfer, [kinran_scene::Wrap; 2]), Arc<MipTexture>>,
}

impl TextureLoader<'_> {
    fn texture(&mut self, place: &TextureRef, transfer: Transfer) -> Result<BoundTexture, Error> {
        let key = (place.runtime.unwrap_or(place.image), transfer, place.wrap);
        if !self.loaded.contains_key(&key) {
            let image = self.scene.images.get(place.image).and_then(Option::as_ref).ok_or_else(|| {
                Error::Scene(format!("image {} is used by a material but was not loaded", place.image))
            })?;
            let runtime = place.runtime.and_then(|i| self.scene.textures.get(i)?.as_ref());
            let texture = match runtime {
                Some(texture) => MipTexture::from_texture(&said(texture, transfer), place.wrap)
                    .map_err(|e| Error::Scene(format!("the texture of image {}: {e}", place.image)))?,
                None => MipTexture::from_image(image, transfer, place.wrap),
            };
            self.loaded.insert(key, Arc::new(texture));
        }
        Ok(BoundTexture::new(self.loaded[&key].clone(), place))
    }

    /// Directions of fibres as vectors, whatever the texture holds: angles cannot be averaged.
    fn fibres(&mut self, place: &TextureRef, encoding: FuzzDirection) -> Result<BoundTexture, Error> {
        let held = self.texture(place, Transfer::Linear)?;
        if encoding == FuzzDirection::Vector {
            return Ok(held);
        }
        let level = &held.texture.levels[0];
        let vectors = level.texels.iter().flat_map(|[tilt, azimuth, ..]| {
            let fibre = fibre_direction(tilt * std::f32::consts::FRAC_PI_2, azimuth * std::f32::consts::TAU);
            (fibre * 0.5 + 0.5).to_array()
        });
        let pixels = Pixels::F32(vectors.collect());
        let image = Image::new(level.width, level.height, Channels::Rgb, pixels)
            .map_err(|e| Error::Scene(format!("image {}: {e}", place.image)))?;
        let texture = MipTexture::from_image(&image, Transfer::Linear, place.wrap);
        Ok(BoundTexture::new(Arc::new(texture), place))
    }

    /// Maps blended from tiles.
    fn detail(&mut self, detail: &Detail) -> Result<RenderDetail, Error> {
        let mut load = |place: Option<&TextureRef>, transfer| {
            place.map(|place| self.texture(place, transfer)).transpose()
        };
        let mut maps = [const { None }; 4];
        for (map, place) in maps.iter_mut().zip(&detail.maps) {
            *map = load(place.as_ref(), Transfer::Linear)?;
        }
        let mut layers = Vec::new();
        for layer in &detail.layers {
            let mut tiles = [const { None }; 4];
            for (map, (tile, place)) in DetailMap::ALL.into_iter().zip(tiles.iter_mut().zip(&layer.tiles)) {
                let color = map == DetailMap::BaseColor;
                let transfer = if color { Transfer::Srgb } else { Transfer::Linear };
                *tile = load(place.as_ref(), transfer)?.map(|bound| bound.texture);
            }
            let mask = load(layer.mask.as_ref().map(|mask| &mask.texture), Transfer::Linear)?;
            layers.push(RenderDetailLayer::new(layer, tiles, mask));
        }
        Ok(RenderDetail::new(detail.clone(), maps, layers))
    }

    fn material(&mut self, m: &Material, surface: Option<SurfaceTextures>) -> Result<RenderMaterial, Error> {
        let detail = m.detail.as_ref().map(|detail| self.detail(detail)).transpose()?;
        let fibres = match &m.fuzz {
            Some(Fuzz::Layer(FuzzLayer { direction_texture: Some(place), direction_encoding, .. })) => {
                Some(self.fibres(place, *direction_encoding)?)
            }
            _ => None,
        };
        let mut load = |place: &Option<TextureRef>, transfer| {
            place.as_ref().map(|place| self.texture(place, transfer)).transpose()
        };
        Ok(RenderMaterial {
            surface,
            base_color_factor: m.base_color_factor,
            base_color: load(&m.base_color, Transfer::Srgb)?,
            metallic_factor: m.metallic_factor,
            roughness_factor: m.roughness_factor,
            metallic_roughness: load(&m.metallic_roughness, Transfer::Linear)?,
            occlusion: load(&m.occlusion, Transfer::Linear)?,
            occlusion_strength: m.occlusion_strength,
            emissive_factor: m.emissive_factor,
            emissive: load(&m.emissive, Transfer::Srgb)?,
            skin: None,
            translucency: match &m.diffuse_transmission {
                Some(d) => Some(Translucency {
                    factor: d.factor,
                    map: load(&d.texture, Transfer::Linear)?,
                    color_factor: d.color_factor,
                    color: load(&d.color, Transfer::Srgb)?,
                }),
                None => None,
            },
            dielectric: match &m.dielectric {
                Some(d) => Some(RenderDielectric {
                    f0: d.color_factor * d.f0(),
                    strength: d.strength,
                    map: color_and_share(
                        load(&d.color, Transfer::Srgb)?,
                        load(&d.strength_texture, Transfer::Linear)?,
                    ),
                }),
                None => None,
            },
            alpha_mode: m.alpha_mode,
            double_sided: m.double_sided,
            detail,
            fuzz: match &m.fuzz {
                None => None,
                Some(fuzz) => {
                    let (color, amount) = match fuzz {
                        Fuzz::Layer(l) => (&l.color_texture, &l.density_texture),
                        Fuzz::Simple { texture, .. } => (&None, texture),
                    };
                    Some(RenderFuzz {
                        fuzz: fuzz.clone(),
                        direction: fibres,
                        color: load(color, Transfer::Srgb)?,
                        amount: load(amount, Transfer::Linear)?,
                        fits: None,
                        talk_ambient: false,
                    })
                }
            },
            transmission: m.transmission,
        })
    }
}
