//! How texels are stored, and what their numbers mean.

/// The layout of a texture's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Format {
    /// 4 bits a texel, RGB.
    Bc1,
    /// 4 bits a texel, R.
    Bc4,
    /// 8 bits a texel, RG.
    Bc5,
    /// 8 bits a texel, RGBA.
    Bc7,
    /// 8 bits a texel, RGBA, in blocks that viewers turn into those of their GPU (Basis Universal); in KTX2 alone.
    Uastc,
    /// One byte a channel.
    Rgba8,
    /// One half float a channel.
    Rgba16F,
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 7] =
        [Format::Bc1, Format::Bc4, Format::Bc5, Format::Bc7, Format::Uastc, Format::Rgba8, Format::Rgba16F];

    /// What reports, messages and flags call it.
    pub fn name(self) -> &'static str {
        match self {
            Format::Bc1 => "bc1",
            Format::Bc4 => "bc4",
            Format::Bc5 => "bc5",
            Format::Bc7 => "bc7",
            Format::Uastc => "uastc",
            Format::Rgba8 => "rgba8",
            Format::Rgba16F => "rgba16f",
        }
    }

    /// Channels that it keeps.
    pub fn channels(self) -> usize {
        match self {
            Format::Bc4 => 1,
            Format::Bc5 => 2,
            Format::Bc1 => 3,
            Format::Bc7 | Format::Uastc | Format::Rgba8 | Format::Rgba16F => 4,
        }
    }

    /// Texels along a side of the unit the bytes come in: 4 for block formats, 1 for the others.
    pub fn block_side(self) -> u32 {
        match self {
            Format::Bc1 | Format::Bc4 | Format::Bc5 | Format::Bc7 | Format::Uastc => 4,
            Format::Rgba8 | Format::Rgba16F => 1,
        }
    }

    /// Bytes of one block, or of one texel in formats without blocks.
    pub fn block_bytes(self) -> usize {
        match self {
            Format::Rgba8 => 4,
            Format::Bc1 | Format::Bc4 | Format::Rgba16F => 8,
            Format::Bc5 | Format::Bc7 | Format::Uastc => 16,
        }
    }

    /// Bytes of a level of `width` x `height` texels, blocks at the edges counted whole.
    pub fn level_bytes(self, width: u32, height: u32) -> usize {
        let side = self.block_side();
        width.div_ceil(side) as usize * height.div_ceil(side) as usize * self.block_bytes()
    }

    /// Whether this build can encode it: [`Format::Uastc`] takes the feature `uastc`.
    pub fn has_encoder(self) -> bool {
        self != Format::Uastc || cfg!(feature = "uastc")
    }

    /// Whether the GPU can linearise this format's colour while sampling (of UASTC, the format that it becomes).
    pub fn has_srgb(self) -> bool {
        matches!(self, Format::Bc1 | Format::Bc7 | Format::Uastc | Format::Rgba8)
    }
}

/// What a colour channel's numbers mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Transfer {
    /// Numbers are used as they are: normals, roughness, aniso, masks, HDR colour.
    Linear,
    /// sRGB-encoded colour, linearised by the sampler.
    Srgb,
    /// The file does not say it: colour is sRGB, all else linear. In textures only of DDS files that are older than
    /// DirectX 10 or typeless; none is written so.
    Unsaid,
}

impl Transfer {
    /// What it is for colour (`color`) or anything else.
    pub fn of_content(self, color: bool) -> Transfer {
        match self {
            Transfer::Unsaid if color => Transfer::Srgb,
            Transfer::Unsaid => Transfer::Linear,
            said => said,
        }
    }
}
