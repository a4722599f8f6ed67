//! A scene on the GPU.

use glam::Vec3;
use kinran_scene::Light;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::layouts::Layouts;
use super::material::{Adjustment, LoadedMaterial};
use super::textures::{Textures, float_texture, half_levels};
use super::{Gpu, probe};
use crate::reference::{FLAT, RenderMaterial, RenderScene, Surroundings, TextureFiltering};

/// Floats of a vertex: position, normal, tangent, both UV sets, colour, code of curvature.
pub(super) const VERTEX_FLOATS: usize = 3 + 3 + 4 + 4 + 4 + 4;

/// Triangles of one material that lie one after the other.
pub(super) struct Draw {
    pub(super) material: usize,
    pub(super) indices: std::ops::Range<u32>,
    /// Middle, for sorting.
    pub(super) middle: Vec3,
}

/// All that is drawn.
pub struct GpuScene {
    pub(super) vertices: wgpu::Buffer,
    pub(super) indices: wgpu::Buffer,
    pub(super) draws: Vec<Draw>,
    pub(super) materials: Vec<LoadedMaterial>,
    pub(super) light: GpuLight,
    pub(super) scene: RenderScene,
}

impl GpuScene {
    /// What is drawn, as it was given.
    pub fn scene(&self) -> &RenderScene {
        &self.scene
    }

    /// Other lights from the next frame on.
    pub fn set_lights(&mut self, lights: Vec<Light>) {
        self.scene.lights = lights;
    }

    /// Other factors, another fuzz and other detail for a material from the next frame on; its textures stay.
    pub fn set_material(
        &mut self,
        gpu: &Gpu,
        index: usize,
        material: &RenderMaterial,
        adjustment: Adjustment,
    ) {
        let range = self.scene.geometry.curvature_range();
        self.materials[index].set(gpu, material, adjustment, range);
    }

    pub(super) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        scene: &RenderScene,
        light: &GpuLight,
        filtering: TextureFiltering,
    ) -> Self {
        let buffer = |contents: &[u8], usage| {
            gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };

        // Geometry, one draw for each run of triangles of the same material.
        let geometry = &scene.geometry;
        let mut vertices = Vec::with_capacity(geometry.positions.len() * VERTEX_FLOATS);
        for i in 0..geometry.positions.len() {
            vertices.extend(geometry.positions[i].to_array());
            vertices.extend(geometry.normals[i].to_array());
            vertices.extend(geometry.tangents[i].to_array());
            vertices.extend(geometry.uvs[i].iter().flat_map(|uv| uv.to_array()));
            vertices.extend(geometry.colors[i].to_array());
            vertices.extend(geometry.curvature.get(i).copied().unwrap_or(FLAT).to_array());
        }
        let indices: Vec<u8> = geometry.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let mut draws: Vec<Draw> = Vec::new();
        for run in (0..geometry.triangles.len())
            .collect::<Vec<_>>()
            .chunk_by(|&a, &b| geometry.materials[a] == geometry.materials[b])
        {
            let corners = run.iter().flat_map(|&t| geometry.triangles[t]);
            let sum: Vec3 = corners.map(|i| geometry.positions[i as usize]).sum();
            draws.push(Draw {
                material: geometry.materials[run[0]] as usize,
                indices: 3 * run[0] as u32..3 * (run[run.len() - 1] + 1) as u32,
                middle: sum / (3 * run.len()) as f32,
            });
        }

        let mut textures = Textures::new(gpu, filtering);
        let range = geometry.curvature_range();
        let materials = scene.materials.iter().map(|m| LoadedMaterial::new(&mut textures, layouts, m, range));
        let materials = materials.collect();
        let vertices: Vec<u8> = vertices.iter().flat_map(|f: &f32| f.to_le_bytes()).collect();
        Self {
            vertices: buffer(&vertices, wgpu::BufferUsages::VERTEX),
            indices: buffer(&indices, wgpu::BufferUsages::INDEX),
            draws,
            materials,
            light: light.clone(),
            scene: scene.clone(),
        }
    }
}

/// Light from all around on the GPU; cloning shares it.
#[derive(Clone)]
pub struct GpuLight {
    /// With all mips.
    pub(super) environment: wgpu::TextureView,
}

impl GpuLight {
    pub(super) fn new(gpu: &Gpu, surroundings: Option<&Surroundings>) -> Self {
        let Some(surroundings) = surroundings else {
            let environment = float_texture(gpu, (1, 1), &half_levels(&[vec![Vec3::ZERO]]));
            return Self { environment };
        };
        let environment = &surroundings.environment;
        let size = (environment.width() as u32, environment.height() as u32);
        Self { environment: float_texture(gpu, size, &half_levels(&probe::levels(environment))) }
    }
}
