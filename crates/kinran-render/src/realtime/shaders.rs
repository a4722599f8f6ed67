//! The shader text of each pass: the library's formulas and this folder's files, one after the other.

use std::path::PathBuf;

use kinran_shaders::{wgsl, with_needs};
use naga::valid::{Capabilities, ValidationFlags, Validator};

use crate::Error;

/// This folder's files.
const FILES: [(&str, &str); 17] = [
    ("frame.wgsl", include_str!("frame.wgsl")),
    ("fuzz.wgsl", include_str!("fuzz.wgsl")),
    ("lighting.wgsl", include_str!("lighting.wgsl")),
    ("surface.wgsl", include_str!("surface.wgsl")),
    ("fuzz_surface.wgsl", include_str!("fuzz_surface.wgsl")),
    ("detail.wgsl", include_str!("detail.wgsl")),
    ("no_detail.wgsl", include_str!("no_detail.wgsl")),
    ("channels.wgsl", include_str!("channels.wgsl")),
    ("skin.wgsl", include_str!("skin.wgsl")),
    ("forward.wgsl", include_str!("forward.wgsl")),
    ("octahedral.wgsl", include_str!("octahedral.wgsl")),
    ("gbuffer.wgsl", include_str!("gbuffer.wgsl")),
    ("deferred.wgsl", include_str!("deferred.wgsl")),
    ("background.wgsl", include_str!("background.wgsl")),
    ("shadow.wgsl", include_str!("shadow.wgsl")),
    ("cutout.wgsl", include_str!("cutout.wgsl")),
    ("accumulate.wgsl", include_str!("accumulate.wgsl")),
];

/// The tone curves, apart since their pass knows nothing of surfaces.
const TONEMAP: (&str, &str) = ("tonemap.wgsl", include_str!("tonemap.wgsl"));

/// Modules of the library that the passes use.
const LIBRARY: [&str; 15] = [
    "ggx",
    "aniso",
    "multiscatter",
    "sh",
    "fuzz_layer",
    "fuzz_p_s",
    "fuzz_ambient",
    "fuzz_deferred",
    "skin_curvature",
    "skin_lighting",
    "detail_hsv",
    "detail_layer",
    "detail_normal",
    "detail_over",
    "detail_overlay",
];

/// Where shader text comes from.
#[derive(Clone, Debug, Default)]
pub struct ShaderSource {
    /// A folder whose files, named as in [`ShaderSource::files`], take the place of those that are built in.
    pub folder: Option<PathBuf>,
}

impl ShaderSource {
    /// Names and texts of all files that are built in.
    pub fn files() -> impl Iterator<Item = (&'static str, &'static str)> {
        FILES.into_iter().chain([TONEMAP])
    }

    /// Refuses a folder that is not there, and one with a `.wgsl` file that no pass would read.
    ///
    /// # Errors
    /// [`Error::Shader`] with the folder or the file, and the names that are read.
    pub fn check(&self) -> Result<(), Error> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let complain = |e: &dyn std::fmt::Display| Error::Shader(format!("{}: {e}", folder.display()));
        let entries = std::fs::read_dir(folder).map_err(|e| complain(&e))?;
        let mut names = Vec::new();
        for entry in entries {
            names.push(entry.map_err(|e| complain(&e))?.file_name().to_string_lossy().into_owned());
        }
        names.sort();
        // Editors keep their own files under names that begin with a dot.
        let stranger = names.iter().find(|name| {
            name.ends_with(".wgsl") && !name.starts_with('.') && !Self::files().any(|(file, _)| file == *name)
        });
        let Some(stranger) = stranger else { return Ok(()) };
        let known: Vec<_> = Self::files().map(|(file, _)| file).collect();
        Err(complain(&format!("{stranger} is no shader's name; those that are read: {}", known.join(", "))))
    }

    fn file(&self, name: &str) -> Result<String, Error> {
        let built_in = Self::files().find(|(file, _)| *file == name).map_or("", |(_, text)| text);
        let Some(path) = self.folder.as_ref().map(|folder| folder.join(name)).filter(|path| path.exists())
        else {
            return Ok(built_in.to_owned());
        };
        std::fs::read_to_string(&path).map_err(|e| Error::Shader(format!("{}: {e}", path.display())))
    }

    /// The text of a pass that is made of the library and the files named, once it is known to compile.
    ///
    /// # Errors
    /// [`Error::Shader`] with file, line and the compiler's message.
    pub fn pass(&self, files: &[&str]) -> Result<String, Error> {
        // Which file each part of the text is.
        let mut parts = vec![("the shader library", with_needs(wgsl::MODULES, &LIBRARY))];
        for name in files {
            parts.push((name, self.file(name)?));
        }
        let text: String = parts.iter().map(|(_, text)| text.as_str()).collect();
        let locate = |line: u32| {
            let mut before = 0;
            for (name, text) in &parts {
                let lines = text.lines().count() as u32;
                if line <= before + lines {
                    return format!("{name}:{}", line - before);
                }
                before += lines;
            }
            "the end".to_owned()
        };
        let complain = |location: Option<naga::SourceLocation>, message: String| {
            let place = location.map_or_else(|| files.join(" + "), |l| locate(l.line_number));
            let line = location.and_then(|l| text.lines().nth(l.line_number as usize - 1));
            let line = line.map_or_else(String::new, |line| format!("\n    {}", line.trim()));
            Error::Shader(format!("{place}: {message}{line}"))
        };

        let module = naga::front::wgsl::parse_str(&text)
            .map_err(|e| complain(e.location(&text), e.message().to_owned()))?;
        Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module).map_err(|e| {
            let causes = std::iter::successors(Some(e.as_inner() as &dyn std::error::Error), |e| e.source());
            let message = causes.map(ToString::to_string).collect::<Vec<_>>().join(": ");
            complain(e.location(&text), message)
        })?;
        Ok(text)
    }
}
