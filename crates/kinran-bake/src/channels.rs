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
    let channels = image.channels as usize;
    let asked = channel;
    // Grey images answer for red, green and blue; images without alpha are opaque.
    let channel = match (channels, channel) {
        (1 | 3, 3) => {
            out.fill(1.0);
            return;
        }
        (2, 3) => 1,
        (1 | 2, _) => 0,
        _ => channel,
    };
    if (image.width, image.height) == at.size {
        let start = (at.y as usize * image.width as usize + at.x0 as usize) * channels;
        let range = start..start + out.len() * channels;
        match &image.pixels {
            Pixels::U8(data) => {
                deinterleave(&data[range], channels, channel, |v| f32::from(v) * (1.0 / 255.0), out)
            }
            Pixels::U16(data) => {
                deinterleave(&data[range], channels, channel, |v| f32::from(v) * (1.0 / 65535.0), out)
            }
            Pixels::F32(data) => deinterleave(&data[range], channels, channel, |v| v, out),
        }
        return;
    }

    let along = |i: u32, from: u32, to: u32, wrap: Wrap| {
        let center = (f64::from(i) + 0.5) * f64::from(from) / f64::from(to) - 0.5;
        let lower = center.floor();
        (wrapped(lower as i64, from, wrap), wrapped(lower as i64 + 1, from, wrap), (center - lower) as f32)
    };
    let (row0, row1, fy) = along(at.y, image.height, at.size.1, at.wrap[1]);
    for (x, o) in (at.x0..).zip(out) {
        let (col0, col1, fx) = along(x, image.width, at.size.0, at.wrap[0]);
        let sample = |col, row| image.texel(col, row)[asked];
        let upper = sample(col0, row0) + (sample(col1, row0) - sample(col0, row0)) * fx;
        let lower = sample(col0, row1) + (sample(col1, row1) - sample(col0, row1)) * fx;
        *o = upper + (lower - upper) * fy;
    }
}

/// Every `channels`-th sample, converted. Picking samples and converting them are loops of their own: only so
/// does the compiler find the byte shuffles for the first.
#[inline(always)]
fn deinterleave<T: Copy + Default>(
    data: &[T],
    channels: usize,
    channel: usize,
    convert: impl Fn(T) -> f32,
    out: &mut [f32],
) {
    #[inline(always)]
    fn pick<const N: usize, T: Copy>(data: &[T], channel: usize, plane: &mut [T]) {
        assert!(channel < N, "channel {channel} of {N}");
        for (p, texel) in plane.iter_mut().zip(data.chunks_exact(N)) {
            *p = texel[channel];
        }
    }
    let mut plane = [T::default(); 128];
    for (data, out) in data.chunks(plane.len() * channels).zip(out.chunks_mut(plane.len())) {
        let plane = &mut plane[..out.len()];
        match channels {
            1 => plane.copy_from_slice(data),
            2 => pick::<2, T>(data, channel, plane),
            3 => pick::<3, T>(data, channel, plane),
            _ => pick::<4, T>(data, channel, plane),
        }
        for (o, v) in out.iter_mut().zip(plane) {
            *o = convert(*v);
        }
    }
}
