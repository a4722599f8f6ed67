#!/usr/bin/env bash
# Expected: of a multi-part OpenEXR file whose second part is deep, the first, an ordinary picture, can be read by a library
# that does not know deep data: parts stand by themselves, each with its own header and offsets.
# What happens: the crate `exr` refuses the whole file, "deep data not supported yet", while it reads the headers, whichever
# part is asked for; so do `image`, and with it Bevy and every tool that reads EXR in Rust. The same picture alone is read.
# Why care: compositing packages write beauty and deep into one file; a look at its beauty, a thumbnail or a map baked from it
# fails, and the message suggests that the picture itself is deep.
# Version: exr 1.74.2, image 0.25.10; the file by OpenEXR 3.5.3. Source: exr/src/meta, the check of headers.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check OpenEXR==3.5.3 numpy==2.3.5
venv/bin/python - <<'PY'
import numpy as np
import OpenEXR

side = 4
flat = OpenEXR.Part(
    {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION},
    {"RGB": np.full((side, side, 3), 0.5, np.float32)},
    "beauty",
)
samples = {name: np.empty((side, side), dtype=object) for name in ("Z", "A")}
for y in range(side):
    for x in range(side):
        samples["Z"][y, x] = np.array([1.0, 2.0], np.float32)
        samples["A"][y, x] = np.array([0.5, 0.5], np.float32)
deep = OpenEXR.Part({"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}, samples, "deep")
OpenEXR.File([flat]).write("flat.exr")
OpenEXR.File([flat, deep]).write("flat_and_deep.exr")
PY
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "deep"
version = "0.0.0"
edition = "2021"
[dependencies]
exr = "=1.74.2"
image = { version = "=0.25.10", default-features = false, features = ["exr"] }
TOML
cat > src/main.rs <<'RS'
fn main() {
    let by_image = |name: &str| image::open(name).map(|image| format!("{:?}", image.color()));
    let by_exr = |name: &str| exr::prelude::read_all_flat_layers_from_file(name).map(|image| image.layer_data.len());
    for name in ["flat.exr", "flat_and_deep.exr"] {
        println!("{name}: image {:?}, exr {:?} layers", by_image(name), by_exr(name));
    }
    assert_eq!(by_exr("flat.exr").unwrap(), 1);
    let refused = by_exr("flat_and_deep.exr").map(drop).expect_err("the flat part of a file with a deep one is read now");
    assert!(refused.to_string().contains("deep"), "{refused}");
    assert!(by_image("flat_and_deep.exr").is_err(), "image reads the flat part now");
}
RS
cargo run --quiet
