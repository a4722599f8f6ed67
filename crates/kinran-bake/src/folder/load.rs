//! Maps of a material, read and brought into the form that the filters take.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use kinran_image::{Channels, Disk, Files, Image, Pixels, Transfer, decode_layer};
use kinran_scene::Wrap;
use kinran_shading::{alpha_from_roughness, alphas_from_khr_anisotropy};
use rayon::prelude::*;

use super::evidence::{
    below_surface, colored, green_correlation, guess_by_correlation, has_alpha, is_grey, is_signed,
    not_normals, odd_lengths, outside_unit,
};
use super::{
    BaseRoughness, CUT_OUT, DirectionSource, FolderError, Green, GreenGuess, GreenSource, LevelSource,
    MapChannel, MaterialMaps, NormalSource, Role, RoughnessSource,
};
use crate::aniso::{
    ColorMap, Dielectric, DirectionMap, NormalMap, NormalZ, Reflectance, ReflectanceMaps, RoughnessMaps,
    ScalarMap, SurfaceMaps,
};
use crate::channels::{Place, read_channel};

/// A file that a material uses.
#[derive(Clone, Debug)]
pub struct LoadedMap {
    /// What it holds.
    pub role: Role,
    /// Where it was read.
    pub path: PathBuf,
    /// BLAKE3 of the file's bytes, in hexadecimal digits.
    pub blake3: String,
    /// Its samples.
    pub image: Arc<Image>,
    /// What was chosen when it was read, a part of a sentence each: the layer, how colour is encoded.
    pub remarks: Vec<String>,
}

/// A material with its images in memory.
#[derive(Clone, Debug)]
pub struct LoadedMaterial {
    /// Its name.
    pub name: String,
    /// Normals and roughness; absent where neither has a map.
    pub surface: Option<SurfaceMaps>,
    /// Every file that is used, those of the surface among them, by role.
    pub images: Vec<LoadedMap>,
    /// Occlusion: which of `images`, and its channel.
    pub occlusion: Option<(usize, usize)>,
    /// Metalness: which of `images`, and its channel.
    pub metallic: Option<(usize, usize)>,
    /// What was assumed and may be wrong, from names and texels; a sentence each that names the material or the file.
    pub notes: Vec<String>,
}

impl LoadedMaterial {
    /// What its texels reflect: by base colour and metalness, or by the specular colour beside gloss. `None` where neither is
    /// there, so that all of it is a dielectric.
    pub fn reflectance(&self) -> Option<Reflectance> {
        let of = |role| self.images.iter().find(|map| map.role == role).map(|map| map.image.clone());
        let color = |image| ColorMap { image, factor: Vec3::ONE };
        let wrap = self.surface.as_ref()?.wrap;
        let maps = match self.metallic {
            Some((i, channel)) => ReflectanceMaps::Metallic {
                base: color(Some(of(Role::Color)?)),
                metallic: ScalarMap::channel(self.images[i].image.clone(), channel),
                dielectric: Dielectric::default(),
            },
            None => ReflectanceMaps::Specular(color(Some(of(Role::SpecularSmoothness)?))),
        };
        Some(Reflectance { maps, wrap })
    }
}

/// Alphas along and across the direction, of a perceptual roughness and a level of anisotropy.
type AlphaLaw = fn(f32, f32) -> (f32, f32);

/// A file that was read.
#[derive(Clone)]
pub(super) struct ReadImage {
    image: Arc<Image>,
    /// Of its bytes.
    blake3: String,
}

/// Files already read, by path.
pub(super) type Images = BTreeMap<PathBuf, ReadImage>;

impl MaterialMaps {
    /// Reads every map and checks that it holds what its name says. Maps may differ in size.
    ///
    /// # Errors
    /// [`FolderError::Image`] where a file cannot be read; [`FolderError::Unfit`] where a normal map is none,
    /// its unlabelled green clearly points down, or a direction or anisotropy map has not the channels it
    /// needs.
    pub fn load(&self) -> Result<LoadedMaterial, FolderError> {
        self.load_in(&Disk)
    }

    /// As [`MaterialMaps::load`], of maps that may be elsewhere than on a disk.
    ///
    /// # Errors
    /// As [`MaterialMaps::load`].
    pub fn load_in(&self, files: &dyn Files) -> Result<LoadedMaterial, FolderError> {
        let (mut images, mut notes) = (Images::new(), self.warnings.clone());
        self.settled(files, &mut images, &mut notes)?.load_settled(files, images, notes)
    }

    /// Loads maps whose twins were compared; `known` are images that were read for that.
    fn load_settled(
        &self,
        files: &dyn Files,
        known: Images,
        mut notes: Vec<String>,
    ) -> Result<LoadedMaterial, FolderError> {
        let paths: BTreeSet<&PathBuf> = self.files.iter().map(|(_, path)| path).collect();
        let read: Vec<Result<(PathBuf, ReadImage), FolderError>> = (paths.into_par_iter())
            .map(|path| {
                let read = known.get(path).cloned().map_or_else(|| self.read(files, path), Ok)?;
                Ok((path.clone(), read))
            })
            .collect();
        // Of several errors the first file's, whichever was read first.
        let images: Images = read.into_iter().collect::<Result<_, FolderError>>()?;
        drop(known);
        let mut loaded: Vec<LoadedMap> =
            (self.files.iter()).map(|(role, path)| self.loaded(*role, path, &images[path])).collect();
        let place = |map: &MapChannel| Some((loaded.iter().position(|l| l.path == map.file)?, map.channel));
        let (occlusion, metallic) =
            (self.occlusion.as_ref().and_then(place), self.metallic.as_ref().and_then(place));
        for map in [&self.occlusion, &self.metallic].into_iter().flatten() {
            channel(&images, map)?;
        }

        notes.extend(self.doubtful_numbers(&images));

        let surface = match &self.roughness {
            None => None,
            Some(source) => {
                let mut remarks = Vec::new();
                let normal = match &self.normal {
                    Some(source) => {
                        normal_map(source, &images[&source.file].image, &mut notes, &mut remarks)?
                    }
                    None => NormalMap::flat(),
                };
                let roughness = roughness_maps(source, &images, self.wrap)?;
                let maps = SurfaceMaps { normal, roughness, wrap: self.wrap, weights: None };
                let size = maps.size();
                for map in loaded.iter_mut().filter(|map| is_of_surface(map.role)) {
                    if map.role == Role::Normal {
                        map.remarks.append(&mut remarks);
                    }
                    let own = (map.image.width, map.image.height);
                    if own != size {
                        let [from, to] = [own, size].map(|(width, height)| format!("{width}x{height}"));
                        map.remarks.push(format!("{from}, enlarged to {to}, the size of the largest"));
                    }
                }
                Some(maps)
            }
        };
        Ok(LoadedMaterial { name: self.name.clone(), surface, images: loaded, occlusion, metallic, notes })
    }
}

impl MaterialMaps {
    /// A file, read once.
    pub(super) fn read_once(
        &self,
        files: &dyn Files,
        images: &mut Images,
        path: &Path,
    ) -> Result<Arc<Image>, FolderError> {
        if let Some(read) = images.get(path) {
            return Ok(read.image.clone());
        }
        let read = self.read(files, path)?;
        let image = read.image.clone();
        images.insert(path.into(), read);
        Ok(image)
    }

    /// An image: of an EXR file the layer that a flag names, colour encoded as a flag says.
    fn read(&self, files: &dyn Files, path: &Path) -> Result<ReadImage, FolderError> {
        let bytes = files.read(path).map_err(|e| kinran_image::Error::io(path, e))?;
        let layer = self.layers.iter().rev().find(|(file, _)| file == path).map(|(_, layer)| layer.as_str());
        let mut image = decode_layer(path, &bytes, layer)?;
        if let Some(space) = self.color_space.filter(|_| self.color.as_deref() == Some(path)) {
            image.transfer = space;
        }
        Ok(ReadImage { image: Arc::new(image), blake3: blake3::hash(&bytes).to_hex().to_string() })
    }

    /// What the texels of maps of numbers say against them: numbers that no such map holds, and colour where grey is wanted.
    fn doubtful_numbers(&self, images: &Images) -> Vec<String> {
        let mut notes = Vec::new();
        for (what, map) in self.numbers() {
            let file = super::file_name(&map.file);
            let outside = outside_unit(&images[&map.file].image, &[map.channel]);
            notes.extend(outside.map(|outside| format!("{file}, its {what}: {outside}")));
            let is_alone = self.files.iter().any(|(role, path)| *path == map.file && !role.is_packed());
            if let Some(colored) = colored(&images[&map.file].image).filter(|_| is_alone && map.channel == 0)
            {
                notes.push(format!(
                    "{file}: {colored}, though a map of {what} is grey; red is taken, name it with --map ROLE={file} if it \
                     holds something else"
                ));
            }
        }
        if let Some(file) = self.vectors().filter(|file| is_signed(&images[*file].image)) {
            notes.push(format!(
                "{}: it holds negative numbers, so red and green are taken as -1 to 1, not as 0 to 1",
                super::file_name(file)
            ));
        }
        let wholes = [(&self.color, "colour", 4), (&self.encoded(), "aniso texels", 3)];
        for (file, what, channels) in wholes {
            let Some(file) = file else { continue };
            let outside = outside_unit(&images[file].image, &[0, 1, 2, 3][..channels]);
            notes.extend(outside.map(|outside| format!("{}, its {what}: {outside}", super::file_name(file))));
        }
        notes
    }

    fn encoded(&self) -> Option<PathBuf> {
        match &self.roughness {
            Some(RoughnessSource::Encoded(file)) => Some(file.clone()),
            _ => None,
        }
    }

    /// The maps of numbers from 0 to 1, each with its name.
    fn numbers(&self) -> Vec<(&'static str, MapChannel)> {
        let red = |file: &PathBuf| MapChannel { file: file.clone(), channel: 0 };
        let mut numbers = Vec::new();
        numbers.extend(self.occlusion.clone().map(|map| ("occlusion", map)));
        numbers.extend(self.metallic.clone().map(|map| ("metalness", map)));
        let (base, direction) = match &self.roughness {
            None | Some(RoughnessSource::Encoded(_)) => (None, None),
            Some(RoughnessSource::Isotropic(base)) => (Some(base), None),
            Some(RoughnessSource::GlossUv { u, v, direction }) => {
                numbers.extend([("gloss along", red(u)), ("gloss across", red(v))]);
                (None, direction.as_ref())
            }
            Some(RoughnessSource::Level { base, level, direction }) => {
                if let LevelSource::Adobe(file) = level {
                    numbers.push(("anisotropy level", red(file)));
                }
                (Some(base), direction.as_ref())
            }
            Some(RoughnessSource::Khr { base, texture }) => {
                numbers.push(("anisotropy strength", MapChannel { file: texture.clone(), channel: 2 }));
                (Some(base), None)
            }
        };
        match base {
            Some(BaseRoughness::Roughness(map)) => numbers.push(("roughness", map.clone())),
            Some(BaseRoughness::Gloss(map)) => numbers.push(("gloss", map.clone())),
            Some(BaseRoughness::Constant(_)) | None => {}
        }
        let angle = direction.filter(|direction| direction.angle);
        numbers.extend(angle.map(|direction| ("angle", red(&direction.file))));
        numbers
    }

    /// The map whose red and green are a direction.
    fn vectors(&self) -> Option<&PathBuf> {
        match &self.roughness {
            Some(
                RoughnessSource::GlossUv { direction: Some(direction), .. }
                | RoughnessSource::Level { direction: Some(direction), .. },
            ) if !direction.angle => Some(&direction.file),
            Some(RoughnessSource::Khr { texture, .. }) => Some(texture),
            _ => None,
        }
    }

    fn loaded(&self, role: Role, path: &Path, read: &ReadImage) -> LoadedMap {
        let image = read.image.clone();
        let mut remarks = image.notes.clone();
        let space = if image.transfer == Transfer::Linear { "linear" } else { "sRGB" };
        match (role, image.transfer) {
            (Role::Color, _) if self.color_space.is_some() => {
                remarks.push(format!("{space}, by --color-space"))
            }
            (Role::Color, Transfer::Linear) => {
                remarks.push("taken as linear; say --color-space srgb if it is not".into());
            }
            (Role::Color, Transfer::Srgb) => remarks.push("sRGB, as its file says".into()),
            (_, Transfer::Srgb) => {
                remarks.push("sRGB by its file, which no data are; taken as stored".into())
            }
            _ => {}
        }
        let reads_alpha = role == Role::Color
            || [Role::Gloss, Role::Roughness]
                .iter()
                .any(|quantity| role.packed_channel(*quantity) == Some(3));
        if role == Role::Color && has_alpha(&image) {
            remarks.push(CUT_OUT.into());
        }
        if !reads_alpha && has_alpha(&image) {
            remarks.push("its alpha is not 1 everywhere and is not read".into());
        }
        LoadedMap { role, path: path.into(), blake3: read.blake3.clone(), image, remarks }
    }
}

fn unfit(path: &Path, reason: impl Into<String>, fix: impl Into<String>) -> FolderError {
    FolderError::Unfit { path: path.into(), reason: reason.into(), fix: fix.into() }
}

/// Whether maps of a role are brought to one size and filtered together.
fn is_of_surface(role: Role) -> bool {
    use Role::{
        Anisotropy, AnisotropyLevel, Direction, DirectionAngle, Gloss, GlossU, GlossV, Normal, Roughness,
    };
    matches!(
        role,
        Normal
            | Roughness
            | Gloss
            | GlossU
            | GlossV
            | Direction
            | DirectionAngle
            | Anisotropy
            | AnisotropyLevel
    )
}

/// A normal map, after a look at its texels; `remarks` are about it, `notes` what may be wrong with it.
fn normal_map(
    source: &NormalSource,
    image: &Arc<Image>,
    notes: &mut Vec<String>,
    remarks: &mut Vec<String>,
) -> Result<NormalMap, FolderError> {
    let file = &source.file;
    match not_normals(image) {
        Some(reason) if source.force => {
            remarks.push(format!("a normal map by --force-normal, though {reason}"))
        }
        Some(reason) => {
            return Err(unfit(
                file,
                format!("this is not a tangent-space normal map: {reason}"),
                "name the right file with --map normal=FILE, or say --force-normal if it is one nevertheless",
            ));
        }
        None => {}
    }

    let correlation = green_correlation(image);
    let guess = guess_by_correlation(correlation);
    let name = super::file_name(file);
    match (guess.contradicts(source.green), source.green_source) {
        (true, GreenSource::Assumed) => {
            return Err(unfit(
                file,
                format!(
                    "its name does not say which way green points, and its slopes say downwards (correlation \
                     {correlation:.2}, a +Y map is above 0)"
                ),
                "say --y-down if they are right (DirectX, Unreal), --y-up if they are not",
            ));
        }
        (true, GreenSource::Name | GreenSource::Flag) => {
            let (said, seen) = match source.green {
                Green::Up => ("+Y", "-Y"),
                Green::Down => ("-Y", "+Y"),
            };
            let by = if source.green_source == GreenSource::Name { "name" } else { "flag" };
            notes.push(format!(
                "{name}: taken as {said} by its {by}, though its slopes look like {seen} (correlation \
                 {correlation:.2})"
            ));
        }
        (false, GreenSource::Assumed) if guess == GreenGuess::Unsure => {
            notes.push(format!("{name}: assumed +Y; its slopes do not tell, say --y-down if it is DirectX"));
        }
        (false, GreenSource::Assumed) => remarks.push("its slopes agree".into()),
        // Texels have the last word where they are asked.
        (_, GreenSource::Texels) | (false, _) => {}
    }
    if let Some(lengths) = odd_lengths(image) {
        notes.push(match source.z {
            NormalZ::Rebuilt => format!(
                "{name}: {lengths}; z is rebuilt from red and green, say --normal-blue if blue is right, as it is in glTF"
            ),
            NormalZ::Blue => format!("{name}: {lengths}; red, green and blue are brought to it together"),
        });
    }
    if let Some(below) = below_surface(image) {
        notes.push(match source.z {
            NormalZ::Rebuilt => {
                format!("{name}: {below}; z is rebuilt from red and green, so they are taken as pointing up")
            }
            NormalZ::Blue => format!("{name}: {below}; they are laid on the surface"),
        });
    }
    Ok(NormalMap { z: source.z, ..NormalMap::new(image.clone(), source.green == Green::Down) })
}

/// One channel of a map as it is.
fn channel(images: &Images, map: &MapChannel) -> Result<ScalarMap, FolderError> {
    let image = &images[&map.file].image;
    let count = image.channels.count();
    let lacks = if map.channel < 3 { map.channel > 0 && count < 3 } else { count % 2 == 1 };
    if lacks {
        let name = ["red", "green", "blue", "alpha"][map.channel];
        return Err(unfit(
            &map.file,
            format!("it has no {name} channel, which should hold one of its quantities"),
            "name what it holds with --map ROLE=FILE, or leave it out with --ignore FILE",
        ));
    }
    // Grey with alpha keeps its alpha in the second channel.
    let channel = if map.channel == 3 && count == 2 { 1 } else { map.channel };
    if count == 2 && channel == 1 {
        let alpha = second_channel(image)?;
        return Ok(ScalarMap::channel(Arc::new(alpha), 0));
    }
    Ok(ScalarMap::channel(image.clone(), channel))
}

/// The alpha of a grey image, as a grey image.
fn second_channel(image: &Image) -> Result<Image, FolderError> {
    fn odd<T: Copy>(v: &[T]) -> Vec<T> {
        v.iter().skip(1).step_by(2).copied().collect()
    }
    let pixels = match &image.pixels {
        Pixels::U8(v) => Pixels::U8(odd(v)),
        Pixels::U16(v) => Pixels::U16(odd(v)),
        Pixels::F32(v) => Pixels::F32(odd(v)),
    };
    Ok(Image::new(image.width, image.height, Channels::R, pixels)?)
}

fn grey_file(images: &Images, file: &Path) -> ScalarMap {
    ScalarMap::channel(images[file].image.clone(), 0)
}

fn roughness_maps(
    source: &RoughnessSource,
    images: &Images,
    wrap: [Wrap; 2],
) -> Result<RoughnessMaps, FolderError> {
    Ok(match source {
        RoughnessSource::Isotropic(base) => match base {
            BaseRoughness::Constant(value) => RoughnessMaps::Isotropic(ScalarMap::constant(*value)),
            BaseRoughness::Roughness(map) => RoughnessMaps::Isotropic(channel(images, map)?),
            BaseRoughness::Gloss(map) => {
                let gloss = channel(images, map)?;
                RoughnessMaps::Gloss { u: gloss.clone(), v: gloss, direction: None }
            }
        },
        RoughnessSource::GlossUv { u, v, direction } => RoughnessMaps::Gloss {
            u: grey_file(images, u),
            v: grey_file(images, v),
            direction: direction_map(direction.as_ref(), images)?,
        },
        RoughnessSource::Level { base, level, direction } => {
            let (level, law): (ScalarMap, AlphaLaw) = match level {
                LevelSource::Strength(value) => (ScalarMap::constant(*value), alphas_from_khr_anisotropy),
                LevelSource::Adobe(file) => (grey_file(images, file), alphas_from_adobe),
            };
            let (u, v) = gloss_pair(base, &level, law, images, wrap)?;
            RoughnessMaps::Gloss { u, v, direction: direction_map(direction.as_ref(), images)? }
        }
        RoughnessSource::Khr { base, texture } => {
            let image = &unsigned(&images[texture].image);
            if is_grey(image) {
                return Err(unfit(
                    texture,
                    "it is grey, but an anisotropy map of glTF has a direction in red and green",
                    format!(
                        "say --map anisotropy-level={0} if it is Substance's level, --map direction={0} if it \
                         is a direction, or --ignore {0}",
                        super::file_name(texture)
                    ),
                ));
            }
            let khr = |roughness| RoughnessMaps::Khr {
                roughness,
                strength: 1.0,
                rotation: 0.0,
                texture: Some(image.clone()),
            };
            match base {
                BaseRoughness::Constant(value) => khr(ScalarMap::constant(*value)),
                BaseRoughness::Roughness(map) => khr(channel(images, map)?),
                BaseRoughness::Gloss(_) => {
                    let strength = ScalarMap::channel(image.clone(), 2);
                    let (u, v) = gloss_pair(base, &strength, alphas_from_khr_anisotropy, images, wrap)?;
                    RoughnessMaps::Gloss { u, v, direction: Some(DirectionMap::Vector(image.clone())) }
                }
            }
        }
        RoughnessSource::Encoded(file) => {
            if is_grey(&images[file].image) {
                return Err(unfit(
                    file,
                    "it is grey, but an aniso map has three different channels",
                    format!("say what it is with --map ROLE=FILE, or --ignore {}", super::file_name(file)),
                ));
            }
            RoughnessMaps::Encoded(images[file].image.clone())
        }
    })
}

/// Vector or angle, by whether the image is coloured; an angle needs its span.
fn direction_map(
    source: Option<&DirectionSource>,
    images: &Images,
) -> Result<Option<DirectionMap>, FolderError> {
    let Some(source) = source else { return Ok(None) };
    let image = &images[&source.file].image;
    Ok(Some(match (is_grey(image), source.span) {
        (true, Some(span)) => DirectionMap::Angle { map: ScalarMap::channel(image.clone(), 0), span },
        (true, None) => {
            return Err(unfit(
                &source.file,
                "it is a grey direction map, and nothing says whether white is a full or half a turn",
                "say --direction-span 360 or --direction-span 180",
            ));
        }
        (false, _) if source.angle => {
            return Err(unfit(
                &source.file,
                "it is named an angle but is not grey",
                format!(
                    "say --map direction={} if red and green are a vector",
                    super::file_name(&source.file)
                ),
            ));
        }
        (false, _) => DirectionMap::Vector(unsigned(image)),
    }))
}

/// A map of directions with red and green from 0 to 1, as they are in all but floats that hold negative numbers.
fn unsigned(image: &Arc<Image>) -> Arc<Image> {
    let mut image = image.clone();
    if is_signed(&image) {
        let own = Arc::make_mut(&mut image);
        let count = own.channels.count();
        if let Pixels::F32(samples) = &mut own.pixels {
            samples
                .chunks_exact_mut(count)
                .flat_map(|texel| &mut texel[..2])
                .for_each(|v| *v = *v * 0.5 + 0.5);
        }
    }
    image
}

/// Principal alphas of the Adobe Standard Material, `alpha_b = roughness²`, `alpha_t = min(1, alpha_b +
/// level⁴)` (Substance 3D Painter shader API, `lib-sampler`, ASM parametrisation).
fn alphas_from_adobe(roughness: f32, level: f32) -> (f32, f32) {
    let alpha_b = alpha_from_roughness(roughness);
    ((alpha_b + level * level * level * level).min(1.0), alpha_b)
}

/// Gloss along and across the direction, texel by texel from a roughness and a level, at the larger of
/// their sizes, in 16 bits; constants stay constants.
fn gloss_pair(
    base: &BaseRoughness,
    level: &ScalarMap,
    law: AlphaLaw,
    images: &Images,
    wrap: [Wrap; 2],
) -> Result<(ScalarMap, ScalarMap), FolderError> {
    let (base, is_gloss) = match base {
        BaseRoughness::Constant(value) => (ScalarMap::constant(*value), false),
        BaseRoughness::Roughness(map) => (channel(images, map)?, false),
        BaseRoughness::Gloss(map) => (channel(images, map)?, true),
    };
    let glosses = |base: f32, level: f32| {
        let roughness = if is_gloss { 1.0 - base } else { base };
        let (alpha_t, alpha_b) = law(roughness, level);
        (1.0 - alpha_t.sqrt(), 1.0 - alpha_b.sqrt())
    };
    let sources = [&base, level];
    let size = sources
        .iter()
        .filter_map(|map| map.image.as_ref())
        .fold((0, 0), |(w, h), (image, _)| (w.max(image.width), h.max(image.height)));
    if size.0 == 0 {
        let (u, v) = glosses(base.factor, level.factor);
        return Ok((ScalarMap::constant(u), ScalarMap::constant(v)));
    }

    let mut rows = [vec![0.0f32; size.0 as usize], vec![0.0f32; size.0 as usize]];
    let texels = size.0 as usize * size.1 as usize;
    let (mut along, mut across) = (Vec::with_capacity(texels), Vec::with_capacity(texels));
    let to_u16 = |v: f32| (v * 65535.0).round() as u16;
    for y in 0..size.1 {
        for (row, map) in rows.iter_mut().zip(sources) {
            match &map.image {
                None => row.fill(map.factor),
                Some((image, channel)) => {
                    read_channel(image, *channel, Place { size, y, x0: 0, wrap }, row);
                }
            }
        }
        for (base, level) in rows[0].iter().zip(&rows[1]) {
            let (u, v) = glosses(base.clamp(0.0, 1.0), level.clamp(0.0, 1.0));
            along.push(to_u16(u));
            across.push(to_u16(v));
        }
    }
    let image = |samples| Image::new(size.0, size.1, Channels::R, Pixels::U16(samples));
    Ok((ScalarMap::channel(Arc::new(image(along)?), 0), ScalarMap::channel(Arc::new(image(across)?), 0)))
}
