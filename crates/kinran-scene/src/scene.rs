use std::sync::Arc;

use glam::{Affine3A, Vec2, Vec3, Vec4};

use crate::{Detail, DetailMap, Fuzz, TextureRef};

/// `KHR_materials_anisotropy`.
#[derive(Clone, Debug, PartialEq)]
pub struct Anisotropy {
    /// 0 to 1, multiplied with the texture's blue channel.
    pub strength: f32,
    /// Radians, counter-clockwise from the tangent, added to the texture's direction.
    pub rotation: f32,
    /// RG direction in tangent space mapped from [0, 1] to [-1, 1], B strength.
    pub texture: Option<TextureRef>,
}

/// Where light that enters skin leaves it, in `KINRAN_materials_skin`.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum SkinProfile {
    /// Human skin, six Gaussians.
    #[default]
    Human,
    /// Gaussians: variance in square millimetres and weight, RGB.
    Gaussians(Vec<(f64, [f64; 3])>),
    /// Burley's normalised diffusion: d of each channel in millimetres.
    Burley([f64; 3]),
}

/// `KINRAN_materials_skin`: the diffuse lobe is pre-integrated skin.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// The diffusion profile.
    pub profile: SkinProfile,
    /// Multiplies the profile's lengths; above zero.
    pub scatter_scale: f32,
    /// Perceptual roughness of a second lobe of gloss, 0 to 1.
    pub second_roughness: f32,
    /// Weight of that lobe, 0 to 1; the first one has the rest.
    pub second_share: f32,
    /// How far the diffuse normal of each channel turns towards the mesh's, 0 to 1.
    pub normal_blur: Vec3,
    /// Width in millimetres of the penumbra that shadows scatter in; 0 for none.
    pub penumbra: f32,
}

impl Default for Skin {
    fn default() -> Self {
        Skin {
            profile: SkinProfile::Human,
            scatter_scale: 1.0,
            second_roughness: 0.0,
            second_share: 0.0,
            normal_blur: Vec3::ZERO,
            penumbra: 0.0,
        }
    }
}

/// `_CURVATURE`: curvature tensors of vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexCurvature {
    /// As `curvature_encode` of `kinran-shading` makes them, 0 to 1.
    pub codes: Vec<Vec4>,
    /// Curvature of the code one, 1/mm.
    pub range: f32,
    /// Millimetres in the mesh's unit of length, scale of its node included, as they were when it was baked.
    pub millimetres: f32,
}

/// Where a primitive comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Source {
    /// Index of the document's mesh.
    pub mesh: usize,
    /// Its number among the mesh's primitives.
    pub primitive: usize,
    /// The vertex of the document's primitive that each vertex was; empty where they are the same.
    pub vertices: Vec<u32>,
    /// The document has no normals here; those of [`Primitive`] are flat.
    pub lacks_normals: bool,
    /// The document has no tangents here; those of [`Primitive`] were made.
    pub lacks_tangents: bool,
    /// Where a skin holds it: [`Primitive`] is not in the mesh's space then but in the world, about [`Pose::origin`].
    pub pose: Option<Pose>,
}

/// How a skin holds a primitive in the rest pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// Index of the document's skin.
    pub skin: usize,
    /// The place in the world that [`Primitive::positions`] are relative to, which its instance has.
    pub origin: Vec3,
    /// Size in the world over size in the mesh's space, the mean over the vertices of its mesh; zero where the joints shrink it to
    /// nothing, and no instance shows it.
    pub scale: f64,
    /// The joints mirror it: triangles turn the other way round than in the document.
    pub mirrored: bool,
    /// The vertices' tangents in the mesh's space.
    pub tangents: Vec<Vec4>,
}

/// `KHR_materials_diffuse_transmission`: of the light that a thin surface scatters, the share that comes out on its
/// other side.
#[derive(Clone, Debug, PartialEq)]
pub struct DiffuseTransmission {
    /// The share, 0 to 1, multiplied with the texture's alpha.
    pub factor: f32,
    /// A share.
    pub texture: Option<TextureRef>,
    /// Linear colour of what comes out, multiplied with the texture.
    pub color_factor: Vec3,
    /// sRGB colour.
    pub color: Option<TextureRef>,
}

/// `KHR_materials_specular` and `KHR_materials_ior`: what of a surface that is not metal reflects,
/// `strength · min(color · f0, 1)` at normal incidence and `strength` at grazing.
#[derive(Clone, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, at least 1, or 0: reflects all that the colour allows, as specular/glossiness has it.
    pub ior: f32,
    /// 0 to 1, multiplied with the texture's alpha.
    pub strength: f32,
    /// A strength.
    pub strength_texture: Option<TextureRef>,
    /// Linear, not negative, may exceed one; multiplied with the texture.
    pub color_factor: Vec3,
    /// sRGB colour.
    pub color: Option<TextureRef>,
}

impl Default for Dielectric {
    /// glTF's, where no extension says otherwise: 4 % of white light.
    fn default() -> Self {
        Dielectric { ior: 1.5, strength: 1.0, strength_texture: None, color_factor: Vec3::ONE, color: None }
    }
}

impl Dielectric {
    /// `((ior - 1) / (ior + 1))²`, before strength and colour.
    pub fn f0(&self) -> f32 {
        ((self.ior - 1.0) / (self.ior + 1.0)).powi(2)
    }
}

/// What happens where a surface's alpha is below one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// Alpha below the cutoff is a hole.
    Mask {
        /// The cutoff, 0 to 1.
        cutoff: f32,
    },
    /// Alpha blends with what lies behind.
    Blend,
}

/// A glTF metallic-roughness material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The document's name, or `material N`.
    pub name: String,
    /// Linear, multiplied with the texture.
    pub base_color_factor: Vec4,
    /// sRGB colour, linear alpha.
    pub base_color: Option<TextureRef>,
    /// 0 to 1, multiplied with the texture's blue channel.
    pub metallic_factor: f32,
    /// Perceptual roughness, 0 to 1, multiplied with the texture's green channel.
    pub roughness_factor: f32,
    /// G roughness, B metallic.
    pub metallic_roughness: Option<TextureRef>,
    /// Tangent space, +Y up.
    pub normal: Option<TextureRef>,
    /// Scales the normal map's x and y.
    pub normal_scale: f32,
    /// R occlusion.
    pub occlusion: Option<TextureRef>,
    /// 0 to 1.
    pub occlusion_strength: f32,
    /// Linear radiance, `emissiveFactor` times `KHR_materials_emissive_strength`.
    pub emissive_factor: Vec3,
    /// sRGB colour.
    pub emissive: Option<TextureRef>,
    /// `KHR_materials_anisotropy`, when present.
    pub anisotropy: Option<Anisotropy>,
    /// `KINRAN_materials_aniso`, when present: RGB hold an aniso texel, squared roughness in the frame of the normal map.
    pub aniso: Option<TextureRef>,
    /// `KINRAN_materials_skin`, when present.
    pub skin: Option<Skin>,
    /// `KINRAN_materials_fuzz`, or `KHR_materials_sheen` as upright fibres.
    pub fuzz: Option<Fuzz>,
    /// `KINRAN_materials_detail`, when present.
    pub detail: Option<Detail>,
    /// `KHR_materials_diffuse_transmission`, when present.
    pub diffuse_transmission: Option<DiffuseTransmission>,
    /// `KHR_materials_transmission`'s factor, 0 to 1: the share of the light that is not reflected which passes through.
    pub transmission: f32,
    /// `KHR_materials_specular` and `KHR_materials_ior`, when one of them is present.
    pub dielectric: Option<Dielectric>,
    /// Transparency.
    pub alpha_mode: AlphaMode,
    /// Both sides are lit; otherwise back faces are culled.
    pub double_sided: bool,
    /// Names of extensions on this material that [`Material`] does not represent.
    pub ignored_extensions: Vec<String>,
}

impl Default for Material {
    /// A material of which a document says nothing.
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color_factor: Vec4::ONE,
            base_color: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness: None,
            normal: None,
            normal_scale: 1.0,
            occlusion: None,
            occlusion_strength: 1.0,
            emissive_factor: Vec3::ZERO,
            emissive: None,
            anisotropy: None,
            aniso: None,
            skin: None,
            fuzz: None,
            detail: None,
            diffuse_transmission: None,
            transmission: 0.0,
            dielectric: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            ignored_extensions: Vec::new(),
        }
    }
}

impl Material {
    /// The maps that hold directions in the surface's plane, of the first of which generated tangents follow the UVs.
    fn directed(&self) -> impl Iterator<Item = &TextureRef> {
        let fibres = self.fuzz.as_ref().and_then(|fuzz| match fuzz {
            Fuzz::Layer(layer) => layer.direction_texture.as_ref(),
            Fuzz::Simple { .. } => None,
        });
        let detail = |map| self.detail.as_ref().and_then(|d| d.maps[map as usize].as_ref());
        [
            self.normal.as_ref(),
            self.anisotropy.as_ref().and_then(|anisotropy| anisotropy.texture.as_ref()),
            self.aniso.as_ref(),
            detail(DetailMap::Normal),
            detail(DetailMap::Aniso),
            fibres,
        ]
        .into_iter()
        .flatten()
    }

    /// Whether the surface has a direction in its plane, by a map or by a factor, so that tangents are seen.
    pub fn needs_tangents(&self) -> bool {
        let combed = matches!(&self.fuzz, Some(Fuzz::Layer(layer)) if layer.tilt != 0.0);
        combed || self.anisotropy.is_some() || self.directed().next().is_some()
    }

    /// The UV set that generated tangents follow: that of the first map which holds directions, whichever other maps there
    /// are; `TEXCOORD_0` without any.
    pub fn tangent_uv_set(&self) -> usize {
        self.directed().next().map_or(0, |texture| texture.uv_set)
    }

    /// Every texture of the material.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let diffuse_transmission = self.diffuse_transmission.as_ref();
        let dielectric = self.dielectric.as_ref();
        [
            self.normal.as_ref(),
            self.anisotropy.as_ref().and_then(|anisotropy| anisotropy.texture.as_ref()),
            self.aniso.as_ref(),
            self.base_color.as_ref(),
            self.metallic_roughness.as_ref(),
            self.occlusion.as_ref(),
            self.emissive.as_ref(),
            diffuse_transmission.and_then(|d| d.texture.as_ref()),
            diffuse_transmission.and_then(|d| d.color.as_ref()),
            dielectric.and_then(|d| d.strength_texture.as_ref()),
            dielectric.and_then(|d| d.color.as_ref()),
        ]
        .into_iter()
        .flatten()
        .chain(self.fuzz.iter().flat_map(Fuzz::textures))
        .chain(self.detail.iter().flat_map(Detail::textures))
    }
}

/// Triangles of one material. All vertex arrays have the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct Primitive {
    /// Metres, times the instance's scale.
    pub positions: Vec<Vec3>,
    /// Unit length.
    pub normals: Vec<Vec3>,
    /// `TANGENT`, or MikkTSpace's: xyz unit length, w the bitangent's sign, `b = w * cross(n, t)`.
    pub tangents: Vec<Vec4>,
    /// `TEXCOORD_0` and `TEXCOORD_1`; empty when absent, which means (0, 0) everywhere.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear RGBA; empty when absent.
    pub colors: Vec<Vec4>,
    /// `_CURVATURE`, when present.
    pub curvature: Option<VertexCurvature>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Where it comes from.
    pub source: Source,
}

/// A primitive placed in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`Scene::primitives`].
    pub primitive: usize,
    /// Object to world; invertible. Where its determinant is negative, triangles turn clockwise in the world.
    pub transform: Affine3A,
}

/// The shape of a [`Light`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Parallel light; intensity in lux.
    Directional,
    /// From a point; intensity in candela.
    Point,
    /// A cone; intensity in candela.
    Spot {
        /// Radians from the axis within which the light is full.
        inner_cone_angle: f32,
        /// Radians from the axis beyond which there is none.
        outer_cone_angle: f32,
    },
}

/// A punctual light (`KHR_lights_punctual`) in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Shape.
    pub kind: LightKind,
    /// Linear colour times intensity.
    pub color: Vec3,
    /// World position; meaningless for [`LightKind::Directional`].
    pub position: Vec3,
    /// The unit direction in which the light shines.
    pub direction: Vec3,
    /// Metres beyond which there is no light; infinite when unlimited.
    pub range: f32,
}

/// A perspective camera in world space, looking along its -z with +y up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Camera to world, a rigid transform.
    pub transform: Affine3A,
    /// Vertical field of view in radians.
    pub yfov: f32,
}

/// A glTF scene, flattened and validated.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Geometry in object space.
    pub primitives: Vec<Primitive>,
    /// Where the geometry stands.
    pub instances: Vec<Instance>,
    /// Materials; a document without any gets glTF's default one.
    pub materials: Vec<Material>,
    /// Decoded images, in the document's order; `None` where no material uses the image, or where an
    /// earlier image has the same source and stands for it.
    pub images: Vec<Option<Arc<kinran_image::Image>>>,
    /// KTX2 and DDS files with their mips, by the number of the document's image; `None` for other images, those that no
    /// material uses, and those that could not be read but have a PNG or JPEG beside them.
    pub textures: Vec<Option<Arc<kinran_image::Texture>>>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// What was left out or mended on the way in, a sentence each.
    pub warnings: Vec<String>,
}
