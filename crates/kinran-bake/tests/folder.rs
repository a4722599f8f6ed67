//! Folders of maps: names of each exporter, what must be asked, what must be refused.

#![allow(clippy::print_stdout, reason = "tests say what they skip and measure")]

#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::f32::consts::{PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};

use glam::{Vec2, vec2};
use kinran_bake::aniso::{DirectionMap, RoughnessMaps, TexelSpan};
use kinran_bake::folder::{
    ASSUMED_ROUGHNESS, BaseRoughness, Folder, FolderError, GREEN_CONFIDENCE, Green, GreenGuess, GreenSource,
    Hints, LoadedMaterial, MaterialMaps, Role, RoughnessSource, Row, green_correlation, guess_green, scan,
};
use kinran_image::{Channels, Image, Pixels, read_image, write_png};
use kinran_shading::ALPHA_MIN;
use proptest::prelude::*;
use sample_assets::sample_assets;

/// A folder of empty files; enough for scanning.
fn folder_of(names: &[&str]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for name in names {
        fs::write(dir.path().join(name), b"").unwrap();
    }
    dir
}

fn scanned(names: &[&str], hints: &Hints) -> Result<Folder, FolderError> {
    scan(folder_of(names).path(), hints)
}

fn only(names: &[&str], hints: &Hints) -> MaterialMaps {
    let folder = scanned(names, hints).unwrap_or_else(|e| panic!("{names:?}: {e}"));
    assert_eq!(folder.materials.len(), 1, "{names:?}:\n{}", folder.table());
    folder.materials.into_iter().next().unwrap()
}

fn refused(names: &[&str], hints: &Hints) -> String {
    match scanned(names, hints) {
        Err(e) => e.to_string(),
        Ok(folder) => panic!("{names:?} was taken as\n{}", folder.table()),
    }
}

fn file(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

fn maps(list: &[(Role, &str)]) -> Hints {
    Hints { maps: list.iter().map(|(r, f)| (*r, f.into())).collect(), ..Hints::default() }
}

// Pictures

fn image(side: u32, channels: Channels, texel: impl Fn(f32, f32) -> [f32; 4]) -> Image {
    let mut samples = Vec::new();
    for y in 0..side {
        for x in 0..side {
            let t = texel((x as f32 + 0.5) / side as f32, (y as f32 + 0.5) / side as f32);
            samples.extend(t[..channels.count()].iter().map(|v| (v * 65535.0).round() as u16));
        }
    }
    Image::new(side, side, channels, Pixels::U16(samples)).unwrap()
}

/// Normals of `h = a sin(2πk(x + y/2)) + a cos(2πky)`, y upwards: diagonal waves, so that the curl tells.
fn waves(green: Green) -> Image {
    image(64, Channels::Rgb, |u, v| {
        let y = 1.0 - v;
        let (a, k) = (0.02, 4.0);
        let diagonal = a * TAU * k * (TAU * k * (u + y * 0.5)).cos();
        let (dx, dy) = (diagonal, 0.5 * diagonal - a * TAU * k * (TAU * k * y).sin());
        let length = (dx * dx + dy * dy + 1.0).sqrt();
        let sign = if green == Green::Up { 1.0 } else { -1.0 };
        let n = [-dx / length, -dy / length * sign, 1.0 / length];
        [n[0] * 0.5 + 0.5, n[1] * 0.5 + 0.5, n[2] * 0.5 + 0.5, 1.0]
    })
}

fn grey(value: f32) -> Image {
    image(8, Channels::R, |_, _| [value; 4])
}

fn painted(files: &[(&str, &Image)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, image) in files {
        write_png(&dir.path().join(name), image).unwrap();
    }
    dir
}

fn load_one(files: &[(&str, &Image)], hints: &Hints) -> Result<LoadedMaterial, FolderError> {
    let dir = painted(files);
    let folder = scan(dir.path(), hints)?;
    assert_eq!(folder.materials.len(), 1, "{}", folder.table());
    folder.materials[0].load()
}

/// The first texel's squared roughness: xx, xy, yy.
fn first_texel(material: &LoadedMaterial) -> [f32; 3] {
    let maps = material.surface.as_ref().expect("a surface");
    let mut span = TexelSpan::default();
    maps.decode_span(maps.size(), 0, 0, 1, &mut span);
    [span.axx[0], span.axy[0], span.ayy[0]]
}

#[track_caller]
fn assert_near(got: [f32; 3], alpha_t: f32, alpha_b: f32, axis: Vec2, what: &str) {
    let (t, b) = (alpha_t * alpha_t, alpha_b * alpha_b);
    let wanted = [
        t * axis.x * axis.x + b * axis.y * axis.y,
        (t - b) * axis.x * axis.y,
        t * axis.y * axis.y + b * axis.x * axis.x,
    ];
    for (g, w) in got.iter().zip(wanted) {
        assert!((g - w).abs() < 2e-4, "{what}: wanted {wanted:?} got {got:?}");
    }
}

// Names

#[test]
fn whole_downloads_of_each_site_become_one_material() {
    type Case<'a> = (&'a str, &'a [&'a str], &'a str, Green, GreenSource, &'a str);
    use GreenSource::{Assumed, Name};
    let cases: &[Case] = &[
        (
            "ambientCG",
            &[
                "Metal009.png",
                "Metal009_2K-PNG.mtlx",
                "Metal009_2K-PNG.usdc",
                "Metal009_2K-PNG_Color.png",
                "Metal009_2K-PNG_Displacement.png",
                "Metal009_2K-PNG_Metalness.png",
                "Metal009_2K-PNG_NormalDX.png",
                "Metal009_2K-PNG_NormalGL.png",
                "Metal009_2K-PNG_Roughness.png",
            ],
            "Metal009_2K-PNG_NormalGL.png",
            Green::Up,
            Name,
            "Metal009_2K-PNG_Roughness.png",
        ),
        (
            "Poly Haven",
            &[
                "rock_06_ao_1k.jpg",
                "rock_06_arm_1k.jpg",
                "rock_06_diff_1k.jpg",
                "rock_06_disp_1k.png",
                "rock_06_nor_gl_1k.exr",
                "rock_06_rough_1k.exr",
                "rock_06_spec_1k.png",
            ],
            "rock_06_nor_gl_1k.exr",
            Green::Up,
            Name,
            "rock_06_rough_1k.exr",
        ),
        (
            "Poly Haven, DirectX and packed alone",
            &["brick_nor_dx_2k.png", "brick_arm_2k.png", "brick_diff_2k.png"],
            "brick_nor_dx_2k.png",
            Green::Down,
            Name,
            "brick_arm_2k.png",
        ),
        (
            "Substance Painter",
            &[
                "Lamp_Shade_Base_color.png",
                "Lamp_Shade_Metallic.png",
                "Lamp_Shade_Normal_DirectX.png",
                "Lamp_Shade_Normal_OpenGL.png",
                "Lamp_Shade_Mixed_AO.png",
                "Lamp_Shade_Roughness.png",
                "Lamp_Shade_Height.png",
            ],
            "Lamp_Shade_Normal_OpenGL.png",
            Green::Up,
            Name,
            "Lamp_Shade_Roughness.png",
        ),
        (
            "Painter for glTF",
            &[
                "wood_baseColor.png",
                "wood_normal.png",
                "wood_occlusionRoughnessMetallic.png",
                "wood_emissive.png",
            ],
            "wood_normal.png",
            Green::Up,
            Assumed,
            "wood_occlusionRoughnessMetallic.png",
        ),
        (
            "3dtextures.me",
            &[
                "Leather_008_ambientOcclusion.jpg",
                "Leather_008_basecolor.jpg",
                "Leather_008_height.png",
                "Leather_008_normal.jpg",
                "Leather_008_roughness.jpg",
            ],
            "Leather_008_normal.jpg",
            Green::Up,
            Assumed,
            "Leather_008_roughness.jpg",
        ),
        (
            "Megascans",
            &["vbsj_4K_Albedo.jpg", "vbsj_4K_Normal_LOD0.jpg", "vbsj_4K_Roughness.jpg", "vbsj_Preview.png"],
            "vbsj_4K_Normal_LOD0.jpg",
            Green::Up,
            Assumed,
            "vbsj_4K_Roughness.jpg",
        ),
        (
            "Unreal",
            &["T_Brick_BC.TGA", "T_Brick_N.TGA", "T_Brick_ORM.TGA"],
            "T_Brick_N.TGA",
            Green::Up,
            Assumed,
            "T_Brick_ORM.TGA",
        ),
        (
            "letters with company",
            &["brick_D.png", "brick_N.png", "brick_R.png"],
            "brick_N.png",
            Green::Up,
            Assumed,
            "brick_R.png",
        ),
        (
            "bare names",
            &["normal.png", "roughness.png", "albedo.png"],
            "normal.png",
            Green::Up,
            Assumed,
            "roughness.png",
        ),
    ];
    for (site, names, normal, green, source, roughness) in cases {
        let material = only(names, &Hints::default());
        let got = material.normal.as_ref().unwrap();
        assert_eq!(
            (file(&got.file).as_str(), got.green, got.green_source),
            (*normal, *green, *source),
            "{site}: {material:?}"
        );
        let Some(RoughnessSource::Isotropic(BaseRoughness::Roughness(map))) = &material.roughness else {
            panic!("{site}: {:?}", material.roughness)
        };
        let channel = usize::from(Role::Orm == material.files.iter().find(|f| f.1 == map.file).unwrap().0);
        assert_eq!((file(&map.file).as_str(), map.channel), (*roughness, channel), "{site}");
        assert!(material.color.is_some(), "{site}: no color in {material:?}");
    }
}

#[test]
fn packed_channels_go_where_their_names_say() {
    let cases = [
        ("x_ORM.png", Some(0), Some((1, false)), Some(2)),
        ("x_rma.png", Some(2), Some((0, false)), Some(1)),
        ("x_mra.png", Some(2), Some((1, false)), Some(0)),
        ("x_metallicRoughness.png", None, Some((1, false)), Some(2)),
        ("x_MetallicSmoothness.png", None, Some((3, true)), Some(0)),
        ("x_MaskMap.png", Some(1), Some((3, true)), Some(0)),
    ];
    for (name, occlusion, roughness, metallic) in cases {
        let material = only(&["x_normal.png", name], &Hints::default());
        let got = match &material.roughness {
            Some(RoughnessSource::Isotropic(BaseRoughness::Roughness(m))) => Some((m.channel, false)),
            Some(RoughnessSource::Isotropic(BaseRoughness::Gloss(m))) => Some((m.channel, true)),
            other => panic!("{name}: {other:?}"),
        };
        let channel = |m: &Option<kinran_bake::folder::MapChannel>| m.as_ref().map(|m| m.channel);
        assert_eq!(
            (channel(&material.occlusion), got, channel(&material.metallic)),
            (occlusion, roughness, metallic),
            "{name}"
        );
    }
}

#[test]
fn a_map_of_its_own_goes_before_a_packed_channel_and_the_table_says_so() {
    let folder =
        scanned(&["r_arm_1k.png", "r_rough_1k.png", "r_ao_1k.png", "r_nor_gl_1k.png"], &Hints::default())
            .unwrap();
    let material = &folder.materials[0];
    assert_eq!(file(&material.occlusion.as_ref().unwrap().file), "r_ao_1k.png");
    assert_eq!(file(&material.metallic.as_ref().unwrap().file), "r_arm_1k.png");
    let row = folder.rows.iter().find(|r| r.file == "r_arm_1k.png").unwrap();
    assert_eq!(row.note, "its occlusion and roughness not used, another map has it");
}

#[test]
fn several_materials_in_one_folder_keep_apart() {
    let names = [
        "Brick_normal.png",
        "brick_rough.png",
        "normal.png",
        "stone-NormalDX.png",
        "stone-Roughness.png",
        "readme.txt",
    ];
    let dir = folder_of(&names);
    let folder = scan(dir.path(), &Hints::default()).unwrap();
    let own = file(dir.path());
    let got: Vec<(&str, usize)> = folder.materials.iter().map(|m| (m.name.as_str(), m.files.len())).collect();
    assert_eq!(got, [(own.as_str(), 1), ("Brick", 2), ("stone", 2)], "{}", folder.table());
}

#[test]
fn a_lone_letter_is_no_map() {
    let folder = scanned(&["plan_d.png", "rock_normal.png"], &Hints::default()).unwrap();
    assert_eq!(folder.materials.len(), 1, "{}", folder.table());
    let row = folder.rows.iter().find(|r| r.file == "plan_d.png").unwrap();
    assert_eq!((row.role, row.note.starts_with("not used: a letter alone")), (None, true), "{row:?}");
}

#[test]
fn hidden_files_and_folders_called_like_maps_are_passed_over() {
    let dir = folder_of(&["a_normal.png", "._a_normal.png", ".a_rough.png"]);
    fs::create_dir(dir.path().join("a_roughness.png")).unwrap();
    let folder = scan(dir.path(), &Hints::default()).unwrap();
    assert_eq!(folder.rows.len(), 3, "{}", folder.table());
    assert!(folder.rows[2].file == "a_roughness.png/" && folder.rows[2].note.contains("a folder"));
    let source = folder.materials[0].roughness.clone();
    assert_eq!(source, Some(RoughnessSource::Isotropic(BaseRoughness::Constant(ASSUMED_ROUGHNESS))));
    assert!(folder.rows[1].note.contains("--roughness"), "{}", folder.table());
}

/// What a material's warnings and the constants of its table say.
fn assumed(names: &[&str], hints: &Hints) -> (Vec<String>, Vec<String>) {
    let dir = folder_of(names);
    let folder = scan(dir.path(), hints).unwrap();
    let rows = folder.rows.iter().filter(|row| row.file == "-");
    let rows = rows.map(|row| format!("{}: {}", row.role.unwrap(), row.note)).collect();
    (folder.materials[0].warnings.clone(), rows)
}

#[test]
fn a_roughness_that_nobody_gave_is_assumed_in_silence() {
    let plain = Hints::default();
    let said = Hints { roughness: Some(0.3), ..Hints::default() };
    // The kinds of surface that need a roughness, and a packed map that does.
    for names in
        [&["a_normal.png"][..], &["a_normal.png", "a_AnisotropyLevel.png"], &["a_ao.png", "a_color.png"]]
    {
        let (warnings, rows) = assumed(names, &plain);
        assert_eq!(warnings.len(), 1, "{names:?}: {warnings:?}");
        assert!(warnings[0].starts_with("a: no roughness map, 0.5 is assumed"), "{warnings:?}");
        assert!(rows[0].starts_with("roughness: warning: no map, 0.5 is assumed"), "{rows:?}");
        let (warnings, rows) = assumed(names, &said);
        assert!(warnings.is_empty(), "{names:?}: {warnings:?}");
        assert_eq!(rows[0], "roughness: no map: 0.3 everywhere, by --roughness");
    }
    for names in [&["a_normal.png", "a_rough.png"][..], &["a_normal.png", "a_orm.png"], &["a_color.png"]] {
        let (warnings, rows) = assumed(names, &plain);
        assert!(warnings.is_empty() && rows.is_empty(), "{names:?}: {warnings:?} {rows:?}");
    }
    let (warnings, _) = assumed(&["a_normal.png", "a_blob.png"], &plain);
    assert!(warnings[0].contains("not recognised: a_blob.png"), "{warnings:?}");
    let (_, rows) = assumed(&["a_normal.png", "a_rough.png", "a_ao.png"], &plain);
    assert_eq!(rows, ["metallic: no map: 0 everywhere, no metal"]);
}

#[test]
fn a_normal_map_that_is_not_there_is_flat_in_silence() {
    for names in [&["a_rough.png"][..], &["a_glossU.png", "a_glossV.png"], &["a_orm.png", "a_color.png"]] {
        let (warnings, rows) = assumed(names, &Hints::default());
        assert!(warnings[0].starts_with("a: no normal map, the surface is taken to be flat"), "{warnings:?}");
        assert!(rows[0].starts_with("normal: warning: no map, the surface is flat"), "{rows:?}");
    }
    let (warnings, _) = assumed(&["a_rough.png", "blob.png"], &Hints::default());
    assert!(warnings[0].contains("not recognised: blob.png"), "{warnings:?}");
    // Without a surface no normals are written.
    let (warnings, rows) = assumed(&["a_color.png"], &Hints::default());
    assert!(warnings.is_empty() && rows.is_empty(), "{warnings:?} {rows:?}");
}

/// Materials as "name: role role", by the files that are used.
fn materials(folder: &Folder) -> Vec<String> {
    let one = |material: &MaterialMaps| {
        let roles: Vec<&str> = material.files.iter().map(|(role, _)| role.name()).collect();
        format!("{}: {}", material.name, roles.join(" "))
    };
    folder.materials.iter().map(one).collect()
}

#[test]
fn sets_as_exporters_name_them_fall_apart_or_together() {
    type Case<'a> = (&'a str, &'a [&'a str], &'a [&'a str]);
    let cases: &[Case] = &[
        (
            "Poliigon, by metalness",
            &[
                "BrushedSteel01_COL_2K_METALNESS.png",
                "BrushedSteel01_DISP_2K_METALNESS.png",
                "BrushedSteel01_METALNESS_2K_METALNESS.png",
                "BrushedSteel01_NRM_2K_METALNESS.png",
                "BrushedSteel01_ROUGHNESS_2K_METALNESS.png",
                "BrushedSteel01_sphere.png",
            ],
            &["BrushedSteel01: normal roughness color metallic"],
        ),
        (
            "Poliigon, both workflows",
            &[
                "Steel01_COL_2K_METALNESS.png",
                "Steel01_NRM_2K_METALNESS.png",
                "Steel01_COL_2K_SPECULAR.png",
                "Steel01_GLOSS_2K_SPECULAR.png",
                "Steel01_NRM_2K_SPECULAR.png",
            ],
            &["Steel01_METALNESS: normal color", "Steel01_SPECULAR: normal gloss color"],
        ),
        (
            "Poliigon, both workflows with one occlusion and one normal map",
            &[
                "Steel01_AO_2K.png",
                "Steel01_NRM_2K.png",
                "Steel01_COL_2K_METALNESS.png",
                "Steel01_METALNESS_2K_METALNESS.png",
                "Steel01_ROUGHNESS_2K_METALNESS.png",
                "Steel01_COL_2K_SPECULAR.png",
                "Steel01_GLOSS_2K_SPECULAR.png",
                "Steel01_REFL_2K_SPECULAR.png",
            ],
            &[
                "Steel01_METALNESS: normal roughness color occlusion metallic",
                "Steel01_SPECULAR: normal gloss color occlusion",
            ],
        ),
        (
            "variants with one normal map",
            &["W_Normal.png", "W_Rough_red.png", "W_Color_red.png", "W_Rough_blue.png", "W_Color_blue.png"],
            &["W_blue: normal roughness color", "W_red: normal roughness color"],
        ),
        (
            "a material beside its variants",
            &[
                "W_Normal.png",
                "W_Rough.png",
                "W_Rough_red.png",
                "W_Color_red.png",
                "W_Rough_blue.png",
                "W_Color_blue.png",
            ],
            &["W: normal roughness", "W_blue: roughness color", "W_red: roughness color"],
        ),
        (
            "a layer's maps called after their roles alone",
            &[
                "base_color.png",
                "clearcoat_normal.png",
                "coat_roughness.png",
                "normal.png",
                "sheen_roughness.png",
            ],
            &["x: normal color"],
        ),
        (
            "a layer's maps beside those of the base",
            &["rock_Coat_Normal.png", "rock_Coat_Color.png", "rock_Coat_Roughness.png", "rock_Normal.png"],
            &["rock: normal"],
        ),
        (
            "glTF's channels called after their roles alone",
            &["base_color.png", "metallic_roughness.png", "normal.png"],
            &["x: normal color metallic-roughness"],
        ),
        (
            "what is worn as a coat",
            &["Red_Coat_AO.png", "Red_Coat_Normal.png", "Red_Coat_Roughness.png"],
            &["Red_Coat: normal roughness occlusion"],
        ),
        (
            "what is worn as a coat, by names of layers alone",
            &["Coat_Color.png", "Coat_Normal.png", "Coat_Roughness.png"],
            &["Coat: normal roughness color"],
        ),
        (
            "Poliigon, some by metalness",
            &[
                "Metal01_AO_2K.png",
                "Metal01_COL_2K_METALNESS.png",
                "Metal01_METALNESS_2K_METALNESS.png",
                "Metal01_NRM_2K_METALNESS.png",
                "Metal01_ROUGHNESS_2K_METALNESS.png",
            ],
            &["Metal01: normal roughness color occlusion metallic"],
        ),
        (
            "Poliigon, one by metalness",
            &["Metal01_COL_VAR1_2K_METALNESS.png", "Metal01_NRM_2K.png", "Metal01_ROUGHNESS_2K.png"],
            &["Metal01: normal roughness color"],
        ),
        (
            "Poliigon, some by specular",
            &[
                "Fabric001_COL_1K_SPECULAR.jpg",
                "Fabric001_GLOSS_1K_SPECULAR.jpg",
                "Fabric001_NRM_1K_SPECULAR.jpg",
                "Fabric001_REFL_1K.jpg",
            ],
            &["Fabric001: normal gloss color"],
        ),
        (
            "metalness behind a size, of materials called as roles",
            &[
                "Wall_Metal_2K_Metallic.png",
                "Wall_Metal_2K_Normal.png",
                "Wall_Rough_2K_Metallic.png",
                "Wall_Rough_2K_Normal.png",
            ],
            &["Wall_Metal: normal metallic", "Wall_Rough: normal metallic"],
        ),
        (
            "Standard Surface",
            &[
                "rock_base_color.png",
                "rock_coat_roughness.png",
                "rock_normal.png",
                "rock_specular_roughness.png",
            ],
            &["rock: normal roughness color"],
        ),
        (
            "Standard Surface, of what is called specular",
            &["old_specular_normal.png", "old_specular_roughness.png"],
            &["old_specular: normal roughness"],
        ),
        (
            "Poliigon, by specular",
            &[
                "Oak01_AO_3K.jpg",
                "Oak01_COL_VAR1_3K.jpg",
                "Oak01_DISP16_3K.png",
                "Oak01_GLOSS_3K.jpg",
                "Oak01_NRM_3K.jpg",
                "Oak01_REFL_3K.jpg",
            ],
            &["Oak01: normal gloss color occlusion"],
        ),
        (
            "Poliigon, new",
            &[
                "Poliigon_WoodOak_2070_Normal.png",
                "Poliigon_WoodOak_2070_Roughness.jpg",
                "Poliigon_WoodOak_2070_BaseColor.jpg",
                "Poliigon_WoodOak_2070_Metallic.jpg",
            ],
            &["Poliigon_WoodOak_2070: normal roughness color metallic"],
        ),
        (
            "Megascans, with both",
            &[
                "vbkm_2K_Albedo.jpg",
                "vbkm_2K_Cavity.jpg",
                "vbkm_2K_Gloss.jpg",
                "vbkm_2K_Normal_LOD0.jpg",
                "vbkm_2K_Roughness.jpg",
                "vbkm_2K_Specular.jpg",
            ],
            &["vbkm: normal roughness color"],
        ),
        (
            "Megascans in Fab",
            &["T_rkswd_4K_B.png", "T_rkswd_4K_N.png", "T_rkswd_4K_ORM.png"],
            &["rkswd: normal color orm"],
        ),
        (
            "Quixel for Unreal",
            &["T_rock_sfDgc_2K_D.png", "T_rock_sfDgc_2K_N.png", "T_rock_sfDgc_2K_ORDp.png"],
            &["rock_sfDgc: normal color occlusion-roughness"],
        ),
        (
            "Painter for Unity",
            &[
                "Gun_AlbedoTransparency.png",
                "Gun_MetallicSmoothness.png",
                "Gun_Normal.png",
                "Gun_Emission.png",
            ],
            &["Gun: normal color metallic-smoothness"],
        ),
        (
            "Painter for Unity, by specular",
            &["Gun_AlbedoTransparency.png", "Gun_SpecularSmoothness.png", "Gun_Normal.png"],
            &["Gun: normal color specular-smoothness"],
        ),
        (
            "Painter for HDRP",
            &["Gun_BaseMap.png", "Gun_MaskMap.png", "Gun_Normal.png", "Gun_Emissive.png"],
            &["Gun: normal color mask-map"],
        ),
        (
            "Painter for URP",
            &["Gun_BaseMap.png", "Gun_MetallicSmoothness.png", "Gun_Normal.png", "Gun_Occlusion.png"],
            &["Gun: normal color occlusion metallic-smoothness"],
        ),
        (
            "Painter for Unreal",
            &["M_Gun_BaseColor.png", "M_Gun_Normal.png", "M_Gun_OcclusionRoughnessMetallic.png"],
            &["M_Gun: normal color orm"],
        ),
        (
            "Painter's colour spaces",
            &[
                "Gun_BaseColor_Utility - sRGB - Texture.png",
                "Gun_Metallic_ACEScg.png",
                "Gun_Normal_Utility - Raw.png",
                "Gun_Roughness_Raw.png",
            ],
            &["Gun: normal roughness color metallic"],
        ),
        (
            "Blender's colour spaces",
            &["Gun_Normal_Non-Color.png", "Gun_Roughness_Non-Color.png", "Gun_Base Color_sRGB.png"],
            &["Gun: normal roughness color"],
        ),
        (
            "Painter's bakes",
            &[
                "Gun_Ambient Occlusion Map from Mesh.png",
                "Gun_Curvature Map from Mesh.png",
                "Gun_Normal Map from Mesh.png",
                "Gun_Roughness.png",
                "Gun_World Space Normals.png",
            ],
            &["Gun: roughness", "Gun_from_Mesh: normal occlusion"],
        ),
        (
            "UDIM behind",
            &[
                "Head_Normal.1001.png",
                "Head_Normal.1002.png",
                "Head_Roughness.1001.png",
                "Head_Roughness.1002.png",
            ],
            &["Head_1001: normal roughness", "Head_1002: normal roughness"],
        ),
        (
            "UDIM behind, of one tile",
            &["Head_Normal_1001.png", "Head_Roughness_1001.png"],
            &["Head_1001: normal roughness"],
        ),
        (
            "UDIM and a side of 1024",
            &["Head_Normal.1023.png", "Head_Normal.1024.png", "Head_Rough.1023.png", "Head_Rough.1024.png"],
            &["Head_1023: normal roughness", "Head_1024: normal roughness"],
        ),
        (
            "UDIM before",
            &["Head.1001_Normal.png", "Head.1001_Roughness.png", "Head.1002_Normal.png"],
            &["Head.1001: normal roughness", "Head.1002: normal"],
        ),
        (
            "tiles of Mudbox",
            &["Head_Normal_u1_v1.png", "Head_Rough_u1_v1.png", "Head_Normal_u2_v1.png"],
            &["Head_u1_v1: normal roughness", "Head_u2_v1: normal"],
        ),
        (
            "3D-Coat",
            &["Lambert1_color.tga", "Lambert1_gloss.tga", "Lambert1_metalness.tga", "Lambert1_nmap.tga"],
            &["Lambert1: normal gloss color metallic"],
        ),
        (
            "Marmoset",
            &["gun_albedo.tga", "gun_gloss.tga", "gun_normals.tga", "gun_normals_object.tga"],
            &["gun: normal gloss color"],
        ),
        (
            "Arnold",
            &["Gun_BaseColor.png", "Gun_Metalness.png", "Gun_Normal.png", "Gun_Roughness.png", "Gun_ior.png"],
            &["Gun: normal roughness color metallic"],
        ),
        (
            "textures.com",
            &[
                "TexturesCom_Metal_Brushed_1K_albedo.png",
                "TexturesCom_Metal_Brushed_1K_height.png",
                "TexturesCom_Metal_Brushed_1K_normal.png",
                "TexturesCom_Metal_Brushed_1K_roughness.png",
            ],
            &["TexturesCom_Metal_Brushed: normal roughness color"],
        ),
        (
            "freepbr",
            &["rusted-steel-albedo.png", "rusted-steel-metallic.png", "rusted-steel-normal-ogl.png"],
            &["rusted-steel: normal color metallic"],
        ),
        (
            "cgbookcase",
            &["Fabric01_MR_2K_BaseColor.png", "Fabric01_MR_2K_Normal.png", "Fabric01_MR_2K_Roughness.png"],
            &["Fabric01_MR: normal roughness color"],
        ),
        (
            "sharetextures",
            &["wood_1-2K_normal-2K.png", "wood_1-2K_roughness-2K.png"],
            &["wood_1: normal roughness"],
        ),
        (
            "Blender's bakes",
            &["Cube Normal.png", "Cube Roughness.png", "Material.001_normal.png", "Material.002_normal.png"],
            &["Cube: normal roughness", "Material.001: normal", "Material.002: normal"],
        ),
        (
            "Blender's glTF",
            &["wood_baseColor.png", "wood_metallic-wood_roughness.png", "wood_normal.png"],
            &["wood: normal color metallic-roughness"],
        ),
        (
            "Sketchfab",
            &["Scene_-_Root_baseColor.jpeg", "Scene_-_Root_metallicRoughness.png", "Scene_-_Root_normal.png"],
            &["Scene_-_Root: normal color metallic-roughness"],
        ),
        (
            "packed in other orders",
            &["a_AO_R_M.png", "a_Normal.png", "b_MRAO.png", "b_Normal.png", "c_RMO.png", "c_Normal.png"],
            &["a: normal orm", "b: normal mra", "c: normal rma"],
        ),
        (
            "roughness and occlusion in one",
            &["rock_06_diff_1k.jpg", "rock_06_nor_gl_1k.exr", "rock_06_rough_ao_1k.jpg"],
            &["rock_06: normal color occlusion-roughness"],
        ),
        (
            "the occlusion of what is called rough",
            &["old_rough_ao.png", "old_rough_normal.png", "old_rough_rough.png"],
            &["old_rough: normal roughness occlusion"],
        ),
        ("copies", &["steel_normal (1).png", "steel_roughness (1).png"], &["steel: normal roughness"]),
        ("a copy", &["Wood_Normal copy.png", "Wood_Roughness.png"], &["Wood: normal roughness"]),
        ("a second copy", &["Wood_Normal copy 2.png", "Wood_Roughness.png"], &["Wood: normal roughness"]),
        ("versions", &["Wood_Normal_v002.png", "Wood_Roughness_v002.png"], &["Wood: normal roughness"]),
        ("final", &["Wood_Normal_final.png", "Wood_Roughness_final.png"], &["Wood: normal roughness"]),
        (
            "a word of the whole set",
            &["Wood_Normal_approved.png", "Wood_Roughness_approved.png"],
            &["Wood: normal roughness"],
        ),
        (
            "variants",
            &["W_Normal_red.png", "W_Rough_red.png", "W_Normal_blue.png", "W_Rough_blue.png"],
            &["W_blue: normal roughness", "W_red: normal roughness"],
        ),
        (
            "previews beside maps",
            &["W_Normal.png", "W_Normal_preview.png", "W_Rough.png", "W_Rough_preview.png"],
            &["W: normal roughness"],
        ),
        ("the role before", &["normal_brick.png", "roughness_brick.png"], &["brick: normal roughness"]),
        (
            "a material called as a role",
            &["Metallic_Base_Color.png", "Metallic_Metallic.png", "Metallic_Normal.png"],
            &["Metallic: normal color metallic"],
        ),
        (
            "materials called as roles",
            &[
                "Wall_Metal_Normal.png",
                "Wall_Metal_Rough.png",
                "Wall_Rough_Normal.png",
                "Wall_Rough_Rough.png",
            ],
            &["Wall_Metal: normal roughness", "Wall_Rough: normal roughness"],
        ),
        (
            "materials called as roles, of one map each",
            &["Wall_Metal_Normal.png", "Wall_Rough_Normal.png"],
            &["Wall_Metal: normal", "Wall_Rough: normal"],
        ),
        (
            "a role's name in a material's",
            &["Rusty_Metal_2K_Color.png", "Rusty_Metal_2K_Normal.png", "Rusty_Metal_2K_Roughness.png"],
            &["Rusty_Metal: normal roughness color"],
        ),
    ];
    for (what, names, wanted) in cases {
        let outer = tempfile::tempdir().unwrap();
        let dir = outer.path().join("x");
        fs::create_dir(&dir).unwrap();
        names.iter().for_each(|name| fs::write(dir.join(name), b"").unwrap());
        let folder = scan(&dir, &Hints::default()).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(materials(&folder), *wanted, "{what}:\n{}", folder.table());
    }
}

#[test]
fn a_shared_map_has_a_row_of_each_material_and_a_layers_map_the_reason_why_it_is_not_used() {
    let names = ["S_AO_2K.png", "S_COL_2K_METALNESS.png", "S_COL_2K_SPECULAR.png", "S_GLOSS_2K_SPECULAR.png"];
    let folder = scanned(&names, &Hints::default()).unwrap();
    let rows: Vec<_> = folder.rows.iter().filter(|row| row.file == names[0]).collect();
    assert_eq!(rows.len(), 2, "{}", folder.table());
    for row in rows {
        assert_eq!(row.channels, "R occlusion", "{row:?}");
        assert!(row.note.contains("shared by S_METALNESS and S_SPECULAR"), "{row:?}");
    }
    // What a flag says of it is said of it in all of them, and goes before what one of them has.
    for (role, named) in [(Role::Occlusion, "S_AO_2K.png"), (Role::Gloss, "S_NRM_2K.png")] {
        let names = [&names[..], &["S_NRM_2K.png"]].concat();
        let folder = scanned(&names, &maps(&[(role, named)])).unwrap();
        let of = |material: &MaterialMaps| {
            let is_it = |(own, path): &&(Role, PathBuf)| *own == role && file(path) == named;
            material.files.iter().filter(is_it).count()
        };
        let taken: Vec<(&str, usize)> = folder.materials.iter().map(|m| (m.name.as_str(), of(m))).collect();
        assert_eq!(taken, [("S_METALNESS", 1), ("S_SPECULAR", 1)], "{}", folder.table());
    }
    for (file, role) in [
        ("coat_roughness.png", Role::Roughness),
        ("clearcoat_normal.png", Role::Normal),
        ("sheen_color.png", Role::Color),
        ("diffuse_roughness.png", Role::Roughness),
        ("bent_normal.png", Role::Normal),
        ("rock_world_space_normal.png", Role::Normal),
    ] {
        let folder = scanned(&[file, "rock_ao.png"], &Hints::default()).unwrap();
        let row = folder.rows.iter().find(|row| row.file == file).unwrap();
        let flag = format!("--map {role}={file}");
        assert_eq!((row.role, row.channels.as_str()), (Some(Role::Other), "-"), "{file}: {row:?}");
        assert!(
            row.note.starts_with("not used: by its name no") && row.note.contains(&flag),
            "{file}: {row:?}"
        );
        let told = refused(&[file], &Hints::default());
        assert!(told.contains("no maps found") && told.contains(file), "{file} alone: {told}");
        let taken = only(&[file, "rock_ao.png"], &maps(&[(role, file)]));
        assert!(taken.files.iter().any(|(own, _)| *own == role), "{flag}: {taken:?}");
    }
}

#[test]
fn a_map_without_the_number_of_a_tile_leaves_its_tiles_in_silence() {
    for (tiled, plain, wanted) in [
        ("rock_Normal_1001.png", "rock_roughness.png", Some("of tile 1001")),
        ("rock.1002_Normal.png", "rock_roughness.png", Some("of tile 1002")),
        ("rock_Normal_u1_v2.png", "rock_roughness.png", Some("of tile u1_v2")),
        ("rock_Normal_1001.png", "moss_roughness.png", None),
        ("rock_Normal_1001.png", "rock_roughness_1001.png", None),
    ] {
        let folder = scanned(&[tiled, plain], &Hints::default()).unwrap();
        let warnings = folder.materials.iter().flat_map(|material| &material.warnings);
        let about: Vec<&String> = warnings.filter(|warning| warning.contains("tile")).collect();
        match wanted {
            None => assert!(about.is_empty(), "{tiled} {plain}: {about:?}"),
            Some(tile) => {
                assert_eq!(about.len(), 1, "{tiled} {plain}: {about:?}\n{}", folder.table());
                for part in [tiled, plain, tile] {
                    assert!(about[0].contains(part), "{tiled} {plain}: no {part} in {about:?}");
                }
            }
        }
    }
}

#[test]
fn a_variant_that_nothing_speaks_for_is_told() {
    let names = ["Wood_Color_Red.png", "Wood_Normal.png", "Wood_Roughness.png"];
    let folder = scanned(&names, &Hints::default()).unwrap();
    assert_eq!(materials(&folder), ["Wood: normal roughness"], "{}", folder.table());
    let row = folder.rows.iter().find(|row| row.file == names[0]).unwrap();
    assert!(row.note.contains("--map color=Wood_Color_Red.png"), "{row:?}");
    let named = only(&names, &maps(&[(Role::Color, "Wood_Color_Red.png")]));
    assert_eq!(named.files.len(), 3, "{named:?}");
}

#[test]
fn a_level_beside_a_direction_is_taken_for_a_second_direction() {
    for direction in ["steel_direction.png", "steel_anisotropy_angle.png"] {
        let names = ["steel_normal.png", "steel_roughness.png", "steel_anisotropy.png", direction];
        let of = |hints: &Hints| {
            let material = only(&names, hints);
            material
                .files
                .iter()
                .find(|(_, path)| path.ends_with("steel_anisotropy.png"))
                .map(|(role, _)| *role)
        };
        assert_eq!(of(&Hints::default()), Some(Role::AnisotropyLevel), "beside {direction}");
        // Who says that it is glTF's map is believed.
        let dir = folder_of(&names);
        let said = scan(dir.path(), &maps(&[(Role::Anisotropy, "steel_anisotropy.png")]));
        assert!(said.is_ok(), "{}", said.unwrap_err());
    }
}

#[test]
fn an_archives_inner_folder_is_not_looked_into() {
    let dir = folder_of(&["rock.blend", "preview.png"]);
    let inner = dir.path().join("textures");
    fs::create_dir(&inner).unwrap();
    for name in ["normal.png", "roughness.png", "LICENSE"] {
        fs::write(inner.join(name), b"").unwrap();
    }
    let folder = scan(dir.path(), &Hints::default()).unwrap();
    assert_eq!(materials(&folder), [format!("{}: normal roughness", file(dir.path()))]);
    for name in ["textures/normal.png", "textures/LICENSE", "rock.blend", "preview.png"] {
        assert!(folder.rows.iter().any(|row| row.file == name), "no {name} in\n{}", folder.table());
    }
    // A file is named as it is called, or by its place.
    for named in ["roughness.png", "textures/roughness.png"] {
        let hints = Hints { ignore: vec![named.into()], ..Hints::default() };
        let folder = scan(dir.path(), &hints).unwrap_or_else(|e| panic!("{named}: {e}"));
        let row = folder.rows.iter().find(|row| row.file == "textures/roughness.png").unwrap();
        assert!(row.note.contains("--ignore"), "{named}: {row:?}");
    }
    // Its own maps go before, and so does a model that they belong to.
    for own in ["own_normal.png", "rock.gltf"] {
        fs::write(dir.path().join(own), b"").unwrap();
        let rows = scan(dir.path(), &Hints::default()).map_or(Vec::new(), |folder| folder.rows);
        let is_inside = |row: &Row| row.file.starts_with("textures/") && row.file != "textures/";
        assert!(!rows.iter().any(is_inside), "{own}: {rows:?}");
        fs::remove_file(dir.path().join(own)).unwrap();
    }
}

// Files that are not read

#[test]
fn a_map_that_is_not_read_is_baked_flat_in_silence() {
    let names = ["mat_normal.avif", "mat_roughness.png"];
    let error = refused(&names, &Hints::default());
    for part in
        ["mat_normal.avif", "the normal map of mat", ".avif files are not read", "--ignore mat_normal.avif"]
    {
        assert!(error.contains(part), "wanted \"{part}\" in: {error}");
    }
    let ignored = Hints { ignore: vec!["mat_normal.avif".into()], ..Hints::default() };
    let (warnings, rows) = assumed(&names, &ignored);
    assert!(warnings[0].contains("no normal map") && rows[0].starts_with("normal"), "{warnings:?} {rows:?}");
    // The source of a map that is there, and a picture that is no map.
    let folder =
        scanned(&["mat_normal.psd", "mat_normal.png", "mat_rough.png", "cat.gif"], &Hints::default());
    let folder = folder.unwrap();
    let note = |name: &str| folder.rows.iter().find(|row| row.file == name).unwrap().note.clone();
    assert_eq!(note("mat_normal.psd"), "not used: .psd is not read, mat_normal.png is");
    assert_eq!(note("cat.gif"), "not recognised, not used");
}

#[test]
fn files_of_a_folder_vanish() {
    let names =
        ["a_normal.png", "a_rough.png", "a.mtlx", "README", "a_height.exr", "photo.jpg", "a.normal.png.meta"];
    let folder = scanned(&names, &Hints::default()).unwrap();
    for name in names {
        assert_eq!(
            folder.rows.iter().filter(|row| row.file == name).count(),
            1,
            "{name}:\n{}",
            folder.table()
        );
    }
    assert!(folder.rows.iter().any(|row| row.file == "README" && !row.is_picture()), "{}", folder.table());
}

// Twins

/// The material of painted files, loaded, and the name of its normal or roughness map.
fn load_twins(
    files: &[(&str, &Image)],
    hints: &Hints,
    role: Role,
) -> Result<(String, LoadedMaterial), FolderError> {
    let loaded = load_one(files, hints)?;
    let used: Vec<String> =
        loaded.images.iter().filter(|map| map.role == role).map(|map| file(&map.path)).collect();
    assert_eq!(used.len(), 1, "{used:?}");
    Ok((used[0].clone(), loaded))
}

#[test]
fn two_normal_maps_are_told_apart_by_their_names() {
    let (up, down, flat) = (waves(Green::Up), waves(Green::Down), grey(0.5));
    let rough = ("w_rough.png", &flat);
    let plain = Hints::default();
    let pointing = |green| Hints { green: Some(green), ..Hints::default() };
    // Files, what is asked for, the file that is used, which way its green points, whether that is told.
    type Case<'a> = ([(&'a str, &'a Image); 2], Hints, &'a str, Green, bool);
    let cases: [Case; 8] = [
        ([("w_normal.png", &up), ("w_nrm.png", &up)], plain.clone(), "w_normal.png", Green::Up, false),
        ([("w_normal.png", &up), ("w_NormalGL.png", &up)], plain.clone(), "w_NormalGL.png", Green::Up, false),
        (
            [("w_NormalDX.png", &down), ("w_NormalGL.png", &up)],
            plain.clone(),
            "w_NormalGL.png",
            Green::Up,
            false,
        ),
        (
            [("w_NormalDX.png", &down), ("w_NormalGL.png", &up)],
            pointing(Green::Down),
            "w_NormalDX.png",
            Green::Down,
            false,
        ),
        // The names have it the wrong way round.
        (
            [("w_NormalDX.png", &up), ("w_NormalGL.png", &down)],
            plain.clone(),
            "w_NormalDX.png",
            Green::Up,
            true,
        ),
        (
            [("w_NormalDX.png", &up), ("w_NormalGL.png", &down)],
            pointing(Green::Down),
            "w_NormalGL.png",
            Green::Down,
            true,
        ),
        // One file under both names.
        (
            [("w_NormalDX.png", &down), ("w_NormalGL.png", &down)],
            plain.clone(),
            "w_NormalGL.png",
            Green::Down,
            true,
        ),
        ([("w_normal.png", &down), ("w_nrm.png", &up)], plain.clone(), "w_nrm.png", Green::Up, true),
    ];
    for (i, (files, hints, wanted, green, told)) in cases.into_iter().enumerate() {
        let (used, loaded) = load_twins(&[files[0], files[1], rough], &hints, Role::Normal)
            .unwrap_or_else(|e| panic!("case {i}: {e}"));
        let y_down = loaded.surface.unwrap().normal.y_down;
        assert_eq!((used.as_str(), y_down), (wanted, green == Green::Down), "case {i}: {:?}", loaded.notes);
        assert_eq!(
            loaded.notes.iter().any(|note| note.contains("by its slopes")),
            told,
            "case {i}: {:?}",
            loaded.notes
        );
    }
    let other = image(64, Channels::Rgb, |u, _| {
        let x = 0.4 * (TAU * 3.0 * u).sin();
        [0.5 + 0.5 * x, 0.5, 0.5 + 0.5 * (1.0 - x * x).sqrt(), 1.0]
    });
    let small = image(32, Channels::Rgb, |_, _| [0.5, 0.5, 1.0, 1.0]);
    for differs in [&other, &small] {
        let error = load_twins(&[("w_normal.png", &up), ("w_nrm.png", differs), rough], &plain, Role::Normal);
        let error = error.unwrap_err().to_string();
        for part in ["several normal maps, and their texels differ", "--map normal=w_nrm.png", "--ignore"] {
            assert!(error.contains(part), "wanted \"{part}\" in: {error}");
        }
    }
}

/// The means of so many by so many texels.
fn reduced(image: &Image, by: u32) -> Image {
    let (width, height) = (image.width / by, image.height / by);
    let mean = |x: u32, y: u32, c: usize| {
        let texels = (0..by * by).map(|i| image.texel(x * by + i % by, y * by + i / by)[c]);
        (texels.sum::<f32>() / (by * by) as f32 * 255.0).round() as u8
    };
    let texel = |i: u32| [0, 1, 2].map(|c| mean(i % width, i / width, c));
    let samples: Vec<u8> = (0..width * height).flat_map(texel).collect();
    Image::new(width, height, Channels::Rgb, Pixels::U8(samples)).unwrap()
}

/// One texture downloaded in two sizes.
#[test]
fn maps_of_two_sizes_are_said_to_differ_in_their_texels() {
    let (up, down, rough) = (waves(Green::Up), waves(Green::Down), grey(0.5));
    let other = image(64, Channels::Rgb, |u, _| {
        let x = 0.6 * (TAU * 3.0 * u).sin();
        [x * 0.5 + 0.5, 0.5, (1.0 - x * x).sqrt() * 0.5 + 0.5, 1.0]
    });
    for by in [2, 4] {
        let small = reduced(&up, by);
        let cases: [([(&str, &Image); 2], &str); 3] = [
            ([("w_1K_normal.png", &small), ("w_2K_normal.png", &up)], "w_2K_normal.png"),
            ([("w_2K_normal.png", &up), ("w_NormalGL.png", &small)], "w_2K_normal.png"),
            ([("w_NormalDX.png", &down), ("w_NormalGL.png", &small)], "w_NormalDX.png"),
        ];
        for (files, wanted) in cases {
            let files = [files[0], files[1], ("w_rough.png", &rough)];
            let (used, loaded) = load_twins(&files, &Hints::default(), Role::Normal)
                .unwrap_or_else(|e| panic!("{wanted}, {by} times smaller: {e}"));
            assert_eq!(used, wanted, "{by} times smaller");
            assert!(loaded.notes.is_empty(), "{wanted}: {:?}", loaded.notes);
        }
        // What differs does so at any size.
        let files = [("w_1K_normal.png", &small), ("w_2K_normal.png", &other), ("w_rough.png", &rough)];
        let error = load_one(&files, &Hints::default()).unwrap_err().to_string();
        assert!(error.contains("their texels differ"), "{error}");
    }
    let odd = image(20, Channels::R, |u, _| [u; 4]);
    for (role, first, second) in [("normal", &up, &reduced(&up, 3)), ("rough", &rough, &odd)] {
        let names = [format!("w_1K_{role}.png"), format!("w_2K_{role}.png")];
        let files = [(names[0].as_str(), first), (names[1].as_str(), second), ("w_color.png", &up)];
        let error = load_one(&files, &Hints::default()).unwrap_err().to_string();
        let (large, small) = (first.width.max(second.width), first.width.min(second.width));
        let sizes = format!("of {large}x{large} and {small}x{small} texels");
        assert!(error.contains(&sizes) && !error.contains("texels differ"), "wanted {sizes} in: {error}");
    }
}

/// Red, green and blue as JPEG with halved colour keeps them: of every four texels one mean of both colour differences.
fn colour_halved(image: &Image, side: u32, over: bool) -> Image {
    let texel = |x: u32, y: u32| {
        let [r, g, b, _] = image.texel(x, y);
        [r, if over { 1.0 - g } else { g }, b]
    };
    let luma = |[r, g, b]: [f32; 3]| 0.299 * r + 0.587 * g + 0.114 * b;
    let mut samples = Vec::new();
    for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| texel(x / 2 * 2 + i, y / 2 * 2 + j));
        let mean = |c: usize| four.iter().map(|t| t[c] - luma(*t)).sum::<f32>() / 4.0;
        let (own, blue, red) = (luma(texel(x, y)), mean(2), mean(0));
        let green = own - (0.114 * blue + 0.299 * red) / 0.587;
        samples.extend([own + red, green, own + blue].map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8));
    }
    Image::new(side, side, Channels::Rgb, Pixels::U8(samples)).unwrap()
}

#[test]
fn sample_assets_saved_as_jpeg_are_not_known_again() {
    let Some(assets) = sample_assets() else { return };
    let mut tried = 0;
    for folder in material_folders(&assets) {
        let Ok(image) = read_image(&folder.join("normal.png")) else { continue };
        let side = image.width.min(image.height).min(512) / 2 * 2;
        let [up, down] = [false, true].map(|over| colour_halved(&image, side, over));
        let dir = painted(&[("w_NormalGL.png", &up), ("w_NormalDX.png", &down)]);
        let material = scan(dir.path(), &Hints::default()).unwrap().materials.remove(0);
        material.compare_twins().unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        tried += 1;
    }
    assert!(tried > 30, "only {tried} normal maps");
}

#[test]
fn gloss_beside_roughness_is_asked_about_though_it_says_the_same() {
    let wave = |gain: f32, over: bool| {
        image(64, Channels::R, move |u, v| {
            let value = 0.5 + gain * (TAU * (3.0 * u + v)).sin();
            [if over { 1.0 - value } else { value }; 4]
        })
    };
    let (rough, gloss, other) = (wave(0.3, false), wave(0.3, true), wave(0.2, true));
    let normal = waves(Green::Up);
    let files = |gloss| [("w_normal.png", &normal), ("w_rough.png", &rough), ("w_gloss.png", gloss)];
    let (used, _) = load_twins(&files(&gloss), &Hints::default(), Role::Roughness).unwrap();
    assert_eq!(used, "w_rough.png");
    let error = load_one(&files(&other), &Hints::default()).unwrap_err().to_string();
    for part in
        ["both roughness and gloss", "opposite", "--map gloss=w_gloss.png", "--map roughness=w_rough.png"]
    {
        assert!(error.contains(part), "wanted \"{part}\" in: {error}");
    }
    // A flag settles it without a look.
    let (used, _) = load_twins(&files(&other), &maps(&[(Role::Gloss, "w_gloss.png")]), Role::Gloss).unwrap();
    assert_eq!(used, "w_gloss.png");
    // Two of the same role, of which one has sixteen bits by its name.
    let files = [("w_rough.png", &rough), ("w_rough16.png", &rough), ("w_normal.png", &normal)];
    assert_eq!(load_twins(&files, &Hints::default(), Role::Roughness).unwrap().0, "w_rough16.png");
    let files = [("w_rough.png", &rough), ("w_roughness.png", &other), ("w_normal.png", &normal)];
    let error = load_one(&files, &Hints::default()).unwrap_err().to_string();
    assert!(error.contains("several files for one map"), "{error}");
}

#[test]
fn specular_colour_with_gloss_in_alpha_is_gloss() {
    let rgba = image(8, Channels::Rgba, |_, _| [0.2, 0.5, 0.1, 0.7]);
    let loaded = load_one(&[("x_SpecularSmoothness.png", &rgba)], &Hints::default()).unwrap();
    assert_near(first_texel(&loaded), 0.09, 0.09, Vec2::X, "specular smoothness");
    let rough_ao = image(8, Channels::Rgb, |_, _| [0.9, 0.4, 0.0, 1.0]);
    let loaded = load_one(&[("x_rough_ao.png", &rough_ao)], &Hints::default()).unwrap();
    assert_near(first_texel(&loaded), 0.16, 0.16, Vec2::X, "green of rough_ao");
    assert!(
        loaded.notes.iter().any(|note| note.contains("--map roughness=x_rough_ao.png")),
        "{:?}",
        loaded.notes
    );
}

// Questions

#[test]
fn what_can_be_read_in_two_ways_is_asked_by_a_flag_that_then_settles_it() {
    struct Case {
        names: &'static [&'static str],
        says: &'static [&'static str],
        settled: Hints,
    }
    let cases = [
        Case {
            names: &["w_normal.png", "w_spec.png"],
            says: &["_spec can mean gloss", "--map gloss=w_spec.png", "--roughness VALUE"],
            settled: maps(&[(Role::Gloss, "w_spec.png")]),
        },
        Case {
            names: &["w_normal.png", "w_spec.png"],
            says: &["_spec can mean gloss"],
            settled: Hints { roughness: Some(0.3), ..Hints::default() },
        },
        Case {
            names: &["w_glossU.png", "w_normal.png"],
            says: &["gloss-u map but no gloss-v", "--map gloss-v=FILE", "--map gloss=FILE"],
            settled: maps(&[(Role::Gloss, "w_glossU.png")]),
        },
        Case {
            names: &["w_glossU.png", "w_glossV.png", "w_roughness.png"],
            says: &["roughness is given twice"],
            settled: Hints { ignore: vec!["w_roughness.png".into()], ..Hints::default() },
        },
        Case {
            names: &["w_aniso.png", "w_anisotropy.png", "w_roughness.png"],
            says: &["several maps say how the highlight is stretched", "--map aniso=w_aniso.png"],
            settled: maps(&[(Role::Anisotropy, "w_anisotropy.png")]),
        },
        Case {
            names: &["w_flow.png", "w_normal.png"],
            says: &["nothing says how strong", "--anisotropy", "--ignore w_flow.png"],
            settled: Hints { anisotropy: Some(0.5), ..Hints::default() },
        },
        Case {
            names: &["w_orm.png", "w_metallicRoughness.png"],
            says: &["several packed maps"],
            settled: maps(&[(Role::Orm, "w_orm.png")]),
        },
        Case {
            names: &["w_flow.png", "w_anisotropyangle.png", "w_anisotropylevel.png"],
            says: &["two direction maps"],
            settled: maps(&[(Role::Direction, "w_flow.png")]),
        },
    ];
    for case in cases {
        let error = refused(case.names, &Hints::default());
        for says in case.says {
            assert!(error.contains(says), "{:?}: wanted \"{says}\" in: {error}", case.names);
        }
        assert!(error.starts_with("material \"w\""), "{error}");
        only(case.names, &case.settled);
    }
}

#[test]
fn gl_and_dx_together_give_gl_unless_asked() {
    let names = ["m_NormalDX.png", "m_NormalGL.png", "m_Roughness.png"];
    let up = scanned(&names, &Hints::default()).unwrap();
    assert_eq!(file(&up.materials[0].normal.as_ref().unwrap().file), "m_NormalGL.png");
    assert!(up.table().contains("not used: the same normals as m_NormalGL.png"), "{}", up.table());
    let down = only(&names, &Hints { green: Some(Green::Down), ..Hints::default() });
    let normal = down.normal.unwrap();
    assert_eq!((file(&normal.file).as_str(), normal.green), ("m_NormalDX.png", Green::Down));
}

#[test]
fn flags_that_cannot_be_are_named() {
    let names = ["brick_normal.png", "stone_normal.png", "thing.png"];
    let cases = [
        (maps(&[(Role::Roughness, "gone.png")]), "--map roughness=gone.png: no such file"),
        (maps(&[(Role::Roughness, "thing.png")]), "which of the materials brick, stone"),
        (
            maps(&[(Role::Roughness, "brick_normal.png"), (Role::Gloss, "brick_normal.png")]),
            "another --map names this file",
        ),
        (Hints { ignore: vec!["gone.png".into()], ..Hints::default() }, "--ignore gone.png"),
        (Hints { roughness: Some(f32::NAN), ..Hints::default() }, "--roughness NaN: give 0 to 1"),
        (Hints { anisotropy: Some(2.0), ..Hints::default() }, "--anisotropy 2: give 0 to 1"),
        (Hints { direction_span: Some(-1.0), ..Hints::default() }, "--direction-span"),
        (Hints { direction_span: Some(f32::INFINITY), ..Hints::default() }, "--direction-span"),
    ];
    for (hints, wanted) in cases {
        let error = refused(&names, &hints);
        assert!(error.contains(wanted), "wanted \"{wanted}\" in: {error}");
    }
}

#[test]
fn a_named_file_joins_the_material_whose_name_it_begins_with() {
    let names = ["brick_normal.png", "brick_wall_normal.png", "brick_wall_thing.png"];
    let folder = scanned(&names, &maps(&[(Role::Gloss, "brick_wall_thing.png")])).unwrap();
    let wall = folder.materials.iter().find(|m| m.name == "brick_wall").unwrap();
    assert_eq!(wall.files.len(), 2, "{}", folder.table());
}

// What folders may hold

#[test]
fn folders_without_maps_say_what_was_looked_for_and_what_is_there() {
    let error = refused(&["holiday.png", "readme.txt", "rock_height.png"], &Hints::default());
    for wanted in ["no maps found", "_normal", "--map ROLE=FILE", "holiday.png, readme.txt, rock_height.png"]
    {
        assert!(error.contains(wanted), "wanted \"{wanted}\" in: {error}");
    }
    assert!(refused(&[], &Hints::default()).contains("saw no files"));
}

#[test]
fn missing_folders_and_files_in_their_place_are_named() {
    let dir = folder_of(&["a.png"]);
    let gone = dir.path().join("gone");
    let error = scan(&gone, &Hints::default()).unwrap_err().to_string();
    assert!(error.contains("gone") && error.contains("there is no such file or folder"), "{error}");
    let error = scan(&dir.path().join("a.png"), &Hints::default()).unwrap_err().to_string();
    assert!(error.contains("a.png") && error.contains("not a folder"), "{error}");
}

#[test]
fn damaged_and_vanished_files_are_named() {
    let dir = folder_of(&["a_normal.png", "a_rough.png"]);
    let folder = scan(dir.path(), &Hints::default()).unwrap();
    let error = folder.materials[0].load().unwrap_err().to_string();
    assert!(error.contains("a_normal.png") && error.contains("empty"), "{error}");
    fs::remove_file(dir.path().join("a_normal.png")).unwrap();
    let error = folder.materials[0].load().unwrap_err().to_string();
    assert!(error.contains("a_normal.png") && error.contains("there is no such file or folder"), "{error}");
}

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_read_shown_and_serialized() {
    use std::os::unix::ffi::OsStrExt;
    let dir = folder_of(&[]);
    for name in [&b"br\xffck_normal.png"[..], b"br\xffck_rough.png", b"br\xffck_\x1b[2J.png"] {
        fs::write(dir.path().join(std::ffi::OsStr::from_bytes(name)), b"").unwrap();
    }
    let folder = scan(dir.path(), &Hints::default()).unwrap();
    assert_eq!(folder.materials.len(), 1);
    assert!(!folder.table().contains('\x1b'), "{:?}", folder.table());
    let json = serde_json::to_string(&folder).unwrap();
    assert!(json.contains("br\u{fffd}ck_normal.png"), "{json}");
}

#[test]
fn the_table_is_aligned_and_the_json_has_no_paths() {
    let dir = folder_of(&["Stoff_Ölig_normal.png", "Stoff_Ölig_ARM_2k.png", "photo.jpg"]);
    let folder = scan(dir.path(), &Hints::default()).unwrap();
    let wanted = "\
material    file                   role    channels                              notes
Stoff_Ölig  Stoff_Ölig_ARM_2k.png  orm     R occlusion, G roughness, B metallic
Stoff_Ölig  Stoff_Ölig_normal.png  normal  RG normal                             assumed +Y
            photo.jpg              -       -                                     not recognised, not used
";
    assert_eq!(folder.table(), wanted);
    let json = serde_json::to_string(&folder).unwrap();
    assert!(!json.contains(dir.path().to_str().unwrap()), "{json}");
    assert!(json.contains(r#""role":"orm""#), "{json}");
}

// Texels

#[test]
fn the_curl_tells_green_up_from_green_down() {
    for (green, guess) in [(Green::Up, GreenGuess::Up), (Green::Down, GreenGuess::Down)] {
        let image = waves(green);
        let got = green_correlation(&image);
        assert_eq!(guess_green(&image), guess, "correlation {got}");
        assert!(got.abs() > 0.9, "a gradient's correlation should be near 1, got {got}");
    }
}

#[test]
fn flat_and_tiny_maps_do_not_tell_green() {
    for side in [1, 2, 3, 16] {
        let image = image(side, Channels::Rgb, |_, _| [0.5, 0.5, 1.0, 1.0]);
        assert_eq!(
            (green_correlation(&image), guess_green(&image)),
            (0.0, GreenGuess::Unsure),
            "side {side}"
        );
    }
}

#[test]
fn an_unlabelled_map_that_looks_like_directx_is_asked_about_a_labelled_one_only_noted() {
    let (up, down) = (waves(Green::Up), waves(Green::Down));
    let plain = Hints { roughness: Some(0.5), ..Hints::default() };
    let error = load_one(&[("x_normal.png", &down)], &plain).unwrap_err().to_string();
    for wanted in ["x_normal.png", "--y-down", "--y-up"] {
        assert!(error.contains(wanted), "{error}");
    }
    for green in [Green::Up, Green::Down] {
        let flag = Hints { green: Some(green), ..plain.clone() };
        let loaded = load_one(&[("x_normal.png", &down)], &flag).unwrap();
        assert_eq!(loaded.surface.unwrap().normal.y_down, green == Green::Down);
        assert_eq!(loaded.notes.len(), usize::from(green == Green::Up), "{:?}", loaded.notes);
    }
    let loaded = load_one(&[("x_NormalGL.png", &down)], &plain).unwrap();
    assert!(!loaded.surface.unwrap().normal.y_down);
    assert!(loaded.notes[0].contains("though its slopes look like -Y"), "{:?}", loaded.notes);
    let loaded = load_one(&[("x_normal.png", &up)], &plain).unwrap();
    assert!(!loaded.notes.iter().any(|note| note.contains("+Y")), "nothing is open: {:?}", loaded.notes);
}

#[test]
fn colors_in_the_place_of_normals_are_refused_unless_forced() {
    let brown = image(16, Channels::Rgb, |u, v| [0.5 + 0.2 * u, 0.35, 0.2 + 0.1 * v, 1.0]);
    let pale = image(16, Channels::Rgb, |_, v| [0.82, 0.78 + 0.02 * v, 0.71, 1.0]);
    for (what, wrong) in [("brown", &brown), ("pale", &pale), ("grey", &grey(0.8))] {
        let error = load_one(&[("x_normal.png", wrong)], &Hints::default()).unwrap_err().to_string();
        for wanted in
            ["x_normal.png", "not a tangent-space normal map", "--force-normal", "--map normal=FILE"]
        {
            assert!(error.contains(wanted), "{what}: {error}");
        }
        let forced = Hints { force_normal: true, ..Hints::default() };
        load_one(&[("x_normal.png", wrong)], &forced).unwrap_or_else(|e| panic!("{what}: {e}"));
    }
}

#[test]
fn float_maps_with_negative_components_are_normals_too() {
    let eight = waves(Green::Up);
    let Pixels::U16(samples) = &eight.pixels else { unreachable!() };
    let signed = samples.iter().map(|&s| f32::from(s) / 65535.0 * 2.0 - 1.0).collect();
    let image = Image::new(64, 64, Channels::Rgb, Pixels::F32(signed)).unwrap();
    assert!((green_correlation(&image) - green_correlation(&eight)).abs() < 1e-4);
    let dir = tempfile::tempdir().unwrap();
    kinran_image::write_exr(&dir.path().join("x_nor_gl.exr"), &image).unwrap();
    let hints = Hints { roughness: Some(0.5), ..Hints::default() };
    let loaded = scan(dir.path(), &hints).unwrap().materials[0].load().unwrap();
    assert!(loaded.surface.unwrap().normal.signed);
    assert_eq!(loaded.notes, [""; 0]);
}

/// A TIFF of one RGB texel of floats, by hand.
fn float_tiff(rgb: [f32; 3]) -> Vec<u8> {
    // Bits and sample format are lists of three shorts after the directory.
    let entries: [(u16, u16, u32, u32); 11] = [
        (256, 3, 1, 1),
        (257, 3, 1, 1),
        (258, 3, 3, 158),
        (259, 3, 1, 1),
        (262, 3, 1, 2),
        (273, 4, 1, 146),
        (277, 3, 1, 3),
        (278, 3, 1, 1),
        (279, 4, 1, 12),
        (284, 3, 1, 1),
        (339, 3, 3, 164),
    ];
    let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
    bytes.extend((entries.len() as u16).to_le_bytes());
    for (tag, kind, count, value) in entries {
        bytes.extend(tag.to_le_bytes());
        bytes.extend(kind.to_le_bytes());
        bytes.extend(count.to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes.resize(146, 0);
    bytes.extend(rgb.iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend([32_u16, 32, 32, 3, 3, 3].iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// Half the light is code 188: 1.055 * 0.5^(1 / 2.4) - 0.055 = 0.7354. An eighth is 99. A colour of 0.5 as it is would be 128.
#[test]
fn linear_colour_is_taken_as_srgb() {
    use kinran_bake::aniso::Kernel;
    use kinran_bake::bake_plain;
    use kinran_image::{Encoding, Format, Role, Transfer, untold, write_exr};
    let rgb = [0.5, 0.125, 1.0];
    let dir = tempfile::tempdir().unwrap();
    let floats = Image::new(1, 1, Channels::Rgb, Pixels::F32(rgb.to_vec())).unwrap();
    let eight = Image::new(1, 1, Channels::Rgb, Pixels::U8(vec![188, 99, 255])).unwrap();
    write_exr(&dir.path().join("a_color.exr"), &floats).unwrap();
    write_png(&dir.path().join("b_color.png"), &eight).unwrap();
    fs::write(dir.path().join("c_color.tif"), float_tiff(rgb)).unwrap();
    // Mantissas of 1/128: 64, 16 and 128.
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x40\x10\x80\x81";
    fs::write(dir.path().join("d_color.hdr"), hdr).unwrap();
    let baked = |hints: &Hints| -> Vec<(String, [u8; 3], String)> {
        let folder = scan(dir.path(), hints).unwrap();
        let materials = folder.materials.iter().map(|material| material.load().unwrap());
        let texel = |material: LoadedMaterial| {
            let map = &material.images[0];
            let encoding = Encoding { format: Format::Rgba8, ..Role::Color.encoding() };
            let texture =
                bake_plain(&map.image, Transfer::Srgb, encoding, Kernel::Box, hints.wrap, &untold).unwrap();
            let data = &texture.levels[0].data;
            (material.name, [data[0], data[1], data[2]], map.remarks.join("; "))
        };
        materials.map(texel).collect()
    };
    for (name, got, remarks) in baked(&Hints::default()) {
        assert_eq!(got, [188, 99, 255], "{name}");
        // A PNG is sRGB as ever, and nothing is said of it.
        assert!(
            if name == "b" { remarks.is_empty() } else { remarks.contains("linear") },
            "{name}: {remarks}"
        );
    }
    let srgb = Hints { color_space: Some(Transfer::Srgb), ..Hints::default() };
    for (name, got, remarks) in baked(&srgb) {
        // 0.5 lies between two codes.
        let wanted = if name == "b" { [188, 99, 255] } else { [128, 32, 255] };
        let near = got[0].abs_diff(wanted[0]) <= 1 && got[1..] == wanted[1..];
        assert!(near, "{name}, by flag: wanted {wanted:?}, got {got:?}");
        assert_eq!(remarks, "sRGB, by --color-space", "{name}");
    }
    let linear = Hints { color_space: Some(Transfer::Linear), ..Hints::default() };
    // Code 188 taken as light is 0.737, whose code is 222: 1.055 * 0.737^(1 / 2.4) - 0.055 = 0.8741, times 255 is 222.9.
    assert_eq!(baked(&linear)[1].1[0], 223, "a PNG of light, by flag");
}

#[test]
fn layers_of_an_exr_file_are_named_by_the_flag_or_told() {
    use kinran_image::write_exr_planes;
    let dir = tempfile::tempdir().unwrap();
    let half = |v: f32| vec![v; 4];
    let planes = vec![
        ("View.Combined.R", half(1.0)),
        ("View.Combined.G", half(0.0)),
        ("View.Combined.B", half(0.0)),
        ("View.Normal.X", half(0.5)),
        ("View.Normal.Y", half(0.5)),
        ("View.Normal.Z", half(1.0)),
    ];
    write_exr_planes(&dir.path().join("x_normal.exr"), (2, 2), planes).unwrap();
    let hints = Hints { roughness: Some(0.5), ..Hints::default() };
    let material = |hints: &Hints| scan(dir.path(), hints).unwrap().materials.remove(0);
    let error = material(&hints).load().unwrap_err().to_string();
    for part in ["x_normal.exr", "View.Combined, View.Normal", "--exr-layer"] {
        assert!(error.contains(part), "no {part} in {error}");
    }
    let layers = vec![("x_normal.exr".into(), "View.Normal".into())];
    let loaded = material(&Hints { layers, ..hints.clone() }).load().unwrap();
    assert_eq!(loaded.images[0].image.texel(1, 1), [0.5, 0.5, 1.0, 1.0]);
    let remark = "layer \"View.Normal\"; X, Y, Z as red, green, blue; left out: View.Combined";
    assert_eq!(loaded.images[0].remarks, [remark]);
    let layers = vec![("y.exr".into(), "View.Normal".into())];
    let error = scan(dir.path(), &Hints { layers, ..hints }).unwrap_err().to_string();
    assert!(error.contains("--exr-layer y.exr=View.Normal") && error.contains("no map"), "{error}");
}

#[test]
fn files_of_a_kind_that_is_read_are_found_whatever_their_extension() {
    for extension in kinran_image::IMAGE_EXTENSIONS {
        let names = [
            format!("x_normal.{extension}"),
            format!("x_2k_{extension}_roughness.{}", extension.to_uppercase()),
        ];
        let material = only(&[&names[0], &names[1]], &Hints::default());
        assert_eq!(material.name, "x", "{names:?}");
        assert!(material.normal.is_some() && !material.files.is_empty(), "{names:?}");
        let base = BaseRoughness::Constant(ASSUMED_ROUGHNESS);
        assert_ne!(material.roughness, Some(RoughnessSource::Isotropic(base)), "{names:?}");
    }
}

/// A BC5 map has no blue; z comes from x and y.
#[test]
fn normals_in_engine_textures_are_read() {
    use kinran_image::{Encoding, Format, Level, Role, Texture, Transfer, encode, write_texture};
    let image = waves(Green::Up);
    let mut bytes = Vec::new();
    for y in 0..64 {
        bytes.extend((0..64).flat_map(|x| image.texel(x, y).map(|v| (v * 255.0).round() as u8)));
    }
    for (name, format) in
        [("x_normal.ktx2", Format::Bc5), ("x_normal.dds", Format::Bc5), ("x_normal.dds", Format::Rgba8)]
    {
        let data = encode(Encoding { format, ..Role::Normal.encoding() }, &bytes, 64, 64).unwrap();
        let levels = vec![Level { width: 64, height: 64, data }];
        let texture = Texture { format, transfer: Transfer::Linear, levels, metadata: Default::default() };
        let dir = tempfile::tempdir().unwrap();
        write_texture(&dir.path().join(name), &texture, None).unwrap();
        let hints = Hints { roughness: Some(0.5), ..Hints::default() };
        let loaded = scan(dir.path(), &hints).unwrap().materials[0].load().unwrap();
        assert_eq!(loaded.notes, [""; 0], "{name} {format:?}");
        let read = &loaded.images[0].image;
        for (x, y) in [(3, 5), (17, 40), (63, 63)] {
            let (wanted, got) = (image.texel(x, y), read.texel(x, y));
            for c in 0..3 {
                // Blocks of BC5 are good to two steps of a smooth map.
                let error = (wanted[c] - got[c]).abs() * 255.0;
                assert!(error < 3.0, "{name} {format:?} ({x}, {y}): wanted {wanted:?}, got {got:?}");
            }
        }
    }
}

/// A float map as EXR, grey or of three or four channels.
fn exr(path: &Path, side: u32, planes: &[(&str, Vec<f32>)]) {
    let planes = planes.iter().map(|(name, plane)| (*name, plane.clone())).collect();
    kinran_image::write_exr_planes(path, (side, side), planes).unwrap();
}

fn notes_of(dir: &Path, hints: &Hints) -> Vec<String> {
    let folder = scan(dir, hints).unwrap();
    assert_eq!(folder.materials.len(), 1, "{}", folder.table());
    folder.materials[0].load().unwrap().notes
}

#[test]
fn floats_outside_of_0_to_1_are_clamped_in_silence() {
    let flat = image(4, Channels::Rgb, |_, _| [0.5, 0.5, 1.0, 1.0]);
    // One texel of 16 above 1, one below 0.
    let off: Vec<f32> = (0..16).map(|i| [1.75, -0.25].get(i).copied().unwrap_or(0.5)).collect();
    // Half a step of 8 bits is rounding.
    let rounded: Vec<f32> = (0..16).map(|i| if i == 3 { 1.0015 } else { 0.5 }).collect();
    let grey = |plane: &Vec<f32>| vec![("Y", plane.clone())];
    let rgb = |plane: &Vec<f32>| vec![("B", plane.clone()), ("G", plane.clone()), ("R", plane.clone())];
    let half = vec![0.5; 16];
    let khr = |plane: &Vec<f32>| vec![("B", plane.clone()), ("G", half.clone()), ("R", vec![1.0; 16])];
    let rgba = |plane: &Vec<f32>| {
        vec![("A", plane.clone()), ("B", vec![0.0; 16]), ("G", vec![0.0; 16]), ("R", vec![0.0; 16])]
    };
    type Planes<'a> = &'a dyn Fn(&Vec<f32>) -> Vec<(&'static str, Vec<f32>)>;
    let cases: [(&str, &str, Planes, &[&str]); 9] = [
        ("x_roughness.exr", "roughness", &grey, &[]),
        ("x_gloss.exr", "gloss", &grey, &[]),
        ("x_ao.exr", "occlusion", &grey, &[]),
        ("x_metallic.exr", "metalness", &grey, &[]),
        ("x_gloss_u.exr", "gloss along", &grey, &["x_gloss_v.png"]),
        ("x_anisotropy_level.exr", "anisotropy level", &grey, &["x_roughness.png"]),
        ("x_anisotropy.exr", "anisotropy strength", &khr, &["x_roughness.png"]),
        ("x_orm.exr", "roughness", &rgb, &[]),
        ("x_color.exr", "colour", &rgba, &[]),
    ];
    for (file, what, planes, beside) in cases {
        let dir = painted(&[("x_normal_gl.png", &flat)]);
        for file in beside {
            write_png(&dir.path().join(file), &self::grey(0.5)).unwrap();
        }
        let hints = Hints { roughness: Some(0.5), ..Hints::default() };
        exr(&dir.path().join(file), 4, &planes(&off));
        let notes = notes_of(dir.path(), &hints);
        let wanted = format!(
            "{file}, its {what}: 12 % of its texels are outside of 0 to 1 (-0.25 to 1.75) and are clamped"
        );
        assert!(notes.contains(&wanted), "{file}: wanted {wanted:?} in {notes:#?}");
        assert_eq!(notes.iter().filter(|note| note.contains(what)).count(), 1, "{file}: {notes:#?}");
        exr(&dir.path().join(file), 4, &planes(&rounded));
        let notes = notes_of(dir.path(), &hints);
        assert!(!notes.iter().any(|note| note.contains("outside")), "{file}, rounded: {notes:#?}");
    }
}

#[test]
fn directions_of_negative_floats_are_read_as_if_from_0_to_1() {
    // Along −45°: (0.7, −0.7) is a vector of components, not (0.4, −2.4).
    let planes = |x: f32, y: f32| vec![("B", vec![1.0; 16]), ("G", vec![y; 16]), ("R", vec![x; 16])];
    for (file, beside) in
        [("x_flow.exr", &["x_gloss_u.png", "x_gloss_v.png"][..]), ("x_anisotropy.exr", &["x_roughness.png"])]
    {
        let texel = |planes: &[(&str, Vec<f32>)]| {
            let dir = tempfile::tempdir().unwrap();
            for (i, file) in beside.iter().enumerate() {
                write_png(&dir.path().join(file), &grey([0.2, 0.8][i])).unwrap();
            }
            exr(&dir.path().join(file), 4, planes);
            let loaded = scan(dir.path(), &Hints::default()).unwrap().materials[0].load().unwrap();
            (first_texel(&loaded), loaded.notes)
        };
        let (wanted, _) = texel(&planes(0.85, 0.15));
        let (got, notes) = texel(&planes(0.7, -0.7));
        for (g, w) in got.iter().zip(wanted) {
            assert!((g - w).abs() < 1e-5, "{file}: wanted {wanted:?}, got {got:?}");
        }
        assert!(wanted[1] < -1e-3, "{file}: {wanted:?} has no direction");
        assert!(notes.iter().any(|note| note.contains(file) && note.contains("-1 to 1")), "{notes:?}");
    }
}

#[test]
fn red_of_a_coloured_map_is_taken_for_its_number_in_silence() {
    let flat = image(4, Channels::Rgb, |_, _| [0.5, 0.5, 1.0, 1.0]);
    // Steps of 8 bits that channels of one texel are apart. JPEG leaves 7 of what was grey within 2.
    let apart = |steps: f32| {
        image(32, Channels::Rgb, move |u, v| {
            let grain = ((u * 32.0) as u32 * 7 + (v * 32.0) as u32 * 13) % 3;
            let c = |channel: u32| 0.5 + if channel == grain { steps / 255.0 } else { 0.0 };
            [c(0), c(1), c(2), 1.0]
        })
    };
    let (noise, colour) = (apart(7.0), apart(12.0));
    let few =
        image(32, Channels::Rgb, |u, v| if v < 0.03 && u < 0.3 { [1.0, 0.0, 0.0, 1.0] } else { [0.5; 4] });
    for (file, what) in [
        ("x_roughness.png", "roughness"),
        ("x_gloss.png", "gloss"),
        ("x_ao.png", "occlusion"),
        ("x_metallic.png", "metalness"),
    ] {
        let hints = Hints { roughness: Some(0.5), ..Hints::default() };
        let notes =
            |map: &Image| notes_of(painted(&[("x_normal_gl.png", &flat), (file, map)]).path(), &hints);
        let wanted = format!(
            "{file}: red, green and blue differ in 100 % of its texels, though a map of {what} is grey; red is taken"
        );
        let told = notes(&colour);
        assert!(told.iter().any(|note| note.starts_with(&wanted)), "wanted {wanted:?} in {told:#?}");
        for (kind, map) in [("noise", &noise), ("nine texels", &few)] {
            let told = notes(map);
            assert!(!told.iter().any(|note| note.contains("red is taken")), "{file}, {kind}: {told:#?}");
        }
    }
    // A packed map is not grey.
    let told =
        notes_of(painted(&[("x_normal_gl.png", &flat), ("x_orm.png", &colour)]).path(), &Hints::default());
    assert!(!told.iter().any(|note| note.contains("red is taken")), "{told:#?}");
}

/// CryEngine and others put gloss there.
#[test]
fn what_is_in_the_alpha_of_a_map_is_lost_in_silence() {
    let with_alpha =
        |alpha: f32| image(8, Channels::Rgba, move |u, _| [0.5, 0.5, 1.0, if u < 0.2 { alpha } else { 1.0 }]);
    for (file, beside, alpha, wanted) in [
        ("x_normal_gl.png", "x_roughness.png", 0.3, true),
        ("x_normal_gl.png", "x_roughness.png", 1.0, false),
        ("x_roughness.png", "x_ao.png", 0.3, true),
        ("x_orm.png", "x_height.png", 0.3, true),
        // There it is read.
        ("x_color.png", "x_roughness.png", 0.3, false),
        ("x_MetallicSmoothness.png", "x_ao.png", 0.3, false),
        ("x_MaskMap.png", "x_height.png", 0.3, false),
    ] {
        let loaded =
            load_one(&[(file, &with_alpha(alpha)), (beside, &grey(0.5))], &Hints::default()).unwrap();
        let map = loaded.images.iter().find(|map| self::file(&map.path) == file).unwrap();
        let told =
            map.remarks.iter().any(|remark| remark.contains("alpha is not 1 everywhere and is not read"));
        assert_eq!(told, wanted, "{file} with alpha {alpha}: {:?}", map.remarks);
    }
}

#[test]
fn normals_that_point_below_the_surface_are_turned_or_laid_on_it_in_silence() {
    let mut map = waves(Green::Up);
    let plain = notes_of(painted(&[("x_normal_gl.png", &map)]).path(), &Hints::default());
    assert!(!plain.iter().any(|note| note.contains("below")), "{plain:?}");
    let Pixels::U16(samples) = &mut map.pixels else { panic!("16 bits") };
    for texel in samples.chunks_exact_mut(3).step_by(400) {
        texel[2] = 65535 - texel[2];
    }
    for (normal_blue, end) in
        [(false, "so they are taken as pointing up"), (true, "they are laid on the surface")]
    {
        let hints = Hints { normal_blue, ..Hints::default() };
        let notes = notes_of(painted(&[("x_normal_gl.png", &map)]).path(), &hints);
        // 4096 texels, each 400th.
        let begin = "x_normal_gl.png: 11 vectors point below the surface, their blue is under 0.5 (0.27 % of the map)";
        let told = notes.iter().any(|note| note.starts_with(begin) && note.ends_with(end));
        assert!(told, "wanted {begin:?} … {end:?} in {notes:#?}");
    }
}

#[test]
fn gloss_is_one_minus_roughness() {
    for (name, hints) in [
        ("x_gloss.png", Hints::default()),
        ("x_rough.png", Hints { roughness_is_gloss: true, ..Hints::default() }),
    ] {
        let loaded = load_one(&[(name, &grey(0.4))], &hints).unwrap();
        assert_near(first_texel(&loaded), 0.36, 0.36, Vec2::X, name);
    }
    let loaded = load_one(&[("x_rough.png", &grey(0.4))], &Hints::default()).unwrap();
    assert_near(first_texel(&loaded), 0.16, 0.16, Vec2::X, "roughness");
}

#[test]
fn alpha_channels_of_unity_maps_are_gloss_and_missing_ones_are_refused() {
    let rgba = image(8, Channels::Rgba, |_, _| [0.0, 0.5, 0.0, 0.7]);
    let loaded =
        load_one(&[("x_MaskMap.png", &rgba), ("x_normal.png", &waves(Green::Up))], &Hints::default());
    assert_near(first_texel_flat(&loaded.unwrap()), 0.09, 0.09, Vec2::X, "mask map");
    let grey_alpha = image(8, Channels::Rg, |_, _| [1.0, 0.7, 0.0, 0.0]);
    let loaded = load_one(&[("x_MetallicSmoothness.png", &grey_alpha)], &Hints::default()).unwrap();
    assert_near(first_texel(&loaded), 0.09, 0.09, Vec2::X, "grey and alpha");
    let rgb = image(8, Channels::Rgb, |_, _| [1.0, 0.7, 0.0, 0.0]);
    let error = load_one(&[("x_MetallicSmoothness.png", &rgb)], &Hints::default()).unwrap_err().to_string();
    assert!(error.contains("no alpha channel") && error.contains("x_MetallicSmoothness.png"), "{error}");
}

/// As [`first_texel`], with the surface's normals taken away.
fn first_texel_flat(material: &LoadedMaterial) -> [f32; 3] {
    let mut flat = material.clone();
    flat.surface.as_mut().unwrap().normal = kinran_bake::aniso::NormalMap::flat();
    first_texel(&flat)
}

#[test]
fn substance_levels_and_angles_become_alphas_along_the_angle() {
    // roughness 0.4: alpha 0.16; level 0.8: 0.16 + 0.4096. An eighth of a turn is 45 degrees.
    let files = [
        ("x_Roughness.png", &grey(0.4)),
        ("x_Anisotropy_level.png", &image(4, Channels::R, |_, _| [0.8; 4])),
        ("x_Anisotropy_angle.png", &grey(0.125)),
    ];
    let loaded = load_one(&files, &Hints::default()).unwrap();
    let axis = vec2(0.5f32.sqrt(), 0.5f32.sqrt());
    assert_near(first_texel(&loaded), 0.16 + 0.4096, 0.16, axis, "full turn");
    let half = Hints { direction_span: Some(PI), ..Hints::default() };
    let loaded = load_one(&files, &half).unwrap();
    let axis = vec2((PI / 8.0).cos(), (PI / 8.0).sin());
    assert_near(first_texel(&loaded), 0.16 + 0.4096, 0.16, axis, "half turn by flag");
}

#[test]
fn gloss_along_and_across_with_a_direction_vector() {
    let up = image(8, Channels::Rgb, |_, _| [0.5, 1.0, 0.0, 1.0]);
    let files = [("x_GlossU.png", &grey(0.2)), ("x_GlossV.png", &grey(0.7)), ("x_flow.png", &up)];
    let loaded = load_one(&files, &Hints::default()).unwrap();
    assert_near(first_texel(&loaded), 0.64, 0.09, Vec2::Y, "u along +y");
}

#[test]
fn grey_directions_ask_for_their_span() {
    let files =
        [("x_GlossU.png", &grey(0.2)), ("x_GlossV.png", &grey(0.7)), ("x_direction.png", &grey(0.25))];
    let error = load_one(&files, &Hints::default()).unwrap_err().to_string();
    for wanted in ["x_direction.png", "--direction-span 360", "--direction-span 180"] {
        assert!(error.contains(wanted), "{error}");
    }
    let span = |span| Hints { direction_span: Some(span), ..Hints::default() };
    let loaded = load_one(&files, &span(TAU)).unwrap();
    assert_near(first_texel(&loaded), 0.64, 0.09, Vec2::Y, "a quarter of 360 degrees");
    let loaded = load_one(&files, &span(PI)).unwrap();
    assert_near(
        first_texel(&loaded),
        0.64,
        0.09,
        vec2(0.5f32.sqrt(), 0.5f32.sqrt()),
        "a quarter of 180 degrees",
    );
}

#[test]
fn gltf_anisotropy_works_with_roughness_and_with_gloss() {
    // Strength 0.5 along +y: alpha_t = 0.16 + 0.84 / 4.
    let khr = image(8, Channels::Rgb, |_, _| [0.5, 1.0, 0.5, 1.0]);
    for (name, base) in [("x_roughness.png", grey(0.4)), ("x_gloss.png", grey(0.6))] {
        let loaded = load_one(&[("x_anisotropy.png", &khr), (name, &base)], &Hints::default()).unwrap();
        assert_near(first_texel(&loaded), 0.16 + 0.84 * 0.25, 0.16, Vec2::Y, name);
    }
    let error =
        load_one(&[("x_anisotropy.png", &grey(0.5)), ("x_roughness.png", &grey(0.4))], &Hints::default());
    assert!(error.unwrap_err().to_string().contains("--map anisotropy-level=x_anisotropy.png"));
}

#[test]
fn a_strength_by_flag_stretches_a_constant_roughness() {
    let flow = image(8, Channels::Rgb, |_, _| [1.0, 0.5, 0.0, 1.0]);
    let hints = Hints { anisotropy: Some(0.5), roughness: Some(0.4), ..Hints::default() };
    let loaded = load_one(&[("x_flow.png", &flow)], &hints).unwrap();
    assert_near(first_texel(&loaded), 0.16 + 0.84 * 0.25, 0.16, Vec2::X, "constants");
}

#[test]
fn aniso_maps_pass_as_they_are() {
    let encoded = image(8, Channels::Rgb, |_, _| [0.8, 0.75, 0.2, 1.0]);
    let loaded = load_one(&[("x_aniso.png", &encoded)], &Hints::default()).unwrap();
    let got = first_texel(&loaded);
    let wanted = [0.64, 0.8 * 0.5 * 0.2, 0.04];
    assert!(got.iter().zip(wanted).all(|(g, w)| (g - w).abs() < 1e-4), "wanted {wanted:?} got {got:?}");
    let error = load_one(&[("x_aniso.png", &grey(0.5))], &Hints::default()).unwrap_err().to_string();
    assert!(error.contains("three different channels"), "{error}");
}

#[test]
fn color_alone_is_a_material_without_a_surface() {
    let color = image(4, Channels::Rgb, |u, v| [u, v, 0.3, 1.0]);
    let loaded = load_one(&[("x_albedo.png", &color)], &Hints::default()).unwrap();
    assert!(loaded.surface.is_none());
    assert_eq!((loaded.images.len(), loaded.images[0].role), (1, Role::Color));
}

#[test]
fn maps_of_different_sizes_are_taken() {
    let loaded = load_one(
        &[
            ("x_NormalGL.png", &waves(Green::Up)),
            ("x_arm.png", &{ image(16, Channels::Rgb, |_, _| [1.0, 0.4, 0.9, 1.0]) }),
        ],
        &Hints::default(),
    )
    .unwrap();
    let surface = loaded.surface.as_ref().unwrap();
    assert_eq!(surface.size(), (64, 64));
    let arm = loaded.images.iter().position(|l| l.role == Role::Orm).unwrap();
    assert_eq!((loaded.occlusion, loaded.metallic), (Some((arm, 0)), Some((arm, 2))));
    assert_near(first_texel_flat(&loaded), 0.16, 0.16, Vec2::X, "green of the packed map");
}

// Real files

fn material_folders(assets: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(assets.join("materials")).unwrap();
    let mut folders: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    folders
}

#[test]
fn sample_assets_are_not_understood() {
    let Some(assets) = sample_assets() else { return };
    let mut surfaces = 0;
    for folder in material_folders(&assets) {
        let has = |name: &str| folder.join(name).exists();
        if !has("albedo.png") && !has("normal.png") {
            continue;
        }
        // A direction without a strength is asked for.
        let strength = has("flow.png").then_some(0.6);
        if strength.is_some() {
            let error = scan(&folder, &Hints::default()).unwrap_err().to_string();
            assert!(error.contains("flow.png") && error.contains("--anisotropy"), "{error}");
        }
        let hints = Hints { anisotropy: strength, ..Hints::default() };
        let understood = scan(&folder, &hints).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        assert_eq!(understood.materials.len(), 1, "{}", understood.table());
        let unknown: Vec<_> = understood.rows.iter().filter(|r| r.role.is_none()).collect();
        assert!(unknown.is_empty(), "{}: {unknown:?}", folder.display());

        let material = understood.materials[0].load().unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        let surface = material.surface.as_ref();
        assert_eq!(surface.is_some(), has("normal.png") || has("roughness.png"), "{}", folder.display());
        assert_eq!(surface.is_some_and(|s| s.normal.image.is_some()), has("normal.png"));
        if let Some(surface) = surface {
            surfaces += 1;
            match &surface.roughness {
                RoughnessMaps::Gloss { direction: Some(DirectionMap::Vector(_)), .. } => {
                    assert!(has("flow.png"))
                }
                RoughnessMaps::Isotropic(map) => assert_eq!(map.image.is_some(), has("roughness.png")),
                other => panic!("{}: {other:?}", folder.display()),
            }
            let [xx, _, yy] = first_texel(&material);
            let least = ALPHA_MIN * ALPHA_MIN * 0.99;
            assert!(
                xx >= least && yy >= least && xx <= 1.001 && yy <= 1.001,
                "{}: {xx} {yy}",
                folder.display()
            );
        }
    }
    assert!(surfaces > 40, "only {surfaces} of the folders had a surface");
}

/// Whether the height map beside a normal map says green up: the sign of its correlation with ∂h/∂v, if that
/// with ∂h/∂x is positive, as bright means high.
fn green_by_height(normal: &Image, height: &Image) -> Green {
    assert_eq!((normal.width, normal.height), (height.width, height.height));
    let (mut along_x, mut along_v) = (0.0, 0.0);
    for y in 1..normal.height - 1 {
        for x in 1..normal.width - 1 {
            let n = normal.texel(x, y).map(|v| f64::from(v) * 2.0 - 1.0);
            let h = |x, y| f64::from(height.texel(x, y)[0]);
            along_x -= n[0] * (h(x + 1, y) - h(x - 1, y));
            along_v += n[1] * (h(x, y + 1) - h(x, y - 1));
        }
    }
    assert!(along_x > 0.0, "bright is low here: {along_x}");
    if along_v > 0.0 { Green::Up } else { Green::Down }
}

#[test]
fn the_curl_of_sample_assets_contradicts_height_maps_labels_and_formats() {
    let Some(assets) = sample_assets() else { return };
    let mut files: Vec<(PathBuf, Green)> = Vec::new();
    for folder in material_folders(&assets) {
        let (normal, height) = (folder.join("normal.png"), folder.join("height.png"));
        if normal.exists() && height.exists() {
            let green = green_by_height(&read_image(&normal).unwrap(), &read_image(&height).unwrap());
            files.push((normal, green));
        }
    }
    let with_height = files.len();

    // Green up by their names or, as textures of glTF files, by the format.
    let meshes = [
        "sheen_chair/SheenChairFabricNormal.jpg",
        "horse_statue_01/textures/horse_statue_01_nor_gl_1k.jpg",
        "sofa_03/textures/sofa_03_nor_gl_1k.jpg",
        "curtain/textures/curtain_normal.png",
        "lee_perry_smith/normal.jpg",
        "anisotropy_barn_lamp/AnisotropyBarnLamp_normalbump.png",
    ];
    let meshes = meshes.iter().map(|f| assets.join("meshes").join(f)).filter(|f| f.exists());
    files.extend(meshes.map(|f| (f, Green::Up)));

    let mut sure = 0;
    for (file, green) in &files {
        let image = read_image(file).unwrap();
        let (correlation, guess) = (green_correlation(&image), guess_green(&image));
        println!("{correlation:+.3} {green:?} {}", file.strip_prefix(&assets).unwrap().display());
        assert!(!guess.contradicts(*green), "{}: wanted {green:?} got {correlation}", file.display());
        sure += usize::from(correlation.abs() >= GREEN_CONFIDENCE);
    }
    println!("{with_height} with height maps, sure of {sure} of {}", files.len());
    assert!(with_height >= 16, "{with_height} height maps");
    assert!(sure * 4 >= files.len() * 3, "sure of {sure} of {}", files.len());
}

#[test]
fn sample_assets_of_another_kind_pass_for_normals() {
    let Some(assets) = sample_assets() else { return };
    let mut count = 0;
    for folder in material_folders(&assets) {
        let mut files: Vec<PathBuf> = fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
        files.sort();
        for wrong in
            files.iter().filter(|f| f.extension().is_some_and(|e| e == "png") && !f.ends_with("normal.png"))
        {
            let material = MaterialMaps {
                name: "wrong".into(),
                normal: Some(kinran_bake::folder::NormalSource {
                    file: wrong.clone(),
                    green: Green::Up,
                    green_source: GreenSource::Name,
                    force: false,
                    z: kinran_bake::aniso::NormalZ::Rebuilt,
                }),
                roughness: Some(RoughnessSource::Isotropic(BaseRoughness::Constant(0.5))),
                color: None,
                color_space: None,
                layers: Vec::new(),
                occlusion: None,
                metallic: None,
                files: vec![(Role::Normal, wrong.clone())],
                wrap: Hints::default().wrap,
                twins: Vec::new(),
                warnings: Vec::new(),
            };
            let error = material.load().map(|_| ()).expect_err(&wrong.display().to_string()).to_string();
            assert!(error.contains("--force-normal"), "{error}");
            count += 1;
        }
    }
    println!("{count} images refused as normal maps");
    assert!(count > 100, "only {count} images were tried");
}

// Anything

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_names_neither_panic_nor_get_lost(
        names in proptest::collection::btree_set(
            prop_oneof!["[^/\\x00]{1,24}", "(T_)?[a-cN_. -]{0,4}(normal|Gloss|U|Flow|ARM|rough|2K|_|GL|dx|spec|n|r){1,4}"],
            1..8,
        ),
    ) {
        let dir = tempfile::tempdir().unwrap();
        let mut visible = 0;
        for name in &names {
            let file = format!("{name}.png");
            if fs::write(dir.path().join(&file), b"").is_ok() && !file.starts_with('.') {
                visible += 1;
            }
        }
        match scan(dir.path(), &Hints::default()) {
            Ok(folder) => {
                let files = folder.rows.iter().filter(|r| r.file != "-").count();
                prop_assert_eq!(files, visible, "{}", folder.table());
                prop_assert_eq!(folder.table().lines().count(), folder.rows.len() + 1);
            }
            Err(e) => prop_assert!(!e.to_string().is_empty()),
        }
    }
}
