//! The part of glTF 2.0's JSON that a [`Scene`](crate::Scene) is made of, field for field, unvalidated.
//! Names and defaults are the specification's.

use serde::Deserialize;
use serde_json::{Map, Value};

pub(crate) type Extensions = Map<String, Value>;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Root {
    pub(crate) asset: Asset,
    #[serde(default)]
    pub(crate) extensions_used: Vec<String>,
    #[serde(default)]
    pub(crate) extensions_required: Vec<String>,
    pub(crate) scene: Option<usize>,
    #[serde(default)]
    pub(crate) scenes: Vec<Scene>,
    #[serde(default)]
    pub(crate) nodes: Vec<Node>,
    #[serde(default)]
    pub(crate) meshes: Vec<Mesh>,
    #[serde(default)]
    pub(crate) skins: Vec<Rig>,
    #[serde(default)]
    pub(crate) cameras: Vec<Camera>,
    #[serde(default)]
    pub(crate) materials: Vec<Material>,
    #[serde(default)]
    pub(crate) textures: Vec<Texture>,
    #[serde(default)]
    pub(crate) samplers: Vec<Sampler>,
    #[serde(default)]
    pub(crate) images: Vec<Image>,
    #[serde(default)]
    pub(crate) accessors: Vec<Accessor>,
    #[serde(default)]
    pub(crate) buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub(crate) buffers: Vec<Buffer>,
    #[serde(default)]
    pub(crate) extensions: RootExtensions,
}

#[derive(Deserialize)]
pub(crate) struct Asset {
    pub(crate) version: String,
}

#[derive(Default, Deserialize)]
pub(crate) struct RootExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(crate) lights: Option<Lights>,
}

#[derive(Deserialize)]
pub(crate) struct Lights {
    pub(crate) lights: Vec<Light>,
}

#[derive(Deserialize)]
pub(crate) struct Light {
    #[serde(rename = "type")]
    pub(crate) kind: String,
    #[serde(default = "one3")]
    pub(crate) color: [f32; 3],
    #[serde(default = "one")]
    pub(crate) intensity: f32,
    pub(crate) range: Option<f32>,
    #[serde(default)]
    pub(crate) spot: Spot,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Spot {
    pub(crate) inner_cone_angle: f32,
    pub(crate) outer_cone_angle: f32,
}

impl Default for Spot {
    fn default() -> Self {
        Spot { inner_cone_angle: 0.0, outer_cone_angle: std::f32::consts::FRAC_PI_4 }
    }
}

#[derive(Deserialize)]
pub(crate) struct Scene {
    #[serde(default)]
    pub(crate) nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(crate) struct Node {
    pub(crate) name: Option<String>,
    #[serde(default)]
    pub(crate) children: Vec<usize>,
    pub(crate) matrix: Option<[f64; 16]>,
    #[serde(default)]
    pub(crate) translation: [f64; 3],
    #[serde(default = "identity_quaternion")]
    pub(crate) rotation: [f64; 4],
    #[serde(default = "one3_f64")]
    pub(crate) scale: [f64; 3],
    pub(crate) mesh: Option<usize>,
    pub(crate) skin: Option<usize>,
    pub(crate) camera: Option<usize>,
    #[serde(default)]
    pub(crate) extensions: NodeExtensions,
}

#[derive(Default, Deserialize)]
pub(crate) struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub(crate) light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(crate) instancing: Option<Instancing>,
}

#[derive(Deserialize)]
pub(crate) struct NodeLight {
    pub(crate) light: usize,
}

#[derive(Deserialize)]
pub(crate) struct Instancing {
    pub(crate) attributes: InstanceAttributes,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) struct InstanceAttributes {
    pub(crate) translation: Option<usize>,
    pub(crate) rotation: Option<usize>,
    pub(crate) scale: Option<usize>,
}

#[derive(Deserialize)]
pub(crate) struct Mesh {
    pub(crate) name: Option<String>,
    pub(crate) primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(crate) struct Primitive {
    pub(crate) attributes: Attributes,
    pub(crate) indices: Option<usize>,
    pub(crate) material: Option<usize>,
    #[serde(default = "triangles")]
    pub(crate) mode: u32,
    #[serde(default)]
    pub(crate) targets: Vec<Value>,
    #[serde(default)]
    pub(crate) extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) struct Attributes {
    pub(crate) position: Option<usize>,
    pub(crate) normal: Option<usize>,
    pub(crate) tangent: Option<usize>,
    pub(crate) texcoord_0: Option<usize>,
    pub(crate) texcoord_1: Option<usize>,
    pub(crate) color_0: Option<usize>,
    #[serde(rename = "_CURVATURE")]
    pub(crate) curvature: Option<usize>,
    /// `JOINTS_0` and what else there is.
    #[serde(flatten)]
    pub(crate) others: Extensions,
}

/// `skins` of the document: what moves a mesh by its joints.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Rig {
    pub(crate) joints: Vec<usize>,
    pub(crate) inverse_bind_matrices: Option<usize>,
}

/// `KINRAN_mesh_curvature` of a primitive.
#[derive(Deserialize)]
pub(crate) struct MeshCurvature {
    #[serde(default = "half")]
    pub(crate) range: f32,
    #[serde(default = "thousand")]
    pub(crate) millimetres: f32,
}

/// `KINRAN_materials_skin`.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Skin {
    #[serde(default)]
    pub(crate) profile: SkinProfile,
    #[serde(default = "one")]
    pub(crate) scatter_scale: f32,
    #[serde(default)]
    pub(crate) second_lobe: SecondLobe,
    #[serde(default)]
    pub(crate) normal_blur: [f32; 3],
    #[serde(default)]
    pub(crate) penumbra: f32,
}

#[derive(Default, Deserialize)]
pub(crate) struct SkinProfile {
    pub(crate) gaussians: Option<Vec<SkinGaussian>>,
    pub(crate) burley: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(crate) struct SkinGaussian {
    pub(crate) variance: f64,
    pub(crate) weight: [f64; 3],
}

#[derive(Default, Deserialize)]
pub(crate) struct SecondLobe {
    pub(crate) share: f32,
    #[serde(default)]
    pub(crate) roughness: f32,
}

#[derive(Deserialize)]
pub(crate) struct Camera {
    pub(crate) name: Option<String>,
    pub(crate) perspective: Option<Perspective>,
}

#[derive(Deserialize)]
pub(crate) struct Perspective {
    pub(crate) yfov: f32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Material {
    pub(crate) name: Option<String>,
    #[serde(default)]
    pub(crate) pbr_metallic_roughness: PbrMetallicRoughness,
    pub(crate) normal_texture: Option<TextureInfo>,
    pub(crate) occlusion_texture: Option<TextureInfo>,
    pub(crate) emissive_texture: Option<TextureInfo>,
    #[serde(default)]
    pub(crate) emissive_factor: [f32; 3],
    #[serde(default)]
    pub(crate) alpha_mode: AlphaMode,
    #[serde(default = "half")]
    pub(crate) alpha_cutoff: f32,
    #[serde(default)]
    pub(crate) double_sided: bool,
    #[serde(default)]
    pub(crate) extensions: Extensions,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: None,
            pbr_metallic_roughness: PbrMetallicRoughness::default(),
            normal_texture: None,
            occlusion_texture: None,
            emissive_texture: None,
            emissive_factor: [0.0; 3],
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: half(),
            double_sided: false,
            extensions: Extensions::new(),
        }
    }
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) enum AlphaMode {
    #[default]
    Opaque,
    Mask,
    Blend,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct PbrMetallicRoughness {
    pub(crate) base_color_factor: [f32; 4],
    pub(crate) base_color_texture: Option<TextureInfo>,
    pub(crate) metallic_factor: f32,
    pub(crate) roughness_factor: f32,
    pub(crate) metallic_roughness_texture: Option<TextureInfo>,
}

impl Default for PbrMetallicRoughness {
    fn default() -> Self {
        PbrMetallicRoughness {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureInfo {
    pub(crate) index: usize,
    #[serde(default)]
    pub(crate) tex_coord: usize,
    /// Of `normalTexture` alone.
    #[serde(default = "one")]
    pub(crate) scale: f32,
    /// Of `occlusionTexture` alone.
    #[serde(default = "one")]
    pub(crate) strength: f32,
    #[serde(default)]
    pub(crate) extensions: TextureInfoExtensions,
}

#[derive(Default, Deserialize)]
pub(crate) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(crate) transform: Option<TextureTransform>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct TextureTransform {
    #[serde(default)]
    pub(crate) offset: [f32; 2],
    #[serde(default)]
    pub(crate) rotation: f32,
    #[serde(default = "one2")]
    pub(crate) scale: [f32; 2],
    pub(crate) tex_coord: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Anisotropy {
    #[serde(default)]
    pub(crate) anisotropy_strength: f32,
    #[serde(default)]
    pub(crate) anisotropy_rotation: f32,
    pub(crate) anisotropy_texture: Option<TextureInfo>,
}

/// Units and ranges are in docs/schema/KINRAN_materials_aniso.schema.json.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Aniso {
    pub(crate) aniso_texture: TextureInfo,
}

/// Units and ranges are in docs/schema/KINRAN_materials_fuzz.schema.json.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Fuzz {
    pub(crate) fuzziness: Option<f32>,
    pub(crate) fuzziness_texture: Option<TextureInfo>,
    pub(crate) phase: Option<String>,
    pub(crate) density: Option<f32>,
    pub(crate) density_texture: Option<TextureInfo>,
    pub(crate) spread: Option<f32>,
    pub(crate) fiber_color_factor: Option<[f32; 3]>,
    pub(crate) fiber_color_texture: Option<TextureInfo>,
    pub(crate) tilt: Option<f32>,
    pub(crate) azimuth: Option<f32>,
    pub(crate) direction_texture: Option<TextureInfo>,
    pub(crate) direction_encoding: Option<String>,
    pub(crate) normal_smoothness: Option<f32>,
    pub(crate) attenuation: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
pub(crate) struct Sheen {
    pub(crate) sheen_color_factor: [f32; 3],
    pub(crate) sheen_color_texture: Option<TextureInfo>,
    pub(crate) sheen_roughness_factor: f32,
    pub(crate) sheen_roughness_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct DiffuseTransmission {
    #[serde(default)]
    pub(crate) diffuse_transmission_factor: f32,
    pub(crate) diffuse_transmission_texture: Option<TextureInfo>,
    #[serde(default = "one3")]
    pub(crate) diffuse_transmission_color_factor: [f32; 3],
    pub(crate) diffuse_transmission_color_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Transmission {
    #[serde(default)]
    pub(crate) transmission_factor: f32,
    pub(crate) transmission_texture: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
pub(crate) struct Ior {
    #[serde(default = "glass")]
    pub(crate) ior: f32,
}

/// glTF's index of refraction where no file says any.
fn glass() -> f32 {
    1.5
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Specular {
    #[serde(default = "one")]
    pub(crate) specular_factor: f32,
    pub(crate) specular_texture: Option<TextureInfo>,
    #[serde(default = "one3")]
    pub(crate) specular_color_factor: [f32; 3],
    pub(crate) specular_color_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct EmissiveStrength {
    #[serde(default = "one")]
    pub(crate) emissive_strength: f32,
}

#[derive(Deserialize)]
pub(crate) struct Texture {
    pub(crate) sampler: Option<usize>,
    pub(crate) source: Option<usize>,
    #[serde(default)]
    pub(crate) extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Sampler {
    #[serde(default = "repeat")]
    pub(crate) wrap_s: u32,
    #[serde(default = "repeat")]
    pub(crate) wrap_t: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Image {
    pub(crate) uri: Option<String>,
    pub(crate) buffer_view: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub(crate) buffer_view: Option<usize>,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u32,
    #[serde(default)]
    pub(crate) normalized: bool,
    pub(crate) count: u64,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    pub(crate) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(crate) struct Sparse {
    pub(crate) count: u64,
    pub(crate) indices: SparseIndices,
    pub(crate) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseIndices {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseValues {
    pub(crate) buffer_view: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub(crate) buffer: usize,
    #[serde(default)]
    pub(crate) byte_offset: u64,
    pub(crate) byte_length: u64,
    pub(crate) byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub(crate) uri: Option<String>,
    pub(crate) byte_length: u64,
}

fn one() -> f32 {
    1.0
}

fn one2() -> [f32; 2] {
    [1.0; 2]
}

fn one3() -> [f32; 3] {
    [1.0; 3]
}

fn one3_f64() -> [f64; 3] {
    [1.0; 3]
}

fn half() -> f32 {
    0.5
}

fn thousand() -> f32 {
    1000.0
}

fn identity_quaternion() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

/// `mode` 4, `TRIANGLES`.
fn triangles() -> u32 {
    4
}

/// `wrapS` 10497, `REPEAT`.
fn repeat() -> u32 {
    10497
}
