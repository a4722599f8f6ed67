//! Any text is a manifest whose entries can be listed, or an error that names a place in it.

#![no_main]

use std::path::Path;

use kinran_bake::manifest::Manifest;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: String| {
    // A folder that does not exist: whatever the patterns say, nothing matches.
    let path = Path::new("/nonexistent/kinran.toml");
    match Manifest::parse(path, text) {
        Ok(manifest) => {
            let _ = manifest.input_folders();
            for job in manifest.jobs(&|_| false) {
                if let Err(error) = job {
                    assert!(error.to_string().contains("kinran.toml"), "{error}");
                }
            }
        }
        Err(error) => assert!(error.to_string().contains("kinran.toml"), "{error}"),
    }
});
