//! Tells the linker about the C++ runtime that Intel's prebuilt encoder may refer to.
//!
//! `intel_tex_2` ships one C++ object (its ASTC half, unused here) and names no runtime for it. Where the
//! compiler keeps all of that crate in one object, as in debug builds, the linker takes it in and misses
//! `__gxx_personality_v0`. The runtime library is named in full, so that no C++ compiler need be installed;
//! in release builds nothing refers to it and the program does not depend on it.

#[allow(clippy::print_stdout, reason = "this is how a build script speaks")]
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let set = |name: &str| std::env::var(name).unwrap_or_default();
    if std::env::var_os("CARGO_FEATURE_ISPC").is_none() {
        return;
    }
    match (set("CARGO_CFG_TARGET_OS").as_str(), set("CARGO_CFG_TARGET_ENV").as_str()) {
        ("linux", "gnu") => println!("cargo:rustc-link-lib=dylib:+verbatim=libstdc++.so.6"),
        ("macos", _) => println!("cargo:rustc-link-lib=dylib=c++"),
        _ => {}
    }
}
