#!/usr/bin/env bash
# Expected: a grey TIFF with alpha (Photoshop's and Pillow's "LA", two samples a pixel with ExtraSamples) opens as grey with
# alpha, as the same picture does from PNG, and as TIFFs of RGB with alpha do.
# What happens: the crate `image` refuses it: "does not support the color type `Unknown(16)`". tiff 0.11 gives such files as
# `ColorType::Multiband { bit_depth, num_samples: 2 }`, of which `image` knows nothing, though it has `ColorType::La8`; the
# message does not say that alpha is what is in the way.
# Why care: masks, opacity and roughness are saved so by painters and by scripts; every Rust engine and tool that reads by
# `image` loses them, and nobody can tell from the message that saving without alpha helps.
# Version: image 0.25.10 with tiff 0.11.3; the file by Pillow 12.0.0. Source: image/src/codecs/tiff.rs, tiff/src/decoder.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check pillow==12.0.0
venv/bin/python - <<'PY'
from PIL import Image

grey = Image.new("LA", (4, 4), (100, 128))
grey.save("grey_alpha.tif")
grey.save("grey_alpha.png")
Image.new("RGBA", (4, 4), (100, 90, 80, 128)).save("rgb_alpha.tif")
PY
mkdir src
cat > Cargo.toml <<'TOML'
[package]
name = "grey"
version = "0.0.0"
edition = "2021"
[dependencies]
image = { version = "=0.25.10", default-features = false, features = ["png", "tiff"] }
tiff = "=0.11.3"
TOML
cat > src/main.rs <<'RS'
fn main() {
    let open = |name: &str| match image::open(name) {
        Ok(image) => format!("{:?}", image.color()),
        Err(error) => error.to_string(),
    };
    let [png, rgb, grey] = ["grey_alpha.png", "rgb_alpha.tif", "grey_alpha.tif"].map(open);
    println!("grey_alpha.png: {png}\nrgb_alpha.tif: {rgb}\ngrey_alpha.tif: {grey}");
    let file = std::fs::File::open("grey_alpha.tif").unwrap();
    println!("tiff calls it {:?}", tiff::decoder::Decoder::new(file).unwrap().colortype());
    assert_eq!((png.as_str(), rgb.as_str()), ("La8", "Rgba8"));
    assert!(grey.contains("does not support the color type"), "grey with alpha is read now");
}
RS
cargo run --quiet
