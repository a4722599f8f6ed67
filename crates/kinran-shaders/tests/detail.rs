//! The shader functions of detail maps, with real textures on a real Vulkan device, against what the solver believes
//! that they do: block decoding, levels of detail, filters, transforms, masks and blends.

#![allow(clippy::print_stderr, reason = "a skipped test says so, and how near the tolerance is")]

use std::fmt::Write;

use glam::{Vec2, vec2, vec3};
use kinran_bake::detail::{
    DetailOptions, Layer, LayerTransform, MapKind, Mask, Planes, Target, Tile, TileOptions, blend_level,
    solve,
};
use kinran_image::{
    Channels, Encoder, Encoding, Format, Image, Level, Pixels, Preset, Texture, Transfer, untold,
};
use kinran_shaders::{wgsl, with_needs};
use wgpu::util::{DeviceExt, TextureDataOrder};

/// Colours that differ from texel to texel by up to twice `amplitude` around 128, but not as wildly as noise.
fn scan(side: u32, seed: f32, amplitude: f32) -> Image {
    let bytes = (0..side * side)
        .flat_map(|i| {
            let (x, y) = ((i % side) as f32, (i / side) as f32);
            [0.0, 1.0, 2.0].map(|c| {
                let wave =
                    (x * 0.7 + seed + c).sin() * (y * 0.45 - c * seed).cos() + (x * 0.13 + y * 0.21).sin();
                (128.0 + amplitude * wave) as u8
            })
        })
        .collect();
    Image::new(side, side, Channels::Rgb, Pixels::U8(bytes)).unwrap()
}

fn encoding(format: Format) -> Encoding {
    Encoding { format, encoder: Encoder::Portable, preset: Preset::Fast }
}

/// A device with block compression, or `None` after saying so.
fn device() -> Option<(wgpu::Device, wgpu::Queue)> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let Ok(adapter) = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
    else {
        assert!(
            std::env::var_os("KINRAN_REQUIRE_GPU").is_none(),
            "there is no Vulkan device; install mesa-vulkan-drivers"
        );
        eprintln!("SKIPPED: there is no Vulkan device; install mesa-vulkan-drivers");
        return None;
    };
    let descriptor = wgpu::DeviceDescriptor {
        required_features: wgpu::Features::TEXTURE_COMPRESSION_BC,
        ..wgpu::DeviceDescriptor::default()
    };
    Some(pollster::block_on(adapter.request_device(&descriptor)).unwrap())
}

fn upload(device: &wgpu::Device, queue: &wgpu::Queue, texture: &Texture) -> wgpu::TextureView {
    let srgb = texture.transfer == Transfer::Srgb;
    let format = match (texture.format, srgb) {
        (Format::Bc1, true) => wgpu::TextureFormat::Bc1RgbaUnormSrgb,
        (Format::Bc1, false) => wgpu::TextureFormat::Bc1RgbaUnorm,
        (Format::Bc5, _) => wgpu::TextureFormat::Bc5RgUnorm,
        (Format::Bc7, true) => wgpu::TextureFormat::Bc7RgbaUnormSrgb,
        (Format::Bc7, false) => wgpu::TextureFormat::Bc7RgbaUnorm,
        (Format::Rgba8, false) => wgpu::TextureFormat::Rgba8Unorm,
        other => panic!("{other:?} is not uploaded here"),
    };
    let data: Vec<u8> = texture.levels.iter().flat_map(|level| level.data.iter().copied()).collect();
    let size = wgpu::Extent3d {
        width: texture.levels[0].width,
        height: texture.levels[0].height,
        depth_or_array_layers: 1,
    };
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: texture.levels.len() as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    device
        .create_texture_with_data(queue, &descriptor, TextureDataOrder::MipMajor, &data)
        .create_view(&wgpu::TextureViewDescriptor::default())
}

fn sampler(device: &wgpu::Device, mode: wgpu::AddressMode) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: mode,
        address_mode_v: mode,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    })
}

/// The pixel shader of a material with these layers: what docs/detail.md tells an engine to write.
fn shader(layers: &[Layer], kind: MapKind, options: &DetailOptions) -> String {
    let needs = ["detail_overlay", "detail_normal", "detail_over", "detail_hsv", "detail_layer", "frame"];
    let mut text = with_needs(wgsl::MODULES, &needs);
    text += "
struct Size { texels: vec2f }
@group(0) @binding(0) var<uniform> size: Size;
@group(0) @binding(1) var synthesized: texture_2d<f32>;
@group(0) @binding(2) var repeating: sampler;
@group(0) @binding(3) var mirroring: sampler;
@group(0) @binding(4) var mask: texture_2d<f32>;
";
    for i in 0..layers.len() {
        writeln!(text, "@group(0) @binding({}) var tile_{i}_: texture_2d<f32>;", 5 + i).unwrap();
    }
    text += "
@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i32(i & 1u) * 4 - 1), f32(i32(i >> 1u) * 4 - 1), 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let uv = position.xy / size.texels;
    let masks = textureSample(mask, repeating, uv);
    var d = vec3f(0.0);
";
    for (i, layer) in layers.iter().enumerate() {
        let (m, o, r) = (layer.transform.matrix(), layer.transform.offset, layer.transform.cos_sin());
        let mirror = layer.transform.mirror;
        let sampler = if mirror { "mirroring" } else { "repeating" };
        let signs = if mirror { "detail_mirror(place)" } else { "vec2f(1.0)" };
        let hsv = layer.hsv;
        let (place, turn) = (
            format!(
                "detail_uv(uv, mat2x2f({:?}, {:?}, {:?}, {:?}), vec2f({:?}, {:?}))",
                m.x_axis.x, m.x_axis.y, m.y_axis.x, m.y_axis.y, o.x, o.y
            ),
            format!("vec2f({:?}, {:?}), {signs}", r.x, r.y),
        );
        let texel = match kind {
            MapKind::Color => format!("hsv_shift(texel.rgb, vec3f({:?}, {:?}, {:?}))", hsv.x, hsv.y, hsv.z),
            MapKind::Data => "texel.rgb".into(),
            MapKind::Normal => {
                format!(
                    "detail_turn_normal(normal_from_xy(texel.r * 2.0 - 1.0, texel.g * 2.0 - 1.0), {turn})"
                )
            }
            MapKind::Aniso => format!("detail_turn_aniso(texel.rgb, {turn})"),
        };
        let alpha = layer.mask.map_or("1.0".into(), |mask| {
            format!("detail_mask(masks[{}], {:?})", mask.channel, mask.contrast)
        });
        writeln!(
            text,
            "    {{\n        let place = {place};\n        let texel = textureSample(tile_{i}_, {sampler}, place);\n        \
             d = mix(d, {texel}, {alpha});\n    }}"
        )
        .unwrap();
    }
    text += "    let texel = textureSample(synthesized, repeating, uv);\n    let s = detail_from_texel(texel.rgb);\n";
    text += &match kind {
        MapKind::Color | MapKind::Data => "    return vec4f(smooth_overlay_color(s, d), 1.0);\n}\n".into(),
        MapKind::Normal => "    let base = normal_from_xy(s.x * 2.0 - 1.0, s.y * 2.0 - 1.0);
    return vec4f(rnm(base, normalize(d)), 1.0);\n}\n"
            .into(),
        MapKind::Aniso => {
            format!("    return vec4f(detail_over(texel.rgb, d, {:?}), 1.0);\n}}\n", options.aniso_alpha)
        }
    };
    text
}

/// Draws a full screen of `width` x `height` pixels and reads it back.
fn draw(
    (device, queue): &(wgpu::Device, wgpu::Queue),
    text: &str,
    synthesized: &Texture,
    mask: &Tile,
    layers: &[Layer],
    (width, height): (u32, u32),
) -> Vec<[f32; 4]> {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::TextureFormat::Rgba32Float.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let size = [width as f32, height as f32].map(f32::to_le_bytes).concat();
    let size = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: &[size, vec![0; 8]].concat(),
        usage: wgpu::BufferUsages::UNIFORM,
    });
    let views: Vec<wgpu::TextureView> =
        layers.iter().map(|layer| upload(device, queue, &layer.tile.texture)).collect();
    let (synthesized, mask) = (upload(device, queue, synthesized), upload(device, queue, &mask.texture));
    let (repeating, mirroring) =
        (sampler(device, wgpu::AddressMode::Repeat), sampler(device, wgpu::AddressMode::MirrorRepeat));
    let mut entries =
        vec![(0, size.as_entire_binding()), (1, wgpu::BindingResource::TextureView(&synthesized))];
    // What a shader does not use is not in its layout.
    for (binding, name, resource) in [
        (2, "repeating", wgpu::BindingResource::Sampler(&repeating)),
        (3, ", mirroring", wgpu::BindingResource::Sampler(&mirroring)),
        (4, "masks[", wgpu::BindingResource::TextureView(&mask)),
    ] {
        // A sample that is taken counts, whether its value is used or not.
        if text.contains(name) || binding == 4 {
            entries.push((binding, resource));
        }
    }
    for (i, view) in views.iter().enumerate() {
        entries.push((5 + i as u32, wgpu::BindingResource::TextureView(view)));
    }
    let entries: Vec<_> =
        entries.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
    let stride = (width * 16).next_multiple_of(256);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(stride * height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    encoder.copy_texture_to_buffer(
        target.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(stride),
                rows_per_image: None,
            },
        },
        extent,
    );
    queue.submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = buffer.slice(..).get_mapped_range().unwrap();
    bytes
        .chunks_exact(stride as usize)
        .flat_map(|row| row[..width as usize * 16].as_chunks::<16>().0)
        .map(|texel| {
            std::array::from_fn(|c| f32::from_le_bytes(std::array::from_fn(|byte| texel[4 * c + byte])))
        })
        .collect()
}

fn texel(planes: &Planes, i: usize) -> [f32; 3] {
    std::array::from_fn(|c| planes.plane(c)[i])
}

/// Largest and root mean square difference between the device's blend and the solver's.
fn difference(got: &[[f32; 4]], want: &Planes) -> (f32, f32) {
    let (mut largest, mut sum) = (0.0_f32, 0.0);
    for (i, got) in got.iter().enumerate() {
        for (got, want) in got.iter().zip(texel(want, i)) {
            largest = largest.max((got - want).abs());
            sum += (got - want) * (got - want);
        }
    }
    (largest, (sum / (got.len() * 3) as f32).sqrt())
}

/// Normals stay away from the horizon, where z is the root of a difference.
fn amplitude(kind: MapKind) -> f32 {
    if kind == MapKind::Normal { 15.0 } else { 50.0 }
}

#[test]
fn the_runtime_does_the_solvers_arithmetic() {
    let Some(device) = device() else { return };
    let tile = |side, seed, kind, format| {
        Tile::new(&scan(side, seed, amplitude(kind)), TileOptions::new(kind, encoding(format))).unwrap()
    };
    let mask = tile(32, 5.0, MapKind::Data, Format::Bc7);
    let straight = LayerTransform { scale: Vec2::splat(4.0), ..LayerTransform::default() };
    let bent = LayerTransform { scale: vec2(1.5, 2.5), rotation: 0.5, offset: vec2(0.3, 0.1), mirror: true };
    for (kind, format) in [
        (MapKind::Color, Format::Bc1),
        (MapKind::Color, Format::Bc7),
        (MapKind::Data, Format::Bc7),
        (MapKind::Normal, Format::Bc5),
        (MapKind::Aniso, Format::Bc7),
    ] {
        let tiles = [1.0, 2.0, 3.0].map(|seed| tile(32, seed, kind, format));
        let over = |i: usize, transform| Layer {
            transform,
            hsv: vec3(0.1, 0.8, 1.1),
            mask: Some(Mask { map: &mask, channel: i - 1, contrast: 2.0 }),
            ..Layer::new(&tiles[i])
        };
        let bottom = Layer { transform: straight, ..Layer::new(&tiles[0]) };
        // Places between texels are known to 1/256 of one. BC1's and BC5's values between the ends of a block are rounded
        // by each device in its own way, to 1/255, which is twice as much for components of normals. All else is exact.
        let rounding = match format {
            Format::Bc7 => 1e-5,
            Format::Bc1 => 4e-3,
            _ => 8e-3,
        };
        for (layers, most) in [
            (vec![bottom], rounding),
            (vec![bottom, over(1, bent), over(2, LayerTransform::default())], rounding + 1.5e-3),
        ] {
            let options = DetailOptions::new(encoding(format));
            let target = Target::new(&scan(64, 9.0, amplitude(kind)), kind, false).unwrap();
            let solved = solve(&target, &layers, &options, &untold).unwrap();
            let text = shader(&layers, kind, &options);
            for level in [0, 1, 2] {
                let size = (64 >> level, 64 >> level);
                let got = draw(&device, &text, &solved.texture, &mask, &layers, size);
                let want = blend_level(&solved.texture, &layers, kind, &options, level).unwrap();
                let (largest, rms) = difference(&got, &want);
                eprintln!(
                    "{kind:?} {format:?}, {} layers, level {level}: {largest:.5}, rms {rms:.5}",
                    layers.len()
                );
                assert!(
                    rms < most && largest < 8.0 * most,
                    "{kind:?} in {format:?}, {} layers, level {level}: differs by {largest}, rms {rms}",
                    layers.len()
                );
            }
        }
    }
}

/// A map as it is filtered, over a whole picture.
const FILTERED: &str = "
struct Size { texels: vec2f }
@group(0) @binding(0) var<uniform> size: Size;
@group(0) @binding(1) var map: texture_2d<f32>;
@group(0) @binding(2) var repeating: sampler;
@group(0) @binding(4) var mask: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i32(i & 1u) * 4 - 1), f32(i32(i >> 1u) * 4 - 1), 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let uv = position.xy / size.texels;
    return textureSampleLevel(map, repeating, uv, 0.0) + 0.0 * textureSampleLevel(mask, repeating, uv, 0.0);
}
";

/// The limits of Mesa's software device in docs/realtime.md.
#[test]
fn the_software_device_filters_as_graphics_cards_do() {
    const SIDE: u32 = 64;
    let Some(device) = device() else { return };
    let name = device.0.adapter_info().name;
    if !name.contains("llvmpipe") {
        eprintln!("SKIPPED: {name} is no software device");
        return;
    }
    let mask =
        Tile::new(&scan(32, 5.0, 50.0), TileOptions::new(MapKind::Data, encoding(Format::Bc7))).unwrap();
    let texture = |format, data| Texture {
        format,
        transfer: Transfer::Linear,
        levels: vec![Level { width: SIDE, height: SIDE, data }],
        metadata: Default::default(),
    };
    let texels: Vec<u8> = (0..SIDE * SIDE)
        .flat_map(|i| [i * 37 % 251, i * 101 % 241, i * 11 % 239, 255].map(|sample| sample as u8))
        .collect();
    let bc7 = kinran_image::encode(encoding(Format::Bc7), &texels, SIDE, SIDE).unwrap();
    // Blocks of all endpoints and codes, by a generator of Lehmer's.
    let mut state = 1u32;
    let mut random = || {
        state = (u64::from(state) * 48271 % 0x7fff_ffff) as u32;
        (state >> 8) as u8
    };
    let bc5: Vec<u8> = (0..SIDE * SIDE).map(|_| random()).collect();
    for (format, data) in [(Format::Rgba8, texels), (Format::Bc7, bc7), (Format::Bc5, bc5)] {
        let texture = texture(format, data);
        // At five places along each texel.
        let filtered = draw(&device, FILTERED, &texture, &mask, &[], (5 * SIDE, 5 * SIDE));
        let from_step = |value: &f32| (255.0 * value - (255.0 * value).round()).abs();
        let between = filtered.iter().flat_map(|texel| texel.iter().map(from_step)).fold(0.0, f32::max);
        let at = draw(&device, FILTERED, &texture, &mask, &[], (SIDE, SIDE));
        let decoded = texture.decode_level(0).unwrap();
        let apart = |(a, b): (&[f32; 4], &[f32; 4])| [0, 1].map(|c| 255.0 * (a[c] - b[c]).abs());
        let off = at.iter().zip(&decoded).flat_map(apart).fold(0.0, f32::max);
        eprintln!("{name}, {format:?}: {between:.4} between steps of 255, {off:.2} off in texels");
        assert!(between < 0.01, "{format:?}: filtered to more than 8 bits, {between} of a step between");
        match format {
            Format::Bc5 => assert!((1.0..1.7).contains(&off), "BC5 is {off} steps of 255 off, not up to 1.6"),
            _ => assert!(off < 0.01, "{format:?} is {off} steps of 255 off"),
        }
    }
}
