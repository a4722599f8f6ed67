//! Images, levels and meshes as flat arrays.

use std::path::Path;
use std::sync::Arc;

use glam::{Vec3, Vec4};
use kinran_bake::aniso::{
    DirectionMap, Filter, Kernel, NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps,
    SurfaceOptions, bake_surface,
};
use kinran_bake::curvature::{Mesh, Method, Options, bake_curvature};
use kinran_bake::{Rgba8Level, compress_levels};
use kinran_image::{
    Channels, Encoder, Encoding, Error, Format, Image, Pixels, Preset, Texture, Transfer, decode_image,
    decode_layer, decode_texture, encode_dds, encode_ktx2, untold,
};
use kinran_scene::Wrap;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::errors::raise;

/// Flat floats, with the width, height and channels that they have.
type Flat<'py> = (Bound<'py, PyArray1<f32>>, u32, u32, usize);

fn floats(image: &Image) -> Vec<f32> {
    match &image.pixels {
        Pixels::U8(v) => v.iter().map(|&x| f32::from(x) / 255.0).collect(),
        Pixels::U16(v) => v.iter().map(|&x| f32::from(x) / 65535.0).collect(),
        Pixels::F32(v) => v.clone(),
    }
}

fn word(transfer: Transfer) -> &'static str {
    match transfer {
        Transfer::Linear => "linear",
        Transfer::Srgb => "srgb",
        Transfer::Unsaid => "unsaid",
    }
}

/// An image of a path, or of bytes that are called so: samples, what is said of its colours, and notes.
#[pyfunction]
#[pyo3(signature = (path, bytes=None, layer=None))]
pub(crate) fn read_image<'py>(
    py: Python<'py>,
    path: &str,
    bytes: Option<&[u8]>,
    layer: Option<&str>,
) -> PyResult<(Flat<'py>, &'static str, Vec<String>)> {
    let name = Path::new(path);
    let read = |bytes: &[u8]| match layer {
        Some(_) => decode_layer(name, bytes, layer),
        None => decode_image(name, bytes),
    };
    let image = py.detach(|| match bytes {
        Some(bytes) => read(bytes),
        None => std::fs::read(name).map_err(|e| Error::io(name, e)).and_then(|bytes| read(&bytes)),
    });
    let image = image.map_err(|error| raise(py, error))?;
    let flat = (PyArray1::from_vec(py, floats(&image)), image.width, image.height, image.channels.count());
    Ok((flat, word(image.transfer), image.notes))
}

/// Every level of a KTX2 or DDS file, four channels each; its format, what is said of its colours, and its keys.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub(crate) fn decode_levels<'py>(
    py: Python<'py>,
    name: &str,
    bytes: &[u8],
) -> PyResult<(Vec<Flat<'py>>, &'static str, &'static str, Vec<(String, String)>)> {
    let decoded = py.detach(|| -> Result<_, Error> {
        let texture = decode_texture(Path::new(name), bytes)?;
        let levels = (0..texture.levels.len()).map(|i| texture.decode_level(i));
        let levels = levels.collect::<Result<Vec<_>, Error>>()?;
        Ok((texture, levels))
    });
    let (texture, levels) = decoded.map_err(|error| raise(py, error))?;
    let levels = levels.into_iter().zip(&texture.levels).map(|(texels, level)| {
        (PyArray1::from_vec(py, texels.into_flattened()), level.width, level.height, 4)
    });
    let keys = texture.metadata.iter().map(|(key, value)| (key.clone(), value.clone())).collect();
    Ok((levels.collect(), texture.format.name(), word(texture.transfer), keys))
}

/// A KTX2 or DDS file of levels with four channels each, from 0 to 1.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn encode_levels<'py>(
    py: Python<'py>,
    levels: Vec<(PyReadonlyArray1<'py, f32>, u32, u32)>,
    format: &str,
    srgb: bool,
    container: &str,
    encoder: &str,
    preset: &str,
    zstd: i32,
    keys: Vec<(String, String)>,
) -> PyResult<Vec<u8>> {
    let encoding = Encoding {
        format: named("format", format, Format::ALL.map(|f| (f.name(), f)))?,
        encoder: named("encoder", encoder, [("ispc", Encoder::Ispc), ("portable", Encoder::Portable)])?,
        preset: named(
            "preset",
            preset,
            [("fast", Preset::Fast), ("normal", Preset::Normal), ("best", Preset::Best)],
        )?,
    };
    let is_dds = named("container", container, [("ktx2", false), ("dds", true)])?;
    let transfer = if srgb { Transfer::Srgb } else { Transfer::Linear };
    let code = |v: &f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let mut all = Vec::new();
    for (floats, width, height) in &levels {
        let floats = floats.as_slice()?;
        all.push(Rgba8Level { width: *width, height: *height, rgba8: floats.iter().map(code).collect() });
    }
    let file = py.detach(|| -> Result<_, Error> {
        let mut texture: Texture = compress_levels(&all, transfer, encoding, &untold)?;
        texture.metadata.extend(keys);
        if is_dds { encode_dds(&texture) } else { encode_ktx2(&texture, (zstd > 0).then_some(zstd)) }
    });
    file.map_err(|error| raise(py, error))
}

/// The value of a name; an error that lists them all.
fn named<T, const N: usize>(what: &str, name: &str, known: [(&str, T); N]) -> PyResult<T> {
    let names: Vec<String> = known.iter().map(|(name, _)| (*name).to_owned()).collect();
    let found = known.into_iter().find(|(known, _)| *known == name);
    found
        .map(|(_, value)| value)
        .ok_or_else(|| PyValueError::new_err(format!("{what}='{name}': it is one of {}", names.join(", "))))
}

/// The levels of a surface: normals as vectors, three floats each, and squared roughness (xx, xy, yy), three floats each.
#[pyfunction]
#[pyo3(signature = (size, normal, roughness, across, direction, filter, kernel, wrap))]
#[allow(clippy::too_many_arguments, clippy::type_complexity)]
pub(crate) fn filter_surface<'py>(
    py: Python<'py>,
    size: (u32, u32),
    normal: Option<PyReadonlyArray1<'py, f32>>,
    roughness: PyReadonlyArray1<'py, f32>,
    across: Option<PyReadonlyArray1<'py, f32>>,
    direction: Option<PyReadonlyArray1<'py, f32>>,
    filter: &str,
    kernel: &str,
    wrap: &str,
) -> PyResult<Vec<(u32, u32, Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>)>> {
    let options = SurfaceOptions {
        filter: named("filter", filter, Filter::ALL.map(|f| (f.name(), f)))?,
        kernel: named("kernel", kernel, [("box", Kernel::Box), ("tent", Kernel::Tent)])?,
    };
    let wraps = [("wrap", Wrap::Repeat), ("clamp", Wrap::Clamp), ("mirror", Wrap::Mirror)];
    let wrap = [named("edges", wrap, wraps)?; 2];
    let image = |channels, floats: Vec<f32>| {
        Image::new(size.0, size.1, channels, Pixels::F32(floats)).map(Arc::new).map_err(|e| raise(py, e))
    };
    let grey = |array: &PyReadonlyArray1<'py, f32>, of: fn(&f32) -> f32| -> PyResult<ScalarMap> {
        Ok(ScalarMap::channel(image(Channels::R, array.as_slice()?.iter().map(of).collect())?, 0))
    };
    // Vectors as codes, so that no float image is taken for signed by its content.
    let codes = |array: &PyReadonlyArray1<'py, f32>| -> PyResult<Vec<f32>> {
        Ok(array.as_slice()?.iter().map(|v| 0.5 * v + 0.5).collect())
    };
    let normal = match &normal {
        Some(normal) => NormalMap::gltf(image(Channels::Rgb, codes(normal)?)?, 1.0),
        None => NormalMap::flat(),
    };
    let roughness = match &across {
        None => RoughnessMaps::Isotropic(grey(&roughness, |r| *r)?),
        Some(across) => RoughnessMaps::Gloss {
            u: grey(&roughness, |r| 1.0 - r)?,
            v: grey(across, |r| 1.0 - r)?,
            direction: match &direction {
                Some(direction) => {
                    // Of two channels the second would be alpha.
                    let codes = codes(direction)?;
                    let codes = codes.chunks_exact(2).flat_map(|d| [d[0], d[1], 0.5]).collect();
                    Some(DirectionMap::Vector(image(Channels::Rgb, codes)?))
                }
                None => None,
            },
        },
    };
    let maps = SurfaceMaps { normal, roughness, wrap, weights: None };
    let encoding = Encoding { format: Format::Rgba16F, encoder: Encoder::Portable, preset: Preset::Normal };
    let request = |sheet| SheetRequest { sheet, encoding, packed_with: None };
    let baked = py.detach(|| {
        let baked = bake_surface(&maps, options, &[request(Sheet::Normal), request(Sheet::Aniso)], &untold)?;
        let levels = |texture: &Texture| {
            (0..texture.levels.len()).map(|i| texture.decode_level(i)).collect::<Result<Vec<_>, Error>>()
        };
        let (normals, texels) = (levels(&baked.textures[0])?, levels(&baked.textures[1])?);
        Ok::<_, Error>((
            baked.textures[0].levels.iter().map(|l| (l.width, l.height)).collect::<Vec<_>>(),
            normals,
            texels,
        ))
    });
    let (sizes, normals, texels) = baked.map_err(|error| raise(py, error))?;
    let levels = sizes.into_iter().zip(normals).zip(texels).map(|(((width, height), normals), texels)| {
        let vectors = normals
            .iter()
            .flat_map(|n| (2.0 * Vec3::new(n[0], n[1], n[2]) - 1.0).normalize_or(Vec3::Z).to_array());
        let matrices = texels.iter().flat_map(|t| {
            let s = kinran_shading::aniso_decode_matrix(Vec3::new(t[0], t[1], t[2]));
            [s.xx, s.xy, s.yy]
        });
        let flat = |floats: Vec<f32>| PyArray1::from_vec(py, floats);
        (width, height, flat(vectors.collect()), flat(matrices.collect()))
    });
    Ok(levels.collect())
}

/// Curvature of a mesh: tensors (xx, xy, yy) in 1/mm, the tangents in whose frame they are, and the report as JSON.
#[pyfunction]
#[allow(clippy::too_many_arguments, clippy::type_complexity)]
#[pyo3(signature = (positions, triangles, normals, tangents, method, millimetres, blur, clamp))]
pub(crate) fn curvature<'py>(
    py: Python<'py>,
    positions: PyReadonlyArray1<'py, f32>,
    triangles: PyReadonlyArray1<'py, u32>,
    normals: Option<PyReadonlyArray1<'py, f32>>,
    tangents: Option<PyReadonlyArray1<'py, f32>>,
    method: &str,
    millimetres: f64,
    blur: Option<Vec<f64>>,
    clamp: bool,
) -> PyResult<(Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>, String)> {
    let method = named("method", method, [("normals", Method::Normals), ("fit", Method::Fit)])?;
    let vectors = |array: &PyReadonlyArray1<'py, f32>| -> PyResult<Vec<Vec3>> {
        Ok(array.as_slice()?.chunks_exact(3).map(Vec3::from_slice).collect())
    };
    let positions = vectors(&positions)?;
    let triangles: Vec<[u32; 3]> = triangles.as_slice()?.as_chunks::<3>().0.to_vec();
    let normals = normals.as_ref().map(vectors).transpose()?;
    let tangents: Option<Vec<Vec4>> = match &tangents {
        Some(array) => Some(array.as_slice()?.chunks_exact(4).map(Vec4::from_slice).collect()),
        None => None,
    };
    let mut options = Options { method, millimetres, clamp, ..Options::default() };
    options.blur = blur.unwrap_or(options.blur);
    let mesh = Mesh {
        positions: &positions,
        normals: normals.as_deref(),
        tangents: tangents.as_deref(),
        triangles: &triangles,
    };
    let baked = py.detach(|| bake_curvature(&mesh, &options, &untold));
    let baked = baked.map_err(|error| PyValueError::new_err(error.to_string()))?;
    let tensors = baked.tensors.iter().flat_map(|s| [s.xx, s.xy, s.yy]).collect();
    let tangents = baked.tangents.iter().flat_map(|t| t.to_array()).collect();
    let report = serde_json::to_string(&baked.report).unwrap_or_else(|_| "{}".into());
    Ok((PyArray1::from_vec(py, tensors), PyArray1::from_vec(py, tangents), report))
}
