//! Curvature of a glTF file's meshes, as a vertex attribute.

use std::path::Path;

use glam::{Mat3, Vec3, Vec4};
use kinran_bake::curvature::{
    Curvature, CurvatureError, Mesh, Options, Packed, bake_curvature, estimated_normals, principal,
    uniform_scale,
};
use kinran_image::{Files, encode_exr_planes, untold};
use kinran_scene::{Attribute, Document, Instance, Maps, Needs, Pose, Primitive, Scene, Skin};
use kinran_shading::Sym2;
use serde_json::{Value, json};

use super::file_stem;
use super::gltf_options::{Dump, GltfOptions, Which};
use crate::report::{MeshCurvature, Report, WrittenFile};
use crate::{Error, Sink, Stage, Task};

/// The extension that makes a material skin.
const SKIN: &str = "KINRAN_materials_skin";

impl GltfOptions {
    /// Whether any of a document's primitives can get curvature.
    pub(crate) fn asks(&self, document: &Document) -> bool {
        let is_skin = |i| document.material(i).get("extensions").is_some_and(|e| e.get(SKIN).is_some());
        match self.curvature.of {
            Which::Skin => !self.skin.is_empty() || (0..document.material_count()).any(is_skin),
            Which::All => true,
            Which::None => false,
        }
    }

    /// Whether a primitive gets curvature.
    pub fn wants(&self, scene: &Scene, primitive: &Primitive) -> bool {
        match self.curvature.of {
            Which::Skin => scene.materials[primitive.material].skin.is_some(),
            Which::All => true,
            Which::None => false,
        }
    }
}

/// Writes smooth normals into the document where its meshes have none; whether any had none.
///
/// # Errors
/// Where its meshes cannot be read.
pub(super) fn add_normals(
    document: &mut Document,
    files: &dyn Files,
    how: &GltfOptions,
    task: Task<'_>,
) -> Result<bool, Error> {
    // Normals are the mesh's own, whatever its joints make of them.
    let needs = Needs { geometry: true, rest_pose: false, maps: Maps::None, ..Needs::NONE };
    let scene = Scene::load_in(files, document.path(), &how.allow_outside, &needs, &|_| {}, &untold)?;
    if !scene.primitives.iter().any(|p| p.source.lacks_normals) {
        return Ok(false);
    }
    document.decompress()?;
    let all = 0..scene.primitives.len();
    let estimating = task.begin(Stage::Normals, "", triangles_of(&scene, all.collect::<Vec<_>>().iter()))?;
    for mesh in meshes(&scene) {
        let group: Vec<&Primitive> = mesh.iter().map(|&i| &scene.primitives[i]).collect();
        let surface = Joined::new(&group);
        let normals = estimated_normals(&surface.positions, &surface.triangles, &|triangles| {
            estimating.tick(triangles)
        })?;
        for (primitive, &first) in group.iter().zip(&surface.firsts) {
            if !primitive.source.lacks_normals {
                continue;
            }
            let (m, p) = (primitive.source.mesh, primitive.source.primitive);
            let mut at_document = vec![Vec3::Z; vertex_count(document, m, p)];
            for (vertex, &origin) in primitive.source.vertices.iter().enumerate() {
                at_document[origin as usize] = normals[first + vertex].normalize_or(Vec3::Z);
            }
            document.set_attribute(m, p, "NORMAL", Attribute::Float3(&at_document));
        }
    }
    Ok(true)
}

/// Marks materials as skin.
///
/// # Errors
/// Where a name is none of the materials'.
pub(super) fn mark_skin(names: &[String], scene: &mut Scene, document: &mut Document) -> Result<(), Error> {
    for name in names {
        let chosen: Vec<usize> = (0..document.material_count().min(scene.materials.len()))
            .filter(|&i| name == "all" || scene.materials[i].name == *name)
            .collect();
        if chosen.is_empty() {
            let names: Vec<&str> =
                scene.materials.iter().take(document.material_count()).map(|m| m.name.as_str()).collect();
            let reason = match names.as_slice() {
                [] => {
                    "the file has no materials; give its meshes one in the program that they come from".into()
                }
                names => format!("there is no such material; there are {}", names.join(", ")),
            };
            let (given, file) = (name.clone(), Some(document.path().to_path_buf()));
            return Err(Error::Option { option: "skin", given, file, reason });
        }
        for i in chosen {
            scene.materials[i].skin.get_or_insert_with(Skin::default);
            let extensions = document.material_mut(i).entry("extensions").or_insert_with(|| json!({}));
            if let Some(extensions) = extensions.as_object_mut() {
                extensions.entry(SKIN).or_insert_with(|| json!({}));
            }
            document.use_extension(SKIN, false);
        }
    }
    Ok(())
}

/// Refuses meshes that no curvature can be measured of, before anything is baked; gives the files of dumps.
///
/// # Errors
/// Where there is no mesh, or one without normals.
pub(super) fn check(
    input: &Path,
    how: &GltfOptions,
    scene: &Scene,
    document: &Document,
) -> Result<Vec<String>, Error> {
    let mut wanted = largest(scene, &mut Vec::new(), |mesh| mesh_name(document, mesh));
    wanted.retain(|mesh| mesh.iter().any(|&i| how.wants(scene, &scene.primitives[i])));
    if wanted.is_empty() && (!how.skin.is_empty() || how.curvature.of == Which::All) {
        return Err(Error::NoMesh { input: input.into() });
    }
    let mut dumps = Vec::new();
    for mesh in wanted {
        let name = mesh_name(document, scene.primitives[mesh[0]].source.mesh);
        if let Some(flat) = mesh.iter().map(|&i| &scene.primitives[i].source).find(|s| s.lacks_normals) {
            return Err(Error::Flat { input: input.into(), mesh: name, primitive: flat.primitive });
        }
        let Some(dump) = how.curvature.dump.map(|format| dump_file(input, &name, format)) else { continue };
        if dumps.iter().any(|known: &String| known.eq_ignore_ascii_case(&dump)) {
            return Err(Error::SameName {
                input: input.into(),
                what: "meshes",
                name: dump,
                fix: "give them names of their own",
            });
        }
        dumps.push(dump);
    }
    Ok(dumps)
}

/// Bakes curvature into the document's meshes, which [`check`] has seen; gives the files of dumps as they were written.
///
/// # Errors
/// Where a mesh is none.
pub(super) fn bake(
    input: &Path,
    how: &GltfOptions,
    scene: &Scene,
    document: &mut Document,
    report: &mut Report,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<Vec<WrittenFile>, Error> {
    let options = &how.curvature;
    let wanted = |p: &Primitive| how.wants(scene, p);
    let mut dumps = Vec::new();
    let groups = largest(scene, &mut report.warnings, |mesh| mesh_name(document, mesh));
    let groups: Vec<Vec<usize>> =
        groups.into_iter().filter(|mesh| mesh.iter().any(|&i| wanted(&scene.primitives[i]))).collect();
    let measuring = task.begin(Stage::Curvature, "", triangles_of(scene, groups.iter().flatten()))?;
    for mesh in groups {
        let group: Vec<&Primitive> = mesh.iter().map(|&i| &scene.primitives[i]).collect();
        let name = mesh_name(document, group[0].source.mesh);
        let surface = measured(scene, &mesh, &name, &mut report.warnings);
        let millimetres =
            options.millimetres.map_or_else(|| unit(scene, &mesh, &name, &mut report.warnings), f64::from);
        let baked = bake_curvature(
            &Mesh {
                positions: &surface.positions,
                normals: Some(&surface.normals),
                tangents: Some(&surface.tangents),
                triangles: &surface.triangles,
            },
            &Options {
                method: options.method,
                millimetres: millimetres / pose_scale(group[0]),
                blur: options.blur.clone(),
                clamp: true,
            },
            &|triangles| measuring.tick(triangles),
        )
        .map_err(|error| match error {
            CurvatureError::Cancelled(stopped) => stopped.into(),
            error => Error::Mesh { input: input.into(), mesh: name.clone(), error },
        })?;
        let packed = baked.pack(options.range.unwrap_or_else(|| baked.fitting_range()));
        for (primitive, &first) in group.iter().zip(&surface.firsts) {
            if wanted(primitive) {
                put(document, primitive, first, &packed, millimetres)?;
            }
        }
        document.use_extension("KINRAN_mesh_curvature", false);
        if let Some(format) = options.dump {
            let file = dump_file(input, &name, format);
            let bytes = dump(&name, format, &baked, &surface)?;
            out.put(&file, &bytes)?;
            dumps.push(WrittenFile::new(file, &bytes));
        }
        report.curvature.push(MeshCurvature {
            mesh: name,
            millimetres,
            range: packed.range,
            largest_error: packed.largest_error,
            rms_error: packed.rms_error,
            clamped_vertices: packed.clamped,
            found: baked.report,
        });
    }
    Ok(dumps)
}

/// The scene's primitives of each mesh, in the document's order; those that different skins hold are apart.
pub fn meshes(scene: &Scene) -> Vec<Vec<usize>> {
    let key = |i: usize| {
        let source = &scene.primitives[i].source;
        (source.mesh, source.pose.as_ref().map(|pose| pose.skin))
    };
    let all: Vec<usize> = (0..scene.primitives.len()).collect();
    all.chunk_by(|&a, &b| key(a) == key(b)).map(<[usize]>::to_vec).collect()
}

/// Of each of the document's meshes that of [`meshes`] which stands largest in the world.
fn largest(scene: &Scene, warnings: &mut Vec<String>, name: impl Fn(usize) -> String) -> Vec<Vec<usize>> {
    let mut chosen: Vec<Vec<usize>> = Vec::new();
    for mesh in meshes(scene) {
        let same = |other: &Vec<usize>| {
            scene.primitives[other[0]].source.mesh == scene.primitives[mesh[0]].source.mesh
        };
        let Some(other) = chosen.last_mut().filter(|other| same(other)) else {
            chosen.push(mesh);
            continue;
        };
        let [size, other_size] = [&mesh, &*other].map(|mesh| sizes(scene, mesh).1);
        if size.max(other_size) > SAME_SIZE * size.min(other_size) {
            let name = name(scene.primitives[mesh[0]].source.mesh);
            warnings.push(several_sizes(&name, size.min(other_size), size.max(other_size)));
        }
        if size > other_size {
            *other = mesh;
        }
    }
    chosen
}

/// Sizes whose ratio is below it are one; chosen by eye.
const SAME_SIZE: f64 = 1.01;

fn several_sizes(name: &str, smallest: f64, largest: f64) -> String {
    format!(
        "{name} stands at several sizes, {smallest:.3} to {largest:.3} times its own, and has one curvature: that of the \
         largest; --unit-mm sets another"
    )
}

/// Size in the scene over size in the document of a primitive.
pub fn pose_scale(primitive: &Primitive) -> f64 {
    primitive.source.pose.as_ref().map(|pose| pose.scale).filter(|scale| *scale > 0.0).unwrap_or(1.0)
}

/// The smallest and the largest size in the world over that in the document at which a mesh stands; no size where it stands
/// nowhere.
fn sizes(scene: &Scene, mesh: &[usize]) -> (f64, f64) {
    let placed = scene.instances.iter().filter(|i| mesh.contains(&i.primitive));
    placed.fold((f64::INFINITY, 0.0), |(smallest, largest), instance| {
        let scale = uniform_scale(columns(instance)).0 * pose_scale(&scene.primitives[instance.primitive]);
        (smallest.min(scale), largest.max(scale))
    })
}

fn columns(instance: &Instance) -> [Vec3; 3] {
    let m = instance.transform.matrix3;
    [m.x_axis.into(), m.y_axis.into(), m.z_axis.into()]
}

/// How nodes stretch a mesh.
pub(crate) enum Stretch {
    /// Not at all.
    None,
    /// All in one way: this, without its size.
    Same(Mat3),
    /// Some more than others.
    Different,
}

/// How the nodes at which a mesh stands stretch it. What they turn makes no difference to a curvature.
pub(crate) fn stretch(scene: &Scene, mesh: &[usize]) -> Stretch {
    let mut shapes = scene.instances.iter().filter(|i| mesh.contains(&i.primitive)).map(|instance| {
        let columns = columns(instance);
        let (scale, uniform) = uniform_scale(columns);
        let matrix = Mat3::from_cols(columns[0], columns[1], columns[2]) * (1.0 / scale as f32);
        (matrix, uniform)
    });
    let Some((first, uniform)) = shapes.next() else { return Stretch::None };
    let metric = first.transpose() * first;
    // In a square, twice what makes sizes one.
    let tolerance = 2.0 * (SAME_SIZE - 1.0) as f32;
    let same = |(other, _): (Mat3, bool)| (other.transpose() * other).abs_diff_eq(metric, tolerance);
    match (shapes.all(same), uniform) {
        (true, true) => Stretch::None,
        (true, false) if first.is_finite() => Stretch::Same(first),
        _ => Stretch::Different,
    }
}

/// Triangles of primitives.
pub fn triangles_of<'a>(scene: &Scene, primitives: impl Iterator<Item = &'a usize>) -> u64 {
    primitives.map(|&i| scene.primitives[i].triangles.len() as u64).sum()
}

/// Primitives as one surface.
#[derive(Clone, Debug)]
pub struct Joined {
    /// Positions.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Tangents; w is the sign of the bitangent.
    pub tangents: Vec<Vec4>,
    /// Corners, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// Each primitive's first vertex.
    pub firsts: Vec<usize>,
}

impl Joined {
    /// The primitives, one after the other.
    pub fn new(group: &[&Primitive]) -> Self {
        let mut joined = Joined {
            positions: Vec::new(),
            normals: Vec::new(),
            tangents: Vec::new(),
            triangles: Vec::new(),
            firsts: Vec::new(),
        };
        for primitive in group {
            let first = joined.positions.len();
            joined.firsts.push(first);
            joined.positions.extend(&primitive.positions);
            joined.normals.extend(&primitive.normals);
            joined.tangents.extend(&primitive.tangents);
            joined.triangles.extend(primitive.triangles.iter().map(|t| t.map(|i| i + first as u32)));
        }
        joined
    }

    /// The surface as a node stretches it. Tensors are still those of the mesh's own tangents, which the node takes along.
    pub(crate) fn stretched(mut self, by: Mat3) -> Self {
        let of_normals = by.inverse().transpose();
        let turned = by.determinant().signum();
        self.positions.iter_mut().for_each(|p| *p = by * *p);
        self.normals.iter_mut().for_each(|n| *n = (of_normals * *n).normalize_or(*n));
        for tangent in &mut self.tangents {
            *tangent = (by * tangent.truncate()).normalize_or(Vec3::X).extend(tangent.w * turned);
        }
        if turned < 0.0 {
            self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        self
    }
}

/// Primitives as the surface that is measured, stretched where their nodes do that.
pub fn measured(scene: &Scene, mesh: &[usize], name: &str, warnings: &mut Vec<String>) -> Joined {
    let group: Vec<&Primitive> = mesh.iter().map(|&i| &scene.primitives[i]).collect();
    let surface = Joined::new(&group);
    match stretch(scene, mesh) {
        Stretch::None => surface,
        Stretch::Same(by) => surface.stretched(by),
        Stretch::Different => {
            warnings.push(format!(
                "{name} is stretched in different ways by its nodes and has one curvature: that of the mesh as it is"
            ));
            surface
        }
    }
}

/// Millimetres in the unit of the document's mesh: a metre times the scale of where it stands.
pub fn unit(scene: &Scene, mesh: &[usize], name: &str, warnings: &mut Vec<String>) -> f64 {
    let (smallest, largest) = sizes(scene, mesh);
    if largest > SAME_SIZE * smallest {
        warnings.push(several_sizes(name, smallest, largest));
    }
    1000.0 * if largest > 0.0 { largest } else { 1.0 }
}

fn mesh_name(document: &Document, mesh: usize) -> String {
    let name = document.json().get("meshes").and_then(|m| m.get(mesh)?.get("name")?.as_str());
    name.filter(|n| !n.is_empty()).map_or_else(|| format!("mesh {mesh}"), str::to_owned)
}

/// Vertices of the document's primitive.
fn vertex_count(document: &Document, mesh: usize, primitive: usize) -> usize {
    let position = document.json().get("meshes").and_then(|m| {
        m.get(mesh)?.get("primitives")?.get(primitive)?.get("attributes")?.get("POSITION")?.as_u64()
    });
    let count = position.and_then(|accessor| {
        document.json().get("accessors")?.get(accessor as usize)?.get("count")?.as_u64()
    });
    count.unwrap_or(0) as usize
}

/// Writes tangents, if they were missing, and codes into the document's primitive. Where tangents split vertices, the
/// primitive gets new ones.
fn put(
    document: &mut Document,
    primitive: &Primitive,
    first: usize,
    packed: &Packed,
    millimetres: f64,
) -> Result<(), Error> {
    let source = &primitive.source;
    let (mesh, number) = (source.mesh, source.primitive);
    let codes = &packed.bytes[first..first + primitive.positions.len()];
    let mut count = vertex_count(document, mesh, number);
    let mut place: Vec<usize> = source.vertices.iter().map(|&v| v as usize).collect();
    if place.is_empty() {
        place = (0..count).collect();
    }
    let mut taken = vec![false; count];
    let split = place.iter().any(|&v| std::mem::replace(&mut taken[v], true));
    if split {
        let mirrored = source.pose.as_ref().is_some_and(|pose| pose.mirrored);
        let own = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let triangles: Vec<[u32; 3]> = primitive.triangles.iter().map(own).collect();
        document.gather_vertices(mesh, number, &source.vertices, &triangles)?;
        count = primitive.positions.len();
        place = (0..count).collect();
    }
    let mut bytes = vec![[0u8, 128, 0, 0]; count];
    let mut tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); count];
    let own: &[Vec4] = match &source.pose {
        Some(Pose { tangents, .. }) => tangents,
        None => &primitive.tangents,
    };
    for (vertex, &at) in place.iter().enumerate() {
        bytes[at] = codes[vertex];
        tangents[at] = own[vertex];
    }
    if source.lacks_tangents {
        document.set_attribute(mesh, number, "TANGENT", Attribute::Float4(&tangents));
    }
    document.set_attribute(mesh, number, "_CURVATURE", Attribute::Byte4(&bytes));
    let extensions = document.primitive_mut(mesh, number).entry("extensions").or_insert_with(|| json!({}));
    if let Some(extensions) = extensions.as_object_mut() {
        let meaning = json!({ "range": packed.range, "millimetres": millimetres });
        extensions.insert("KINRAN_mesh_curvature".into(), meaning);
    }
    Ok(())
}

/// The name of a dump's file.
fn dump_file(input: &Path, mesh: &str, format: Dump) -> String {
    let stem = input.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let extension = match format {
        Dump::Json => "json",
        Dump::Exr => "exr",
    };
    format!("{stem}_{}_curvature.{extension}", file_stem(mesh))
}

/// Pixels in a row of an EXR dump.
const DUMP_WIDTH: usize = 1024;

/// A dump's bytes.
fn dump(name: &str, format: Dump, baked: &Curvature, surface: &Joined) -> Result<Vec<u8>, Error> {
    match format {
        Dump::Exr => {
            let height = baked.tensors.len().div_ceil(DUMP_WIDTH);
            let plane = |value: fn(&Sym2) -> f32| {
                let mut plane: Vec<f32> = baked.tensors.iter().map(value).collect();
                plane.resize(DUMP_WIDTH * height, 0.0);
                plane
            };
            // Not as R, G, B and A: readers divide colours by alpha.
            let planes = vec![
                ("tensor.X", plane(|t| t.xx)),
                ("tensor.Y", plane(|t| t.xy)),
                ("tensor.Z", plane(|t| t.yy)),
                ("Y", plane(|t| 0.5 * t.trace())),
            ];
            Ok(encode_exr_planes((DUMP_WIDTH as u32, height as u32), planes)?)
        }
        Dump::Json => {
            let vertices: Vec<Value> = (baked.tensors.iter().enumerate())
                .map(|(i, t)| {
                    let (k1, k2, [x, y]) = principal(*t);
                    let (n, tangent) = (surface.normals[i], baked.tangents[i]);
                    let along = tangent.truncate();
                    let direction = x * along + y * tangent.w * n.cross(along);
                    json!({
                        "position": surface.positions[i].to_array(),
                        "normal": n.to_array(),
                        "tangent": tangent.to_array(),
                        "tensor": [t.xx, t.xy, t.yy],
                        "mean": 0.5 * t.trace(),
                        "principal": [k1, k2],
                        "direction": direction.to_array(),
                    })
                })
                .collect();
            let text = json!({
                "unit": "1/mm",
                "mesh": name,
                "primitives": surface.firsts,
                "vertices": vertices,
                "triangles": surface.triangles,
            });
            serde_json::to_vec(&text).map_err(|e| Error::Internal(e.to_string()))
        }
    }
}
