//! Any bytes are an OBJ whose mesh is sound, or an error. OBJ is read by path alone.

#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

use kinran_scene::Scene;
use libfuzzer_sys::fuzz_target;

static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("kinran_fuzz_{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("the temporary folder can be written");
    folder.join("fuzz.obj")
});

fuzz_target!(|bytes: &[u8]| {
    std::fs::write(&*FILE, bytes).expect("the temporary folder can be written");
    let Ok(scene) = Scene::load(&*FILE) else { return };
    for primitive in &scene.primitives {
        let count = primitive.positions.len();
        assert_eq!(primitive.normals.len(), count);
        assert!(primitive.positions.iter().all(|p| p.is_finite()));
        assert!(primitive.triangles.iter().flatten().all(|&vertex| (vertex as usize) < count));
    }
});
