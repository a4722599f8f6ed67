//! The formulas of `kinran-shading` as text for GPUs: the same functions with the same names and parameters, in WESL,
//! WGSL, GLSL, HLSL, MSL and SPIR-V. Strings and nothing else: no dependency, no GPU API.
//!
//! ```
//! use kinran_shaders::{wgsl, with_needs};
//! let library = with_needs(wgsl::MODULES, &["ggx", "aniso"]);
//! let shader = format!("{library}\n@fragment fn main() -> @location(0) vec4f {{ return vec4f(ALPHA_MIN); }}");
//! ```

mod texts;

pub use texts::*;

/// All modules as a SPIR-V module that `spirv-link` links, each function exported under its name.
pub const SPIRV: &[u8] = include_bytes!("../spirv/kinran.spv");

/// How to link it.
pub const SPIRV_README: &str = include_str!("../spirv/README.md");

/// A module of the library in one language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Module {
    /// Its name, such as `ggx`: the same in every language, and in `kinran-shading`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
    /// Names of the modules it uses directly.
    pub needs: &'static [&'static str],
}

/// The named modules of a language and all that they need, each once, in an order in which everything is declared
/// before it is used, with the lines that include one file in another left out.
///
/// # Panics
/// When a name is not among `modules`.
pub fn with_needs(modules: &[Module], names: &[&str]) -> String {
    let mut wanted: Vec<&str> = names.to_vec();
    let mut at = 0;
    while let Some(&name) = wanted.get(at) {
        let module = modules.iter().find(|module| module.name == name);
        let module = module.unwrap_or_else(|| panic!("the shader library has no module {name}"));
        wanted.extend(module.needs.iter().filter(|need| !names.contains(need)));
        at += 1;
    }
    let chosen = modules.iter().filter(|module| wanted.contains(&module.name));
    let lines = chosen.flat_map(|module| module.text.lines().chain([""]));
    lines.filter(|line| !line.starts_with("#include \"")).flat_map(|line| [line, "\n"]).collect()
}
