//! Any bytes are a scene, a document, or an error.

#![no_main]

use std::path::Path;

use kinran_scene::{Document, Scene, Slot};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let nothing = |_: &str| Err(std::io::ErrorKind::NotFound.into());
    if let Ok(scene) = Scene::from_bytes(Path::new("fuzz.glb"), bytes, &nothing) {
        for primitive in &scene.primitives {
            let count = primitive.positions.len();
            assert_eq!(primitive.normals.len(), count);
            assert_eq!(primitive.tangents.len(), count);
            assert!(primitive.triangles.iter().flatten().all(|&vertex| (vertex as usize) < count));
            assert!(primitive.tangents.iter().all(|t| t.is_finite() && t.w.abs() == 1.0));
        }
        assert!(scene.instances.iter().all(|instance| instance.primitive < scene.primitives.len()));
        assert_eq!(scene.default_camera(1.5).is_some(), scene.triangle_count() > 0);
    }
    // A folder that does not exist: whatever the document names, nothing is read.
    if let Ok(document) = Document::from_bytes(Path::new("/nonexistent/fuzz.glb"), bytes) {
        for material in 0..document.material_count() {
            let _ = document.texture(material, Slot::Normal).map(|texture| document.texture_image(texture));
        }
        for image in 0..4 {
            let _ = document.image_bytes(image);
        }
    }
});
