//! The forward pass with skin in it, as the compiler sees it; no device is needed.
#![cfg(feature = "gpu")]

use kinran_render::realtime::ShaderSource;

#[test]
fn the_forward_pass_compiles_with_skin() {
    let files = [
        "frame.wgsl",
        "fuzz.wgsl",
        "lighting.wgsl",
        "no_detail.wgsl",
        "surface.wgsl",
        "fuzz_surface.wgsl",
        "channels.wgsl",
        "skin.wgsl",
        "forward.wgsl",
    ];
    let text = ShaderSource::default().pass(&files).unwrap_or_else(|e| panic!("{e}"));
    assert!(text.contains("fn skin_punctual"), "the pass knows nothing of skin");
}
