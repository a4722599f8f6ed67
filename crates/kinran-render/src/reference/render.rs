//! The picture.

use super::{
    Hit, PictureCamera, RenderFuzz, RenderScene,
    camera::CameraRay,
    diffuse::diffuse_lobe,
    fuzz::FuzzAt,
    geometry::SurfacePoint,
    light::{Incident, incident},
    sampler::{pixel_seed, sample_2d},
    scene::{RenderMaterial, Surroundings},
    shading::{Shading, shadow_transmittance},
    skin::{RenderSkin, SkinPoint},
    texture::TextureFiltering,
};
use crate::Error;
use glam::{Vec2, Vec3};
use kinran_image::{Cancelled, Tick};
use kinran_scene::{AlphaMode, Camera};
use kinran_shading::fuzz::{fuzz_over_base_pdf, fuzz_over_base_sample};
use kinran_shading::{ggx_vndf_pdf, ggx_vndf_sample, m_n};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// What the camera sees where there is no surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The environment, seen through a cone of this half angle in radians; 0 is sharp.
    Environment {
        /// Radians, 0 to pi.
        blur: f32,
    },
    /// Linear radiance.
    Color(Vec3),
}

/// Where in a pixel surfaces are shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadingRate {
    /// At every sample's own place.
    #[default]
    Sample,
    /// Once for the pixel, as GPUs do it with multisampling: a surface that the pixel's centre shows is shaded there, and
    /// samples say how much of the pixel it covers. It goes on as far as samples see the same material, from the same side,
    /// not farther than a pixel's width from the tangent plane at the centre; what they see else is shaded at their own
    /// places.
    Pixel,
}

/// How to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Pixels in a row, 1 to 32768.
    pub width: u32,
    /// Rows, 1 to 32768.
    pub height: u32,
    /// Samples in a pixel, box-filtered; powers of two are stratified best.
    pub samples_per_pixel: u32,
    /// The first of them, 0 to 2^20: samples n to 2n of a pixel go on where samples 0 to n ended, and the mean of both
    /// pictures is the one of 2n samples.
    pub first_sample: u32,
    /// Which random numbers are drawn: pictures of different seeds have independent noise.
    pub seed: u32,
    /// How textures are read.
    pub filtering: TextureFiltering,
    /// Where surfaces are shaded.
    pub shading: ShadingRate,
    /// For every sample of a pixel, this many of the specular lobe and as many of the environment; 0 leaves
    /// the environment's specular reflection black.
    pub env_samples: u32,
    /// Punctual lights cast hard shadows.
    pub shadows: bool,
    /// Behind everything.
    pub background: Background,
}

impl Default for Settings {
    /// 512 by 512 pixels of 16 samples as a GPU with 16x anisotropic filtering draws them, with shadows.
    fn default() -> Self {
        Settings {
            width: 512,
            height: 512,
            samples_per_pixel: 16,
            first_sample: 0,
            seed: 0,
            filtering: TextureFiltering::Mips { max_anisotropy: 16 },
            shading: ShadingRate::Sample,
            env_samples: 1,
            shadows: true,
            background: Background::Environment { blur: 0.0 },
        }
    }
}

/// A picture of linear radiance, Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

impl Film {
    /// The picture at `1 / by` of its width and height, rounded up: each pixel the mean of what it covers.
    ///
    /// # Panics
    /// When `by` is zero.
    pub fn shrunk(&self, by: u32) -> Film {
        let (width, height) = (self.width.div_ceil(by), self.height.div_ceil(by));
        let covered = |at: u32, of: u32| at * by..((at + 1) * by).min(of);
        let mean = |(x, y): (u32, u32)| {
            let rows = covered(y, self.height);
            let places = rows.flat_map(|y| covered(x, self.width).map(move |x| y * self.width + x));
            let colors: Vec<Vec3> = places.map(|i| Vec3::from(self.pixels[i as usize])).collect();
            (colors.iter().sum::<Vec3>() / colors.len() as f32).to_array()
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(mean).collect();
        Film { width, height, pixels }
    }
}

/// Longest side of a picture in pixels.
const MAX_SIDE: u32 = 32768;

/// Side of the squares of pixels that threads work on.
const TILE: u32 = 16;

/// Samples of a pixel above which each row of a tile asks whether to go on: a tile of them takes a tenth of a second and more.
const LONG_PIXEL: u32 = 128;

/// Surfaces one behind the other that a ray may see or pass; beyond it there is nothing. Blended foliage
/// rarely stacks more than a dozen.
const MAX_LAYERS: usize = 128;

/// Light of which less comes through is not seen: half a code of an 8-bit display.
const INVISIBLE: f32 = 1.0 / 512.0;

/// Pairs of the sample sequence.
const PIXEL: u32 = 0;
const LOBE: u32 = 1;
const ENVIRONMENT: u32 = 2;
const BACKDROP: u32 = 3;
const PENUMBRA: u32 = 4;

/// Renders `scene`. `tick` is told of pixels, `width * height` in all. The same
/// arguments give the same picture, bit by bit, whatever the number of threads.
///
/// # Errors
/// [`Error::Setting`] for a size, a number of samples or an angle outside its range, [`Error::Cancelled`] where `tick` stops
/// the work.
pub fn render(
    scene: &RenderScene,
    camera: &Camera,
    settings: &Settings,
    tick: &Tick<'_>,
) -> Result<Film, Error> {
    check(camera, settings)?;
    check_fuzz(scene)?;
    let (width, height) = (settings.width, settings.height);
    let picture = PictureCamera::new(camera, width, height);
    let renderer = Renderer { scene, settings, cutouts: scene.materials.iter().any(lets_light_through) };

    let columns = width.div_ceil(TILE);
    let total = columns * height.div_ceil(TILE);
    let tiles = (0..total)
        .into_par_iter()
        .map(|tile| {
            let (x0, y0) = (tile % columns * TILE, tile / columns * TILE);
            let mut pixels = Vec::new();
            for y in y0..(y0 + TILE).min(height) {
                if settings.samples_per_pixel > LONG_PIXEL {
                    tick(0)?;
                }
                pixels.extend((x0..(x0 + TILE).min(width)).map(|x| renderer.pixel(&picture, x, y)));
            }
            tick(pixels.len() as u64)?;
            Ok(pixels)
        })
        .collect::<Result<Vec<Vec<Vec3>>, Cancelled>>()?;

    let mut pixels = vec![[0.0; 3]; width as usize * height as usize];
    for (tile, values) in tiles.iter().enumerate() {
        let (x0, y0) = (tile as u32 % columns * TILE, tile as u32 / columns * TILE);
        let row_length = TILE.min(width - x0) as usize;
        for (row, values) in values.chunks_exact(row_length).enumerate() {
            let start = (y0 as usize + row) * width as usize + x0 as usize;
            for (pixel, value) in pixels[start..].iter_mut().zip(values) {
                *pixel = value.to_array();
            }
        }
    }
    Ok(Film { width, height, pixels })
}

fn check(camera: &Camera, settings: &Settings) -> Result<(), Error> {
    let refuse = |name, value: String, fix| Err(Error::Setting { name, value, fix });
    for (name, side) in [("width", settings.width), ("height", settings.height)] {
        if !(1..=MAX_SIDE).contains(&side) {
            return refuse(name, side.to_string(), "it must be 1 to 32768 pixels");
        }
    }
    if !(1..=1 << 20).contains(&settings.samples_per_pixel) {
        let value = settings.samples_per_pixel.to_string();
        return refuse("samples_per_pixel", value, "it must be 1 to 1048576");
    }
    if settings.first_sample > 1 << 20 {
        return refuse("first_sample", settings.first_sample.to_string(), "it must be 0 to 1048576");
    }
    if settings.env_samples > 1024 {
        return refuse("env_samples", settings.env_samples.to_string(), "it must be 0 to 1024");
    }
    if let Some(max_anisotropy) = settings.filtering.max_anisotropy()
        && !(1..=16).contains(&max_anisotropy)
    {
        return refuse("max_anisotropy", max_anisotropy.to_string(), "it must be 1 to 16");
    }
    match settings.background {
        Background::Environment { blur } if !(0.0..=std::f32::consts::PI).contains(&blur) => {
            return refuse("blur", blur.to_string(), "it must be 0 to pi radians");
        }
        Background::Color(color) if !color.is_finite() => {
            return refuse("background", color.to_string(), "it must be finite");
        }
        _ => {}
    }
    if !(camera.yfov > 0.0 && camera.yfov < std::f32::consts::PI) {
        return refuse("yfov", camera.yfov.to_string(), "it must lie between 0 and pi radians");
    }
    if !camera.transform.is_finite() {
        return refuse("camera", camera.transform.to_string(), "it must be finite");
    }
    Ok(())
}

fn check_fuzz(scene: &RenderScene) -> Result<(), Error> {
    let is_fitted = |fuzz: &RenderFuzz| fuzz.is_exact() || fuzz.fits.is_some();
    match scene.materials.iter().position(|m| m.fuzz.as_ref().is_some_and(|fuzz| !is_fitted(fuzz))) {
        Some(i) => Err(Error::Scene(format!("the fuzz of material {i} has no coefficients; call fit_fuzz"))),
        None => Ok(()),
    }
}

fn lets_light_through(material: &RenderMaterial) -> bool {
    material.alpha_mode != AlphaMode::Opaque || material.transmission > 0.0
}

struct Renderer<'a> {
    scene: &'a RenderScene,
    settings: &'a Settings,
    /// Whether any material lets shadow rays through.
    cutouts: bool,
}

/// Which of a pixel's samples is taken.
#[derive(Clone, Copy)]
struct Sample {
    index: u32,
    seed: u32,
}

/// A surface that a ray meets, where it is shaded.
#[derive(Clone, Copy)]
struct Place {
    hit: Hit,
    point: SurfacePoint,
    /// The unit direction towards the viewer.
    view: Vec3,
    /// A pixel's width there, across the view.
    width: f32,
    /// What it shows where that is the same for every sample.
    shown: Option<(Shading, Vec3)>,
}

impl Place {
    fn new(scene: &RenderScene, hit: Hit, ray: &CameraRay) -> Self {
        let point = scene.geometry.surface_point(&hit, ray);
        let width = hit.distance * ray.direction_dx.length().max(ray.direction_dy.length());
        Place { hit, point, view: -ray.direction, width, shown: None }
    }

    fn shows_back(&self) -> bool {
        self.point.geometric_normal.dot(self.view) <= 0.0
    }

    /// Whether the surface of this place goes on to another one, see [`ShadingRate::Pixel`].
    fn reaches(&self, other: &Place) -> bool {
        let rise = (other.point.position - self.point.position).dot(self.point.geometric_normal);
        (self.point.material, self.shows_back()) == (other.point.material, other.shows_back())
            && rise.abs() <= self.width
    }
}

impl Renderer<'_> {
    fn pixel(&self, picture: &PictureCamera, x: u32, y: u32) -> Vec3 {
        let seed = pixel_seed(x, y, self.settings.seed);
        let (first, count) = (self.settings.first_sample, self.settings.samples_per_pixel);
        let corner = Vec2::new(x as f32, y as f32);
        let center = match self.settings.shading {
            ShadingRate::Sample => Vec::new(),
            ShadingRate::Pixel => self.center(&picture.ray(corner.x + 0.5, corner.y + 0.5), seed),
        };
        let sum: Vec3 = (first..first + count)
            .map(|index| {
                let place = corner + sample_2d(index, PIXEL, seed);
                self.radiance(&picture.ray(place.x, place.y), &center, Sample { index, seed })
            })
            .sum();
        sum / count as f32
    }

    /// The surfaces that a pixel's centre shows, the nearest first.
    fn center(&self, ray: &CameraRay, seed: u32) -> Vec<Place> {
        let mut places = Vec::new();
        let (mut start, mut through) = (0.0, Vec3::ONE);
        while places.len() < MAX_LAYERS && through.max_element() >= INVISIBLE {
            let bvh = self.scene.geometry.bvh();
            let Some(hit) = bvh.closest_hit(ray.origin, ray.direction, start, f32::INFINITY) else { break };
            start = hit.distance;
            let mut place = Place::new(self.scene, hit, ray);
            if self.is_hidden(&place) {
                continue;
            }
            let sample = Sample { index: 0, seed };
            let shading = self.shading(&place, sample);
            through *= 1.0 - shading.opacity + shading.opacity * shading.transmitted;
            if self.is_steady(place.point.material) {
                place.shown = Some((shading, self.reflected(&shading, &place, sample)));
            }
            places.push(place);
        }
        places
    }

    /// Whether it is the back of a surface that has none.
    fn is_hidden(&self, place: &Place) -> bool {
        !self.scene.materials[place.point.material].double_sided && place.shows_back()
    }

    /// Whether what a material reflects does not depend on the sample.
    fn is_steady(&self, material: usize) -> bool {
        let material = &self.scene.materials[material];
        let by_texel = matches!(self.settings.filtering, TextureFiltering::Texels { .. });
        let by_light = self.settings.env_samples > 0 && self.scene.surroundings.is_some();
        !by_texel && !by_light && material.skin.is_none() && material.fuzz.is_none()
    }

    fn shading(&self, place: &Place, sample: Sample) -> Shading {
        let material = &self.scene.materials[place.point.material];
        let range = self.scene.geometry.curvature_range();
        let filtering = self.settings.filtering.of_sample(sample.index, sample.seed);
        Shading::new(material, &place.point, place.view, filtering, range)
    }

    /// Radiance along a ray, surfaces that let light through composited front to back; those of `center` are shaded there.
    fn radiance(&self, ray: &CameraRay, center: &[Place], sample: Sample) -> Vec3 {
        let mut seen = Vec3::ZERO;
        let mut through = Vec3::ONE;
        let mut start = 0.0;
        for _ in 0..MAX_LAYERS {
            let bvh = self.scene.geometry.bvh();
            let Some(hit) = bvh.closest_hit(ray.origin, ray.direction, start, f32::INFINITY) else {
                return seen + through * self.background(ray.direction, sample);
            };
            start = hit.distance;
            let own = Place::new(self.scene, hit, ray);
            if self.is_hidden(&own) {
                continue;
            }
            let place = center.iter().find(|place| place.reaches(&own)).unwrap_or(&own);
            let (shading, reflected) = match place.shown {
                Some(shown) => shown,
                None => {
                    let shading = self.shading(place, sample);
                    let is_seen = shading.opacity > 0.0;
                    (shading, if is_seen { self.reflected(&shading, place, sample) } else { Vec3::ZERO })
                }
            };
            seen += through * shading.opacity * reflected;
            through *= 1.0 - shading.opacity + shading.opacity * shading.transmitted;
            if through.max_element() < INVISIBLE {
                break;
            }
        }
        seen
    }

    fn reflected(&self, shading: &Shading, place: &Place, sample: Sample) -> Vec3 {
        let Place { hit, point, view, .. } = place;
        let view = *view;
        let mut sum = shading.emitted;
        let to_shading = shading.frame.transpose();
        for light in &self.scene.lights {
            let Some(light) = incident(light, point.position) else { continue };
            if let (Some(at), Some(skin)) = (shading.skin, &self.scene.materials[point.material].skin) {
                let cosine = skin.punctual(&at, light.direction);
                let (direct, scattered) = if at.turns_away(light.direction) {
                    (Vec3::ZERO, Vec3::ONE)
                } else if self.settings.shadows && skin.penumbra > 0.0 {
                    let lit = self.filtered_visibility(point, hit, view, &light, (&at, skin), sample);
                    (lit, skin.in_penumbra(lit))
                } else {
                    let lit = self.visibility(point, hit, view, light.direction, light.distance);
                    (lit, lit)
                };
                let u = to_shading * light.direction;
                sum += shading.of_skin(u, cosine, direct, scattered) * light.irradiance;
                continue;
            }
            let u = to_shading * light.direction;
            let scattered = shading.scattered(u) * light.irradiance;
            if scattered.max_element() > 0.0 {
                // Light from behind arrives at the other side.
                let side = if u.z < 0.0 && shading.translucent != Vec3::ZERO { -view } else { view };
                sum += scattered * self.visibility(point, hit, side, light.direction, light.distance);
            }
        }
        if let Some(surroundings) = &self.scene.surroundings {
            let n = shading.frame.z_axis;
            let irradiance = match (shading.skin, &self.scene.materials[point.material].skin) {
                (Some(at), Some(skin)) => {
                    let (h_one, h_two) = skin.ambient(&at);
                    surroundings.skin_irradiance(n, h_one, h_two)
                }
                _ => surroundings.irradiance(n),
            };
            if let Some(fuzz) = &shading.fuzz {
                // Skin under fibres is a Lambert surface as much brighter as its harmonics are.
                let mut base = *shading;
                if shading.skin.is_some() {
                    base.diffuse *= irradiance / surroundings.irradiance(n).max(Vec3::splat(1e-6));
                }
                return sum + shading.occlusion * self.environment_through(&base, fuzz, surroundings, sample);
            }
            let mut diffuse = diffuse_lobe(shading.diffuse) * irradiance;
            if shading.translucent != Vec3::ZERO {
                diffuse += diffuse_lobe(shading.translucent) * surroundings.irradiance(-n);
            }
            let specular = self.environment_specular(shading, surroundings, sample);
            sum += shading.occlusion * (diffuse + specular);
        }
        sum
    }

    /// The environment in the specular lobe: as many samples of visible normals as of the environment,
    /// combined by the balance heuristic (Veach. Robust Monte Carlo Methods. 1997, section 9.2.2).
    fn environment_specular(&self, shading: &Shading, surroundings: &Surroundings, sample: Sample) -> Vec3 {
        let count = self.settings.env_samples;
        let environment = &surroundings.environment;
        let to_shading = shading.frame.transpose();
        let contribution = |u: Vec3, world: Vec3, environment_pdf: f32| -> Vec3 {
            if u.z <= 0.0 {
                return Vec3::ZERO;
            }
            let h = (u + shading.v).normalize();
            let lobe_pdf = ggx_vndf_pdf(shading.v, h, shading.alpha_t, shading.alpha_b)
                / (4.0 * shading.v.dot(h)).max(f32::MIN_POSITIVE);
            shading.specular(u) * u.z * environment.radiance(world) / (lobe_pdf + environment_pdf)
        };

        let mut sum = Vec3::ZERO;
        for i in sample.index * count..(sample.index + 1) * count {
            let xi = sample_2d(i, LOBE, sample.seed);
            let h = ggx_vndf_sample(shading.v, shading.alpha_t, shading.alpha_b, xi);
            let u = 2.0 * shading.v.dot(h) * h - shading.v;
            let world = shading.frame * u;
            sum += contribution(u, world, environment.pdf(world));

            let (world, pdf) = environment.sample(sample_2d(i, ENVIRONMENT, sample.seed));
            sum += contribution(to_shading * world, world, pdf);
        }
        if count == 0 { Vec3::ZERO } else { sum / count as f32 }
    }

    /// The environment in all lobes of a layer of fibres and its base, none of them by harmonics, since the layer dims each
    /// direction differently; sampled as [`Self::environment_specular`] is, once at least.
    fn environment_through(
        &self,
        shading: &Shading,
        fuzz: &FuzzAt,
        surroundings: &Surroundings,
        sample: Sample,
    ) -> Vec3 {
        let count = self.settings.env_samples.max(1);
        let environment = &surroundings.environment;
        let to_shading = shading.frame.transpose();
        let (specular, diffuse) = shading.brightness();
        let shares = fuzz.shares(specular, diffuse);
        let (t, alpha) = fuzz.fibres();
        let Shading { v, alpha_t, alpha_b, .. } = *shading;
        let contribution = |u: Vec3, world: Vec3, environment_pdf: f32| -> Vec3 {
            let lobe_pdf = fuzz_over_base_pdf(u, v, t, alpha, alpha_t, alpha_b, shares);
            shading.reflected(u) * environment.radiance(world) / (lobe_pdf + environment_pdf)
        };
        let mut sum = Vec3::ZERO;
        for i in sample.index * count..(sample.index + 1) * count {
            let xi = sample_2d(i, LOBE, sample.seed);
            let u = fuzz_over_base_sample(v, t, alpha, alpha_t, alpha_b, shares, xi);
            let world = shading.frame * u;
            sum += contribution(u, world, environment.pdf(world));

            let (world, pdf) = environment.sample(sample_2d(i, ENVIRONMENT, sample.seed));
            sum += contribution(to_shading * world, world, pdf);
        }
        sum / count as f32
    }

    /// The share of a light that reaches a point, on the side of the surface that `side` looks at.
    fn visibility(
        &self,
        point: &SurfacePoint,
        hit: &Hit,
        side: Vec3,
        direction: Vec3,
        distance: f32,
    ) -> Vec3 {
        if !self.settings.shadows {
            return Vec3::ONE;
        }
        let facing = if point.geometric_normal.dot(side) < 0.0 { -1.0 } else { 1.0 };
        let origin = self.scene.geometry.shadow_origin(hit, facing * point.geometric_normal);
        self.passed(origin, direction, distance)
    }

    /// The share of a light that reaches skin, filtered over a square across the light, as a shadow map's filter does it: rays
    /// along the light from the point's tangent plane. What stands nearer than half the square's side casts no shadow,
    /// since hollows rise above the plane.
    fn filtered_visibility(
        &self,
        point: &SurfacePoint,
        hit: &Hit,
        side: Vec3,
        light: &Incident,
        (at, skin): (&SkinPoint, &RenderSkin),
        sample: Sample,
    ) -> Vec3 {
        // Chosen by eye: penumbras are smooth at eight samples a pixel.
        const RAYS: u32 = 16;
        let facing = if point.geometric_normal.dot(side) < 0.0 { -1.0 } else { 1.0 };
        let origin = self.scene.geometry.shadow_origin(hit, facing * point.geometric_normal);
        let (u, width) = (light.direction, skin.penumbra_width());
        let across = m_n(if u.z < 0.0 { -u } else { u });
        let sum: Vec3 = (sample.index * RAYS..(sample.index + 1) * RAYS)
            .map(|i| {
                let place = (sample_2d(i, PENUMBRA, sample.seed) - 0.5) * width;
                let offset = place.x * across.x_axis + place.y * across.y_axis;
                let forward = 0.5 * width + at.rise(u, offset);
                self.passed(origin + offset + forward * u, u, (light.distance - forward).max(0.0))
            })
            .sum();
        sum / RAYS as f32
    }

    /// The share of light that passes from `origin` up to a distance.
    fn passed(&self, origin: Vec3, direction: Vec3, distance: f32) -> Vec3 {
        let geometry = &self.scene.geometry;
        if !self.cutouts {
            return Vec3::splat(f32::from(u8::from(
                !geometry.bvh().any_hit(origin, direction, 0.0, distance),
            )));
        }
        let ray = CameraRay { origin, direction, direction_dx: Vec3::ZERO, direction_dy: Vec3::ZERO };
        let mut through = Vec3::ONE;
        let mut start = 0.0;
        for _ in 0..MAX_LAYERS {
            let Some(hit) = geometry.bvh().closest_hit(origin, direction, start, distance) else {
                return through;
            };
            start = hit.distance;
            let material = &self.scene.materials[geometry.material(hit.triangle)];
            if !lets_light_through(material) {
                return Vec3::ZERO;
            }
            let point = geometry.surface_point(&hit, &ray);
            through *= shadow_transmittance(material, &point, TextureFiltering::Level0);
            if through == Vec3::ZERO {
                return Vec3::ZERO;
            }
        }
        Vec3::ZERO
    }

    fn background(&self, direction: Vec3, sample: Sample) -> Vec3 {
        let blur = match self.settings.background {
            Background::Color(color) => return color,
            Background::Environment { blur } => blur,
        };
        let Some(surroundings) = &self.scene.surroundings else { return Vec3::ZERO };
        if blur == 0.0 {
            return surroundings.environment.radiance(direction);
        }

        // Uniform over the spherical cap of half angle `blur`.
        let xi = sample_2d(sample.index, BACKDROP, sample.seed);
        let z = 1.0 - xi.x * (1.0 - libm::cosf(blur));
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = libm::sincosf(TAU * xi.y);
        let (t, b) = direction.any_orthonormal_pair();
        surroundings.environment.radiance(radius * cos * t + radius * sin * b + z * direction)
    }
}
