//! Skin from the command line: tables, curvature through glTF, and pictures of both renderers.

#![allow(
    clippy::print_stderr,
    reason = "the numbers are what the documentation quotes, and skipped tests say so"
)]

#[cfg(feature = "gpu")]
#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::path::{Path, PathBuf};
use std::process::Command;

use glam::{Vec2, Vec3, Vec4, vec2, vec3};
use kinran_image::{Format, Pixels, Transfer, read_image, read_layer, read_texture};
use kinran_scene::Scene;
use kinran_shading::skin::curvature::curvature_decode;
use serde_json::{Value, json};

fn kinran(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_kinran")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn done(arguments: &[&str]) -> String {
    let (code, out, error) = kinran(arguments);
    assert_eq!(code, Some(0), "{arguments:?}: {error}");
    out
}

/// The one error that bad input gives.
fn refused(arguments: &[&str]) -> String {
    let (code, out, error) = kinran(arguments);
    assert_eq!(code, Some(2), "{arguments:?}: {out}{error}");
    assert_eq!(error.matches("error:").count(), 1, "{arguments:?}: {error}");
    error
}

fn str(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A mesh over a grid of UVs, with vertices of its own on both sides of the seams.
struct Mesh {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// `at` gives place and normal at (u, v) from 0 to 1; u runs round the outside as v does over it.
    fn grid(columns: u32, rows: u32, at: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Mesh {
        let mut mesh =
            Mesh { positions: Vec::new(), normals: Vec::new(), uvs: Vec::new(), triangles: Vec::new() };
        for j in 0..=rows {
            for i in 0..=columns {
                let uv = vec2(i as f32 / columns as f32, j as f32 / rows as f32);
                // Both sides of a seam stand at the same place, bit by bit.
                let (p, n) = at((i % columns) as f32 / columns as f32, uv.y);
                mesh.positions.push(p);
                mesh.normals.push(n);
                mesh.uvs.push(uv);
                if i < columns && j < rows {
                    let a = j * (columns + 1) + i;
                    let b = a + columns + 1;
                    mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
                }
            }
        }
        mesh
    }

    fn sphere(radius: f32) -> Mesh {
        Mesh::grid(96, 48, |u, v| {
            let (azimuth, polar) = (std::f32::consts::TAU * u, std::f32::consts::PI * v);
            // All vertices of a pole stand at one place.
            let ring = if v == 0.0 || v == 1.0 { 0.0 } else { polar.sin() };
            let n = vec3(ring * azimuth.sin(), polar.cos(), ring * azimuth.cos());
            (radius * n, n)
        })
    }

    fn torus(large: f32, small: f32) -> Mesh {
        Mesh::grid(128, 64, |u, v| {
            let (around, tube) = (std::f32::consts::TAU * u, std::f32::consts::TAU * v);
            let out = vec3(around.sin(), around.cos(), 0.0);
            let n = tube.cos() * out + tube.sin() * Vec3::Z;
            (large * out + small * n, n)
        })
    }

    /// A document of one primitive, and its binary part; further attributes and whatever else by hand.
    fn document(&self) -> (Value, Vec<u8>) {
        let mut binary = Vec::new();
        let mut views = Vec::new();
        let mut part = |bytes: Vec<u8>| {
            views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
            binary.extend(bytes);
        };
        let floats = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
        part(floats(&self.positions.iter().flat_map(|p| p.to_array()).collect::<Vec<_>>()));
        part(floats(&self.normals.iter().flat_map(|n| n.to_array()).collect::<Vec<_>>()));
        part(floats(&self.uvs.iter().flat_map(|t| t.to_array()).collect::<Vec<_>>()));
        part(self.triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect());
        let vertices = self.positions.len();
        let bound = |f: fn(Vec3, Vec3) -> Vec3| {
            self.positions.iter().copied().reduce(f).unwrap_or_default().to_array().to_vec()
        };
        let document = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "materials": [{ "name": "Face", "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.55, 0.45, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5
            } }],
            "meshes": [{ "name": "mesh", "primitives": [{
                "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0
            }] }],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3",
                  "min": bound(Vec3::min), "max": bound(Vec3::max) },
                { "bufferView": 1, "componentType": 5126, "count": vertices, "type": "VEC3" },
                { "bufferView": 2, "componentType": 5126, "count": vertices, "type": "VEC2" },
                { "bufferView": 3, "componentType": 5125, "count": 3 * self.triangles.len(), "type": "SCALAR" },
            ],
            "bufferViews": views,
            "buffers": [{ "byteLength": binary.len() }],
        });
        (document, binary)
    }

    fn write(&self, path: &Path) {
        let (document, binary) = self.document();
        write_glb(path, document, binary);
    }
}

/// Adds an accessor of `bytes` and gives its index.
fn add(document: &mut Value, binary: &mut Vec<u8>, bytes: &[u8], mut accessor: Value) -> usize {
    let view = document["bufferViews"].as_array().unwrap().len();
    accessor["bufferView"] = view.into();
    let span = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() });
    document["bufferViews"].as_array_mut().unwrap().push(span);
    binary.extend(bytes);
    binary.resize(binary.len().next_multiple_of(4), 0);
    document["buffers"][0]["byteLength"] = binary.len().into();
    let accessors = document["accessors"].as_array_mut().unwrap();
    accessors.push(accessor);
    accessors.len() - 1
}

fn write_glb(path: &Path, document: Value, binary: Vec<u8>) {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF".to_vec();
    let length = 12 + 8 + text.len() + 8 + binary.len();
    glb.extend([2u32, length as u32, text.len() as u32].iter().flat_map(|x| x.to_le_bytes()));
    glb.extend(b"JSON");
    glb.extend(text);
    glb.extend((binary.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(binary);
    std::fs::write(path, glb).unwrap();
}

/// Bakes all of a file as skin, a unit of it being so many millimetres.
fn bake(model: &Path, output: &Path, millimetres: &str, more: &[&str]) -> PathBuf {
    let fixed = ["--quiet", "bake", str(model), "-o", str(output), "--skin", "all", "--unit-mm", millimetres];
    done(&[&fixed[..], more].concat());
    output.join(model.file_name().unwrap())
}

#[test]
fn tables_are_written_in_both_containers_with_the_numbers_of_the_closed_form() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("tables");
    let json = done(&[
        "--json",
        "skin-lut",
        "-o",
        str(&out),
        "--name",
        "face",
        "--container",
        "both",
        "--size",
        "400x100",
        "--range",
        "0.4",
        "--penumbra",
    ]);
    let report: Value = serde_json::from_str(&json).unwrap();
    let tables = report["tables"].as_array().unwrap();
    assert_eq!(tables.len(), 3, "{json}");
    for table in tables {
        assert!(table["encoding_error"].as_f64().unwrap() < 3e-4, "{table}");
        for file in table["files"].as_array().unwrap() {
            let texture = read_texture(&out.join(file.as_str().unwrap())).unwrap();
            assert_eq!((texture.format, texture.transfer), (Format::Rgba16F, Transfer::Linear), "{file}");
            let size = [texture.levels[0].width, texture.levels[0].height];
            assert_eq!(json!(size), json!([table["width"], table["height"]]), "{file}");
        }
    }
    // Halfway between four texels: curvature 0.2/mm and n·u 0; values of an independent implementation.
    let texture = read_texture(&out.join("face_punctual.ktx2")).unwrap();
    let texels = texture.decode_level(0).unwrap();
    let near = |x: usize, y: usize| Vec4::from(texels[y * 400 + x]);
    let middle = 0.25 * (near(199, 49) + near(200, 49) + near(199, 50) + near(200, 50));
    let want = vec3(0.07076, 0.01650, 0.01060);
    assert!((middle.truncate() - want).abs().max_element() < 2e-4, "wanted {want}, got {middle}");
    let plot = read_image(&out.join("face.png")).unwrap();
    assert!(plot.width > 800 && plot.height > 300);
    assert!(out.join("face.kinran.json").exists());
}

#[test]
fn profiles_come_from_flags_and_files_and_bad_ones_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        str(&path).to_owned()
    };
    let run = |more: &[&str]| {
        let fixed = ["--json", "skin-lut", "-o", str(&out), "--size", "64x32"];
        done(&[&fixed[..], more].concat());
        let texture = read_texture(&out.join("skin_punctual.ktx2")).unwrap();
        texture.decode_level(0).unwrap()
    };
    // Burley's d from mean free path and albedo 0.8, where s = 1.1, is a path of 1.1 d.
    let (burley, free) = (
        run(&["--burley", "0.5,0.4,0.3"]),
        run(&["--mean-free-path", "0.55,0.44,0.33", "--albedo", "0.8,0.8,0.8"]),
    );
    for (a, b) in burley.iter().zip(&free) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-3), "{a:?}, {b:?}");
    }
    let gauss = r#"{ "gaussians": [ { "variance": 1, "weight": [1, 1, 1] } ] }"#;
    let gauss = run(&["--profile", &file("gauss.json", gauss)]);
    // The same Gaussian as a table of its radial density.
    let rows: String = (0..200)
        .map(|i| {
            let r = 0.035 * f64::from(i);
            let density = (-0.5 * r * r).exp();
            format!("{r},{density},{density},{density}\n")
        })
        .collect();
    let table = run(&["--profile", &file("gauss.csv", &format!("mm,r,g,b\n{rows}"))]);
    for (a, b) in gauss.iter().zip(&table) {
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 2e-3), "{a:?}, {b:?}");
    }

    let bad = [
        (file("rows.csv", "0,1,1,1\n1,oops,1,1\n"), "rows.csv: line 2"),
        (file("back.csv", "0,1,1,1\n2,1,1,1\n1,1,1,1\n"), "must grow"),
        (file("empty.csv", "\n"), "empty.csv"),
        (file("odd.json", r#"{ "gauss": [] }"#), "gaussians"),
        (file("dark.json", r#"{ "gaussians": [ { "variance": -1, "weight": [1, 1, 1] } ] }"#), "above zero"),
        (file("profile.txt", "0,1,1,1\n"), ".csv or .json"),
    ];
    for (path, part) in bad {
        let error = refused(&["skin-lut", "-o", str(&out), "--profile", &path]);
        assert!(error.contains(part), "{path}: {error}");
    }
    let (code, _, error) = kinran(&["skin-lut", "-o", str(&out), "--burley", "0.9,0.4"]);
    assert!(code == Some(2) && error.contains("three numbers"), "{error}");
    for size in ["0x0", "1x64", "64x8192", "wide"] {
        let (code, _, error) = kinran(&["skin-lut", "-o", str(&out), "--size", size]);
        assert!(code == Some(2) && error.contains("each 2 to 4096"), "{size}: {error}");
    }
}

#[test]
fn curvature_comes_back_from_gltf_as_it_was_baked() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("ball.glb");
    Mesh::sphere(0.2).write(&model);
    // Fifty millimetres a unit: a radius of 10 mm.
    let baked = bake(&model, &folder.path().join("out"), "50", &[]);
    let scene = Scene::load(&baked).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert!(scene.materials[0].skin.is_some());
    let primitive = &scene.primitives[0];
    assert!(!primitive.source.lacks_tangents);
    let curvature = primitive.curvature.as_ref().unwrap();
    assert_eq!(curvature.millimetres, 50.0);
    for (i, &code) in curvature.codes.iter().enumerate() {
        let (tensor, mean) = curvature_decode(code, curvature.range);
        // Half a code of a root, and of the correlation.
        let near = |got: f32, want: f32| (got - want).abs() < 0.0012;
        assert!(
            near(tensor.xx, 0.1) && near(tensor.yy, 0.1) && near(tensor.xy, 0.0) && near(mean, 0.1),
            "vertex {i}: {tensor:?}, {mean}"
        );
    }
    // The same again from what was baked.
    let again = bake(&baked, &folder.path().join("again"), "50", &[]);
    assert_eq!(Scene::load(&again).unwrap().primitives[0].curvature, primitive.curvature);
}

#[test]
fn authored_tangents_are_kept_and_tensors_stand_in_their_frame() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = Mesh::torus(0.06, 0.01);
    let (mut document, mut binary) = mesh.document();
    // Round the tube for odd vertices, round the axis for even ones, bitangents mirrored now and then.
    let tangents: Vec<Vec4> = (mesh.normals.iter().enumerate())
        .map(|(i, &n)| {
            let axis = Vec3::Z.cross(n).normalize();
            let tangent = if i % 2 == 0 { axis } else { n.cross(axis) };
            tangent.extend(if i % 3 == 0 { -1.0 } else { 1.0 })
        })
        .collect();
    let bytes: Vec<u8> = tangents.iter().flat_map(|t| t.to_array()).flat_map(f32::to_le_bytes).collect();
    let accessor = json!({ "componentType": 5126, "count": tangents.len(), "type": "VEC4" });
    let index = add(&mut document, &mut binary, &bytes, accessor);
    document["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = index.into();
    let model = folder.path().join("ring.glb");
    write_glb(&model, document, binary);
    // A blur would even the tube's inside and outside out.
    let baked = bake(&model, &folder.path().join("out"), "1000", &["--curvature-blur", "none"]);
    let scene = Scene::load(&baked).unwrap();
    let primitive = &scene.primitives[0];
    for (i, (got, want)) in primitive.tangents.iter().zip(&tangents).enumerate() {
        assert!((*got - *want).abs().max_element() < 1e-5, "vertex {i}: wanted {want}, got {got}");
    }
    let curvature = primitive.curvature.as_ref().unwrap();
    for (i, &code) in curvature.codes.iter().enumerate() {
        let tensor = curvature_decode(code, curvature.range).0;
        let along_tube = if i % 2 == 0 { tensor.yy } else { tensor.xx };
        assert!((along_tube - 0.1).abs() < 0.003, "vertex {i}: wanted 0.1 along the tube, got {tensor:?}");
    }
}

#[test]
fn skinned_and_morphed_meshes_are_baked_in_their_rest_pose_and_stay_so() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = Mesh::torus(0.06, 0.01);
    let plain = folder.path().join("plain.glb");
    mesh.write(&plain);
    let (mut document, mut binary) = mesh.document();
    let count = mesh.positions.len();
    let joints = add(
        &mut document,
        &mut binary,
        &[0u8, 0, 0, 0].repeat(count),
        json!({ "componentType": 5121, "count": count, "type": "VEC4" }),
    );
    let weights: Vec<u8> = [1.0f32, 0.0, 0.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let weights = add(
        &mut document,
        &mut binary,
        &weights.repeat(count),
        json!({ "componentType": 5126, "count": count, "type": "VEC4" }),
    );
    let target: Vec<u8> = [0.0f32, 0.5, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    let target = add(
        &mut document,
        &mut binary,
        &target.repeat(count),
        json!({ "componentType": 5126, "count": count, "type": "VEC3", "min": [0, 0.5, 0], "max": [0, 0.5, 0] }),
    );
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["attributes"]["JOINTS_0"] = joints.into();
    primitive["attributes"]["WEIGHTS_0"] = weights.into();
    primitive["targets"] = json!([{ "POSITION": target }]);
    document["meshes"][0]["weights"] = json!([1.0]);
    document["nodes"] = json!([{ "mesh": 0, "skin": 0 }, { "translation": [3.0, 0.0, 0.0] }]);
    document["scenes"][0]["nodes"] = json!([0, 1]);
    document["skins"] = json!([{ "joints": [1] }]);
    let posed = folder.path().join("posed.glb");
    write_glb(&posed, document, binary);

    let [plain, posed] = [&plain, &posed].map(|model| {
        let baked = bake(model, &folder.path().join("out"), "1000", &[]);
        Scene::load(&baked).unwrap()
    });
    assert_eq!(plain.primitives[0].curvature, posed.primitives[0].curvature);
    assert!(posed.warnings.iter().any(|w| w.contains("rest pose")), "{:?}", posed.warnings);
    // The morph target and the weights are still there, for as many vertices as there are now.
    let bytes = std::fs::read(folder.path().join("out/posed.glb")).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let document: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let primitive = &document["meshes"][0]["primitives"][0];
    let count =
        |accessor: &Value| document["accessors"][accessor.as_u64().unwrap() as usize]["count"].clone();
    let vertices = count(&primitive["attributes"]["POSITION"]);
    for accessor in [
        &primitive["attributes"]["_CURVATURE"],
        &primitive["attributes"]["JOINTS_0"],
        &primitive["attributes"]["WEIGHTS_0"],
        &primitive["targets"][0]["POSITION"],
    ] {
        assert_eq!(count(accessor), vertices);
    }
}

/// glTF places a skinned mesh by its joints alone: a sphere of 10 mm is one however scale is spread over its vertices, its
/// bind matrix, its joint, the joint's parent and its own node, turned and mirrored too.
#[test]
fn a_skin_is_measured_by_its_node_or_its_vertices() {
    let folder = tempfile::tempdir().unwrap();
    // Scales of vertices, inverse bind matrix, joint and its parent.
    for (i, (vertices, bind, joint, parent)) in [
        (1.0_f32, 1.0_f32, 1.0, 1.0),
        (819_150.0, 1.0 / 819_150.0, 1.0, 1.0),
        (100.0, 1.0, 0.01, 1.0),
        (100.0, 1.0, 1.0, 0.01),
        (1.0, 100.0, 1.0, 0.01),
        (1.0, -1.0, 1.0, 1.0),
    ]
    .into_iter()
    .enumerate()
    {
        let mut mesh = Mesh::sphere(0.01);
        mesh.positions.iter_mut().for_each(|p| *p *= vertices);
        let (mut document, mut binary) = mesh.document();
        let count = mesh.positions.len();
        let joints = json!({ "componentType": 5121, "count": count, "type": "VEC4" });
        let joints = add(&mut document, &mut binary, &[0u8, 1, 0, 0].repeat(count), joints);
        // Two joints in the same place; their weights are bytes that do not add up to 255.
        let weights = json!({ "componentType": 5121, "normalized": true, "count": count, "type": "VEC4" });
        let weights = add(&mut document, &mut binary, &[200u8, 50, 0, 0].repeat(count), weights);
        let mut matrix = [0.0f32; 16];
        (matrix[0], matrix[5], matrix[10], matrix[15]) = (bind, bind.abs(), bind.abs(), 1.0);
        let matrix: Vec<u8> = matrix.repeat(2).iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
        let bind = add(
            &mut document,
            &mut binary,
            &matrix,
            json!({ "componentType": 5126, "count": 2, "type": "MAT4" }),
        );
        let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
        (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (joints.into(), weights.into());
        let joint = json!({ "scale": [joint, joint, joint], "rotation": [0.6, 0.0, 0.0, 0.8] });
        document["nodes"] = json!([
            { "mesh": 0, "skin": 0, "scale": [7.0, 7.0, 7.0] },
            { "children": [2, 3], "scale": [parent, parent, parent], "translation": [3.0, 0.0, 0.0] },
            joint.clone(),
            joint,
        ]);
        document["scenes"][0]["nodes"] = json!([0, 1]);
        document["skins"] = json!([{ "joints": [2, 3], "inverseBindMatrices": bind }]);
        let model = folder.path().join(format!("skin{i}.glb"));
        write_glb(&model, document, binary);

        let [min, max] = Scene::load(&model).unwrap().bounds().unwrap();
        assert!((max - min - 0.02).abs().max_element() < 1e-5, "case {i}: from {min} to {max}");
        assert!(
            (0.5 * (min + max) - 3.0 * Vec3::X).abs().max_element() < 1e-5,
            "case {i}: from {min} to {max}"
        );
        let out = folder.path().join("out");
        done(&["--quiet", "bake", str(&model), "-o", str(&out), "--skin", "all", "--curvature-blur", "none"]);
        let scene = Scene::load(out.join(format!("skin{i}.glb"))).unwrap();
        let primitive = &scene.primitives[0];
        let curvature = primitive.curvature.as_ref().unwrap();
        assert!((curvature.millimetres - 1000.0).abs() < 0.1, "case {i}: {} mm", curvature.millimetres);
        for (vertex, &code) in curvature.codes.iter().enumerate() {
            let (tensor, mean) = curvature_decode(code, curvature.range);
            let error = (tensor.xx - 0.1).abs().max((tensor.yy - 0.1).abs()).max((mean - 0.1).abs());
            assert!(
                error < 0.0015,
                "case {i}, vertex {vertex} at {}: {tensor:?}, {mean}",
                primitive.positions[vertex]
            );
            let along = primitive.tangents[vertex].truncate().dot(primitive.normals[vertex]);
            assert!(along.abs() < 1e-3, "case {i}: a tangent leaves its surface");
        }
        for triangle in &primitive.triangles {
            let [a, b, c] = triangle.map(|i| primitive.positions[i as usize]);
            let out = (b - a).cross(c - a).dot(primitive.normals[triangle[0] as usize]);
            assert!(out >= 0.0, "case {i}: a face is turned inside out");
        }
    }
}

/// A sphere of 10 mm that its node makes an ellipsoid, turned, mirrored and used twice too.
#[test]
fn a_stretched_mesh_keeps_the_curvature_that_it_had() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, binary) = Mesh::sphere(0.01).document();
    let turned = json!({ "mesh": 0, "scale": [1, 2, 1], "rotation": [0.6, 0.0, 0.0, 0.8] });
    for (i, nodes) in [
        json!([{ "mesh": 0, "scale": [1, 2, 1] }]),
        json!([{ "mesh": 0, "scale": [-1, 2, 1] }]),
        json!([turned, { "mesh": 0, "scale": [1, 2, 1] }]),
        json!([{ "mesh": 0, "scale": [1, 2, 1] }, { "mesh": 0, "scale": [-1, 2, 1] }]),
    ]
    .into_iter()
    .enumerate()
    {
        document["scenes"][0]["nodes"] = (0..nodes.as_array().unwrap().len()).collect();
        document["nodes"] = nodes;
        let model = folder.path().join(format!("ellipsoid{i}.glb"));
        write_glb(&model, document.clone(), binary.clone());
        let out = folder.path().join("out");
        done(&["--quiet", "bake", str(&model), "-o", str(&out), "--skin", "all", "--curvature-blur", "none"]);
        let scene = Scene::load(out.join(format!("ellipsoid{i}.glb"))).unwrap();
        let primitive = &scene.primitives[0];
        let curvature = primitive.curvature.as_ref().unwrap();
        for (vertex, &code) in curvature.codes.iter().enumerate() {
            // Of a spheroid with half axes of a, b, a: along its parallels and its meridians.
            let p = 1000.0 * primitive.positions[vertex] * vec3(1.0, 2.0, 1.0);
            let (a, b) = (10.0f32, 20.0f32);
            let h = ((p.x * p.x + p.z * p.z) / a.powi(4) + p.y * p.y / b.powi(4)).sqrt();
            let wanted = [1.0 / (a * a * h), 1.0 / (a * a * b * b * h.powi(3))];
            let tensor = curvature_decode(code, curvature.range).0;
            let (mean, half) = (0.5 * (tensor.xx + tensor.yy), 0.5 * (tensor.xx - tensor.yy));
            let radius = (half * half + tensor.xy * tensor.xy).sqrt();
            let (most, least) = (wanted[0].max(wanted[1]), wanted[0].min(wanted[1]));
            let error = (mean + radius - most).abs().max((mean - radius - least).abs());
            assert!(
                error < 0.005,
                "case {i} at {p}: wanted {wanted:?}, got {} and {}",
                mean + radius,
                mean - radius
            );
        }
    }
}

#[test]
fn one_curvature_for_several_sizes_is_taken_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, binary) = Mesh::sphere(0.01).document();
    document["scenes"][0]["nodes"] = json!([0, 1]);
    for (scale, said, curvature) in [
        (json!([3, 3, 3]), &["1.000 to 3.000", "--unit-mm", "largest"][..], 0.1 / 3.0),
        (json!([1, 1, 1]), &[], 0.1),
        (json!([1, 1, 1.001]), &[], 0.1),
        (json!([1, 2, 0.5]), &["different ways"], 0.1),
    ] {
        document["nodes"] = json!([{ "mesh": 0 }, { "mesh": 0, "scale": scale }]);
        let model = folder.path().join("two.glb");
        write_glb(&model, document.clone(), binary.clone());
        let out = folder.path().join("out");
        let flags = ["--skin", "all", "--curvature-blur", "none", "--json"];
        let report = done(&[&["--quiet", "bake", str(&model), "-o", str(&out)], &flags[..]].concat());
        let report: Value = serde_json::from_str(&report).unwrap();
        let warnings = report["warnings"].as_array().unwrap();
        assert_eq!(warnings.len(), usize::from(!said.is_empty()), "{scale}: {warnings:?}");
        for part in said {
            assert!(warnings[0].as_str().unwrap().contains(part), "{scale}: {warnings:?}");
        }
        let scene = Scene::load(out.join("two.glb")).unwrap();
        let baked = scene.primitives[0].curvature.as_ref().unwrap();
        let mean = curvature_decode(baked.codes[2000], baked.range).1;
        assert!((mean - curvature).abs() < 0.0015, "{scale}: wanted {curvature}, got {mean}");
    }
}

#[test]
fn borders_are_not_counted_where_nothing_is_blurred() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("dome.glb");
    let dome = Mesh::grid(96, 24, |u, v| {
        let (azimuth, polar) = (std::f32::consts::TAU * u, 0.5 * std::f32::consts::PI * v);
        let ring = if v == 0.0 { 0.0 } else { polar.sin() };
        let n = vec3(ring * azimuth.sin(), polar.cos(), ring * azimuth.cos());
        (0.01 * n, n)
    });
    dome.write(&model);
    for blur in ["none", "8,2.3"] {
        let flags = ["--skin", "all", "--curvature-blur", blur, "--json"];
        let out = folder.path().join("out");
        let report = done(&[&["--quiet", "bake", str(&model), "-o", str(&out)], &flags[..]].concat());
        let report: Value = serde_json::from_str(&report).unwrap();
        assert_eq!(report["curvature"][0]["border_edges"], 96, "{blur}");
    }
}

/// One half of a sphere mirrors the texture of the other: on the line between them MikkTSpace wants two tangents where
/// the file has one vertex.
#[test]
fn vertices_that_tangents_split_keep_one_curvature() {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = Mesh::sphere(0.01);
    for uv in &mut mesh.uvs {
        uv.x = 1.0 - (2.0 * uv.x - 1.0).abs();
    }
    let model = folder.path().join("mirrored.glb");
    mesh.write(&model);
    let baked = bake(&model, &folder.path().join("out"), "1000", &[]);
    let scene = Scene::load(&baked).unwrap();
    let primitive = &scene.primitives[0];
    assert!(primitive.positions.len() > mesh.positions.len(), "no vertex was split");
    assert_eq!(primitive.triangles.len(), mesh.triangles.len());
    let signs = [1.0, -1.0].map(|sign| primitive.tangents.iter().filter(|t| t.w == sign).count());
    assert!(signs.iter().all(|&count| count > 1000), "both halves: {signs:?}");
    let curvature = primitive.curvature.as_ref().unwrap();
    for (i, &code) in curvature.codes.iter().enumerate() {
        let (tensor, mean) = curvature_decode(code, curvature.range);
        let error = (tensor.xx - 0.1).abs().max((tensor.yy - 0.1).abs()).max((mean - 0.1).abs());
        assert!(error < 0.0012, "vertex {i} at {}: {tensor:?}, {mean}", primitive.positions[i]);
    }
}

/// Halves of a sphere in primitives of their own, and what other tools read of it.
#[test]
fn primitives_of_one_surface_are_baked_together_and_dumped() {
    let folder = tempfile::tempdir().unwrap();
    let mut mesh = Mesh::sphere(0.01);
    let whole = std::mem::take(&mut mesh.triangles);
    let (upper, lower) = whole.split_at(whole.len() / 2);
    mesh.triangles = upper.to_vec();
    let (mut document, mut binary) = mesh.document();
    let bytes: Vec<u8> = lower.as_flattened().iter().flat_map(|i| i.to_le_bytes()).collect();
    let indices = json!({ "componentType": 5125, "count": 3 * lower.len(), "type": "SCALAR" });
    let indices = add(&mut document, &mut binary, &bytes, indices);
    let mut second = document["meshes"][0]["primitives"][0].clone();
    second["indices"] = indices.into();
    document["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    let model = folder.path().join("halves.glb");
    write_glb(&model, document, binary);
    let out = folder.path().join("out");
    for format in ["json", "exr"] {
        let baked = bake(&model, &out, "1000", &["--curvature-dump", format]);
        let scene = Scene::load(&baked).unwrap();
        assert_eq!(scene.primitives.len(), 2);
        for primitive in &scene.primitives {
            let curvature = primitive.curvature.as_ref().unwrap();
            let used: std::collections::BTreeSet<u32> =
                primitive.triangles.as_flattened().iter().copied().collect();
            for &vertex in &used {
                let (tensor, _) = curvature_decode(curvature.codes[vertex as usize], curvature.range);
                let error = (tensor.xx - 0.1).abs().max((tensor.yy - 0.1).abs());
                assert!(error < 0.0012, "{}: {tensor:?}", primitive.positions[vertex as usize]);
            }
        }
    }
    let dump: Value =
        serde_json::from_slice(&std::fs::read(out.join("halves_mesh_curvature.json")).unwrap()).unwrap();
    let vertices = dump["vertices"].as_array().unwrap();
    assert_eq!(dump["unit"], "1/mm");
    assert_eq!(dump["primitives"].as_array().unwrap().len(), 2);
    let principal = vertices[500]["principal"][0].as_f64().unwrap();
    assert!((principal - 0.1).abs() < 0.001, "{principal}");
    let layer = |name| match read_layer(&out.join("halves_mesh_curvature.exr"), name).unwrap().pixels {
        Pixels::F32(samples) => samples,
        _ => panic!("no floats"),
    };
    let (tensor, mean) = (layer(Some("tensor")), layer(None));
    assert!(tensor.len() >= 3 * vertices.len() && mean.len() >= vertices.len());
    assert!((mean[500] - 0.1).abs() < 0.001, "the mean is {}", mean[500]);
    let [xx, yy] = [tensor[3 * 500], tensor[3 * 500 + 2]];
    assert!((0.5 * (xx + yy) - mean[500]).abs() < 1e-6, "half the trace of {xx}, {yy} is not {}", mean[500]);
}

#[test]
fn bad_meshes_give_one_clear_error_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mesh = Mesh::sphere(0.01);
    let check = |name: &str, change: &dyn Fn(&mut Value, &mut Vec<u8>), parts: &[&str]| {
        let (mut document, mut binary) = mesh.document();
        change(&mut document, &mut binary);
        let model = folder.path().join(format!("{name}.glb"));
        write_glb(&model, document, binary);
        let error = refused(&["bake", str(&model), "-o", str(&out), "--skin", "all"]);
        for part in [&[name][..], parts].concat() {
            assert!(error.contains(part), "{name}: no \"{part}\" in: {error}");
        }
        assert!(!out.join(format!("{name}.glb")).exists(), "{name}: a file was left");
    };
    check(
        "bare",
        &|document, _| {
            document["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
        },
        &["NORMAL", "--estimate-normals"],
    );
    check("nan", &|_, binary| binary[36..40].copy_from_slice(&f32::NAN.to_le_bytes()), &["POSITION"]);
    check(
        "beyond",
        &|document, binary| {
            let at = document["bufferViews"][3]["byteOffset"].as_u64().unwrap() as usize;
            binary[at..at + 4].copy_from_slice(&4_000_000u32.to_le_bytes());
        },
        &["4000000", "vertices"],
    );
    check("billion", &|document, _| document["accessors"][3]["count"] = 1_000_000_000.into(), &["indices"]);
    check(
        "giant",
        &|document, _| {
            document["accessors"][3]["count"] = 1_000_000_000.into();
            document["bufferViews"][3]["byteLength"] = 4_000_000_000u64.into();
            document["buffers"][0]["byteLength"] = 5_000_000_000u64.into();
        },
        &["buffer"],
    );
    check("empty", &|document, _| document["accessors"][3]["count"] = 0.into(), &["no mesh", "triangles"]);
}

#[test]
fn a_mesh_without_normals_gets_smooth_ones_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let (mut document, binary) = Mesh::sphere(0.01).document();
    document["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    let model = folder.path().join("bare.glb");
    write_glb(&model, document, binary);
    let baked = bake(&model, &folder.path().join("out"), "1000", &["--estimate-normals"]);
    let scene = Scene::load(&baked).unwrap();
    assert!(!scene.primitives[0].source.lacks_normals);
    let curvature = scene.primitives[0].curvature.as_ref().unwrap();
    for &code in &curvature.codes {
        let (tensor, _) = curvature_decode(code, curvature.range);
        assert!((tensor.xx - 0.1).abs().max((tensor.yy - 0.1).abs()) < 0.0015, "{tensor:?}");
    }
}

/// A picture's pixels and its side.
fn pixels(path: &Path) -> (Vec<[u8; 3]>, u32) {
    let image = read_image(path).unwrap();
    let Pixels::U8(samples) = image.pixels else { panic!("{}: not 8 bits", path.display()) };
    (samples.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect(), image.width)
}

#[cfg(feature = "gpu")]
mod both {
    use super::*;
    use crate::sample_assets::sample_assets;
    use kinran_render::metrics::flip;

    /// Mean FLIP of the GPU's picture beside the reference's.
    fn compare(name: &str, model: &Path, more: &[&str], folder: &Path) -> f64 {
        let shots = ["cpu", "gpu"].map(|backend| {
            let picture = folder.join(format!("{name}_{backend}.png"));
            let samples = if backend == "cpu" { "32" } else { "16" };
            let fixed = ["--quiet", "render", str(model), "-o", str(&picture), "--backend", backend];
            let rest = ["--spp", samples, "--size", "96x96", "--max-anisotropy", "1", "--env", "none"];
            done(&[&fixed[..], &rest, more].concat());
            pixels(&picture)
        });
        let [(reference, side), (test, _)] = &shots;
        let lit = reference.iter().filter(|p| p.iter().any(|&c| c > 100)).count();
        assert!(lit > reference.len() / 50, "{name}: the reference shows next to nothing");
        let flip = flip(reference, test, *side, *side).unwrap();
        eprintln!("{name}: mean FLIP {:.4}", flip.mean);
        f64::from(flip.mean)
    }

    fn pictures() -> (PathBuf, Option<tempfile::TempDir>) {
        if let Some(folder) = std::env::var_os("KINRAN_PICTURES").map(PathBuf::from) {
            std::fs::create_dir_all(&folder).unwrap();
            return (folder, None);
        }
        let folder = tempfile::tempdir().unwrap();
        (folder.path().into(), Some(folder))
    }

    const SIDE_LIGHT: [&str; 2] = ["--light", "1,0.35,-0.15"];

    #[test]
    fn a_ring_of_skin_looks_as_in_the_reference() {
        let (folder, _guard) = pictures();
        let model = folder.join("ring.glb");
        // A tube of 4 mm radius, where light comes far round.
        Mesh::torus(0.012, 0.004).write(&model);
        let baked = bake(&model, &folder.join("out"), "1000", &[]);
        let mut results = Vec::new();
        for (name, more) in [
            ("zero", &["--skin-curvature", "zero", "--no-shadows"][..]),
            ("mean", &["--skin-curvature", "mean", "--no-shadows"]),
            ("directional", &["--no-shadows"]),
            ("normalised", &["--skin-curvature", "normalized", "--no-shadows"]),
            ("penumbra", &["--skin-penumbra", "6"]),
        ] {
            results.push((name, compare(name, &baked, &[&SIDE_LIGHT, more].concat(), &folder)));
        }
        let worse: Vec<_> = results.iter().filter(|(_, flip)| *flip > 0.02).collect();
        assert!(worse.is_empty(), "mean FLIP above 0.02: {worse:?}");
    }

    #[test]
    fn sample_assets_of_skin_look_as_in_the_reference() {
        let Some(assets) = sample_assets() else { return };
        let head = assets.join("meshes/lee_perry_smith/LeePerrySmith.gltf");
        let (folder, _guard) = pictures();
        let baked = bake(&head, &folder.join("out"), "50", &["--container", "dds", "--preset", "fast"]);
        let mut results = Vec::new();
        for (name, more) in [
            ("head", &["--no-shadows"][..]),
            ("head_normals", &["--no-shadows", "--skin-normals", "profile"]),
            ("head_penumbra", &["--skin-penumbra", "8"]),
        ] {
            results.push((name, compare(name, &baked, &[&SIDE_LIGHT, more].concat(), &folder)));
        }
        let worse: Vec<_> = results.iter().filter(|(_, flip)| *flip > 0.05).collect();
        assert!(worse.is_empty(), "mean FLIP above 0.05: {worse:?}");
    }
}

/// Red of the shadowed side of a shadow's edge, and green, beside hard shadows.
#[test]
fn light_scatters_into_penumbras_and_red_the_farthest() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("ring.glb");
    // The ring's lower half lies in the shadow of its upper one.
    Mesh::torus(0.06, 0.015).write(&model);
    let baked = bake(&model, &folder.path().join("out"), "1000", &[]);
    let shot = |name: &str, more: &[&str]| {
        let picture = folder.path().join(format!("{name}.exr"));
        let fixed = ["--quiet", "render", str(&baked), "-o", str(&picture), "--size", "96x96", "--spp", "16"];
        let light = ["--env", "none", "--light", "0,1,0.1", "--from", "0,0.6,1", "--background", "0,0,0"];
        done(&[&fixed[..], &light, more].concat());
        let Pixels::F32(samples) = read_image(&picture).unwrap().pixels else { panic!("no floats") };
        samples.chunks_exact(3).map(|p| vec3(p[0], p[1], p[2])).collect::<Vec<_>>()
    };
    let (hard, soft) = (shot("hard", &[]), shot("soft", &["--skin-penumbra", "6"]));
    // Red over green beyond that of the skin's colour, 0.8 over 0.55, in pixels that are not dark.
    let redder =
        |picture: &[Vec3]| picture.iter().filter(|p| p.x > 0.02 && p.x > 1.2 * p.y * 0.8 / 0.55).count();
    let (a, b) = (redder(&hard), redder(&soft));
    assert!(b > a + 50, "{a} pixels redder than the skin with hard shadows, {b} with a penumbra");
    let sum = |picture: &[Vec3]| picture.iter().sum::<Vec3>();
    let (hard, soft) = (sum(&hard), sum(&soft));
    assert!((soft / hard).max_element() < 1.05, "shadows became lighter as a whole: {hard}, {soft}");
}

#[test]
fn fibres_grow_on_skin() {
    let folder = tempfile::tempdir().unwrap();
    // A ball of 3 mm, round which red light comes far.
    let (mut document, binary) = Mesh::sphere(0.003).document();
    document["materials"][0]["extensions"] = json!({
        "KINRAN_materials_skin": {},
        "KINRAN_materials_fuzz": { "density": 0.3, "fiberColorFactor": [0.9, 0.8, 0.7] },
    });
    document["extensionsUsed"] = json!(["KINRAN_materials_skin", "KINRAN_materials_fuzz"]);
    let shot = |name: &str, document: Value| {
        let model = folder.path().join(format!("{name}.glb"));
        write_glb(&model, document, binary.clone());
        let baked = bake(&model, &folder.path().join(name), "1000", &[]);
        let picture = folder.path().join(format!("{name}.exr"));
        let fixed = ["--quiet", "render", str(&baked), "-o", str(&picture), "--size", "64x64", "--spp", "16"];
        done(&[&fixed[..], &["--env", "none", "--light", "1,0.2,0.1", "--background", "0,0,0"]].concat());
        let Pixels::F32(samples) = read_image(&picture).unwrap().pixels else { panic!("no floats") };
        samples.chunks_exact(3).map(|p| vec3(p[0], p[1], p[2])).sum::<Vec3>()
    };
    let both = shot("both", document.clone());
    let mut without = document.clone();
    without["materials"][0]["extensions"].as_object_mut().unwrap().remove("KINRAN_materials_fuzz");
    let skin = shot("skin", without);
    let mut without = document;
    without["materials"][0]["extensions"].as_object_mut().unwrap().remove("KINRAN_materials_skin");
    // `bake --skin all` would mark it again.
    without["materials"][0]["extensions"]["KINRAN_materials_skin"] = json!({ "scatterScale": 0.001 });
    let fuzz = shot("fuzz", without);
    assert!((both - skin).abs().max_element() > 0.02 * skin.max_element(), "no fibres: {both}, {skin}");
    // Scattered red is left under the fibres.
    let red = |c: Vec3| c.x / c.y;
    assert!(red(both) > 1.01 * red(fuzz), "no skin: {both}, {fuzz}");
}

#[test]
fn every_sheet_is_drawn_and_shows_something() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("ring.glb");
    Mesh::torus(0.012, 0.004).write(&model);
    let out = folder.path().join("sheets");
    let shared = ["skin", str(&model), "-o", str(&out), "--size", "64x48", "--spp", "1", "--unit-mm", "1000"];
    let json = done(&[&["--json"], &shared[..], &["--crop", "0.25,0,0.75,1"]].concat());
    let report: Value = serde_json::from_str(&json).unwrap();
    let sheets = ["turn", "curvature", "profiles", "shadows", "normals", "tensors"];
    assert_eq!(report["files"].as_array().unwrap().len(), sheets.len(), "{json}");
    for name in sheets {
        let (pixels, _) = pixels(&out.join(format!("{name}.png")));
        let bright = pixels.iter().filter(|p| p[0] > 120).count();
        assert!(bright > pixels.len() / 200, "{name} is dark");
    }

    // A ball of 40 m: rows that look alike are explained.
    let ball = folder.path().join("ball.glb");
    Mesh::sphere(40.0).write(&ball);
    let shared_ball =
        ["skin", str(&ball), "-o", str(&out), "--size", "64x48", "--spp", "1", "--sheet", "turn"];
    let (code, _, said) = kinran(&shared_ball);
    assert!(code == Some(0) && said.contains("--unit-mm"), "{said}");
    let (_, _, said) = kinran(&[&shared[..], &["--sheet", "turn"]].concat());
    assert!(!said.contains("hardly scatters"), "{said}");

    // The camera comes nearer, so that more of a sheet is skin than background; --whole leaves it where it was.
    let skin = |flags: &[&str]| {
        done(&[&shared[..], &["--sheet", "curvature"], flags].concat());
        let (pixels, width) = pixels(&out.join("curvature.png"));
        // The first picture's rows begin under its label; false colours of curvature have no blue where they have no green.
        let colored = |p: &[u8; 3]| p[0] > 20 && p[2] == 0;
        let rows = pixels.chunks_exact(width as usize).take(60);
        rows.flatten().filter(|p| colored(p)).count()
    };
    let (near, whole) = (skin(&[]), skin(&["--whole"]));
    assert!(near as f32 > 1.2 * whole as f32, "{near} pixels of skin, {whole} of the whole model's");
    let error = refused(&[&shared[..], &["--sheet", "turn", "--base", "2,0,0"]].concat());
    assert!(error.contains("--base"), "{error}");
    let (code, _, error) = kinran(&[&shared[..], &["--crop", "0.5,0,0.75,1"]].concat());
    assert!(code == Some(2) && error.contains("left, top"), "{error}");
}
