//! The whole library in another language, by naga.

use naga::back::{glsl, hlsl, msl, spv};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

use crate::shaders::Error;

/// GLSL is written for an entry point only: one that uses a derivative, so that functions for fragments stay.
const STUB: &str = "\n@fragment fn kinran_stub() { _ = dpdx(0.0); }\n";

fn parse(wgsl: &str) -> Result<(naga::Module, ModuleInfo), Error> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| Error::Naga(e.emit_to_string(wgsl)))?;
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .map_err(|e| Error::Naga(e.emit_to_string(wgsl)))?;
    Ok((module, info))
}

/// GLSL of a version, with the stub's `main` as its last declaration.
pub fn glsl(wgsl: &str, version: glsl::Version) -> Result<String, Error> {
    let (module, info) = parse(&(wgsl.to_owned() + STUB))?;
    let options = glsl::Options { version, writer_flags: glsl::WriterFlags::empty(), ..Default::default() };
    let pipeline = glsl::PipelineOptions {
        shader_stage: naga::ShaderStage::Fragment,
        entry_point: "kinran_stub".into(),
        multiview: None,
    };
    let mut text = String::new();
    glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, BoundsCheckPolicies::default())
        .and_then(|mut writer| writer.write())
        .map_err(|e| Error::Naga(e.to_string()))?;
    Ok(text)
}

/// HLSL, shader model 5.0: the oldest that engines still take.
pub fn hlsl(wgsl: &str) -> Result<String, Error> {
    let (module, info) = parse(wgsl)?;
    // The library's loops end by themselves and its indices are constants: no guards.
    let options = hlsl::Options {
        shader_model: hlsl::ShaderModel::V5_0,
        force_loop_bounding: false,
        restrict_indexing: false,
        ..Default::default()
    };
    let mut text = String::new();
    hlsl::Writer::new(&mut text, &options, &hlsl::PipelineOptions::default())
        .write(&module, &info, None)
        .map_err(|e| Error::Naga(e.to_string()))?;
    Ok(text)
}

/// MSL 2.0.
pub fn msl(wgsl: &str) -> Result<String, Error> {
    let (module, info) = parse(wgsl)?;
    let unchecked = BoundsCheckPolicy::Unchecked;
    let options = msl::Options {
        lang_version: (2, 0),
        force_loop_bounding: false,
        bounds_check_policies: BoundsCheckPolicies { index: unchecked, buffer: unchecked, ..Default::default() },
        ..Default::default()
    };
    let mut writer = msl::Writer::new(String::new());
    (writer.write(&module, &info, &options, &msl::PipelineOptions::default()))
        .map_err(|e| Error::Naga(e.to_string()))?;
    Ok(writer.finish())
}

/// SPIR-V 1.3, one linkable module (capability Linkage), its functions named.
pub fn spirv(wgsl: &str) -> Result<Vec<u8>, Error> {
    let (module, info) = parse(wgsl)?;
    let options = spv::Options {
        lang_version: (1, 3),
        flags: spv::WriterFlags::DEBUG,
        force_loop_bounding: false,
        ..Default::default()
    };
    let words = spv::write_vec(&module, &info, &options, None).map_err(|e| Error::Naga(e.to_string()))?;
    Ok(words.iter().flat_map(|word| word.to_le_bytes()).collect())
}
