//! Any JSON is a `KINRAN_materials_detail` that comes back from a document as it went in, or an error.

#![no_main]

use std::path::Path;

use kinran_image::{Channels, Image, Pixels, encode_png};
use kinran_scene::{DETAIL_EXTENSION, Scene};
use libfuzzer_sys::fuzz_target;
use serde_json::{Value, json};

fn load(extension: &Value) -> Result<Scene, kinran_scene::Error> {
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": [DETAIL_EXTENSION],
        "materials": [{ "extensions": { DETAIL_EXTENSION: extension } }],
        "textures": [{ "source": 0 }, { "source": 1 }],
        "images": [{ "uri": "a.png" }, { "uri": "b.png" }],
    });
    let image = Image::new(1, 1, Channels::Rgb, Pixels::U8(vec![128; 3])).expect("a sound image");
    let resolve = |_: &str| Ok(encode_png(&image).expect("a sound image"));
    Scene::from_bytes(Path::new("fuzz.gltf"), document.to_string().as_bytes(), &resolve)
}

fuzz_target!(|bytes: &[u8]| {
    let Ok(extension) = serde_json::from_slice(bytes) else { return };
    let Ok(scene) = load(&extension) else { return };
    let Some(detail) = &scene.materials[0].detail else { return };
    let mut material = serde_json::Map::new();
    detail.write(&mut material, |image| image);
    let again = load(&material["extensions"][DETAIL_EXTENSION]).expect("what is written can be read");
    let again = again.materials[0].detail.as_ref().expect("what is written is there");
    assert_eq!(again.layers, detail.layers);
    assert_eq!((again.channels, again.plain_overlay), (detail.channels, detail.plain_overlay));
    assert_eq!(again.aniso_alpha, detail.aniso_alpha);
});
