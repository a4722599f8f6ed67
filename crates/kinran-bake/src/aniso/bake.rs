//! From authored maps to compressed textures, and what was lost on the way.

use std::collections::BTreeMap;

use glam::{Vec2, Vec3, vec2, vec3};
use kinran_image::{
    Encoding, Error, Format, Image, Level, Texture, Tick, Transfer, decode, encode, encode_half,
    full_level_count, level_size,
};
use kinran_shading::Sym2;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::footprint::{Kernel, Taps, footprints};
use super::levels::{Band, Filter, filter_levels};
use super::maps::{DirectionMap, RoughnessMaps, SurfaceMaps, TexelSpan};
use super::ndf_error::weighted_ndf_error;
use super::sheet::{Sheet, decode_aniso, decode_khr};
use super::weights;
use crate::mips::{BAND_ROWS, Rgba8Level, plain_levels, unorm8};
use crate::simd::dispatch;

/// One texture asked for.
#[derive(Clone, Debug)]
pub struct SheetRequest<'a> {
    /// Its content.
    pub sheet: Sheet,
    /// How it is compressed.
    pub encoding: Encoding,
    /// For the roughness sheets: the packed map whose red, blue and alpha stay beside the roughness,
    /// averaged as they are.
    pub packed_with: Option<&'a Image>,
}

/// How a surface is baked.
#[derive(Clone, Copy, Debug, Default)]
pub struct SurfaceOptions {
    /// The filter.
    pub filter: Filter,
    /// The footprints' shape.
    pub kernel: Kernel,
}

/// What one level lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct LevelError {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Filter: relative L2 error of the texels' lobes against level 0's microfacets, root mean square over
    /// up to 16 texels.
    pub ndf_l2: f32,
    /// Compression: root mean square angle between normals, degrees.
    pub normal_rms_degrees: f32,
    /// Compression: largest angle between normals, degrees.
    pub normal_max_degrees: f32,
    /// Compression: root mean square error of the larger principal roughness.
    pub alpha_t_rms: f32,
    /// Compression: root mean square error of the smaller principal roughness.
    pub alpha_b_rms: f32,
}

/// A baked surface.
#[derive(Clone, Debug)]
pub struct BakedSurface {
    /// A texture for each request, in their order.
    pub textures: Vec<Texture>,
    /// Errors, per level.
    pub levels: Vec<LevelError>,
}

/// Bands per level whose compression is decoded again and measured, evenly spread: at 4096², every row of blocks of
/// level 5 and above, and a quarter of a million texels of level 0.
const MEASURED_BANDS: u32 = 4;

/// Filters a surface and compresses it to the textures asked for, in parallel; `tick` is told of texels of the mip chain that
/// are in all of them.
///
/// # Errors
/// [`Error::Unsupported`] where an encoder refuses, [`Error::Cancelled`] where `tick` does.
pub fn bake_surface(
    maps: &SurfaceMaps,
    options: SurfaceOptions,
    requests: &[SheetRequest],
    tick: &Tick<'_>,
) -> Result<BakedSurface, Error> {
    bake_surface_and_metal(maps, options, requests, &[], tick)
}

/// [`bake_surface`], with levels of metalness for blue of the packed maps, each of as many bytes as texels, such as
/// [`base_and_metal`](crate::metal::base_and_metal) makes. Levels that are not there are averaged as they are.
///
/// # Errors
/// As those of [`bake_surface`].
///
/// # Panics
/// When a level has not as many bytes as texels.
pub fn bake_surface_and_metal(
    maps: &SurfaceMaps,
    options: SurfaceOptions,
    requests: &[SheetRequest],
    metallic: &[Vec<u8>],
    tick: &Tick<'_>,
) -> Result<BakedSurface, Error> {
    let size = maps.size();
    let authored = authored_directions(maps);
    let beside: Vec<Option<Vec<Rgba8Level>>> = requests
        .iter()
        .map(|request| -> Result<_, Error> {
            let image = match request.sheet {
                Sheet::KhrAnisotropy => authored.as_ref().map(|authored| authored.image),
                _ => request.packed_with,
            };
            let Some(image) = image else { return Ok(None) };
            let mut levels =
                plain_levels(image, size, Transfer::Linear, options.kernel, maps.wrap, &|_| tick(0))?;
            if request.sheet != Sheet::KhrAnisotropy {
                for (level, metallic) in levels.iter_mut().zip(metallic) {
                    assert_eq!(level.rgba8.len(), 4 * metallic.len(), "a byte of metalness for each texel");
                    for (texel, metallic) in level.rgba8.chunks_exact_mut(4).zip(metallic) {
                        texel[2] = *metallic;
                    }
                }
            }
            Ok(Some(levels))
        })
        .collect::<Result<_, Error>>()?;
    let turn = authored.map_or(Vec2::X, |authored| authored.turn);

    // Compress, band by band.
    let bands = filter_levels(maps, options.filter, options.kernel, |band| {
        let encoded = requests
            .iter()
            .zip(&beside)
            .map(|(request, beside)| {
                let beside = beside.as_ref().map(|levels| &levels[band.level]);
                encode_band(request, beside, turn, band)
            })
            .collect::<Result<Vec<Vec<u8>>, Error>>()?;
        let bands = level_size(size.1, band.level).div_ceil(BAND_ROWS);
        let measured = (band.y0 / BAND_ROWS).is_multiple_of(bands.div_ceil(MEASURED_BANDS));
        let errors = if measured { compression_error(requests, &encoded, band)? } else { Sums::default() };
        tick(u64::from(band.width) * u64::from(band.rows))?;
        Ok::<_, Error>((encoded, errors, probes(band, size)))
    })?;

    // Put the bands together.
    let levels = full_level_count(size.0, size.1);
    let columns = footprints(size.0, levels, options.kernel, maps.wrap[0]);
    let rows = footprints(size.1, levels, options.kernel, maps.wrap[1]);
    let mut textures: Vec<Texture> = requests
        .iter()
        .map(|request| Texture {
            format: request.encoding.format,
            transfer: Transfer::Linear,
            levels: Vec::with_capacity(levels),
            metadata: BTreeMap::new(),
        })
        .collect();
    let mut errors = Vec::with_capacity(levels);
    for (level, bands) in bands.into_iter().enumerate() {
        let (width, height) = (level_size(size.0, level), level_size(size.1, level));
        let mut data = vec![Vec::new(); requests.len()];
        let mut sums = Sums::default();
        let mut level_probes = Vec::new();
        for (encoded, band_sums, band_probes) in bands {
            for (all, part) in data.iter_mut().zip(encoded) {
                all.extend(part);
            }
            sums.add(&band_sums);
            level_probes.extend(band_probes);
        }
        let ndf: Vec<f64> = level_probes
            .par_iter()
            .filter(|_| level > 0)
            .map(|probe| {
                let (columns, rows) =
                    (&columns[level - 1][probe.x as usize], &rows[level - 1][probe.y as usize]);
                let (texels, weights) = footprint_texels(maps, columns, rows);
                f64::from(weighted_ndf_error(&texels, &weights, (probe.n, probe.a)).powi(2))
            })
            .collect();
        for (texture, data) in textures.iter_mut().zip(data) {
            texture.levels.push(Level { width, height, data });
        }
        let ndf_l2 = (ndf.iter().sum::<f64>() / ndf.len().max(1) as f64).sqrt() as f32;
        errors.push(LevelError { width, height, ndf_l2, ..sums.finish() });
    }
    Ok(BakedSurface { textures, levels: errors })
}

/// A painted direction map, whose signs matter: a lobe has none, but where neighbours disagree about theirs, a
/// sampler averages them to nothing.
struct AuthoredDirections<'a> {
    /// Red and green, mapped from [0, 1] to [−1, 1].
    image: &'a Image,
    /// Cosine and sine of the rotation added to the map's directions.
    turn: Vec2,
}

fn authored_directions(maps: &SurfaceMaps) -> Option<AuthoredDirections<'_>> {
    match &maps.roughness {
        RoughnessMaps::Khr { texture: Some(image), rotation, .. } => {
            Some(AuthoredDirections { image, turn: vec2(libm::cosf(*rotation), libm::sinf(*rotation)) })
        }
        RoughnessMaps::Gloss { direction: Some(DirectionMap::Vector(image)), .. } => {
            Some(AuthoredDirections { image, turn: Vec2::X })
        }
        _ => None,
    }
}

/// Compresses one band of one sheet; `beside` is the level of the image that the sheet is packed with, or of
/// the authored directions, which `turn` rotates.
fn encode_band(
    request: &SheetRequest,
    beside: Option<&Rgba8Level>,
    turn: Vec2,
    band: &Band,
) -> Result<Vec<u8>, Error> {
    let count = band.texels.len();
    let beside = beside.map(|level| {
        let start = band.y0 as usize * band.width as usize * 4;
        &level.rgba8[start..start + count * 4]
    });
    if request.encoding.format == Format::Rgba16F {
        let texels: Vec<[f32; 4]> =
            (0..count).map(|i| texel(request.sheet, &band.texels, i, beside, turn)).collect();
        return encode_half(&texels);
    }

    let mut rgba8 = vec![0; count * 4];
    dispatch(QuantiseBand { sheet: request.sheet, texels: &band.texels, beside, turn, out: &mut rgba8 });
    encode(request.encoding, &rgba8, band.width, band.rows)
}

/// RGBA of one texel of a sheet.
#[inline(always)]
fn texel(sheet: Sheet, texels: &TexelSpan, i: usize, beside: Option<&[u8]>, turn: Vec2) -> [f32; 4] {
    let (n, a) = texels.texel(i);
    let [r, g, b] = sheet.encode(n, a);
    let Some(beside) = beside else { return [r, g, b, 1.0] };
    let beside = [0, 1, 2, 3].map(|channel| f32::from(beside[4 * i + channel]) * (1.0 / 255.0));
    if sheet != Sheet::KhrAnisotropy {
        return [beside[0], g, beside[2], beside[3]];
    }

    let painted = turn.rotate(vec2(beside[0] * 2.0 - 1.0, beside[1] * 2.0 - 1.0));
    let direction = vec2(r * 2.0 - 1.0, g * 2.0 - 1.0);
    // Below half a step of 8 bits the lobe is round, and any direction is right: the painted one filters best.
    let direction = if b < 0.5 / 255.0 {
        painted.normalize_or(direction)
    } else if direction.dot(painted) < 0.0 {
        -direction
    } else {
        direction
    };
    [direction.x * 0.5 + 0.5, direction.y * 0.5 + 0.5, b, 1.0]
}

/// Texels quantised at a time.
const RUN: usize = 64;

/// Texels of a band to bytes.
struct QuantiseBand<'a> {
    sheet: Sheet,
    texels: &'a TexelSpan,
    beside: Option<&'a [u8]>,
    turn: Vec2,
    out: &'a mut [u8],
}

impl pulp::WithSimd for QuantiseBand<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        // The two sheets of every folder get loops of their own, in which the compiler finds vectors.
        match (self.sheet, self.beside) {
            (Sheet::Normal, None) => self.quantise(|n, a| Sheet::Normal.encode(n, a)),
            (Sheet::Aniso, None) => self.quantise(|n, a| Sheet::Aniso.encode(n, a)),
            _ => {
                for (i, out) in self.out.chunks_exact_mut(4).enumerate() {
                    let rgba = texel(self.sheet, self.texels, i, self.beside, self.turn);
                    out.copy_from_slice(&rgba.map(unorm8));
                }
            }
        }
    }
}

impl QuantiseBand<'_> {
    /// Opaque texels, by a formula for their RGB.
    #[inline(always)]
    fn quantise(self, encode: impl Fn(Vec3, Sym2) -> [f32; 3]) {
        let TexelSpan { nx, ny, nz, axx, axy, ayy, .. } = self.texels;
        let mut run = [[0.0; RUN]; 6];
        let mut packed = [0; RUN];
        for (x0, out) in (0..).step_by(RUN).zip(self.out.chunks_mut(4 * RUN)) {
            let len = out.len() / 4;
            for (run, plane) in run.iter_mut().zip([nx, ny, nz, axx, axy, ayy]) {
                run[..len].copy_from_slice(&plane[x0..x0 + len]);
            }
            let [nx, ny, nz, axx, axy, ayy] = &run;
            for i in 0..RUN {
                let a = Sym2 { xx: axx[i], xy: axy[i], yy: ayy[i] };
                let [r, g, b] = encode(vec3(nx[i], ny[i], nz[i]), a);
                packed[i] = u32::from_le_bytes([unorm8(r), unorm8(g), unorm8(b), 255]);
            }
            for (out, packed) in out.as_chunks_mut().0.iter_mut().zip(&packed) {
                *out = packed.to_le_bytes();
            }
        }
    }
}

/// Sums of squared errors.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: u64,
    angle: f64,
    largest: f32,
    alpha_t: f64,
    alpha_b: f64,
}

impl Sums {
    fn add(&mut self, o: &Sums) {
        self.count += o.count;
        self.angle += o.angle;
        self.largest = self.largest.max(o.largest);
        self.alpha_t += o.alpha_t;
        self.alpha_b += o.alpha_b;
    }

    fn finish(self) -> LevelError {
        let rms = |sum: f64| if self.count > 0 { (sum / self.count as f64).sqrt() as f32 } else { 0.0 };
        LevelError {
            normal_rms_degrees: rms(self.angle).to_degrees(),
            normal_max_degrees: self.largest.to_degrees(),
            alpha_t_rms: rms(self.alpha_t),
            alpha_b_rms: rms(self.alpha_b),
            ..LevelError::default()
        }
    }
}

/// Decodes a band again and compares the surface with what was encoded.
fn compression_error(requests: &[SheetRequest], encoded: &[Vec<u8>], band: &Band) -> Result<Sums, Error> {
    let decoded = |sheet: Sheet| -> Result<Option<Vec<[f32; 4]>>, Error> {
        let Some(i) = requests.iter().position(|r| r.sheet == sheet) else { return Ok(None) };
        decode(requests[i].encoding.format, &encoded[i], band.width, band.rows).map(Some)
    };
    let (normal, aniso) = (decoded(Sheet::Normal)?, decoded(Sheet::Aniso)?);
    let (roughness, anisotropy) = (decoded(Sheet::Roughness)?, decoded(Sheet::KhrAnisotropy)?);
    let isotropic = decoded(Sheet::IsotropicRoughness)?;
    let mut sums = Sums::default();
    for i in 0..band.texels.len() {
        let (n, mut a) = band.texels.texel(i);
        let flat = [0.5, 0.5, 1.0, 1.0];
        let texel = normal.as_ref().map_or(flat, |t| t[i]);
        let (stored_n, stored_a) = match (&aniso, &roughness, &isotropic) {
            (Some(t), ..) => decode_aniso(texel, t[i]),
            (None, Some(t), _) => decode_khr(texel, t[i][1], anisotropy.as_ref().map(|t| t[i])),
            (None, None, Some(t)) => {
                // What compression lost, not what leaving out the direction did.
                a = Sym2::scalar(0.5 * a.trace());
                decode_khr(texel, t[i][1], None)
            }
            (None, None, None) => (decode_aniso(texel, flat).0, a),
        };
        let angle =
            if normal.is_some() { libm::atan2f(n.cross(stored_n).length(), n.dot(stored_n)) } else { 0.0 };
        let (t, b, _) = a.eigen();
        let (stored_t, stored_b, _) = stored_a.eigen();
        sums.count += 1;
        sums.angle += f64::from(angle * angle);
        sums.largest = sums.largest.max(angle);
        sums.alpha_t += f64::from((t.sqrt() - stored_t.sqrt()).powi(2));
        sums.alpha_b += f64::from((b.sqrt() - stored_b.sqrt()).powi(2));
    }
    Ok(sums)
}

/// A texel whose footprint is looked at again.
struct Probe {
    x: u32,
    y: u32,
    n: Vec3,
    a: Sym2,
}

/// The texels of a band that belong to the level's grid of up to 4 × 4 probes.
fn probes(band: &Band, size: (u32, u32)) -> Vec<Probe> {
    let height = level_size(size.1, band.level);
    let grid = |len: u32| {
        let count = len.min(4);
        (0..count).map(move |i| ((2 * i + 1) * len / (2 * count)).min(len - 1))
    };
    grid(height)
        .filter(|y| (band.y0..band.y0 + band.rows).contains(y))
        .flat_map(|y| grid(band.width).map(move |x| (x, y)))
        .map(|(x, y)| {
            let (n, a) = band.texels.texel(((y - band.y0) * band.width + x) as usize);
            Probe { x, y, n, a }
        })
        .collect()
}

/// Up to 8 × 8 texels of level 0 spread over a footprint, and their weights, whose mean is one.
fn footprint_texels(maps: &SurfaceMaps, columns: &Taps, rows: &Taps) -> (Vec<(Vec3, Sym2)>, Vec<f32>) {
    let some = |taps: &Taps| -> Vec<u32> {
        let count = taps.len().min(8);
        // Every other one is drawn from one texel earlier: even steps would meet one phase of a weave only.
        let shift = |i| usize::from(taps.len() >= 16 && i % 2 == 1);
        (0..count).map(|i| taps[(2 * i + 1) * taps.len() / (2 * count) - shift(i)].0).collect()
    };
    let (mut texels, mut shares) = (Vec::new(), Vec::new());
    let mut span = TexelSpan::default();
    for row in some(rows) {
        for column in some(columns) {
            maps.decode_span(maps.size(), row, column, 1, &mut span);
            texels.push((vec3(span.nx[0], span.ny[0], span.nz[0]), span.texel(0).1));
            let weights = maps.weights.as_ref().map(|weights| weights.row(row, column, 1));
            shares.push(weights.map_or(1.0, |weights| weights::share(weights[0])));
        }
    }
    if maps.weights.is_some() {
        let mean = shares.iter().sum::<f32>() / shares.len() as f32;
        shares.iter_mut().for_each(|share| *share /= mean);
    }
    (texels, shares)
}
