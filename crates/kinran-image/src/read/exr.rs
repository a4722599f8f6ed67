//! OpenEXR: one layer of one part, flat.
//!
//! A layer is what the channels of a part have in front of their last dot, `normal` of `normal.X`. In a file of several
//! parts the part's name goes before it.

use std::io::{Read, Seek};

use exr::block::reader::ChunksReader;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Chromaticities, SampleType};
use exr::meta::header::Header;
use half::f16;

use super::{check_claims, finite_image, unassociate};
use crate::{Channels, Image, Pixels, Transfer};

/// The layer called `wanted`; without a name the one that has none, or the only one, else `advice` is given.
pub(super) fn decode(
    mut file: impl Read + Seek + Send,
    stored: u64,
    wanted: Option<&str>,
    advice: &str,
) -> Result<Image, String> {
    let damaged = |e: exr::error::Error| match e {
        exr::error::Error::NotSupported(e) => format!("{e}; save it flat, with ZIP compression"),
        e => format!("{e}; the file is damaged or truncated, save it again"),
    };
    let meta = MetaData::read_from_buffered(&mut file, false).map_err(damaged)?;
    file.rewind().map_err(|e| e.to_string())?;
    if meta.headers.iter().any(|header| header.deep) {
        return Err("it holds deep data; save it without, or flatten it".into());
    }
    let layers = layers(&meta.headers);
    let layer = &layers[choose(&layers, wanted, advice)?];
    let header = &meta.headers[layer.part];

    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (width, height) = (side(header.layer_size.width()), side(header.layer_size.height()));
    let texel_bytes: usize = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
    check_claims(width, height, texel_bytes as u64, stored)?;
    if header.channels.list.iter().any(|c| (c.sampling.x(), c.sampling.y()) != (1, 1)) {
        return Err("it has subsampled channels; save it as RGB".into());
    }
    let window = header.shared_attributes.display_window;
    if (window.position, window.size) != (header.own_attributes.layer_position, header.layer_size) {
        return Err("its data window is not its display window; crop or extend it to the picture".into());
    }

    // Read the blocks of this part, and of them the lines of these channels.
    let n = layer.planes.len();
    let mut missing = width as usize * height as usize * n;
    let mut samples = vec![f32::NAN; missing];
    let insert = |meta: &MetaData, block: exr::block::UncompressedBlock| {
        for line in block.lines(&meta.headers[layer.part].channels) {
            let Some(c) = layer.planes.iter().position(|&plane| plane == line.location.channel) else {
                continue;
            };
            let at = line.location.position.y() * width as usize + line.location.position.x();
            let texels = samples[at * n..].iter_mut().skip(c).step_by(n);
            match meta.headers[layer.part].channels.list[line.location.channel].sample_type {
                SampleType::F16 => {
                    for (sample, value) in texels.zip(line.read_samples::<f16>()) {
                        *sample = value?.to_f32();
                    }
                }
                _ => {
                    for (sample, value) in texels.zip(line.read_samples::<f32>()) {
                        *sample = value?;
                    }
                }
            }
            missing = missing.saturating_sub(line.location.sample_count);
        }
        Ok(())
    };
    let is_level_0 = |level: exr::math::Vec2<usize>| (level.x(), level.y()) == (0, 0);
    exr::block::read(file, false)
        .and_then(|reader| {
            reader.filter_chunks(false, |_, _, block| block.layer == layer.part && is_level_0(block.level))
        })
        .and_then(|chunks| chunks.decompress_parallel(false, insert))
        .map_err(damaged)?;
    if missing > 0 {
        return Err("blocks of texels are missing; the file is damaged or truncated, save it again".into());
    }

    let channels = [Channels::R, Channels::Rg, Channels::Rgb, Channels::Rgba][n - 1];
    let mut image = finite_image(width, height, channels, Pixels::F32(samples))?;
    if layer.alpha {
        image = unassociate(image);
    }
    image.notes.extend(choice(&layers, layer));
    color_of(header, &mut image);
    Ok(image)
}

/// Channels of a part that belong together.
struct Layer {
    part: usize,
    /// As it is called to a person; empty where nothing gives it a name.
    name: String,
    /// All its channels: the index in the part, and what follows the last dot.
    channels: Vec<(usize, String)>,
    /// Those that are an image: R, G, B; X, Y, Z; Y or one of any name; and A. Indices into the part's; empty where they
    /// are no image.
    planes: Vec<usize>,
    alpha: bool,
}

fn layers(headers: &[Header]) -> Vec<Layer> {
    let mut layers: Vec<Layer> = Vec::new();
    for (part, header) in headers.iter().enumerate() {
        let own = header.own_attributes.layer_name.as_ref().map(ToString::to_string).unwrap_or_default();
        let first = layers.len();
        // Channels with the part's index, by the name of their layer in it.
        let mut members: Vec<(String, Vec<(usize, String)>)> = Vec::new();
        for (i, channel) in header.channels.list.iter().enumerate() {
            let full = channel.name.to_string();
            let (prefix, last) = full.rsplit_once('.').unwrap_or(("", &full));
            match members.iter_mut().find(|(name, _)| name == prefix) {
                Some((_, channels)) => channels.push((i, last.to_owned())),
                None => members.push((prefix.to_owned(), vec![(i, last.to_owned())])),
            }
        }
        layers.extend(members.into_iter().map(|(prefix, channels)| {
            let name = match (headers.len() > 1, prefix.as_str()) {
                (false, _) => prefix,
                (true, "") => own.clone(),
                (true, prefix) if own.is_empty() || prefix == own => prefix.to_owned(),
                (true, prefix) => format!("{own}.{prefix}"),
            };
            let integers = |i: usize| header.channels.list[i].sample_type == SampleType::U32;
            let (planes, alpha) = image_of(&channels);
            let planes = if planes.iter().any(|&i| integers(i)) { Vec::new() } else { planes };
            Layer { part, name, channels, planes, alpha }
        }));
        layers[first..].sort_by(|a, b| a.name.cmp(&b.name));
    }
    layers
}

/// The channels that are an image, and whether alpha is among them.
fn image_of(channels: &[(usize, String)]) -> (Vec<usize>, bool) {
    let find =
        |wanted: &str| channels.iter().find(|(_, name)| name.eq_ignore_ascii_case(wanted)).map(|c| c.0);
    let three = |names: [&str; 3]| names.into_iter().map(find).collect::<Option<Vec<usize>>>();
    let alpha = find("A").filter(|_| channels.len() > 1);
    let others: Vec<usize> = channels.iter().map(|c| c.0).filter(|i| Some(*i) != alpha).collect();
    let only = (others.len() == 1).then_some(others);
    let grey = || if find("R").is_some() { None } else { find("Y").map(|y| vec![y]) };
    let mut planes =
        three(["R", "G", "B"]).or_else(|| three(["X", "Y", "Z"])).or(only).or_else(grey).unwrap_or_default();
    let alpha = alpha.filter(|_| !planes.is_empty());
    planes.extend(alpha);
    (planes, alpha.is_some())
}

/// Which layer is meant.
fn choose(layers: &[Layer], wanted: Option<&str>, advice: &str) -> Result<usize, String> {
    let images: Vec<usize> = (0..layers.len()).filter(|&i| !layers[i].planes.is_empty()).collect();
    let names = |of: &[usize]| {
        let names: Vec<String> = of.iter().map(|&i| called(&layers[i])).collect();
        names.join(", ")
    };
    if images.is_empty() {
        let channels: Vec<String> =
            layers.iter().flat_map(|layer| layer.channels.iter().map(|(_, c)| full_name(layer, c))).collect();
        return Err(format!(
            "its channels are {}; wanted are R, G, B, or X, Y, Z, or Y, and A, in floats",
            channels.join(", ")
        ));
    }
    if let Some(wanted) = wanted {
        let named = images.iter().copied().find(|&i| layers[i].name.eq_ignore_ascii_case(wanted));
        return named.ok_or_else(|| {
            format!("it has no layer \"{wanted}\" that is an image; its layers are {}", names(&images))
        });
    }
    let unnamed: Vec<usize> = images.iter().copied().filter(|&i| layers[i].name.is_empty()).collect();
    match (&unnamed[..], &images[..]) {
        ([only], _) | ([], [only]) => Ok(*only),
        _ => Err(format!("it has several layers, {}, and none without a name; {advice}", names(&images))),
    }
}

fn called(layer: &Layer) -> String {
    if !layer.name.is_empty() {
        return layer.name.clone();
    }
    let channels: Vec<&str> = layer.channels.iter().map(|(_, name)| name.as_str()).collect();
    format!("one without a name ({})", channels.join(", "))
}

fn full_name(layer: &Layer, channel: &str) -> String {
    if layer.name.is_empty() { channel.to_owned() } else { format!("{}.{channel}", layer.name) }
}

/// What was taken and what was left out, where there was something to choose.
fn choice(layers: &[Layer], taken: &Layer) -> Option<String> {
    let others = layers.iter().filter(|layer| !std::ptr::eq(*layer, taken)).map(called);
    let spare = taken.channels.iter().filter(|(i, _)| !taken.planes.contains(i));
    let left: Vec<String> = others.chain(spare.map(|(_, name)| full_name(taken, name))).collect();
    let first = taken.channels.iter().find(|(i, _)| *i == taken.planes[0]);
    let as_vector = taken.planes.len() >= 3 && first.is_some_and(|(_, name)| name.eq_ignore_ascii_case("X"));

    let mut words = Vec::new();
    if !taken.name.is_empty() {
        words.push(format!("layer \"{}\"", taken.name));
    } else if !left.is_empty() {
        words.push("the layer without a name".into());
    }
    if as_vector {
        words.push("X, Y, Z as red, green, blue".into());
    }
    if !left.is_empty() {
        words.push(format!("left out: {}", left.join(", ")));
    }
    (!words.is_empty()).then(|| words.join("; "))
}

/// Sets what a part says of its colour. `colorInteropID` is the ASWF Color Interop Forum's, written by Blender since 5.0.
fn color_of(header: &Header, image: &mut Image) {
    let id = header.own_attributes.other.iter().find(|(name, _)| **name == *"colorInteropID");
    let id = match id {
        Some((_, AttributeValue::Text(text))) => text.to_string(),
        _ => String::new(),
    };
    if id.starts_with("srgb_") {
        image.transfer = Transfer::Srgb;
    }
    let encodings = ["lin_", "srgb_", "data", "unknown", "raw"];
    if !id.is_empty() && !encodings.iter().any(|known| id.starts_with(known)) {
        image
            .notes
            .push(format!("its colours are said to be \"{id}\", which is not known here; taken as linear"));
    } else if (id.starts_with("lin_") || id.starts_with("srgb_")) && !id.contains("rec709") {
        image.notes.push(format!("its colours are said to be \"{id}\"; they are taken as if of Rec. 709"));
    } else if id.is_empty()
        && let Some(given) = header.shared_attributes.chromaticities
        && !is_rec_709(given)
    {
        let (r, g, b) = (given.red, given.green, given.blue);
        image.notes.push(format!(
            "its primaries are ({}, {}), ({}, {}), ({}, {}); colours are taken as if of Rec. 709",
            r.x(),
            r.y(),
            g.x(),
            g.y(),
            b.x(),
            b.y()
        ));
    }
}

/// Whether primaries are those of Rec. 709 within rounding.
fn is_rec_709(given: Chromaticities) -> bool {
    let wanted = [(0.64, 0.33), (0.3, 0.6), (0.15, 0.06), (0.3127, 0.329)];
    let given = [given.red, given.green, given.blue, given.white];
    given.iter().zip(wanted).all(|(g, (x, y))| (g.x() - x).abs() < 2e-3 && (g.y() - y).abs() < 2e-3)
}
