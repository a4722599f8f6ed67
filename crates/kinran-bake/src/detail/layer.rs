//! Tiles, and the layers they are laid in.

use glam::{Mat2, Vec2, Vec3, vec2, vec3};
use kinran_image::{Encoding, Error, Image, Texture, Tick, full_level_count, untold};
use kinran_scene::{LayerTransform, Wrap};
use kinran_shading::detail::{
    detail_mask, detail_mirror, detail_turn_aniso, detail_turn_normal, detail_uv, hsv_shift,
};
use kinran_shading::normal_from_xy;

use super::map::{MapKind, Planes, compress, decoded_level, mip_chain, planes_of_image};
use super::sample::Fetch;

/// The most layers that a target is solved against.
pub const MAX_LAYERS: usize = 3;

/// How an image becomes a tile or a mask.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileOptions {
    /// What it holds.
    pub kind: MapKind,
    /// How it is compressed.
    pub encoding: Encoding,
    /// Green of a normal map grows downwards (DirectX).
    pub y_down: bool,
    /// The histogram of each channel is centred, see [`Tile::new`].
    pub center: bool,
}

impl TileOptions {
    /// A map that repeats, compressed so.
    pub fn new(kind: MapKind, encoding: Encoding) -> Self {
        TileOptions { kind, encoding, y_down: false, center: false }
    }
}

/// A map that repeats over a mesh: as it was authored, and as the GPU decodes it. Many targets share one.
#[derive(Clone, Debug)]
pub struct Tile {
    /// What it holds.
    pub kind: MapKind,
    /// The mip chain, compressed.
    pub texture: Texture,
    authored: Vec<Planes>,
    decoded: Vec<Planes>,
}

impl Tile {
    /// A tile from an image of any size, 8 or 16 bits or float. Alpha is kept in the texture and plays no part in
    /// blending.
    ///
    /// `center` moves each channel of colour and data, in linear light, so that its mean is 1/2, and narrows it where
    /// it would leave [0, 1] (slide: Detail Maps, "centering histogram of detail maps"): overlay over a grey of 1/2
    /// is straight and as fine in the dark as in the light.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where a sample lies outside [0, 1], the kind asks for more channels than the image has,
    /// or the encoder refuses.
    pub fn new(image: &Image, options: TileOptions) -> Result<Self, Error> {
        Tile::bake(image, options, &untold)
    }

    /// [`new`](Tile::new), which tells `tick` of texels of all levels.
    ///
    /// # Errors
    /// As [`new`](Tile::new), and [`Error::Cancelled`] where `tick` stops it.
    pub fn bake(image: &Image, options: TileOptions, tick: &Tick<'_>) -> Result<Self, Error> {
        let TileOptions { kind, encoding, y_down, center } = options;
        let mut finest = planes_of_image(image, kind, y_down)?;
        if center && matches!(kind, MapKind::Color | MapKind::Data) {
            center_histogram(&mut finest);
        }
        let authored = mip_chain(finest, kind, &|_| tick(0))?;
        let texture = compress(&authored, kind, encoding, tick)?;
        let decoded = decode_levels(&texture, kind)?;
        Ok(Tile { kind, texture, authored, decoded })
    }

    /// A tile that was baked before, of which only the compressed texels are known.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where mips are missing (a tile is seen from afar too) or a level cannot be decoded.
    pub fn from_texture(texture: Texture, kind: MapKind) -> Result<Self, Error> {
        texture.check()?;
        let (width, height) = (texture.levels[0].width, texture.levels[0].height);
        let wanted = full_level_count(width, height);
        if texture.levels.len() != wanted {
            return Err(Error::Unsupported(format!(
                "the tile has {} of {wanted} mip levels; bake it with all of them",
                texture.levels.len()
            )));
        }
        let decoded = decode_levels(&texture, kind)?;
        Ok(Tile { kind, texture, authored: decoded.clone(), decoded })
    }

    /// Width and height of its finest level.
    pub fn size(&self) -> (u32, u32) {
        (self.decoded[0].width, self.decoded[0].height)
    }

    /// Bytes of all levels.
    pub fn bytes(&self) -> u64 {
        texture_bytes(&self.texture)
    }

    fn levels(&self, seen: Seen) -> &[Planes] {
        match seen {
            Seen::Authored => &self.authored,
            Seen::Decoded => &self.decoded,
        }
    }
}

fn decode_levels(texture: &Texture, kind: MapKind) -> Result<Vec<Planes>, Error> {
    (0..texture.levels.len()).map(|level| decoded_level(texture, level, kind)).collect()
}

/// Bytes of all levels of a texture.
pub fn texture_bytes(texture: &Texture) -> u64 {
    texture.levels.iter().map(|level| level.data.len() as u64).sum()
}

fn center_histogram(planes: &mut Planes) {
    let len = planes.width as usize * planes.height as usize;
    for plane in planes.samples.chunks_exact_mut(len).take(3) {
        let mean = (plane.iter().map(|&v| f64::from(v)).sum::<f64>() / len as f64) as f32;
        let reach = plane.iter().fold(0.0_f32, |reach, v| reach.max((v - mean).abs()));
        let gain = if reach > 0.5 { 0.5 / reach } else { 1.0 };
        for v in plane {
            *v = (0.5 + (*v - mean) * gain).clamp(0.0, 1.0);
        }
    }
}

/// Which texels of a tile are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Seen {
    /// Before compression.
    Authored,
    /// As the GPU decodes them.
    Decoded,
}

/// Where a layer is seen: one channel of a texture over the mesh's own UVs.
#[derive(Clone, Copy, Debug)]
pub struct Mask<'a> {
    /// The texture, of kind [`MapKind::Data`].
    pub map: &'a Tile,
    /// 0 red to 3 alpha.
    pub channel: usize,
    /// See [`detail_mask`]; 1 leaves the mask as it is.
    pub contrast: f32,
}

/// One tiled layer.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// What repeats.
    pub tile: &'a Tile,
    /// Where.
    pub transform: LayerTransform,
    /// For colour: hue in turns, factors of saturation and value; (0, 1, 1) leaves the tile as it is.
    pub hsv: Vec3,
    /// How much of it is seen over the layers before. The first layer has none, all others must.
    pub mask: Option<Mask<'a>>,
    /// Multiplies the mask, 0 to 1. Under the first layer lies what asks for nothing: 1/2, and for normals z. Aniso maps
    /// have an opacity of their own, so that this one is 1 there.
    pub opacity: f32,
}

impl<'a> Layer<'a> {
    /// A tile once over the unit square, as it is.
    pub fn new(tile: &'a Tile) -> Self {
        Layer {
            tile,
            transform: LayerTransform::default(),
            hsv: vec3(0.0, 1.0, 1.0),
            mask: None,
            opacity: 1.0,
        }
    }
}

/// Refuses layers that cannot be what was meant.
pub(crate) fn check_layers(layers: &[Layer], kind: MapKind) -> Result<(), Error> {
    let fail = |reason: String| Err(Error::Unsupported(reason));
    if layers.is_empty() || layers.len() > MAX_LAYERS {
        return fail(format!("a target takes 1 to {MAX_LAYERS} layers, got {}", layers.len()));
    }
    for (i, layer) in layers.iter().enumerate() {
        let name = format!("layer {}", i + 1);
        if layer.tile.kind != kind {
            let [tile, target] = [layer.tile.kind, kind].map(MapKind::name);
            return fail(format!("{name} holds {tile}, but the target is {target}"));
        }
        let LayerTransform { scale, rotation, offset, .. } = layer.transform;
        if !(scale.is_finite()
            && scale.x != 0.0
            && scale.y != 0.0
            && rotation.is_finite()
            && offset.is_finite())
        {
            return fail(format!("{name}: scale must be finite and not zero, rotation and offset finite"));
        }
        if !(layer.hsv.is_finite() && layer.hsv.y >= 0.0 && layer.hsv.z >= 0.0) {
            return fail(format!("{name}: HSV factors must be finite and not negative"));
        }
        if !(0.0..=1.0).contains(&layer.opacity) {
            return fail(format!("{name}: the opacity is a number from 0 to 1, got {}", layer.opacity));
        }
        if kind == MapKind::Aniso && layer.opacity != 1.0 {
            return fail(format!(
                "{name}: over an aniso map all layers have one opacity, the map's own alpha"
            ));
        }
        match (&layer.mask, i) {
            (Some(_), 0) => {
                return fail(format!("{name} lies at the bottom and takes no mask; leave the mask out"));
            }
            (None, 1..) => {
                return fail(format!("{name} has no mask and would hide the layers below; give it one"));
            }
            (Some(mask), _) if mask.map.kind != MapKind::Data || mask.channel > 3 => {
                return fail(format!("{name}: a mask is one channel, 0 to 3, of a data map"));
            }
            (Some(mask), _) if !mask.contrast.is_finite() => {
                return fail(format!("{name}: the mask's contrast must be finite"));
            }
            _ => {}
        }
    }
    Ok(())
}

/// The layers together, at the places of a level's texels.
pub(crate) struct DetailRows<'a> {
    kind: MapKind,
    size: (u32, u32),
    layers: Vec<LayerRows<'a>>,
}

struct LayerRows<'a> {
    layer: &'a Layer<'a>,
    fetch: Fetch<'a>,
    mask: Option<(Fetch<'a>, usize, f32)>,
}

/// Room for a row.
#[derive(Default)]
pub(crate) struct RowRoom {
    layer: [Vec<f32>; 3],
    mask: [Vec<f32>; 4],
}

impl<'a> DetailRows<'a> {
    /// The layers as texels of a level of `size` see them.
    pub(crate) fn new(layers: &'a [Layer], kind: MapKind, size: (u32, u32), seen: Seen) -> Self {
        let layers = layers
            .iter()
            .map(|layer| {
                let LayerTransform { offset, mirror, .. } = layer.transform;
                let wrap = if mirror { Wrap::Mirror } else { Wrap::Repeat };
                let (tile, matrix) = (layer.tile, layer.transform.matrix());
                LayerRows {
                    layer,
                    fetch: Fetch::new(tile.levels(seen), size, matrix, offset, wrap),
                    mask: layer.mask.map(|Mask { map, channel, contrast }| {
                        let fetch =
                            Fetch::new(map.levels(seen), size, Mat2::IDENTITY, Vec2::ZERO, Wrap::Repeat);
                        (fetch, channel, contrast)
                    }),
                }
            })
            .collect();
        DetailRows { kind, size, layers }
    }

    /// Row `y` of the detail: three planes, which for normals are x, y and z.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize, room: &mut RowRoom, out: &mut [Vec<f32>; 3]) {
        let width = self.size.0 as usize;
        out.iter_mut().chain(&mut room.layer).chain(&mut room.mask).for_each(|v| v.resize(width, 0.0));
        for (i, layer) in self.layers.iter().enumerate() {
            let row = if i == 0 { &mut *out } else { &mut room.layer };
            let [r0, r1, r2] = row.each_mut().map(Vec::as_mut_slice);
            layer.fetch.row(y, &mut [r0, r1, r2][..self.kind.channels()]);
            self.transform_row(layer, y, row);
            let opacity = layer.layer.opacity;
            let Some((fetch, channel, contrast)) = &layer.mask else {
                if opacity < 1.0 {
                    let neutral = if self.kind == MapKind::Normal { [0.0, 0.0, 1.0] } else { [0.5; 3] };
                    for (row, neutral) in row.iter_mut().zip(neutral) {
                        row.iter_mut().for_each(|v| *v = neutral + (*v - neutral) * opacity);
                    }
                }
                continue;
            };
            let [m0, m1, m2, m3] = room.mask.each_mut().map(Vec::as_mut_slice);
            fetch.row(y, &mut [m0, m1, m2, m3][..=*channel]);
            for (out, layer) in out.iter_mut().zip(&room.layer) {
                for ((o, l), m) in out.iter_mut().zip(layer).zip(&room.mask[*channel]) {
                    *o += (l - *o) * (detail_mask(*m, *contrast) * opacity);
                }
            }
        }
        if self.kind == MapKind::Normal && (self.layers.len() > 1 || self.layers[0].layer.opacity < 1.0) {
            map_row(out, |n, _| n.normalize_or(Vec3::Z));
        }
    }

    #[inline(always)]
    fn transform_row(&self, layer: &LayerRows, y: usize, row: &mut [Vec<f32>; 3]) {
        let transform = &layer.layer.transform;
        let (rotation, mirrored) = (transform.cos_sin(), transform.mirror);
        let (matrix, offset) = (transform.matrix(), transform.offset);
        let signs = |x: usize| {
            if !mirrored {
                return Vec2::ONE;
            }
            let size = vec2(self.size.0 as f32, self.size.1 as f32);
            detail_mirror(detail_uv(vec2(x as f32 + 0.5, y as f32 + 0.5) / size, matrix, offset))
        };
        let turned = rotation != Vec2::X || mirrored;
        match self.kind {
            MapKind::Color if layer.layer.hsv != vec3(0.0, 1.0, 1.0) => {
                map_row(row, |color, _| hsv_shift(color, layer.layer.hsv));
            }
            MapKind::Normal => map_row(row, |n, x| {
                let n = normal_from_xy(n.x, n.y);
                if turned { detail_turn_normal(n, rotation, signs(x)) } else { n }
            }),
            MapKind::Aniso if turned => {
                map_row(row, |texel, x| detail_turn_aniso(texel, rotation, signs(x)));
            }
            _ => {}
        }
    }
}

/// Replaces each vector of three planes.
#[inline(always)]
fn map_row(row: &mut [Vec<f32>; 3], f: impl Fn(Vec3, usize) -> Vec3) {
    let [a, b, c] = row;
    for (x, ((a, b), c)) in a.iter_mut().zip(b).zip(c).enumerate() {
        (*a, *b, *c) = f(vec3(*a, *b, *c), x).into();
    }
}
