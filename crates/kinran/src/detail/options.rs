use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3, vec3};
use kinran_bake::detail::LayerTransform;
use kinran_bake::folder::Green;
use kinran_image::{Encoding, Format, Preset};

use super::{MapKind, default_format, encoding, green_by_name, kind_of_file};
use crate::Error;
use crate::options::Container;

/// A tile, and how it is laid under a target.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TiledLayer {
    /// The tile: an image, or a baked .ktx2 or .dds.
    pub tile: PathBuf,
    /// Repetitions along u and v, not 0; negative ones turn it over.
    pub scale: Vec2,
    /// Degrees.
    pub rotation: f32,
    /// In tiles.
    pub offset: Vec2,
    /// Every other tile is mirrored.
    pub mirror: bool,
    /// Hue in degrees.
    pub hue: f32,
    /// Factor of saturation, not negative.
    pub saturation: f32,
    /// Factor of value, not negative.
    pub value: f32,
    /// How much of it is seen, 0 to 1.
    pub opacity: f32,
    /// Where the layer is seen.
    pub mask: Option<PathBuf>,
    /// The mask's channel: 0 red to 3 alpha.
    pub channel: usize,
    /// Of the mask, not negative.
    pub contrast: f32,
    /// Green of a normal tile grows downwards; its name says so by default.
    pub y_down: bool,
}

impl TiledLayer {
    /// A tile as it is, once.
    pub fn new(tile: impl Into<PathBuf>) -> Self {
        let tile = tile.into();
        TiledLayer {
            y_down: green_by_name(&tile),
            tile,
            scale: Vec2::ONE,
            rotation: 0.0,
            offset: Vec2::ZERO,
            mirror: false,
            hue: 0.0,
            saturation: 1.0,
            value: 1.0,
            opacity: 1.0,
            mask: None,
            channel: 0,
            contrast: 1.0,
        }
    }

    /// Where it lies.
    pub(super) fn transform(&self) -> LayerTransform {
        LayerTransform {
            scale: self.scale,
            rotation: self.rotation.to_radians(),
            offset: self.offset,
            mirror: self.mirror,
        }
    }

    /// How its colour is shifted: turns of hue, factors of saturation and value.
    pub(super) fn hsv(&self) -> Vec3 {
        vec3(self.hue / 360.0, self.saturation, self.value)
    }
}

/// What carries the result, so that it can be looked at.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Carrier {
    /// NAME.glb, a board.
    Board,
    /// A `.glb` or `.gltf` file, written again with the result in a material; the target becomes the map that viewers show
    /// which know nothing of detail maps.
    Model {
        /// The file.
        path: PathBuf,
        /// The material; needed where it has several.
        material: Option<String>,
        /// Folders outside of its own whose files it may name.
        allow_outside: Vec<PathBuf>,
    },
}

/// How a target is solved.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct SolveOptions {
    /// The tiles, from the bottom up; up to three, of which all but the first have masks.
    pub layers: Vec<TiledLayer>,
    /// What the target and its tiles hold; else what the target's name says, else colour.
    pub kind: Option<MapKind>,
    /// Format of the synthesized map; [`default_format`] of its kind by default.
    pub format: Option<Format>,
    /// Format of tiles that come as images; that of the synthesized map by default.
    pub tile_format: Option<Format>,
    /// Time spent on a block of the synthesized map; that of [`encoding`] by default.
    pub preset: Option<Preset>,
    /// Opacity of the detail over an aniso target, 0 to 1: the shader's parameter; 0.5 by default.
    pub alpha: f32,
    /// Where green of a normal target grows; else its name says it, else upwards.
    pub green: Option<Green>,
    /// Which layer of an EXR file holds the target, a tile or a mask.
    pub exr_layer: Vec<(PathBuf, String)>,
    /// Overlay as it is, instead of the smooth one.
    pub plain_overlay: bool,
    /// Whether it is solved against the tiles as the GPU decodes them, not as they were authored; it is by default.
    pub compensate: bool,
    /// How much of what the tiles' compression did the finest level takes back: 0 as in the talk, 1 as all other levels; 0.5
    /// by default.
    pub finest_compensation: f32,
    /// Whether blocks are chosen by what they are blended to, and the finest level is solved otherwise than in the talk; it is
    /// by default.
    pub choose: bool,
    /// Whether the histogram of the tiles is centred.
    pub center: bool,
    /// Whether layers are faded until the blended error is no higher than that of the target, compressed by itself.
    pub fade: bool,
    /// The synthesized map gets the lowest resolution whose error is not above this: RMSE in steps of 8 bits, degrees for
    /// normals.
    pub max_error: Option<f32>,
    /// Whether each part of the method is measured, which takes four more solutions.
    pub compare: bool,
    /// Whether pictures are written: detail, synthesized, blended, target, errors.
    pub pictures: bool,
    /// What carries the result.
    pub carrier: Option<Carrier>,
    /// What the channels of a data target are, for the carrier, a letter each: `o` occlusion, `r` roughness, `m` metallic, `-`
    /// none; `orm` by default, of grey maps `r`.
    pub channels: Option<String>,
    /// File format of the textures.
    pub container: Container,
    /// Zstandard level of KTX2 files, 0 for none to 22; 3 by default.
    pub zstd: i32,
}

/// The shader's default for the opacity of the detail over an aniso target; chosen by eye.
pub const ALPHA: f32 = 0.5;

impl SolveOptions {
    /// The defaults, with layers.
    pub fn new(layers: Vec<TiledLayer>) -> Self {
        SolveOptions {
            layers,
            kind: None,
            format: None,
            tile_format: None,
            preset: None,
            alpha: ALPHA,
            green: None,
            exr_layer: Vec::new(),
            plain_overlay: false,
            compensate: true,
            finest_compensation: 0.5,
            choose: true,
            center: false,
            fade: false,
            max_error: None,
            compare: false,
            pictures: false,
            carrier: None,
            channels: None,
            container: Container::default(),
            zstd: 3,
        }
    }

    /// What a target holds: as is said, else by its name, else colour.
    pub fn kind_of(&self, target: &Path) -> MapKind {
        self.kind.or_else(|| kind_of_file(target)).unwrap_or(MapKind::Color)
    }

    /// Format of the synthesized map of a target.
    pub fn format_of(&self, target: &Path) -> Format {
        self.format.unwrap_or_else(|| default_format(self.kind_of(target)))
    }

    /// How textures may be compressed: the synthesized map, tiles, masks.
    pub fn encodings(&self, target: &Path) -> Vec<Encoding> {
        let masks = self.layers.iter().any(|layer| layer.mask.is_some()).then_some(Format::Bc7);
        let formats = [Some(self.format_of(target)), self.tile_format, masks].into_iter().flatten();
        formats.map(encoding).collect()
    }

    /// Whether green of a normal target grows downwards.
    pub(super) fn is_down(&self, target: &Path) -> bool {
        self.green.map_or_else(|| green_by_name(target), |green| green == Green::Down)
    }

    /// The images of tiles and masks.
    pub fn images(&self) -> impl Iterator<Item = &PathBuf> {
        self.layers.iter().flat_map(|layer| [Some(&layer.tile), layer.mask.as_ref()]).flatten()
    }

    /// Refuses what no map can have.
    ///
    /// # Errors
    /// [`Error::Option`] that names the option and what it may be.
    pub fn check(&self) -> Result<(), Error> {
        let refused = |option, given: String, reason: &str| {
            Err(Error::Option { option, given, file: None, reason: reason.into() })
        };
        for (option, format) in [("format", self.format), ("tile-format", self.tile_format)] {
            if format == Some(Format::Rgba16F) {
                return refused(
                    option,
                    "rgba16f".into(),
                    "detail maps hold 8 bits; choose bc7, bc1, bc4, bc5 or rgba8",
                );
            }
        }
        for (option, value, most) in [
            ("alpha", Some(self.alpha), 1.0),
            ("finest-compensation", Some(self.finest_compensation), 1.0),
            ("max-error", self.max_error, 255.0),
        ] {
            if value.is_some_and(|value| !(0.0..=most).contains(&value)) {
                let given = value.unwrap_or_default().to_string();
                return refused(option, given, &format!("give 0 to {most}"));
            }
        }
        if !(0..=22).contains(&self.zstd) {
            return refused("zstd", self.zstd.to_string(), "levels are 0 to 22");
        }
        if let Some(channels) = self.channels.as_ref().filter(|text| !are_channels(text)) {
            return refused(
                "channels",
                channels.clone(),
                "give a letter for each channel: o occlusion, r roughness, m metallic, - none; such as orm, -rm or r",
            );
        }
        Ok(())
    }
}

/// Whether letters say what up to three channels are, none of them twice.
fn are_channels(text: &str) -> bool {
    let known = |c: char| "orm-".contains(c);
    let twice = ['o', 'r', 'm'].iter().any(|c| text.matches(*c).count() > 1);
    (1..=3).contains(&text.len()) && text.chars().all(known) && !twice && text.contains(['o', 'r', 'm'])
}

/// The layer that is named for a file, which is called by its path, from here or from `folder`, or by its name.
pub fn exr_layer_of<'a>(layers: &'a [(PathBuf, String)], file: &Path, folder: &Path) -> Option<&'a str> {
    let is_it = |path: &PathBuf| {
        file == path
            || file == folder.join(path)
            || file.file_name().is_some_and(|name| path == Path::new(name))
    };
    layers.iter().rev().find(|(path, _)| is_it(path)).map(|(_, layer)| layer.as_str())
}

#[cfg(test)]
mod tests {
    use super::are_channels;

    #[test]
    fn channels_that_mean_nothing_are_taken() {
        for good in ["orm", "-rm", "r", "o", "mro", "o-r"] {
            assert!(are_channels(good), "{good:?} was refused");
        }
        for bad in ["", "---", "rgb", "oo", "ormo", "x"] {
            assert!(!are_channels(bad), "{bad:?} was taken");
        }
    }
}
