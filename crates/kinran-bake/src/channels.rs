//! Channels of images as rows of floats.

use kinran_image::{Image, Pixels};
use kinran_scene::Wrap;

/// Which texels of level 0 are asked for.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    /// Level 0's size.
    pub(crate) size: (u32, u32),
    /// Row.
    pub(crate) y: u32,
    /// First column.
    pub(crate) x0: u32,
    /// What lies beyond the borders.
    pub(crate) wrap: [Wrap; 2],
}

/// Index of the texel that stands at `i`, possibly beyond the borders of a row of `len`.
pub(crate) fn wrapped(i: i64, len: u32, wrap: Wrap) -> u32 {
    let len = i64::from(len);
    let inside = match wrap {
        Wrap::Repeat => i.rem_euclid(len),
        Wrap::Clamp => i.clamp(0, len - 1),
        Wrap::Mirror => {
            let j = i.rem_euclid(2 * len);
            j.min(2 * len - 1 - j)
        }
    };
    inside as u32
}

/// Reads one channel, normalised; enlarges bilinearly where the image is smaller than level 0.
#[inline(always)]
pub(crate) fn read_channel(image: &Image, channel: usize, at: Place, out: &mut [f32]) {
    read_channels(image, [channel], at, [out]);
}

/// [`read_channel`] of several channels at once, of one length.
#[inline(always)]
pub(crate) fn read_channels<const K: usize>(
    image: &Image,
    channels: [usize; K],
    at: Place,
    out: [&mut [f32]; K],
) {
    if (image.width, image.height) != at.size {
        for (channel, out) in channels.into_iter().zip(out) {
            enlarge_channel(image, channel, at, out);
        }
        return;
    }
    // Grey images answer for red, green and blue; images without alpha are opaque.
    let stored = image.channels as usize;
    let planes = channels.map(|channel| match (stored, channel) {
        (1 | 3, 3) => OPAQUE,
        (2, 3) => 1,
        (1 | 2, _) => 0,
        _ => channel,
    });
    let start = (at.y as usize * image.width as usize + at.x0 as usize) * stored;
    let range = start..start + out.first().map_or(0, |out| out.len()) * stored;
    match &image.pixels {
        Pixels::U8(data) => deinterleave(&data[range], stored, planes, |v| f32::from(v) * (1.0 / 255.0), out),
        Pixels::U16(data) => {
            deinterleave(&data[range], stored, planes, |v| f32::from(v) * (1.0 / 65535.0), out);
        }
        Pixels::F32(data) => deinterleave(&data[range], stored, planes, |v| v, out),
    }
}

/// Reads one channel of an image that is smaller than level 0, bilinearly.
#[inline(always)]
fn enlarge_channel(image: &Image, channel: usize, at: Place, out: &mut [f32]) {
    let along = |i: u32, from: u32, to: u32, wrap: Wrap| {
        let center = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
        let lower = center.floor();
        (wrapped(lower as i64, from, wrap), wrapped(lower as i64 + 1, from, wrap), (center - lower) as f32)
    };
    let (row0, row1, fy) = along(at.y, image.height, at.size.1, at.wrap[1]);
    for (x, o) in (at.x0..).zip(out) {
        let (col0, col1, fx) = along(x, image.width, at.size.0, at.wrap[0]);
        let sample = |col, row| image.texel(col, row)[channel];
        let upper = sample(col0, row0) + (sample(col1, row0) - sample(col0, row0)) * fx;
        let lower = sample(col0, row1) + (sample(col1, row1) - sample(col0, row1)) * fx;
        *o = upper + (lower - upper) * fy;
    }
}

/// Texels taken apart at a time.
const RUN: usize = 64;

/// The plane of ones, after the four of an image.
const OPAQUE: usize = 4;

/// Takes interleaved samples of `stored` channels apart and hands out the planes asked for. Picking samples and
/// converting them are loops of their own, of known lengths: only so does the compiler find shuffles for both.
#[inline(always)]
fn deinterleave<T: Copy + Default, const K: usize>(
    data: &[T],
    stored: usize,
    planes: [usize; K],
    convert: impl Fn(T) -> f32 + Copy,
    out: [&mut [f32]; K],
) {
    match stored {
        1 => deinterleave_by::<T, 1, K>(data, planes, convert, out),
        2 => deinterleave_by::<T, 2, K>(data, planes, convert, out),
        3 => deinterleave_by::<T, 3, K>(data, planes, convert, out),
        _ => deinterleave_by::<T, 4, K>(data, planes, convert, out),
    }
}

#[inline(always)]
fn deinterleave_by<T: Copy + Default, const N: usize, const K: usize>(
    data: &[T],
    planes: [usize; K],
    convert: impl Fn(T) -> f32,
    mut out: [&mut [f32]; K],
) {
    let mut padded = [[T::default(); N]; RUN];
    let mut apart = [[T::default(); RUN]; N];
    for (run, data) in data.as_chunks::<N>().0.chunks(RUN).enumerate() {
        let data: &[[T; N]; RUN] = data.try_into().unwrap_or_else(|_| {
            padded[..data.len()].copy_from_slice(data);
            &padded
        });
        for i in 0..RUN {
            for channel in 0..N {
                apart[channel][i] = data[i][channel];
            }
        }
        for (out, plane) in out.iter_mut().zip(planes) {
            let out = &mut out[run * RUN..];
            let Some(plane) = apart.get(plane) else {
                out.fill(1.0);
                continue;
            };
            match out.first_chunk_mut::<RUN>() {
                Some(out) => out.iter_mut().zip(plane).for_each(|(o, v)| *o = convert(*v)),
                None => out.iter_mut().zip(plane).for_each(|(o, v)| *o = convert(*v)),
            }
        }
    }
}
