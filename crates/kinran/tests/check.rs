//! The checker finds nothing in what Kinran wrote, and every rule that is broken.

mod common;

use std::path::Path;

use common::{maps, model};
use kinran::bake::{FolderOptions, GltfOptions, Which, folder, gltf, understand};
use kinran::options::{Container, Form};
use kinran::{Checked, Files, Finding, Memory, Task, check};
use kinran_image::{
    Channels, Encoder, Image, Pixels, Texture, Transfer, decode_ktx2, encode_ktx2, encode_png,
};

fn baked_maps() -> Memory {
    let mut how = FolderOptions::default();
    (how.form, how.textures.container) = (Form::Both, Some(Container::Both));
    how.textures.encoder = Some(Encoder::Portable);
    let (files, out) = (maps().into_iter().collect::<Memory>(), Memory::new());
    let understood = understand(&files, Path::new("cloth"), &how).unwrap();
    folder(&files, Path::new("cloth"), &understood, &how, &out, Task::QUIET).unwrap();
    out
}

fn baked_model() -> Memory {
    baked_model_of(model())
}

/// The same with a smaller roughness map.
fn baked_model_of_two_sizes() -> Memory {
    let smaller = Image::new(16, 8, Channels::Rgb, Pixels::U8(vec![90; 16 * 8 * 3])).unwrap();
    let smaller = encode_png(&smaller).unwrap();
    let is_it = |name: &str| name.ends_with("rough.png");
    baked_model_of(
        model()
            .into_iter()
            .map(|(name, bytes)| (name, if is_it(name) { smaller.clone() } else { bytes }))
            .collect(),
    )
}

fn baked_model_of(model: Vec<(&'static str, Vec<u8>)>) -> Memory {
    let mut how = GltfOptions::default();
    (how.all_textures, how.estimate_normals, how.curvature.of) = (true, true, Which::All);
    (how.form, how.separate_specular) = (Form::Both, true);
    how.textures.encoder = Some(Encoder::Portable);
    let (files, out) = (model.into_iter().collect::<Memory>(), Memory::new());
    gltf(&files, Path::new("models/drum.gltf"), &how, &out, Task::QUIET).unwrap();
    out
}

/// A copy of files, of which one is changed.
fn changed(files: &Memory, name: &str, change: impl FnOnce(Vec<u8>) -> Vec<u8>) -> Memory {
    let copy: Memory = files.files().into_iter().collect();
    copy.insert(name, change(files.read(name.as_ref()).unwrap_or_else(|e| panic!("{name}: {e}"))));
    copy
}

/// The one thing that is wrong.
fn only(findings: Vec<Finding>) -> String {
    match findings.as_slice() {
        [finding] => format!("{}: {}", finding.place, finding.problem),
        findings => panic!("not one finding but {findings:#?}"),
    }
}

#[test]
fn what_was_just_baked_is_found_wrong() {
    let mut checked = 0;
    for files in [baked_maps(), baked_model(), baked_model_of_two_sizes()] {
        for (name, _) in files.files() {
            let end = name.extension().unwrap().to_str().unwrap();
            if ["ktx2", "dds", "gltf", "json"].contains(&end) {
                let Checked { looked_at, findings } = check(&files, &name).unwrap();
                assert_eq!(findings, [], "{}", name.display());
                assert!(looked_at > 0, "{}: nothing in it has rules", name.display());
                checked += 1;
            }
        }
    }
    assert!(checked > 12, "{checked} files");
}

#[test]
fn a_texture_that_breaks_a_rule_is_all_right() {
    let files = baked_maps();
    let broken = |name: &str, change: &dyn Fn(&mut Texture)| {
        let files = changed(&files, name, |bytes| {
            let mut texture = decode_ktx2(name.as_ref(), &bytes).unwrap();
            change(&mut texture);
            encode_ktx2(&texture, None).unwrap()
        });
        only(check(&files, name.as_ref()).unwrap().findings)
    };
    let normal = "silk_normal.ktx2";
    let said = broken(normal, &|texture| drop(texture.levels.pop()));
    assert_eq!(said, "silk_normal.ktx2: has 5 levels; 32x16 texels want 6");
    let said = broken(normal, &|texture| drop(texture.metadata.insert("KinranMap".into(), "velvet".into())));
    assert_eq!(said, "silk_normal.ktx2: key KinranMap: \"velvet\" is no map that is known");
    let said =
        broken(normal, &|texture| drop(texture.metadata.insert("KinranFilter".into(), "sieve".into())));
    assert_eq!(said, "silk_normal.ktx2: key KinranFilter: \"sieve\" is no filter that is known");
    let said = broken(normal, &|texture| drop(texture.metadata.insert("KinranMap".into(), "aniso".into())));
    assert_eq!(said, "silk_normal.ktx2: bc5 has too few channels for aniso, which needs 3");
    let said = broken("silk_color.ktx2", &|texture| texture.transfer = Transfer::Linear);
    assert_eq!(said, "silk_color.ktx2: colour is marked as linear; it is sRGB");
    let said = broken("silk_aniso.ktx2", &|texture| texture.transfer = Transfer::Srgb);
    assert_eq!(said, "silk_aniso.ktx2: aniso is marked as sRGB; it is linear");
    // Both codes of every texel are 255.
    let said = broken(normal, &|texture| {
        texture.levels[2].data =
            [[255u8, 255, 0, 0, 0, 0, 0, 0]; 2].concat().repeat(texture.levels[2].data.len() / 16);
    });
    assert_eq!(said, "silk_normal.ktx2, level 2: 32 of 32 normals are longer than one");
    let cut = changed(&files, normal, |bytes| bytes[..bytes.len() / 2].to_vec());
    let said = only(check(&cut, normal.as_ref()).unwrap().findings);
    assert!(said.starts_with("silk_normal.ktx2: ") && said.matches(".ktx2").count() == 1, "{said}");
}

#[test]
fn a_model_that_breaks_a_rule_is_all_right() {
    let files = baked_model();
    let name = "drum.gltf";
    let broken = |from: &str, to: &str| {
        let files = changed(&files, name, |bytes| {
            let text = String::from_utf8(bytes).unwrap();
            assert!(text.contains(from), "{from} is not in {text}");
            text.replacen(from, to, 1).into_bytes()
        });
        check(&files, name.as_ref()).unwrap().findings
    };
    let said = only(broken("\"KHR_texture_basisu\",", ""));
    assert_eq!(said, "drum.gltf: KHR_texture_basisu is used, and not listed in extensionsUsed");
    let said = only(broken(
        "\"extensionsUsed\"",
        "\"extensionsRequired\": [\"KINRAN_mesh_curvature\"], \"extensionsUsed\"",
    ));
    assert_eq!(
        said,
        "drum.gltf: KINRAN_mesh_curvature is required, so that other viewers refuse the whole file"
    );
    let said = broken("_normal.ktx2", "_roughness.ktx2");
    assert!(said.iter().any(|f| f.problem == "holds roughness and stands for normal"), "{said:#?}");
    let said = broken("_roughness.ktx2", "_gone.ktx2");
    assert!(said.iter().any(|f| f.place.contains("metallicRoughnessTexture")), "{said:#?}");
    let said = broken("\"TANGENT\"", "\"_TANGENT\"");
    assert!(said.iter().any(|f| f.problem.starts_with("_CURVATURE has no TANGENT")), "{said:#?}");
    let said = broken("\"KINRAN_mesh_curvature\": {", "\"KINRAN_mesh_curve\": {");
    assert!(
        said.iter().any(|f| f.problem.starts_with("_CURVATURE has no KINRAN_mesh_curvature")),
        "{said:#?}"
    );
}

#[test]
fn a_report_speaks_of_files_that_are_others_now() {
    let files = baked_maps();
    let (name, texture) = ("silk.kinran.json", "silk_normal.ktx2");
    let longer = changed(&files, texture, |mut bytes| {
        bytes.push(0);
        bytes
    });
    let said = check(&longer, name.as_ref()).unwrap().findings;
    assert!(said.iter().any(|f| f.place == texture && f.problem.starts_with("was changed")), "{said:#?}");
    let gone: Memory = files.files().into_iter().filter(|(name, _)| name != Path::new(texture)).collect();
    let said = only(check(&gone, name.as_ref()).unwrap().findings);
    assert_eq!(said, "silk_normal.ktx2: there is no such file or folder");
    let lies = changed(&files, name, |bytes| {
        String::from_utf8(bytes).unwrap().replacen("\"levels\": 6", "\"levels\": 7", 1).into_bytes()
    });
    assert!(only(check(&lies, name.as_ref()).unwrap().findings).contains("levels: it has 6"));
    let written = r#"{ "written": [{ "file": "../secret", "bytes": 1, "blake3": "" }] }"#;
    let outside = Memory::from([("a/x.kinran.json", written.as_bytes()), ("secret", b"s")]);
    let said = only(check(&outside, "a/x.kinran.json".as_ref()).unwrap().findings);
    assert_eq!(said, "x.kinran.json: \"../secret\" leads out of its folder");
    let files = changed(&files, texture, |bytes| bytes);
    files.insert("silk_normal.dds", files.get(texture).unwrap());
    let said = only(check(&files, "silk_normal.dds".as_ref()).unwrap().findings);
    assert_eq!(said, "silk_normal.dds: holds KTX2; its name must end in .ktx2");
    let dump = Memory::from([("boot_curvature.json", b"{}".to_vec())]);
    assert!(check(&dump, "boot_curvature.json".as_ref()).is_err());
}
