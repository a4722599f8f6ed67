//! How textures are made: the options that all bakes share.

use kinran_bake::aniso::{Sheet, SurfaceOptions};
use kinran_image::{Encoding, Role};
use kinran_scene::{AlphaMode, Material};

pub use kinran_bake::aniso::{Filter, Kernel};
pub use kinran_image::{Encoder, Format, Preset};

use crate::Error;

/// Which maps hold the lobe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Kinran's aniso map.
    Aniso,
    /// Roughness and `KHR_materials_anisotropy`.
    Khr,
    /// Both.
    Both,
}

impl Form {
    /// Whether there is an aniso map.
    pub fn aniso(self) -> bool {
        self != Form::Khr
    }

    /// Whether there are a roughness and an anisotropy map.
    pub fn khr(self) -> bool {
        self != Form::Aniso
    }
}

/// File format of textures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Container {
    /// KTX2.
    #[default]
    Ktx2,
    /// DDS with a DX10 header.
    Dds,
    /// Both.
    Both,
}

impl Container {
    /// What messages and flags call it.
    pub fn name(self) -> &'static str {
        match self {
            Container::Ktx2 => "ktx2",
            Container::Dds => "dds",
            Container::Both => "both",
        }
    }

    /// The file extensions written.
    pub fn extensions(self) -> &'static [&'static str] {
        match self {
            Container::Ktx2 => &["ktx2"],
            Container::Dds => &["dds"],
            Container::Both => &["ktx2", "dds"],
        }
    }
}

/// Which colours keep, at every level, as much alpha at or above a cutoff as level 0 has.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaCoverage {
    /// Those of glTF materials that are cut out (`alphaMode` MASK), at their own cutoff.
    #[default]
    Masked,
    /// None: alpha is averaged.
    Off,
    /// At this cutoff, 0 to 1: those of folders, and of glTF materials that are not opaque.
    At(f32),
}

impl AlphaCoverage {
    /// The cutoff for the texels of a folder's colour.
    pub(crate) fn of_folder(self) -> Option<f32> {
        match self {
            AlphaCoverage::At(cutoff) => Some(cutoff),
            AlphaCoverage::Masked | AlphaCoverage::Off => None,
        }
    }

    /// The cutoff for the texels of a material's base colour.
    pub(crate) fn of_material(self, material: &Material) -> Option<f32> {
        let factor = material.base_color_factor.w;
        match (self, material.alpha_mode) {
            (AlphaCoverage::Masked, AlphaMode::Mask { cutoff }) => {
                Some(cutoff / factor).filter(|cutoff| (0.0..=1.0).contains(cutoff))
            }
            (AlphaCoverage::At(cutoff), AlphaMode::Mask { .. } | AlphaMode::Blend) => Some(cutoff),
            _ => None,
        }
    }
}

/// How textures are filtered, compressed and stored.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct TextureOptions {
    /// How a footprint becomes one texel; [`Filter::Ml`] by default.
    pub filter: Filter,
    /// Shape of the footprint.
    pub kernel: Kernel,
    /// Whether lobes are weighed by what their texels reflect, and base colour and metalness are chosen together, where their
    /// maps lie as those of the surface do; they are by default. [`Filter::Naive`] does neither.
    pub correlated: bool,
    /// Which colours keep their cut-out area from afar.
    pub alpha_coverage: AlphaCoverage,
    /// File format; KTX2 by default, of glTF files what the target has.
    pub container: Option<Container>,
    /// Zstandard level of KTX2 files, 0 for none to 22; 3 by default.
    pub zstd: i32,
    /// Texel format of normal maps; BC5 by default, of glTF files what the target has. It needs two channels.
    pub normal_format: Option<Format>,
    /// Texel format of aniso, anisotropy, roughness and packed maps; BC7 by default. It needs three channels.
    pub aniso_format: Option<Format>,
    /// Texel format of colour maps; BC7 by default. It needs three channels of 8 bits.
    pub color_format: Option<Format>,
    /// Who compresses blocks of BCn; the default is measured for each kind of map. [`Encoder::Portable`] gives the same bytes
    /// on every processor, as does the encoder of UASTC.
    pub encoder: Option<Encoder>,
    /// Time spent on a block; the default is measured for each kind of map.
    pub preset: Option<Preset>,
}

impl Default for TextureOptions {
    fn default() -> Self {
        TextureOptions {
            filter: Filter::Ml,
            kernel: Kernel::Box,
            correlated: true,
            alpha_coverage: AlphaCoverage::Masked,
            container: None,
            zstd: 3,
            normal_format: None,
            aniso_format: None,
            color_format: None,
            encoder: None,
            preset: None,
        }
    }
}

impl TextureOptions {
    /// How a surface is filtered.
    pub fn surface(&self) -> SurfaceOptions {
        SurfaceOptions { filter: self.filter, kernel: self.kernel }
    }

    /// Whether colour, metalness and lobes are filtered together where they can be.
    pub fn is_correlated(&self) -> bool {
        self.correlated && self.filter != Filter::Naive
    }

    /// A map's encoding: the role's measured default, changed by what the options say; `format` is that of its kind of map.
    pub fn encoding(&self, role: Role, format: Option<Format>) -> Encoding {
        let mut encoding = role.encoding();
        encoding.format = format.unwrap_or(encoding.format);
        if encoding.format == Format::Uastc {
            (encoding.encoder, encoding.preset) = (Encoder::Portable, Preset::Normal);
        } else if let Some(encoder) = self.encoder {
            (encoding.encoder, encoding.preset) = match encoder {
                Encoder::Ispc => (encoder, Preset::Normal),
                Encoder::Portable => (encoder, Preset::Fast),
            };
        }
        encoding.preset = self.preset.unwrap_or(encoding.preset);
        encoding
    }

    /// Refuses formats that have fewer channels than the map.
    ///
    /// # Errors
    /// [`Error::Option`] that names the option and what it may be.
    pub fn check(&self) -> Result<(), Error> {
        let refused = |option, format: Format, reason: String| {
            Err(Error::Option { option, given: format.name().into(), file: None, reason })
        };
        if self.color_format == Some(Format::Rgba16F) {
            let reason = "colour maps hold 8 bits; choose bc7, bc1 or rgba8";
            return refused("color-format", Format::Rgba16F, reason.into());
        }
        if let AlphaCoverage::At(cutoff) = self.alpha_coverage
            && !(0.0..=1.0).contains(&cutoff)
        {
            let (given, reason) = (cutoff.to_string(), "a cutoff is 0 to 1".into());
            return Err(Error::Option { option: "alpha-coverage", given, file: None, reason });
        }
        if !(0..=22).contains(&self.zstd) {
            let (given, reason) = (self.zstd.to_string(), "levels are 0 to 22".into());
            return Err(Error::Option { option: "zstd", given, file: None, reason });
        }
        let dds = self.container.unwrap_or_default() != Container::Ktx2;
        for (option, format, channels, reason) in [
            ("normal-format", self.normal_format, 2, "normal maps need red and green"),
            ("aniso-format", self.aniso_format, 3, "these maps need red, green and blue"),
            ("color-format", self.color_format, 3, "colour needs red, green and blue"),
        ] {
            let Some(format) = format else { continue };
            if !format.has_encoder() {
                let reason =
                    "this build has no encoder for it; build with the feature `uastc`, or choose bc7";
                return refused(option, format, reason.into());
            }
            if format == Format::Uastc && dds {
                return refused(
                    option,
                    format,
                    "DDS cannot hold it; choose bc7, or the container ktx2".into(),
                );
            }
            if format.channels() < channels {
                return refused(option, format, format!("{reason}; choose bc7, bc1, rgba8 or rgba16f"));
            }
        }
        Ok(())
    }
}

impl TextureOptions {
    /// The encoding of a sheet.
    pub(crate) fn of_sheet(&self, sheet: Sheet) -> Encoding {
        let format = if sheet == Sheet::Normal { self.normal_format } else { self.aniso_format };
        self.encoding(role_of(sheet), format)
    }

    /// The names of a texture's files.
    pub(crate) fn files(&self, name: &str) -> Vec<String> {
        self.container
            .unwrap_or_default()
            .extensions()
            .iter()
            .map(|extension| format!("{name}.{extension}"))
            .collect()
    }
}

/// The role of a sheet's texels.
fn role_of(sheet: Sheet) -> Role {
    match sheet {
        Sheet::Normal => Role::Normal,
        Sheet::Roughness | Sheet::IsotropicRoughness => Role::Data,
        Sheet::Aniso | Sheet::KhrAnisotropy => Role::Aniso,
    }
}
