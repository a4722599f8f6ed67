//! The library as a SPIR-V module that `spirv-link` can link.

use naga::back::spv;
use naga::valid::ModuleInfo;

use crate::Error;

const OP_NAME: u16 = 5;
const OP_FUNCTION: u16 = 54;
const OP_DECORATE: u16 = 71;
const LINKAGE_ATTRIBUTES: u32 = 41;
const EXPORT: u32 = 0;
/// Words before the first instruction.
const HEADER: usize = 5;

/// The module, with every function exported under its name.
pub(crate) fn write(module: &naga::Module, info: &ModuleInfo) -> Result<Vec<u8>, Error> {
    let options = spv::Options {
        flags: spv::WriterFlags::DEBUG,
        force_loop_bounding: false,
        ..spv::Options::default()
    };
    let words = export_functions(&spv::write_vec(module, info, &options, None)?)?;
    Ok(words.iter().flat_map(|word| word.to_le_bytes()).collect())
}

/// An instruction: its opcode, and its words after the first.
fn instructions(words: &[u32]) -> impl Iterator<Item = (usize, u16, &[u32])> {
    let mut at = HEADER;
    std::iter::from_fn(move || {
        let first = *words.get(at)?;
        let start = at;
        at += (first >> 16) as usize;
        Some((start, first as u16, &words[start + 1..at]))
    })
}

/// Adds `OpDecorate %function LinkageAttributes "name" Export` for every function; naga declares the capability
/// `Linkage` and exports nothing.
fn export_functions(words: &[u32]) -> Result<Vec<u32>, Error> {
    let functions: Vec<u32> =
        instructions(words).filter(|i| i.1 == OP_FUNCTION).map(|(_, _, operands)| operands[1]).collect();
    let mut decorations = Vec::new();
    for (_, _, operands) in instructions(words).filter(|i| i.1 == OP_NAME && functions.contains(&i.2[0])) {
        let length = 3 + operands.len() as u32;
        decorations.push(length << 16 | u32::from(OP_DECORATE));
        decorations.extend([operands[0], LINKAGE_ATTRIBUTES]);
        decorations.extend(&operands[1..]);
        decorations.push(EXPORT);
    }
    // Decorations stand after all names and before all types.
    let (last_name, _, operands) =
        instructions(words).filter(|i| i.1 == OP_NAME).last().ok_or("naga wrote no names")?;
    let place = last_name + 1 + operands.len();
    Ok([&words[..place], &decorations, &words[place..]].concat())
}
