//! What naga makes of the flat library, language by language.

use naga::back::{glsl, hlsl, msl};
use naga::proc::BoundsCheckPolicies;

use crate::{Error, flat, flat::Validated};

/// A language made by naga.
pub(crate) struct Language {
    /// Its folder, and its module in the crate of strings.
    pub(crate) folder: &'static str,
    /// Its name, for people.
    pub(crate) name: &'static str,
    /// Extension of its files.
    pub(crate) extension: &'static str,
    /// How its include guards end.
    pub(crate) guard_suffix: &'static str,
    /// Whether one file can include another.
    pub(crate) includes: bool,
    /// What stands in every file before declarations.
    pub(crate) preamble: &'static str,
    /// What makes a function fit to be defined in a file that is included more than once in a program.
    pub(crate) linkage: &'static str,
    /// All declarations, from flat WGSL.
    pub(crate) translate: fn(&str) -> Result<String, Error>,
}

/// The languages, in the order of the pages about them.
pub(crate) const LANGUAGES: [Language; 4] = [
    Language {
        folder: "glsl_450",
        name: "GLSL 4.50",
        extension: "glsl",
        guard_suffix: "GLSL",
        includes: true,
        preamble: "",
        linkage: "",
        translate: |wgsl| to_glsl(wgsl, glsl::Version::Desktop(450)),
    },
    Language {
        folder: "glsl_es_300",
        name: "GLSL ES 3.00",
        extension: "glsl",
        guard_suffix: "GLSL",
        includes: false,
        preamble: "",
        linkage: "",
        translate: |wgsl| to_glsl(wgsl, glsl::Version::new_gles(300)),
    },
    Language {
        folder: "hlsl",
        name: "HLSL",
        extension: "hlsl",
        guard_suffix: "HLSL",
        includes: true,
        preamble: "",
        linkage: "",
        translate: to_hlsl,
    },
    Language {
        folder: "msl",
        name: "MSL",
        extension: "h",
        guard_suffix: "METAL",
        includes: true,
        preamble: "#include <metal_stdlib>\n",
        linkage: "inline ",
        translate: to_msl,
    },
];

/// naga writes GLSL for an entry point only. A derivative in it keeps functions that use derivatives themselves.
const GLSL_STUB: &str = "\n@fragment fn main() { _ = dpdx(0.0); }\n";

fn to_glsl(wgsl: &str, version: glsl::Version) -> Result<String, Error> {
    let (module, info) = flat::validate(&format!("{wgsl}{GLSL_STUB}"))?;
    let options =
        glsl::Options { version, writer_flags: glsl::WriterFlags::empty(), ..glsl::Options::default() };
    let pipeline = glsl::PipelineOptions {
        shader_stage: naga::ShaderStage::Fragment,
        entry_point: "main".to_owned(),
        multiview: None,
    };
    let mut text = String::new();
    glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, BoundsCheckPolicies::default())?
        .write()?;
    let stub = text.find("\nvoid main() {").ok_or("naga wrote no stub")?;
    text.truncate(stub);
    // The same types under the names that Godot's dialect knows too.
    for n in 2..=4 {
        text = text.replace(&format!("mat{n}x{n}"), &format!("mat{n}"));
    }
    Ok(text)
}

fn to_hlsl(wgsl: &str) -> Result<String, Error> {
    let (module, info) = flat::validate(wgsl)?;
    // Guards are the price of untrusted shaders; every index and loop of the library is in range.
    let options =
        hlsl::Options { restrict_indexing: false, force_loop_bounding: false, ..hlsl::Options::default() };
    let mut text = String::new();
    hlsl::Writer::new(&mut text, &options, &hlsl::PipelineOptions::default()).write(&module, &info, None)?;
    // Padding is for structs in buffers, of which the library has none.
    let is_padding = |line: &&str| {
        line.trim_start().starts_with("int _pad") || line.trim_start().starts_with("int _end_pad")
    };
    Ok(text.lines().filter(|line| !is_padding(line)).map(|line| format!("{line}\n")).collect())
}

fn to_msl(wgsl: &str) -> Result<String, Error> {
    let (mut module, info): Validated = flat::validate(wgsl)?;
    name_arrays(&mut module);
    let options =
        msl::Options { lang_version: (2, 0), force_loop_bounding: false, ..msl::Options::default() };
    Ok(msl::write_string(&module, &info, &options, &msl::PipelineOptions::default())?.0)
}

/// MSL wraps arrays in structs, which naga would number.
fn name_arrays(module: &mut naga::Module) {
    let handles: Vec<_> = module.types.iter().map(|(handle, _)| handle).collect();
    for handle in handles {
        let naga::TypeInner::Array { base, size: naga::ArraySize::Constant(size), .. } =
            module.types[handle].inner
        else {
            continue;
        };
        // Names that end in a digit would be changed.
        let name = match module.types[base].inner {
            naga::TypeInner::Scalar(_) => format!("Float{size}Array"),
            naga::TypeInner::Vector { size: components, .. } => {
                format!("Float{}x{size}Array", components as u8)
            }
            _ => continue,
        };
        let named = naga::Type { name: Some(name), ..module.types[handle].clone() };
        module.types.replace(handle, named);
    }
}
