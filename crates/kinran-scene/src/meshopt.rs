//! Buffer views of `EXT_meshopt_compression` and `KHR_meshopt_compression`, by the bitstreams and filters of those
//! extensions' appendices A and B.

/// Elements decoded together share a group; the last group of a block may be longer than the block.
const GROUP: usize = 16;

/// What every reason below means for a person who has the file.
type Result<T> = std::result::Result<T, &'static str>;

const CUT: &str = "its stream is cut off";
const LONG: &str = "its stream has bytes left over";

/// Bytes that are read from the front.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(CUT)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8> {
        Ok(self.take(1)?[0])
    }

    /// Seven bits a byte, the lowest first.
    fn varint(&mut self) -> Result<u32> {
        let mut value = 0u32;
        for i in 0..5 {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << (7 * i);
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("its stream has a number of more than five bytes")
    }

    fn end(&self) -> Result<()> {
        if self.0.is_empty() { Ok(()) } else { Err(LONG) }
    }
}

/// Mode `ATTRIBUTES`: `count` elements of `stride` bytes.
pub(crate) fn attributes(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>> {
    if stride == 0 || !stride.is_multiple_of(4) || stride > 256 {
        return Err("its byteStride is not a multiple of 4 up to 256");
    }
    let first_version = match data.first() {
        Some(0xa0) => true,
        Some(0xa1) => false,
        _ => return Err("it is no stream of attributes"),
    };
    let (modes_size, least_tail) = if first_version { (0, 32) } else { (stride / 4, 24) };
    let tail = (stride + modes_size).max(least_tail);
    let end = data.len().checked_sub(tail).filter(|&end| end > 0).ok_or(CUT)?;
    let last = &data[data.len() - stride - modes_size..];
    let (baseline, modes) = last.split_at(stride);
    if modes.iter().any(|mode| mode & 15 > 2 || mode & 15 < 2 && mode >> 4 > 0) {
        return Err("a channel of its stream has an unknown mode");
    }

    let mut reader = Reader(&data[1..end]);
    let mut before = baseline.to_vec();
    let mut out = vec![0; count * stride];
    let block_elements = ((8192 / stride) & !(GROUP - 1)).min(256);
    let mut lanes = vec![[0u8; 256]; stride];
    for block in out.chunks_mut(block_elements * stride) {
        let elements = block.len() / stride;
        let controls = reader.take(modes_size)?;
        for (byte, lane) in lanes.iter_mut().enumerate() {
            let control = controls.get(byte / 4).map(|control| control >> (2 * (byte % 4)) & 3);
            deltas(&mut reader, control, elements, lane)?;
        }
        for channel in 0..stride / 4 {
            let mode = modes.get(channel).copied().unwrap_or(0);
            let at = 4 * channel;
            let mut word: [u8; 4] = [before[at], before[at + 1], before[at + 2], before[at + 3]];
            for (element, out) in block.chunks_exact_mut(stride).enumerate() {
                let delta = [0, 1, 2, 3].map(|i| lanes[at + i][element]);
                word = undo(word, delta, mode);
                out[at..at + 4].copy_from_slice(&word);
            }
            before[at..at + 4].copy_from_slice(&word);
        }
    }
    reader.end()?;
    Ok(out)
}

/// The value after `before`, by a channel's mode.
fn undo(before: [u8; 4], delta: [u8; 4], mode: u8) -> [u8; 4] {
    match mode & 15 {
        0 => std::array::from_fn(|i| {
            let change = if delta[i] & 1 != 0 { !(delta[i] >> 1) } else { delta[i] >> 1 };
            before[i].wrapping_add(change)
        }),
        1 => {
            let half = |i: usize| {
                let delta = u16::from_le_bytes([delta[i], delta[i + 1]]);
                let change = if delta & 1 != 0 { !(delta >> 1) } else { delta >> 1 };
                u16::from_le_bytes([before[i], before[i + 1]]).wrapping_add(change).to_le_bytes()
            };
            let ([a, b], [c, d]) = (half(0), half(2));
            [a, b, c, d]
        }
        _ => {
            let turned = u32::from_le_bytes(delta).rotate_right(u32::from(mode >> 4));
            (u32::from_le_bytes(before) ^ turned).to_le_bytes()
        }
    }
}

/// One byte's deltas of a block; `control` is `None` in version 0.
fn deltas(reader: &mut Reader<'_>, control: Option<u8>, elements: usize, lane: &mut [u8; 256]) -> Result<()> {
    // Bits of a delta by a group's header.
    let widths: [usize; 4] = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            lane.fill(0);
            return Ok(());
        }
        Some(_) => {
            lane[..elements].copy_from_slice(reader.take(elements)?);
            return Ok(());
        }
    };
    let groups = elements.div_ceil(GROUP);
    let headers = reader.take(groups.div_ceil(4))?;
    for group in 0..groups {
        let width = widths[usize::from(headers[group / 4] >> (2 * (group % 4)) & 3)];
        let out = &mut lane[group * GROUP..(group + 1) * GROUP];
        match width {
            0 => out.fill(0),
            8 => out.copy_from_slice(reader.take(GROUP)?),
            _ => {
                let packed = reader.take(GROUP * width / 8)?;
                let sentinel = (1u8 << width) - 1;
                let per_byte = 8 / width;
                for (i, out) in out.iter_mut().enumerate() {
                    // Single bits begin at the lowest, others at the highest.
                    let place = if width == 1 { i % 8 } else { 8 - width - width * (i % per_byte) };
                    let small = packed[i / per_byte] >> place & sentinel;
                    *out = if small == sentinel { reader.byte()? } else { small };
                }
            }
        }
    }
    Ok(())
}

/// The sixteen entries written last.
struct Fifo<T>(Vec<T>);

impl<T: Copy> Fifo<T> {
    fn push(&mut self, value: T) {
        self.0.push(value);
    }

    /// Number `age` from the last one.
    fn get(&self, age: u8) -> Result<T> {
        let at = self.0.len().checked_sub(1 + usize::from(age));
        at.map(|at| self.0[at]).ok_or("its stream refers to what was not there yet")
    }
}

/// Mode `TRIANGLES`: `count` indices.
pub(crate) fn triangles(data: &[u8], count: usize) -> Result<Vec<u32>> {
    const TABLE: usize = 16;
    if !count.is_multiple_of(3) {
        return Err("its count is no multiple of 3");
    }
    if data.first() != Some(&0xe1) {
        return Err("it is no stream of triangles");
    }
    let end = data.len().checked_sub(TABLE).filter(|&end| end > 0).ok_or(CUT)?;
    let (body, table) = data[1..].split_at(end - 1);
    let mut reader = Reader(body);
    let codes = reader.take(count / 3)?;
    let (mut next, mut last) = (0u32, 0u32);
    let (mut edges, mut vertices) = (Fifo::<[u32; 2]>(Vec::new()), Fifo::<u32>(Vec::new()));
    let mut out = Vec::with_capacity(count);
    fn new(next: &mut u32) -> u32 {
        *next = next.wrapping_add(1);
        next.wrapping_sub(1)
    }
    fn explicit(reader: &mut Reader<'_>, last: &mut u32) -> Result<u32> {
        let v = reader.varint()?;
        *last = last.wrapping_add(if v & 1 != 0 { !(v >> 1) } else { v >> 1 });
        Ok(*last)
    }
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let [a, b] = edges.get(high)?;
            let c = match low {
                0 => new(&mut next),
                1..=12 => vertices.get(low)?,
                13 | 14 => {
                    last = if low == 13 { last.wrapping_sub(1) } else { last.wrapping_add(1) };
                    last
                }
                _ => explicit(&mut reader, &mut last)?,
            };
            edges.push([c, b]);
            edges.push([a, c]);
            if !(1..=12).contains(&low) {
                vertices.push(c);
            }
            out.extend([a, b, c]);
            continue;
        }
        let is_explicit = low >= 14;
        let pair = if is_explicit { reader.byte()? } else { table[usize::from(low)] };
        if is_explicit && pair == 0 {
            next = 0;
        }
        let a = if low == 15 { explicit(&mut reader, &mut last)? } else { new(&mut next) };
        let mut other = |nibble: u8| match nibble {
            0 => Ok(new(&mut next)),
            15 if is_explicit => explicit(&mut reader, &mut last),
            15 => Err("its table has an entry that is not allowed"),
            age => vertices.get(age - 1),
        };
        let (b, c) = (other(pair >> 4)?, other(pair & 15)?);
        edges.push([b, a]);
        edges.push([c, b]);
        edges.push([a, c]);
        vertices.push(a);
        for (nibble, vertex) in [(pair >> 4, b), (pair & 15, c)] {
            if matches!(nibble, 0 | 15) {
                vertices.push(vertex);
            }
        }
        out.extend([a, b, c]);
    }
    reader.end()?;
    Ok(out)
}

/// Mode `INDICES`: `count` indices.
pub(crate) fn indices(data: &[u8], count: usize) -> Result<Vec<u32>> {
    const TAIL: usize = 4;
    if data.first() != Some(&0xd1) {
        return Err("it is no stream of indices");
    }
    let end = data.len().checked_sub(TAIL).filter(|&end| end > 0).ok_or(CUT)?;
    let mut reader = Reader(&data[1..end]);
    // An index takes a byte or more.
    if count > reader.0.len() {
        return Err(CUT);
    }
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let v = reader.varint()?;
        let last = &mut last[(v & 1) as usize];
        *last = last.wrapping_add(if v & 2 != 0 { !(v >> 2) } else { v >> 2 });
        out.push(*last);
    }
    reader.end()?;
    Ok(out)
}

/// Undoes a filter of mode `ATTRIBUTES` in place.
pub(crate) fn unfilter(filter: &str, data: &mut [u8], stride: usize) -> Result<()> {
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => bytes(data, |v| {
            let v = v.map(|b| i32::from(b as i8));
            octahedral(v, 127.0).map(|x| x as i8 as u8)
        }),
        ("OCTAHEDRAL", 8) => {
            words(data, |v| octahedral(v.map(|w| i32::from(w as i16)), 32767.0).map(|x| x as u16))
        }
        ("QUATERNION", 8) => words(data, |v| quaternion(v.map(|w| w as i16))),
        ("EXPONENTIAL", _) => {
            for word in data.as_chunks_mut::<4>().0 {
                let v = i32::from_le_bytes(*word);
                let (exponent, mantissa) = (v >> 24, v << 8 >> 8);
                *word = libm::scalbnf(mantissa as f32, exponent).to_le_bytes();
            }
        }
        ("COLOR", 4) => bytes(data, |v| {
            let [y, co, cg] = [i32::from(v[0]), i32::from(v[1] as i8), i32::from(v[2] as i8)];
            color([y, co, cg, i32::from(v[3])], 255.0).map(|x| x as u8)
        }),
        ("COLOR", 8) => words(data, |v| {
            let [y, co, cg] = [i32::from(v[0]), i32::from(v[1] as i16), i32::from(v[2] as i16)];
            color([y, co, cg, i32::from(v[3])], 65535.0).map(|x| x as u16)
        }),
        ("OCTAHEDRAL" | "QUATERNION" | "COLOR", _) => return Err("its byteStride does not fit its filter"),
        _ => return Err("it has an unknown filter"),
    }
    Ok(())
}

fn bytes(data: &mut [u8], decode: impl Fn([u8; 4]) -> [u8; 4]) {
    data.as_chunks_mut::<4>().0.iter_mut().for_each(|element| *element = decode(*element));
}

fn words(data: &mut [u8], decode: impl Fn([u16; 4]) -> [u16; 4]) {
    for element in data.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, f, g, h] = *element;
        let decoded = decode([[a, b], [c, d], [e, f], [g, h]].map(u16::from_le_bytes));
        for (pair, word) in element.as_chunks_mut::<2>().0.iter_mut().zip(decoded) {
            *pair = word.to_le_bytes();
        }
    }
}

/// Nearest integer, halves away from zero.
fn round(x: f32) -> i32 {
    x.round() as i32
}

/// A unit vector as x and y of an octahedron, in units of the third number; the fourth is passed through.
fn octahedral([x, y, one, rest]: [i32; 4], largest: f32) -> [i32; 4] {
    let (x, y) = (x as f32 / one as f32, y as f32 / one as f32);
    let z = 1.0 - x.abs() - y.abs();
    let folded = z.min(0.0);
    let (x, y) = (x - folded.copysign(x), y - folded.copysign(y));
    let length = (x * x + y * y + z * z).sqrt();
    [round(x / length * largest), round(y / length * largest), round(z / length * largest), rest]
}

/// A unit quaternion without its largest component, whose number stands in the lowest two bits of the unit.
fn quaternion(v: [i16; 4]) -> [u16; 4] {
    let one = f32::from(v[3] | 3);
    let [x, y, z] = [v[0], v[1], v[2]].map(|c| f32::from(c) / one * std::f32::consts::FRAC_1_SQRT_2);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (v[3] & 3) as usize;
    let mut out = [0; 4];
    for (i, component) in [w, x, y, z].into_iter().enumerate() {
        out[(largest + i) % 4] = round(component * 32767.0) as u16;
    }
    out
}

/// RGBA of YCoCg and an alpha whose highest bit says how many bits there are.
fn color([y, co, cg, alpha]: [i32; 4], largest: f32) -> [i32; 4] {
    let unit = (1i32 << (32 - alpha.leading_zeros())) - 1;
    let a = alpha & unit >> 1;
    let scale = largest / unit as f32;
    [y + co - cg, y + cg, y - co - cg, a << 1 | a & 1].map(|c| round(c as f32 * scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What npm's meshoptimizer wrote and read back.
    #[test]
    fn other_bytes_come_out_than_from_the_reference() {
        let unhex = |text: &str| -> Vec<u8> {
            let pair = |i: usize| u8::from_str_radix(&text[i..i + 2], 16).unwrap();
            (0..text.len()).step_by(2).map(pair).collect()
        };
        let lines = include_str!("../tests/data/meshopt.txt").lines().filter(|line| !line.starts_with('#'));
        let mut seen = 0;
        for line in lines {
            let [name, count, stride, mode, filter, data, wanted] =
                line.split(' ').collect::<Vec<_>>().try_into().unwrap();
            let (count, stride): (usize, usize) = (count.parse().unwrap(), stride.parse().unwrap());
            let (data, wanted) = (unhex(data), unhex(wanted));
            let decode = |data: &[u8]| match mode {
                "ATTRIBUTES" => attributes(data, count, stride).and_then(|mut bytes| {
                    unfilter(filter, &mut bytes, stride)?;
                    Ok(bytes)
                }),
                _ => indices(data, count).map(|all| all.into_iter().flat_map(u32::to_le_bytes).collect()),
            };
            assert_eq!(decode(&data).as_ref(), Ok(&wanted), "{name}");
            for length in 0..data.len() {
                assert!(decode(&data[..length]).is_err(), "{name}: {length} bytes were enough");
            }
            seen += 1;
        }
        assert_eq!(seen, 7, "the file was not read to its end");
    }
}
