//! The solver: every texel's `s`, compressed, and how far the blended result is from the target.

use glam::{Vec3, Vec4, vec3};
use kinran_image::srgb::{byte_from_linear, code_from_linear, linear_from_byte};
use kinran_image::{
    Channels, Encoding, Error, Format, Image, Level, Pixels, Texture, Tick, Transfer, decode, encode, untold,
};
use kinran_shading::detail::{
    detail_from_texel, detail_over, detail_over_inverse, overlay_color, rnm, rnm_inverse,
    smooth_overlay_color,
};
use kinran_shading::normal_from_xy;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::choose::{ChooseBand, Stored, can_choose, makes_its_own};
use super::layer::{DetailRows, Layer, RowRoom, Seen, check_layers};
use super::map::{
    MapKind, Planes, bytes_of_planes, for_each_row, mip_chain, planes_of_image, synthesized_level, texture,
};
use super::operator::{Blend, Operator, Plain, RUN, Smooth, run_of};
use crate::simd::dispatch;

/// How a target is solved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetailOptions {
    /// For colour and data.
    pub blend: Blend,
    /// Opacity of the detail over an aniso target, 0 to 1: the shader's parameter.
    pub aniso_alpha: f32,
    /// Solves against the tiles as the GPU decodes them, below the finest level. Off: against the tiles as authored.
    pub compensate: bool,
    /// How much of what the tiles' compression did is taken back where blocks of the finest level are chosen, 0 to 1.
    /// That level is seen once at its own size, against the level of the tile that it could be solved against, and
    /// magnified against many finer ones, whose losses are others. At 0 it is solved against the tiles as authored, as
    /// in the talk.
    pub finest_compensation: f32,
    /// Chooses among blocks of `s` by the error of the blended result: BC1, BC4, BC5 and BC7, of targets without alpha.
    /// Off: keeps what the encoder made, and solves the finest level as in the talk.
    pub choose: bool,
    /// How `s` is compressed.
    pub encoding: Encoding,
    /// How `s` of colour is stored: sRGB is finer where `s` is below 0.22, linear above. `None` tries both three levels
    /// below the finest and keeps the better; all other kinds are linear.
    pub transfer: Option<Transfer>,
    /// Measures every texel; off, up to 8 bands of 16 rows a level, evenly spread.
    pub measure_all: bool,
    /// Levels of the target left out of `s`: its finest is this one.
    pub first_level: usize,
}

/// Half: a quarter of the tile's squared loss is left where the map is seen at its own size, and a quarter of it comes in
/// as noise where the map is magnified, which bilinear weights of 1/4 and 3/4 bring down to a tenth (`(5/8)²` of it).
const FINEST_COMPENSATION: f32 = 0.5;

impl DetailOptions {
    /// Everything that lowers the error, at the target's own resolution; the aniso detail half opaque.
    pub fn new(encoding: Encoding) -> Self {
        DetailOptions {
            blend: Blend::Smooth,
            aniso_alpha: 0.5,
            compensate: true,
            finest_compensation: FINEST_COMPENSATION,
            choose: true,
            encoding,
            transfer: None,
            measure_all: false,
            first_level: 0,
        }
    }
}

/// A map to be reproduced, with its mips.
#[derive(Clone, Debug)]
pub struct Target {
    /// What it holds.
    pub kind: MapKind,
    /// Whether its three channels are one.
    pub grey: bool,
    /// Whether an alpha below one is among its texels; it passes through to `s` unblended.
    pub alpha: bool,
    /// Level 0 first, each an average of level 0.
    pub levels: Vec<Planes>,
}

impl Target {
    /// A target of any size from an image of 8 or 16 bits or floats; float colour is linear light.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where a sample lies outside [0, 1] or the kind asks for more channels than the image has.
    pub fn new(image: &Image, kind: MapKind, y_down: bool) -> Result<Self, Error> {
        let levels = mip_chain(planes_of_image(image, kind, y_down)?, kind, &untold)?;
        let grey = kind == MapKind::Data && matches!(image.channels, Channels::R | Channels::Rg);
        let alpha =
            matches!(kind, MapKind::Color | MapKind::Data) && levels[0].plane(3).iter().any(|&a| a < 1.0);
        Ok(Target { kind, grey, alpha, levels })
    }

    /// The finest level as an image of 8 bits: as it was authored, but for its bits and for normals that pointed down.
    ///
    /// # Errors
    /// None that a target can cause.
    pub fn image(&self) -> Result<Image, Error> {
        let finest = &self.levels[0];
        let rgba8 = bytes_of_planes(finest, self.kind);
        let (channels, kept) = match (self.grey, self.alpha) {
            (true, false) => (Channels::R, 1),
            (_, true) => (Channels::Rgba, 4),
            (false, false) => (Channels::Rgb, 3),
        };
        let bytes = rgba8.chunks_exact(4).flat_map(|texel| &texel[..kept]).copied().collect();
        Image::new(finest.width, finest.height, channels, Pixels::U8(bytes))
    }

    /// Channels of which errors are measured.
    fn measured(&self) -> usize {
        if self.grey { 1 } else { 3 }
    }

    /// Refuses a format that cannot hold a map of this kind.
    pub(crate) fn check_format(&self, format: Format) -> Result<(), Error> {
        let fits = match (self.kind, format) {
            (_, Format::Bc7 | Format::Rgba8) => true,
            (MapKind::Normal, Format::Bc5) => true,
            (MapKind::Data, Format::Bc4) => self.grey && !self.alpha,
            (MapKind::Color | MapKind::Data | MapKind::Aniso, Format::Bc1) => !self.alpha,
            _ => false,
        };
        if fits {
            return Ok(());
        }
        let alpha = if self.alpha { " with alpha" } else { "" };
        Err(Error::Unsupported(format!(
            "{} does not hold a map of {}{alpha}; take bc7 or rgba8",
            format.name(),
            self.kind.name()
        )))
    }
}

/// What one level of `s` became.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct LevelError {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Root mean square difference between the blended result, both textures decoded, and the target: in steps of 8
    /// bits (of the sRGB code, for colour), or for normals in degrees.
    pub error: f32,
    /// Share of texels whose target cannot be reached exactly: normals that `s` would need below the horizon, aniso
    /// texels outside what the alpha leaves.
    pub unreached: f32,
}

/// A solved target.
#[derive(Clone, Debug)]
pub struct Solved {
    /// `s` and its mips. Colour, data and normals are stored so that byte 128 is neutral, see
    /// [`detail_from_texel`]. Its [`transfer`](Texture::transfer) says whether colour is to be sampled with sRGB decoding.
    pub texture: Texture,
    /// For each level of `s`.
    pub levels: Vec<LevelError>,
}

/// Rows in a band: the unit of parallel work, whole blocks.
const BAND: usize = 16;

/// Bands per level whose errors are measured, unless all are.
const MEASURED_BANDS: usize = 8;

/// Solves a target against its layers, all levels from `options.first_level` down, in parallel; `tick` is told of
/// their texels. The bytes do not depend on the number of threads.
///
/// # Errors
/// [`Error::Unsupported`] where layers and target do not fit together, an option is out of range, the format cannot
/// hold the kind, or the encoder refuses; [`Error::Cancelled`] where `tick` does.
pub fn solve(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    tick: &Tick<'_>,
) -> Result<Solved, Error> {
    solve_levels(target, layers, options, options.first_level..target.levels.len(), tick)
}

/// Some of the levels.
pub(crate) fn solve_levels(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    range: std::ops::Range<usize>,
    tick: &Tick<'_>,
) -> Result<Solved, Error> {
    check_layers(layers, target.kind)?;
    target.check_format(options.encoding.format)?;
    if !(0.0..=1.0).contains(&options.aniso_alpha) {
        return Err(Error::Unsupported(format!(
            "the aniso alpha is an opacity from 0 to 1, got {}",
            options.aniso_alpha
        )));
    }
    if options.first_level >= target.levels.len() {
        return Err(Error::Unsupported(format!(
            "the target has {} levels, so level {} cannot be the finest of s",
            target.levels.len(),
            options.first_level
        )));
    }

    let transfer = better_transfer(target, layers, options, tick)?;
    let mut levels = Vec::new();
    let mut errors = Vec::new();
    for level in range {
        let compensation = match (options.compensate, level > options.first_level) {
            (false, _) => 0.0,
            (true, false) => options.finest_compensation,
            (true, true) => 1.0,
        };
        let (data, error) = solve_level(target, layers, options, level, (compensation, transfer), tick)?;
        let (width, height) = (target.levels[level].width, target.levels[level].height);
        levels.push(Level { width, height, data });
        errors.push(error);
    }
    Ok(Solved { texture: texture(options.encoding.format, transfer, levels), levels: errors })
}

/// Sets `rgba8` to the texels of one level of `s` before compression, RGBA of 8 bits as [`Solved::texture`] stores them,
/// on the calling thread alone: solved against the tiles as the GPU decodes them, and linear unless `options.transfer`
/// asks for sRGB.
///
/// # Errors
/// As [`solve`].
pub fn synthesize(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    level: usize,
    rgba8: &mut Vec<u8>,
) -> Result<(), Error> {
    check_layers(layers, target.kind)?;
    let Some(planes) = target.levels.get(level) else {
        return Err(Error::Unsupported(format!("the target has no level {level}")));
    };
    let width = planes.width as usize;
    let rows = DetailRows::new(layers, target.kind, (planes.width, planes.height), Seen::Decoded);
    let (mut room, mut detail) = (RowRoom::default(), <[Vec<f32>; 3]>::default());
    let srgb = target.kind == MapKind::Color && options.transfer == Some(Transfer::Srgb);
    rgba8.resize(width * planes.height as usize * 4, 0);
    for (y, out) in rgba8.chunks_exact_mut(width * 4).enumerate() {
        rows.row(y, &mut room, &mut detail);
        let target_row = std::array::from_fn(|c| planes.row(c, y));
        let row = SolveRow { row: target_row, detail: &detail, target, srgb, options, out };
        dispatch(row);
    }
    Ok(())
}

/// Levels below the finest where both ways to store colour are tried: a 64th of the texels.
const TRIAL_LEVEL: usize = 3;

/// How colour is stored with the lower error. `tick` is told of no units.
fn better_transfer(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    tick: &Tick<'_>,
) -> Result<Transfer, Error> {
    if target.kind != MapKind::Color {
        return Ok(Transfer::Linear);
    }
    if let Some(transfer) = options.transfer {
        return Ok(transfer);
    }
    let level = (options.first_level + TRIAL_LEVEL).min(target.levels.len() - 1);
    let error = |transfer| -> Result<f32, Error> {
        let options = &DetailOptions { measure_all: true, ..*options };
        let compensation = if options.compensate { 1.0 } else { 0.0 };
        Ok(solve_level(target, layers, options, level, (compensation, transfer), &|_| tick(0))?.1.error)
    };
    let (linear, srgb) = (error(Transfer::Linear)?, error(Transfer::Srgb)?);
    Ok(if srgb < linear { Transfer::Srgb } else { Transfer::Linear })
}

fn solve_level(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    level: usize,
    (compensation, transfer): (f32, Transfer),
    tick: &Tick<'_>,
) -> Result<(Vec<u8>, LevelError), Error> {
    let planes = &target.levels[level];
    let (width, height) = (planes.width, planes.height);
    let decoded = DetailRows::new(layers, target.kind, (width, height), Seen::Decoded);
    let authored =
        (compensation < 1.0).then(|| DetailRows::new(layers, target.kind, (width, height), Seen::Authored));
    let bands = (0..height as usize)
        .into_par_iter()
        .step_by(BAND)
        .map_init(RowRoom::default, |room, y0| {
            let rows = BAND.min(height as usize - y0);
            let srgb = transfer == Transfer::Srgb;
            let mut band =
                Band { planes, target, options, compensation, srgb, y0, rows, sums: Sums::default() };
            let solved = band.solve(&decoded, authored.as_ref(), room)?;
            tick(u64::from(width) * rows as u64)?;
            Ok(solved)
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let (mut data, mut sums) = (Vec::new(), Sums::default());
    for (bytes, band_sums) in bands {
        data.extend(bytes);
        sums.add(&band_sums);
    }
    Ok((data, LevelError { width, height, error: sums.error(target), unreached: sums.unreached() }))
}

/// Some whole rows of blocks of one level.
struct Band<'a> {
    planes: &'a Planes,
    target: &'a Target,
    options: &'a DetailOptions,
    compensation: f32,
    srgb: bool,
    y0: usize,
    rows: usize,
    sums: Sums,
}

impl Band<'_> {
    fn solve(
        &mut self,
        decoded: &DetailRows,
        authored: Option<&DetailRows>,
        room: &mut RowRoom,
    ) -> Result<(Vec<u8>, Sums), Error> {
        let width = self.planes.width as usize;
        let format = self.options.encoding.format;
        let chosen = self.options.choose && !self.target.alpha && can_choose(format, self.target.kind);
        // Overlay reaches every target, so that blocks made from the start need no texels before.
        let own = chosen && makes_its_own(format) && self.target.kind != MapKind::Aniso;
        let mut seen: Vec<[Vec<f32>; 3]> = vec![<[Vec<f32>; 3]>::default(); self.rows];
        let mut before = if authored.is_some() { seen.clone() } else { Vec::new() };
        let mut rgba8 = vec![0; if own { 0 } else { self.rows * width * 4 }];
        for i in 0..self.rows {
            let y = self.y0 + i;
            decoded.row(y, room, &mut seen[i]);
            if let Some(authored) = authored {
                authored.row(y, room, &mut before[i]);
                if chosen && self.compensation > 0.0 {
                    mix(&mut before[i], &seen[i], self.compensation, self.target.kind);
                }
            }
            if !own {
                let against = if authored.is_some() { &before[i] } else { &seen[i] };
                let out = &mut rgba8[i * width * 4..][..width * 4];
                self.solve_row(std::array::from_fn(|c| self.planes.row(c, y)), against, out);
            }
        }
        let mut blocks = if own {
            vec![0; format.level_bytes(width as u32, self.rows as u32)]
        } else {
            encode(self.options.encoding, &rgba8, width as u32, self.rows as u32)?
        };
        if chosen {
            let rows = self.y0..self.y0 + self.rows;
            dispatch(ChooseBand {
                width,
                target: rows.map(|y| std::array::from_fn(|c| self.planes.row(c, y))).collect(),
                detail: if authored.is_some() { &before } else { &seen },
                kind: self.target.kind,
                blend: self.options.blend,
                alpha: self.options.aniso_alpha,
                stored: match self.target.kind {
                    MapKind::Aniso => Stored::Plain,
                    _ if self.srgb => Stored::Srgb,
                    _ => Stored::Linear,
                },
                format,
                blocks: &mut blocks,
            });
        }
        let bands = (self.planes.height as usize).div_ceil(BAND);
        if self.options.measure_all || (self.y0 / BAND).is_multiple_of(bands.div_ceil(MEASURED_BANDS)) {
            self.measure(&blocks, &seen)?;
        }
        self.sums.solved += (width * self.rows) as u64;
        Ok((blocks, self.sums))
    }

    fn solve_row(&mut self, target: [&[f32]; 4], detail: &[Vec<f32>; 3], out: &mut [u8]) {
        let row = SolveRow {
            row: target,
            detail,
            target: self.target,
            srgb: self.srgb,
            options: self.options,
            out,
        };
        self.sums.unreached += dispatch(row);
    }

    /// Decodes the band again and compares the blended result with the target.
    fn measure(&mut self, blocks: &[u8], detail: &[[Vec<f32>; 3]]) -> Result<(), Error> {
        let width = self.planes.width as usize;
        let texels = decode(self.options.encoding.format, blocks, width as u32, self.rows as u32)?;
        for (i, detail) in detail.iter().enumerate() {
            let y = self.y0 + i;
            for x in 0..width {
                let d = vec3(detail[0][x], detail[1][x], detail[2][x]);
                let mut texel = Vec4::from(texels[i * width + x]).truncate();
                if self.srgb {
                    texel = Vec3::from(texel.to_array().map(|v| linear_from_byte((v * 255.0 + 0.5) as u8)));
                }
                let blended = blend(texel, d, self.target.kind, self.options);
                let t = Vec3::from(std::array::from_fn(|c| self.planes.row(c, y)[x]));
                self.sums.sum += squared_error(blended, t, self.target);
            }
        }
        self.sums.texels += (width * self.rows) as u64;
        Ok(())
    }
}

/// Moves a row of one detail towards another.
fn mix(row: &mut [Vec<f32>; 3], towards: &[Vec<f32>; 3], by: f32, kind: MapKind) {
    for (row, towards) in row.iter_mut().zip(towards) {
        for (v, t) in row.iter_mut().zip(towards) {
            *v += (t - *v) * by;
        }
    }
    if kind == MapKind::Normal {
        let [x, y, z] = row;
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            (*x, *y, *z) = vec3(*x, *y, *z).normalize_or(Vec3::Z).into();
        }
    }
}

/// What the runtime makes of level `level` of `s` and the layers under it, where a pixel is a texel of that level: linear
/// light for colour, unit vectors for normals. Alpha is that of `s`.
///
/// # Errors
/// [`Error::Unsupported`] where layers do not fit together, or there is no such level or it cannot be decoded.
pub fn blend_level(
    synthesized: &Texture,
    layers: &[Layer],
    kind: MapKind,
    options: &DetailOptions,
    level: usize,
) -> Result<Planes, Error> {
    check_layers(layers, kind)?;
    let mut planes = synthesized_level(synthesized, level)?;
    let rows = DetailRows::new(layers, kind, (planes.width, planes.height), Seen::Decoded);
    for_each_row(&mut planes, |y, [a, b, c, _]| {
        let (mut room, mut row) = (RowRoom::default(), <[Vec<f32>; 3]>::default());
        rows.row(y, &mut room, &mut row);
        for x in 0..a.len() {
            let d = Vec3::from(row.each_ref().map(|plane| plane[x]));
            (a[x], b[x], c[x]) = blend(vec3(a[x], b[x], c[x]), d, kind, options).into();
        }
    });
    Ok(planes)
}

/// A texel of `s` as the sampler returns it, blended with a detail.
#[inline(always)]
pub(crate) fn blend(texel: Vec3, d: Vec3, kind: MapKind, options: &DetailOptions) -> Vec3 {
    match kind {
        MapKind::Color | MapKind::Data => {
            let s = detail_from_texel(texel);
            match options.blend {
                Blend::Smooth => smooth_overlay_color(s, d),
                Blend::Plain => overlay_color(s, d),
            }
        }
        MapKind::Normal => {
            let s = detail_from_texel(texel) * 2.0 - 1.0;
            rnm(normal_from_xy(s.x, s.y), d)
        }
        MapKind::Aniso => detail_over(texel, d, options.aniso_alpha),
    }
}

/// Squared difference of two texels in the unit of [`LevelError::error`], summed over the channels measured.
pub(crate) fn squared_error(a: Vec3, b: Vec3, target: &Target) -> f64 {
    match target.kind {
        MapKind::Normal => {
            let b = normal_from_xy(b.x, b.y);
            let angle = libm::atan2f(a.cross(b).length(), a.dot(b)).to_degrees();
            f64::from(angle * angle)
        }
        kind => {
            let code = |v: f32| if kind == MapKind::Color { code_from_linear(v) } else { v };
            (0..target.measured())
                .map(|c| {
                    let difference = (code(a[c]) - code(b[c])) * 255.0;
                    f64::from(difference * difference)
                })
                .sum()
        }
    }
}

/// Sums over texels.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums {
    pub(crate) texels: u64,
    pub(crate) sum: f64,
    pub(crate) unreached: u64,
    pub(crate) solved: u64,
}

impl Sums {
    pub(crate) fn add(&mut self, o: &Sums) {
        self.texels += o.texels;
        self.sum += o.sum;
        self.unreached += o.unreached;
        self.solved += o.solved;
    }

    pub(crate) fn error(&self, target: &Target) -> f32 {
        let numbers = if target.kind == MapKind::Normal { 1 } else { target.measured() };
        (self.sum / (self.texels as f64 * numbers as f64)).sqrt() as f32
    }

    fn unreached(&self) -> f32 {
        self.unreached as f32 / self.solved as f32
    }
}

/// One row, as a unit that is compiled once for each instruction set. Returns how many texels cannot be reached.
struct SolveRow<'a> {
    row: [&'a [f32]; 4],
    detail: &'a [Vec<f32>; 3],
    target: &'a Target,
    srgb: bool,
    options: &'a DetailOptions,
    out: &'a mut [u8],
}

impl pulp::WithSimd for SolveRow<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> u64 {
        let SolveRow { row, detail, target, srgb, options, out } = self;
        debug_assert!(row.iter().all(|plane| plane.len() == row[0].len()), "planes of one width");
        debug_assert!(detail.iter().all(|plane| plane.len() == row[0].len()), "a detail for each texel");
        debug_assert_eq!(out.len(), 4 * row[0].len(), "four bytes a texel");
        match target.kind {
            MapKind::Color | MapKind::Data => {
                match options.blend {
                    Blend::Smooth => overlay_rows(row, target.alpha, detail, srgb, Smooth, out),
                    Blend::Plain => overlay_rows(row, target.alpha, detail, srgb, Plain, out),
                }
                0
            }
            MapKind::Normal => {
                let mut unreached = 0;
                for (x, out) in out.chunks_exact_mut(4).enumerate() {
                    let t = normal_from_xy(row[0][x], row[1][x]);
                    let s = rnm_inverse(t, vec3(detail[0][x], detail[1][x], detail[2][x]));
                    unreached += u64::from(s.z == 0.0);
                    let byte = |v: f32| synthesized_byte(v * 0.5 + 0.5);
                    out.copy_from_slice(&[byte(s.x), byte(s.y), byte(s.z), 255]);
                }
                unreached
            }
            MapKind::Aniso => {
                let mut unreached = 0;
                for (x, out) in out.chunks_exact_mut(4).enumerate() {
                    let t = vec3(row[0][x], row[1][x], row[2][x]);
                    let d = vec3(detail[0][x], detail[1][x], detail[2][x]);
                    let s = detail_over_inverse(t, d, options.aniso_alpha);
                    let missed = detail_over(s, d, options.aniso_alpha) - t;
                    // Half a step of 8 bits is lost anyway.
                    unreached += u64::from(missed.abs().max_element() > 0.5 / 255.0);
                    let byte = |v: f32| (v * 255.0 + 0.5) as u8;
                    out.copy_from_slice(&[byte(s.x), byte(s.y), byte(s.z), 255]);
                }
                unreached
            }
        }
    }
}

/// The byte that [`detail_from_texel`] turns into a value in [0, 1].
#[inline(always)]
fn synthesized_byte(s: f32) -> u8 {
    (s * 254.0 + 1.5) as u8
}

#[inline(always)]
#[allow(
    clippy::needless_range_loop,
    reason = "loops over lanes of known length are what compilers vectorise"
)]
fn overlay_rows(
    target: [&[f32]; 4],
    alpha: bool,
    detail: &[Vec<f32>; 3],
    srgb: bool,
    operator: impl Operator,
    out: &mut [u8],
) {
    let width = target[0].len();
    for x0 in (0..width).step_by(RUN) {
        let out = &mut out[4 * x0..4 * width.min(x0 + RUN)];
        let mut texels = [0_u32; RUN];
        for channel in 0..3 {
            let (t, d) = (run_of(target[channel], x0), run_of(&detail[channel], x0));
            let mut stored = operator.inverse_run(&t, &d);
            for i in 0..RUN {
                stored[i] = stored[i] * 254.0 + 1.0;
            }
            // Apart from the solution: codes are looked up, which does not run in lanes.
            if srgb {
                for i in 0..RUN {
                    let code = byte_from_linear(stored[i] * (1.0 / 255.0));
                    texels[i] |= u32::from(code) << (8 * channel);
                }
            } else {
                for i in 0..RUN {
                    texels[i] |= rounded(stored[i]) << (8 * channel);
                }
            }
        }
        // Planes of ones need not be read.
        let alpha = if alpha { run_of(target[3], x0) } else { [1.0; RUN] };
        for i in 0..RUN {
            texels[i] |= rounded(alpha[i] * 255.0) << 24;
        }
        for (out, texel) in out.as_chunks_mut().0.iter_mut().zip(texels) {
            *out = texel.to_le_bytes();
        }
    }
}

/// The whole number nearest to a value in [0, 255], by the way floats of 2^23 and more have none but whole ones: a cast
/// would keep the loop from running in lanes.
#[inline(always)]
fn rounded(v: f32) -> u32 {
    (v + 8_388_608.0).to_bits() & 0xff
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::detail::{Tile, TileOptions};
    use kinran_image::{Encoder, Preset};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn blocks_depend_on_the_band_they_are_solved_in(
            size in (4_u32..40, 4_u32..40),
            kind in prop::sample::select(vec![MapKind::Color, MapKind::Normal, MapKind::Aniso]),
            blocks in 1_usize..9,
            bytes in prop::collection::vec(60_u8..200, 96),
        ) {
            let picture = |skip: usize, (width, height): (u32, u32)| {
                let samples = bytes.iter().cycle().skip(skip).take((width * height * 3) as usize);
                Image::new(width, height, Channels::Rgb, Pixels::U8(samples.copied().collect())).unwrap()
            };
            let format = if kind == MapKind::Normal { Format::Bc5 } else { Format::Bc7 };
            let encoding = Encoding { format, encoder: Encoder::Portable, preset: Preset::Fast };
            let tile = Tile::new(&picture(5, (16, 16)), TileOptions::new(kind, encoding)).unwrap();
            let layers = [Layer::new(&tile)];
            let target = Target::new(&picture(0, size), kind, false).unwrap();
            let options = DetailOptions::new(encoding);
            let planes = &target.levels[0];
            let seen = |seen| DetailRows::new(&layers, kind, size, seen);
            let (decoded, authored) = (seen(Seen::Decoded), seen(Seen::Authored));
            let solve = |y0: usize, rows: usize| {
                let (target, options) = (&target, &options);
                let sums = Sums::default();
                let mut band = Band { planes, target, options, compensation: 0.5, srgb: false, y0, rows, sums };
                band.solve(&decoded, Some(&authored), &mut RowRoom::default()).unwrap().0
            };
            let height = size.1 as usize;
            let starts = (0..height).step_by(4 * blocks);
            let banded: Vec<u8> = starts.flat_map(|y0| solve(y0, (4 * blocks).min(height - y0))).collect();
            prop_assert_eq!(banded, solve(0, height));
        }
    }
}
