//! The textures that a renderer draws a scene's surfaces with.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use kinran::bake::{Together, together, why_apart};
use kinran::options::TextureOptions;
use kinran_bake::aniso::{
    Filter, NormalMap, Reflectance, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps,
    SurfaceOptions, TexelSpan, Weights, bake_surface,
};
use kinran_bake::fuzz_fit::{FuzzFit, Phase, ambient_texels, fuzz_fit};
use kinran_bake::metal::{BaseAndMetal, specular_white};
use kinran_bake::{MaterialSurface, NoSurface, Rgba8Level, material_reflectance, material_surface};
use kinran_image::{Cancelled, Format, Level, Role, Texture, Transfer, full_level_count, level_size};
use kinran_render::reference::{
    AnisoEncoding, BoundTexture, ColorTextures, FUZZ_TILTS, FuzzCoefficients, FuzzFits, MipLevel, MipTexture,
    RenderDielectric, SurfaceTextures,
};
use kinran_scene::{FuzzPhase, Material, Scene, TextureRef};
use kinran_shading::fuzz::{FUZZ_COMBED_ALPHA, fuzz_alpha};
use rayon::prelude::*;

use crate::progress::Bars;
use crate::{Error, Progress};

/// How colour, metalness and lobe of a surface are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Colors {
    /// Each map by itself.
    Apart,
    /// Together, where they can be.
    Together,
    /// Together, and with a specular colour, as `--separate-specular` has it.
    Separate,
}

/// A way to make mips.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Method {
    /// How a footprint becomes one texel.
    pub filter: Filter,
    /// How colours go with it.
    pub colors: Colors,
}

impl Method {
    /// As a bake has it: a filter that knows nothing of metal takes each map by itself.
    pub fn new(filter: Filter, correlated: bool) -> Self {
        Method::of(filter, if correlated { Colors::Together } else { Colors::Apart })
    }

    /// As [`Self::new`].
    pub fn of(filter: Filter, colors: Colors) -> Self {
        let mut options = TextureOptions::default();
        (options.filter, options.correlated) = (filter, colors != Colors::Apart);
        Method { filter, colors: if options.is_correlated() { colors } else { Colors::Apart } }
    }

    /// The filter's name; with `-apart` where it would filter colour, metalness and lobe together, and does not, and with
    /// `-separate` where there is a specular colour too.
    pub fn name(self) -> &'static str {
        let [together, apart, separate] = match self.filter {
            Filter::Ml => ["ml", "ml-apart", "ml-separate"],
            Filter::Dpd => ["dpd", "dpd-apart", "dpd-separate"],
            Filter::Linear => ["linear", "linear-apart", "linear-separate"],
            Filter::Param => ["param", "param-apart", "param-separate"],
            Filter::Lean => ["lean", "lean-apart", "lean-separate"],
            Filter::Naive => ["naive"; 3],
        };
        match self.colors {
            Colors::Together => together,
            Colors::Apart => apart,
            Colors::Separate => separate,
        }
    }
}

/// Which texels surfaces are drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mips {
    /// A filter's mip chain as it is after block compression: BC5 normals, BC7 aniso. Colours are not compressed.
    Filtered(Method),
    /// The same mip chain in floats.
    Uncompressed(Method),
    /// Level 0 of normals and lobes, in floats, with what texels count in a filter as alpha of the normals; colours as they are
    /// filtered with the lobes, or by themselves.
    Colors(Colors),
    /// Level 0 alone, in floats: ground truth.
    Level0,
    /// The mip chains that came with the model in KTX2 or DDS files, as they are; materials without any as
    /// [`Mips::DEFAULT`] has them.
    Baked,
}

impl Mips {
    /// What a bake makes that is not told how.
    pub const DEFAULT: Mips = Mips::Filtered(Method { filter: Filter::Ml, colors: Colors::Together });

    /// The method's name, `baked`, or `truth`.
    pub fn name(self) -> &'static str {
        match self {
            Mips::Filtered(method) | Mips::Uncompressed(method) => method.name(),
            Mips::Colors(_) => "colours",
            Mips::Level0 => "truth",
            Mips::Baked => "baked",
        }
    }

    /// What a model is drawn with unless someone asks for something else: its own mips if it has any.
    pub fn of(scene: &Scene) -> Self {
        let baked = scene.materials.iter().any(|m| baked_maps(scene, m).is_some());
        if baked { Mips::Baked } else { Mips::DEFAULT }
    }

    fn colors(self) -> Colors {
        match self {
            Mips::Filtered(method) | Mips::Uncompressed(method) => method.colors,
            Mips::Colors(colors) => colors,
            Mips::Level0 | Mips::Baked => Colors::Apart,
        }
    }

    /// With colour, metalness and lobe filtered together, or each by itself.
    pub fn correlated(self, correlated: bool) -> Self {
        match self {
            Mips::Filtered(method) => Mips::Filtered(Method::new(method.filter, correlated)),
            mips => mips,
        }
    }
}

/// Surface textures of every material of `scene`, `None` for isotropic ones without a normal and a roughness map, and a
/// sentence for each material whose maps could not be filtered together.
///
/// # Errors
/// [`Error::Image`] where an encoder refuses.
pub fn scene_surfaces(
    scene: &Scene,
    mips: Mips,
    progress: &Progress,
) -> Result<(Vec<Option<SurfaceTextures>>, Vec<String>), Error> {
    let mut warnings = Vec::new();
    let surfaces = (0..scene.materials.len()).map(|i| {
        let mips = match mips {
            Mips::Baked => match baked_surface(scene, &scene.materials[i])? {
                Some(surface) => return Ok(Some(surface)),
                None => Mips::DEFAULT,
            },
            mips => mips,
        };
        match material_surface(scene, i) {
            Ok(surface) => {
                let sheets = [Sheet::Normal, Sheet::Aniso];
                let name = &scene.materials[i].name;
                let together = filtered_together(scene, i, &surface, mips, &mut warnings, progress)?;
                let [normal, aniso] = textures(&together.maps, sheets, mips, name, progress)?;
                let place = surface.place.as_ref();
                let [normal, aniso] = [normal, aniso].map(|t| bind(t, place));
                let colors = together.pair.map(|pair| colors(pair, &surface)).transpose()?;
                Ok(Some(SurfaceTextures { colors, ..SurfaceTextures::new(normal, aniso) }))
            }
            Err(NoSurface::Plain) => Ok(None),
            Err(NoSurface::Apart(reason)) => {
                warnings.push(reason);
                separate_surface(scene, &scene.materials[i], mips, progress).map(Some)
            }
        }
    });
    let surfaces = surfaces.collect::<Result<_, Error>>()?;
    Ok((surfaces, warnings))
}

/// The maps of a surface with their weights, and its base colour and metalness, as a bake of all its textures makes them.
fn filtered_together(
    scene: &Scene,
    material: usize,
    surface: &MaterialSurface,
    mips: Mips,
    warnings: &mut Vec<String>,
    progress: &Progress,
) -> Result<Together, Error> {
    if mips.colors() == Colors::Apart {
        return Ok(Together { maps: surface.maps.clone(), pair: None });
    }
    let Material { name, dielectric, .. } = &scene.materials[material];
    let separate = mips.colors() == Colors::Separate && dielectric.is_none();
    let reflectance = material_reflectance(scene, material, surface).unwrap_or_else(|reason| {
        warnings.push(reason);
        None
    });
    let mut maps = surface.maps.clone();
    maps.weights = reflectance.as_ref().and_then(|of| of.weights(maps.size())).map(Arc::new);
    let reflectance = reflectance.filter(|_| maps.weights.is_some());
    let apart = |of: &Reflectance| why_apart(&format!("material \"{name}\""), of, &maps);
    warnings.extend(reflectance.as_ref().and_then(apart));
    let (kernel, bars) = (SurfaceOptions::default().kernel, Bars::new(progress.clone()));
    Ok(together(&maps, reflectance.as_ref(), None, separate, name, kernel, bars.task())?)
}

/// Whether any material's maps are filtered together: what it reflects differs from texel to texel.
pub(crate) fn has_mixed(scene: &Scene) -> bool {
    (0..scene.materials.len()).any(|i| {
        let weights = |surface: MaterialSurface| {
            let reflectance = material_reflectance(scene, i, &surface).ok().flatten()?;
            reflectance.weights(surface.maps.size())
        };
        material_surface(scene, i).is_ok_and(|surface| weights(surface).is_some())
    })
}

/// Base colour, metalness and specular colour as textures, in 8 bits.
fn colors(pair: BaseAndMetal, surface: &MaterialSurface) -> Result<ColorTextures, Error> {
    let place = surface.place.as_ref();
    let color = |levels: Vec<Rgba8Level>| -> Result<BoundTexture, Error> {
        let level = |level: Rgba8Level| Level { width: level.width, height: level.height, data: level.rgba8 };
        let texture = Texture {
            format: Format::Rgba8,
            transfer: Transfer::Srgb,
            levels: levels.into_iter().map(level).collect(),
            metadata: BTreeMap::new(),
        };
        Ok(bind(Arc::new(MipTexture::from_texture(&texture, surface.maps.wrap)?), place))
    };
    let ((width, height), wrap) = (surface.maps.size(), surface.maps.wrap);
    let levels = (0..).zip(pair.metallic).map(|(level, metallic)| MipLevel {
        width: level_size(width, level),
        height: level_size(height, level),
        texels: metallic.into_iter().map(|m| [1.0, 1.0, f32::from(m) / 255.0, 1.0]).collect(),
    });
    let metallic = MipTexture { levels: levels.collect(), wrap, encoded: None };
    let dielectric =
        |map| RenderDielectric { f0: Vec3::splat(specular_white()), strength: 1.0, map: Some(map) };
    let specular = Some(pair.specular).filter(|levels| !levels.is_empty());
    Ok(ColorTextures {
        base_color: color(pair.color)?,
        metallic: bind(Arc::new(metallic), place),
        dielectric: specular.map(color).transpose()?.map(dielectric),
    })
}

/// Where a material's own runtime textures of normals and roughness are, `None` for what it has no map of, and how they hold
/// roughness. `None` where it has none of the maps that are filtered together, or one of them as an image only.
fn baked_maps<'a>(
    scene: &Scene,
    m: &'a Material,
) -> Option<(Option<&'a TextureRef>, Option<&'a TextureRef>, AnisoEncoding)> {
    let is_image = |place: &TextureRef| runtime(scene, place).is_none();
    let anisotropy = m.anisotropy.as_ref().filter(|a| a.strength > 0.0);
    let anisotropy_map = anisotropy.and_then(|a| a.texture.as_ref());
    let normal = m.normal.as_ref();
    let roughness = m.metallic_roughness.as_ref();
    if (normal.is_none() && m.aniso.is_none() && anisotropy_map.is_none() && roughness.is_none())
        || m.normal_scale != 1.0
        || normal.is_some_and(is_image)
    {
        return None;
    }
    if let Some(aniso) = m.aniso.as_ref().filter(|place| !is_image(place)) {
        return Some((normal, Some(aniso), AnisoEncoding::Texel));
    }
    if roughness.into_iter().chain(anisotropy_map).any(is_image) {
        return None;
    }
    let strength = anisotropy.map_or(0.0, |a| a.strength);
    let rotation = anisotropy.map_or(0.0, |a| a.rotation);
    Some((normal, anisotropy_map, AnisoEncoding::Khr { strength, rotation }))
}

fn runtime<'a>(scene: &'a Scene, place: &TextureRef) -> Option<&'a Arc<Texture>> {
    scene.textures.get(place.runtime?)?.as_ref()
}

/// The surface that a material's own runtime textures hold, see [`baked_maps`].
fn baked_surface(scene: &Scene, m: &Material) -> Result<Option<SurfaceTextures>, Error> {
    let Some((normal, aniso, encoding)) = baked_maps(scene, m) else { return Ok(None) };
    let bound = |place: Option<&TextureRef>, texel: [f32; 4]| -> Result<BoundTexture, Error> {
        match place.and_then(|place| Some((place, runtime(scene, place)?))) {
            Some((place, texture)) => {
                let is_normal = normal.is_some_and(|normal| std::ptr::eq(normal, place));
                let mut mips = MipTexture::from_texture(texture, place.wrap)?;
                if is_normal && !texture.metadata.contains_key("KinranMap") {
                    unit_normals(texture.format, &mut mips);
                }
                Ok(BoundTexture::new(Arc::new(mips), place))
            }
            None => Ok(BoundTexture::constant(texel)),
        }
    };
    // Where there is no map, it is flat, or round: a direction along the tangent.
    let normal = bound(normal, [0.5, 0.5, 1.0, 1.0])?;
    let aniso = bound(aniso, [1.0, 0.5, 1.0, 1.0])?;
    Ok(Some(SurfaceTextures { normal, aniso, encoding, colors: None }))
}

/// Brings vectors of red, green and blue to unit length together, as glTF has it, since shaders rebuild z. Kinran's own
/// textures have that length, and what has two channels has no other z.
fn unit_normals(format: Format, mips: &mut MipTexture) {
    if matches!(format, Format::Bc4 | Format::Bc5) {
        return;
    }
    for texel in mips.levels.iter_mut().flat_map(|level| &mut level.texels) {
        let [x, y, z, _] = texel.map(|c| 2.0 * c - 1.0);
        let n = Vec3::new(x, y, z.max(0.0)).normalize_or(Vec3::Z);
        [texel[0], texel[1], texel[2]] = (0.5 * n + 0.5).to_array();
    }
    mips.encoded = None;
}

/// A texture in its place; one of a single texel needs none.
fn bind(texture: Arc<MipTexture>, place: Option<&TextureRef>) -> BoundTexture {
    match place {
        Some(place) => BoundTexture::new(texture, place),
        None => BoundTexture { texture, ..BoundTexture::constant([0.0; 4]) },
    }
}

/// The sheets of a surface as decoded mip chains.
fn textures<const N: usize>(
    maps: &SurfaceMaps,
    sheets: [Sheet; N],
    mips: Mips,
    name: &str,
    progress: &Progress,
) -> Result<[Arc<MipTexture>; N], Error> {
    let size = maps.size();
    let (method, format) = match mips {
        // A single texel has nothing to filter, and a factor is not to be rounded to 8 bits.
        Mips::Filtered(method) if size != (1, 1) => (method, None),
        Mips::Uncompressed(method) if size != (1, 1) => (method, Some(Format::Rgba16F)),
        // What is baked already never comes here.
        _ => return Ok(level_0(maps, sheets).map(Arc::new)),
    };
    let requests = sheets.map(|sheet| {
        let role = if sheet == Sheet::Normal { Role::Normal } else { Role::Aniso };
        let encoding = TextureOptions::default().encoding(role, format);
        SheetRequest { sheet, encoding, packed_with: None }
    });
    let texels = (0..full_level_count(size.0, size.1))
        .map(|level| u64::from(level_size(size.0, level)) * u64::from(level_size(size.1, level)))
        .sum();
    let stage = progress.stage(format!("{} {name}", method.name()), texels);
    let options = SurfaceOptions { filter: method.filter, ..SurfaceOptions::default() };
    let baked = bake_surface(maps, options, &requests, &|texels| stage.tick(texels))?;
    let decoded: Vec<_> = baked
        .textures
        .iter()
        .map(|texture| MipTexture::from_texture(texture, maps.wrap).map(Arc::new))
        .collect::<Result<_, _>>()?;
    decoded.try_into().map_err(|_| Error::Internal("a sheet that was asked for was not baked".into()))
}

/// The authored texels, uncompressed, and what they count in alpha: 1 where that is not said.
fn level_0<const N: usize>(maps: &SurfaceMaps, sheets: [Sheet; N]) -> [MipTexture; N] {
    let (width, height) = maps.size();
    let rows: Vec<[Vec<[f32; 4]>; N]> = (0..height)
        .into_par_iter()
        .map_init(TexelSpan::default, |span, y| {
            maps.decode_span((width, height), y, 0, width as usize, span);
            let texel = |sheet: Sheet, i: usize| {
                let (n, a) = span.texel(i);
                let [r, g, b] = sheet.encode(n, a);
                let weight = |weights: &Arc<Weights>| f32::from(weights.at(i as u32, y)) / 65535.0;
                [r, g, b, maps.weights.as_ref().map_or(1.0, weight)]
            };
            sheets.map(|sheet| (0..span.len()).map(|i| texel(sheet, i)).collect())
        })
        .collect();
    std::array::from_fn(|sheet| {
        let texels = rows.iter().flat_map(|row| &row[sheet]).copied().collect();
        MipTexture { levels: vec![MipLevel { width, height, texels }], wrap: maps.wrap, encoded: None }
    })
}

/// Normals and roughness that lie on the mesh in different ways, each filtered by itself. Roughness is then
/// relative to a flat normal map: exact for isotropic materials, and close for others where bumps are low. A
/// roughness map that lies apart from an anisotropy map is left out.
fn separate_surface(
    scene: &Scene,
    m: &Material,
    mips: Mips,
    progress: &Progress,
) -> Result<SurfaceTextures, Error> {
    let image = |place: Option<&TextureRef>| scene.images.get(place?.image)?.clone();
    let anisotropy = m.anisotropy.as_ref().filter(|a| a.strength > 0.0);
    let anisotropy_place = anisotropy.and_then(|a| a.texture.as_ref());
    let roughness_place = m.metallic_roughness.as_ref();
    let roughness_place = roughness_place.filter(|r| anisotropy_place.is_none_or(|a| a.lies_as(r)));

    let roughness =
        ScalarMap { image: image(roughness_place).map(|image| (image, 1)), factor: m.roughness_factor };
    let roughness = match anisotropy {
        Some(a) => RoughnessMaps::Khr {
            roughness,
            strength: a.strength,
            rotation: a.rotation,
            texture: image(anisotropy_place),
        },
        None => RoughnessMaps::Isotropic(roughness),
    };
    let bound = |sheet, place: Option<&TextureRef>, normal, roughness| -> Result<BoundTexture, Error> {
        let wrap = place.map_or([kinran_scene::Wrap::Repeat; 2], |place| place.wrap);
        let maps = SurfaceMaps { normal, roughness, wrap, weights: None };
        let [texture] = textures(&maps, [sheet], mips, &m.name, progress)?;
        Ok(bind(texture, place))
    };
    let normal =
        image(m.normal.as_ref()).map_or_else(NormalMap::flat, |image| NormalMap::gltf(image, m.normal_scale));
    let smooth = RoughnessMaps::Isotropic(ScalarMap::constant(1.0));
    Ok(SurfaceTextures::new(
        bound(Sheet::Normal, m.normal.as_ref(), normal, smooth)?,
        bound(Sheet::Aniso, anisotropy_place.or(roughness_place), NormalMap::flat(), roughness)?,
    ))
}

/// Coefficients of layers of fibres, for [`RenderScene::fit_fuzz`](kinran_render::reference::RenderScene::fit_fuzz): some
/// 200 ms of one core, and 1.6 s more for combed fibres. The last ones are kept.
///
/// # Errors
/// Where `progress` stops the work.
pub fn fuzz_fits(phase: FuzzPhase, spread: f32, progress: &Progress) -> Result<Arc<FuzzFits>, Cancelled> {
    static LAST: Mutex<Option<(FuzzPhase, f32, Arc<FuzzFits>)>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, at, fits)) = &*last
        && (*of, *at) == (phase, spread)
    {
        return Ok(fits.clone());
    }
    let named = match phase {
        FuzzPhase::Fibre => Phase::Fibre,
        FuzzPhase::Velvet => Phase::Velvet,
    };
    let tilts: Vec<f64> = (0..FUZZ_TILTS).map(|i| FRAC_PI_2 * i as f64 / (FUZZ_TILTS - 1) as f64).collect();
    let combed = fuzz_alpha(spread) < FUZZ_COMBED_ALPHA;
    let stage = progress.stage("fitting fuzz", if combed { 2 } else { 1 } * FUZZ_TILTS as u64);
    let fits = (tilts.par_iter())
        .map(|&tilt| {
            let fit = fuzz_fit(named, tilt, spread.into());
            stage.tick(1)?;
            Ok(fit)
        })
        .collect::<Result<Vec<FuzzFit>, Cancelled>>()?;
    let tables = (tilts.par_iter().filter(|_| combed))
        .map(|&tilt| {
            let texels = ambient_texels(named, tilt, spread.into());
            stage.tick(1)?;
            Ok(texels)
        })
        .collect::<Result<Vec<_>, Cancelled>>()?;
    let table = combed.then(|| tables.concat());
    let tilts = std::array::from_fn(|i| FuzzCoefficients {
        p_s: fits[i].p_s.coefficients,
        ambient: fits[i].ambient.coefficients,
        direction: fits[i].direction.coefficients,
        r: fits[i].r.coefficients[0],
    });
    let fits = Arc::new(FuzzFits { tilts, table });
    *last = Some((phase, spread, fits.clone()));
    Ok(fits)
}
