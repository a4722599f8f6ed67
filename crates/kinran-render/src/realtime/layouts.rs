//! What resources a shader sees: group 0 in every pass, group 1 by the pass, group 2 where maps are blended from tiles.

use wgpu::{BindingResource, BindingType, SamplerBindingType, TextureSampleType};

use kinran_scene::DETAIL_LAYERS_MAX;

use super::Gpu;

/// Textures of a material, fuzz and skin apart.
pub(super) const SLOTS: usize = 9;

/// Textures of its fuzz.
pub(super) const FUZZ_SLOTS: usize = 3;

/// Tables of skin: punctual, ambient, penumbra.
pub(super) const SKIN_TABLES: usize = 3;

/// Textures of a material blended from tiles: four synthesized maps, four tiles a layer, two masks.
pub(super) const DETAIL_TEXTURES: usize = 4 + 4 * DETAIL_LAYERS_MAX + 2;

/// Samplers of it: of maps and masks, and of each layer.
pub(super) const DETAIL_SAMPLERS: usize = 1 + DETAIL_LAYERS_MAX;

/// The layout of each group.
pub(super) struct Layouts {
    pub(super) frame: wgpu::BindGroupLayout,
    pub(super) shadow: wgpu::BindGroupLayout,
    pub(super) material: wgpu::BindGroupLayout,
    pub(super) detail: wgpu::BindGroupLayout,
    pub(super) g_buffer: wgpu::BindGroupLayout,
    pub(super) accumulate: wgpu::BindGroupLayout,
    pub(super) show: wgpu::BindGroupLayout,
}

const UNIFORM: BindingType = BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};
const FILTERED: BindingType = texture(TextureSampleType::Float { filterable: true });
const RAW: BindingType = texture(TextureSampleType::Float { filterable: false });
const DEPTH: BindingType = texture(TextureSampleType::Depth);
const CODES: BindingType = texture(TextureSampleType::Uint);
const VOLUME: BindingType = BindingType::Texture {
    sample_type: TextureSampleType::Float { filterable: true },
    view_dimension: wgpu::TextureViewDimension::D3,
    multisampled: false,
};
const SMOOTH: BindingType = BindingType::Sampler(SamplerBindingType::Filtering);
const COMPARISON: BindingType = BindingType::Sampler(SamplerBindingType::Comparison);

const fn texture(sample_type: TextureSampleType) -> BindingType {
    BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

/// What frame.wgsl declares, from binding 0 on.
const FRAME: [BindingType; 7] = [UNIFORM, FILTERED, FILTERED, DEPTH, SMOOTH, SMOOTH, COMPARISON];

/// What deferred.wgsl declares.
const G_BUFFER: [BindingType; 4] = [RAW, CODES, RAW, DEPTH];

/// What surface.wgsl and fuzz_surface.wgsl declare.
fn material() -> Vec<BindingType> {
    let mut types = vec![UNIFORM];
    types.extend([FILTERED; SLOTS]);
    types.extend([SMOOTH; SLOTS]);
    types.push(UNIFORM);
    types.extend([FILTERED; FUZZ_SLOTS]);
    types.extend([SMOOTH; FUZZ_SLOTS]);
    types.extend([FILTERED; SKIN_TABLES]);
    types.push(VOLUME);
    types
}

/// What detail.wgsl declares.
fn detail() -> Vec<BindingType> {
    let mut types = vec![UNIFORM];
    types.extend([FILTERED; DETAIL_TEXTURES]);
    types.extend([SMOOTH; DETAIL_SAMPLERS]);
    types
}

impl Layouts {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let layout = |types: &[BindingType]| {
            let entry = |(binding, &ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty,
                count: None,
            };
            let entries: Vec<_> = (0..).zip(types).map(entry).collect();
            device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
        };
        Layouts {
            frame: layout(&FRAME),
            shadow: layout(&[UNIFORM]),
            material: layout(&material()),
            detail: layout(&detail()),
            g_buffer: layout(&G_BUFFER),
            accumulate: layout(&[RAW, RAW]),
            show: layout(&[RAW]),
        }
    }
}

/// Resources from binding 0 on.
pub(super) fn bind<'a>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = BindingResource<'a>>,
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use encase::private::ShaderType;
    use naga::TypeInner;

    use super::*;
    use crate::realtime::ShaderSource;
    use crate::realtime::detail::DetailMaterial;
    use crate::realtime::frame::Frame;
    use crate::realtime::fuzz::FuzzMaterial;
    use crate::realtime::material::Material;

    /// In surface.wgsl and fuzz_surface.wgsl, `NAME_map` and `NAME_sampler`, in the order in which a material hands them over.
    const SLOT_NAMES: [&str; SLOTS] = [
        "normal",
        "aniso",
        "base_color",
        "metallic_roughness",
        "occlusion",
        "emissive",
        "translucency",
        "translucent_color",
        "specular",
    ];
    const FUZZ_SLOT_NAMES: [&str; FUZZ_SLOTS] = ["fuzz_direction", "fuzz_color", "fuzz_amount"];

    const LIT: [&str; 9] = [
        "frame.wgsl",
        "fuzz.wgsl",
        "lighting.wgsl",
        "surface.wgsl",
        "detail.wgsl",
        "fuzz_surface.wgsl",
        "channels.wgsl",
        "skin.wgsl",
        "forward.wgsl",
    ];
    const DEFERRED: [&str; 5] =
        ["frame.wgsl", "fuzz.wgsl", "lighting.wgsl", "octahedral.wgsl", "deferred.wgsl"];

    fn module(files: &[&str]) -> naga::Module {
        naga::front::wgsl::parse_str(&ShaderSource::default().pass(files).unwrap()).unwrap()
    }

    /// Name and kind of what a group of a pass declares, by binding.
    fn declared(files: &[&str], group: u32) -> BTreeMap<u32, (String, String)> {
        let module = module(files);
        let kind = |inner: &TypeInner| match inner {
            TypeInner::Struct { .. } => format!("{UNIFORM:?}"),
            TypeInner::Sampler { comparison: true } => format!("{COMPARISON:?}"),
            TypeInner::Sampler { comparison: false } => format!("{SMOOTH:?}"),
            TypeInner::Image { dim: naga::ImageDimension::D3, .. } => format!("{VOLUME:?}"),
            TypeInner::Image { class: naga::ImageClass::Depth { .. }, .. } => format!("{DEPTH:?}"),
            TypeInner::Image { class: naga::ImageClass::Sampled { kind, .. }, .. } => match kind {
                naga::ScalarKind::Uint => format!("{CODES:?}"),
                _ => "floats".to_owned(),
            },
            other => panic!("{other:?} is bound"),
        };
        let globals = module.global_variables.iter();
        let of_group = globals.filter_map(|(_, variable)| {
            let binding = variable.binding.as_ref().filter(|binding| binding.group == group)?;
            let name = variable.name.clone().unwrap();
            Some((binding.binding, (name, kind(&module.types[variable.ty].inner))))
        });
        of_group.collect()
    }

    #[test]
    fn a_pass_binds_another_resource_than_its_text_declares() {
        let cases = [
            (&LIT[..], 0, FRAME.to_vec()),
            (&LIT, 1, material()),
            (&LIT, 2, detail()),
            (&DEFERRED, 1, G_BUFFER.to_vec()),
            (&["frame.wgsl", "accumulate.wgsl"], 1, vec![RAW, RAW]),
            (&["frame.wgsl", "tonemap.wgsl"], 1, vec![RAW]),
        ];
        for (files, group, wanted) in cases {
            let got = declared(files, group);
            let bindings: Vec<u32> = got.keys().copied().collect();
            let all: Vec<u32> = (0..wanted.len() as u32).collect();
            assert_eq!(bindings, all, "{files:?}, group {group}");
            for (wanted, (binding, (name, got))) in wanted.iter().zip(got) {
                let wanted = match *wanted {
                    FILTERED | RAW => "floats".to_owned(),
                    other => format!("{other:?}"),
                };
                assert_eq!(got, wanted, "{files:?}, group {group}, binding {binding}, {name}");
            }
        }
    }

    #[test]
    fn textures_of_a_material_change_places() {
        let named = |names: &[&str], what: &str| names.iter().map(|name| format!("{name}_{what}")).collect();
        let mut wanted: Vec<String> = vec!["material".to_owned()];
        wanted.extend::<Vec<_>>(named(&SLOT_NAMES, "map"));
        wanted.extend::<Vec<_>>(named(&SLOT_NAMES, "sampler"));
        wanted.push("fuzz_material".to_owned());
        wanted.extend::<Vec<_>>(named(&FUZZ_SLOT_NAMES, "map"));
        wanted.extend::<Vec<_>>(named(&FUZZ_SLOT_NAMES, "sampler"));
        wanted.extend(
            ["skin_table", "skin_ambient_table", "skin_penumbra_table", "fuzz_table"].map(String::from),
        );
        let got: Vec<String> = declared(&LIT, 1).into_values().map(|(name, _)| name).collect();
        assert_eq!(got, wanted);
    }

    /// Name, size and the offset of each member.
    fn structs(module: &naga::Module) -> BTreeMap<String, (u64, Vec<u64>)> {
        let of_type = |ty: &naga::Type| match &ty.inner {
            TypeInner::Struct { members, span } => {
                let offsets = members.iter().map(|member| u64::from(member.offset)).collect();
                Some((ty.name.clone()?, (u64::from(*span), offsets)))
            }
            _ => None,
        };
        module.types.iter().filter_map(|(_, ty)| of_type(ty)).collect()
    }

    #[test]
    fn a_uniform_lies_elsewhere_than_its_shader_reads_it() {
        fn ours<T: encase::ShaderSize, const N: usize>(offsets: [u64; N]) -> (u64, Vec<u64>) {
            (T::SHADER_SIZE.get(), offsets.to_vec())
        }
        let got = structs(&module(&LIT));
        for (name, wanted) in [
            ("Frame", ours::<Frame, _>(Frame::METADATA.extra.offsets)),
            ("Material", ours::<Material, _>(Material::METADATA.extra.offsets)),
            ("FuzzMaterial", ours::<FuzzMaterial, _>(FuzzMaterial::METADATA.extra.offsets)),
            ("DetailMaterial", ours::<DetailMaterial, _>(DetailMaterial::METADATA.extra.offsets)),
        ] {
            assert_eq!(got[name], wanted, "size and offsets of {name}");
        }
    }
}
