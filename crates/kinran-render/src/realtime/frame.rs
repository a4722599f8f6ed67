//! What every pass of a frame knows: the uniform that frame.wgsl declares.

use encase::ShaderType;
use glam::camera::rh;
use glam::{Mat4, Vec2, Vec3, Vec4};
use kinran_scene::{Camera, LightKind};

use super::settings::{MAX_LIGHTS, Settings, sun};
use super::uniform::{Mat4f, Vec4f, Vec4u};
use crate::reference::{Background, RenderScene};
use crate::tonemap::Tonemap;

#[derive(Clone, Copy, Default, ShaderType)]
pub(super) struct Light {
    position: Vec4f,
    direction: Vec4f,
    color: Vec4f,
    cone: Vec4f,
}

#[derive(ShaderType)]
pub(super) struct Frame {
    view_projection: Mat4f,
    inverse_view_projection: Mat4f,
    light_projection: Mat4f,
    camera: Vec4f,
    background: Vec4f,
    irradiance: [Vec4f; 9],
    counts: Vec4u,
    display: Vec4f,
    lights: [Light; MAX_LIGHTS],
}

impl Frame {
    /// The `frame`th frame of a picture of `size` pixels, which looks at the place `jitter` of each.
    pub(super) fn new(
        scene: &RenderScene,
        camera: &Camera,
        settings: &Settings,
        size: (u32, u32),
        frame: u32,
        jitter: Vec2,
    ) -> Self {
        let (width, height) = (size.0 as f32, size.1 as f32);
        let (min, max) = scene.geometry.bounds().unwrap_or((Vec3::NEG_ONE, Vec3::ONE));
        let (middle, radius) = (0.5 * (min + max), (0.5 * (max - min)).length().max(1e-6));

        // Near and far just hold the model.
        let eye = Vec3::from(camera.transform.translation);
        let far = (eye.distance(middle) + radius) * 1.01;
        let near = ((eye.distance(middle) - radius) * 0.99).max(far * 1e-4);
        // The place in the pixel that this frame looks at becomes its centre.
        let shift =
            Vec3::new(1.0 - 2.0 * jitter.x, 2.0 * jitter.y - 1.0, 0.0) / Vec3::new(width, height, 1.0);
        let projection = Mat4::from_translation(shift)
            * rh::proj::directx::perspective(camera.yfov, width / height, near, far);
        let view_projection = projection * Mat4::from(camera.transform).inverse();

        // The shadow map sees the whole model.
        let sun = sun(scene).filter(|_| settings.shadows);
        let light_projection = sun.map_or(Mat4::IDENTITY, |sun| {
            let up = if sun.direction.y.abs() > 0.99 { Vec3::X } else { Vec3::Y };
            let view = rh::view::look_to_mat4(middle - radius * sun.direction, sun.direction, up);
            rh::proj::directx::orthographic(-radius, radius, -radius, radius, 0.0, 2.0 * radius) * view
        });

        let background = match settings.background {
            Background::Color(color) => color.extend(0.0),
            Background::Environment { .. } => Vec4::W,
        };
        let curve = match settings.tonemap {
            Tonemap::None => 0.0,
            Tonemap::Aces => 1.0,
            Tonemap::AgX => 2.0,
        };
        let lights = &scene.lights[..scene.lights.len().min(MAX_LIGHTS)];
        let mut uniforms = [Light::default(); MAX_LIGHTS];
        for (uniform, light) in uniforms.iter_mut().zip(lights) {
            let shadowed = sun.is_some_and(|sun| std::ptr::eq(sun, light));
            *uniform = light_uniform(light, shadowed);
        }
        let surrounded = u32::from(scene.surroundings.is_some());
        Frame {
            view_projection: view_projection.into(),
            inverse_view_projection: view_projection.inverse().into(),
            light_projection: light_projection.into(),
            camera: eye.extend(f32::from(u8::from(settings.reflections))).into(),
            background: background.into(),
            irradiance: scene
                .surroundings
                .as_ref()
                .map(|s| s.irradiance)
                .unwrap_or_default()
                .map(|c| c.extend(0.0).into()),
            counts: [lights.len() as u32, surrounded, settings.channel as u32, frame].into(),
            display: [width, height, settings.exposure.exp2(), curve].into(),
            lights: uniforms,
        }
    }
}

fn light_uniform(light: &kinran_scene::Light, shadowed: bool) -> Light {
    let (kind, inner, outer) = match light.kind {
        LightKind::Directional => (0.0, 0.0, 0.0),
        LightKind::Spot { inner_cone_angle, outer_cone_angle } => (2.0, inner_cone_angle, outer_cone_angle),
        _ => (1.0, 0.0, 0.0),
    };
    Light {
        position: light.position.extend(kind).into(),
        // A range without end, squared, must stay a number.
        direction: light.direction.extend(light.range.min(1e18)).into(),
        color: light.color.extend(f32::from(u8::from(shadowed))).into(),
        cone: [libm::cosf(inner), libm::cosf(outer), 0.0, 0.0].into(),
    }
}
