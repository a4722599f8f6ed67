use std::path::{Path,PathBuf};
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("{}: {}", .0.display(), .1)]
    Read(PathBuf, std::io::Error),
    #[error("modules import each other in a circle: {}", .0.join(", "))]
    Circle(Vec<String>),
    #[error("WESL: {0}")]
    Wesl(String),
    #[error("{0}")]
    Naga(String),
}
pub fn run(folder: &Path, _check: bool) -> Result<(), Error> {
    let modules = crate::library::read(&folder.join("src"))?;
    let whole: String = modules.iter().map(|m| m.text.clone()).collect();
    use crate::translate as t;
    std::fs::create_dir_all("/tmp/tr").unwrap();
    std::fs::write("/tmp/tr/a.450", t::glsl(&whole, naga::back::glsl::Version::Desktop(450))?).unwrap();
    std::fs::write("/tmp/tr/a.es", t::glsl(&whole, naga::back::glsl::Version::Embedded{version:300,is_webgl:true})?).unwrap();
    std::fs::write("/tmp/tr/a.hlsl", t::hlsl(&whole)?).unwrap();
    std::fs::write("/tmp/tr/a.metal", t::msl(&whole)?).unwrap();
    std::fs::write("/tmp/tr/a.spv", t::spirv(&whole)?).unwrap();
    let _ = crate::split::declarations;
    Ok(())
}
