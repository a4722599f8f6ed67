//! What each flag of `kinran bake` acts on. A flag that cannot act is refused by its name, and never swallowed.

use kinran::bake::Which;
use kinran::options::AlphaCoverage;
use kinran_bake::aniso::Kernel;
use kinran_bake::curvature::Method;
use kinran_scene::Wrap;

use super::{Args, DEFAULT_ZSTD};

/// What a flag acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum On {
    /// Folders of maps and glTF files.
    Any,
    /// Folders of maps; glTF files say it themselves.
    Folder,
    /// glTF files; folders of maps have no meshes, materials and other files.
    Model,
    /// Meshes whose curvature is measured.
    Curvature,
    /// Any run.
    Run,
    /// A run over one folder or glTF file.
    One,
    /// A run over a kinran.toml.
    Library,
}

/// A flag.
pub(super) struct Flag {
    /// Without dashes.
    pub(super) name: &'static str,
    pub(super) on: On,
    /// Whether it says anything but its default.
    pub(super) given: fn(&Args) -> bool,
}

const fn flag(name: &'static str, on: On, given: fn(&Args) -> bool) -> Flag {
    Flag { name, on, given }
}

/// Every flag, in the order of `kinran bake --help`.
pub(super) const FLAGS: [Flag; 45] = [
    flag("output", On::Run, |a| a.output.is_some()),
    flag("filter", On::Any, |a| a.filter.name() != "ml"),
    flag("kernel", On::Any, |a| a.kernel != Kernel::default()),
    flag("correlated", On::Any, |a| !a.correlated),
    flag("alpha-coverage", On::Any, |a| a.alpha_coverage != AlphaCoverage::Masked),
    flag("edges", On::Folder, |a| a.edges != Wrap::Repeat),
    flag("form", On::Any, |a| a.form.is_some()),
    flag("target", On::Model, |a| a.target.is_some()),
    flag("container", On::Any, |a| a.container.is_some()),
    flag("zstd", On::Any, |a| a.zstd != DEFAULT_ZSTD),
    flag("normal-format", On::Any, |a| a.normal_format.is_some()),
    flag("aniso-format", On::Any, |a| a.aniso_format.is_some()),
    flag("color-format", On::Any, |a| a.color_format.is_some()),
    flag("encoder", On::Any, |a| a.encoder.is_some()),
    flag("preset", On::Any, |a| a.preset.is_some()),
    flag("all-textures", On::Model, |a| a.all_textures),
    flag("separate-specular", On::Model, |a| a.separate_specular),
    flag("y-up", On::Any, |a| a.y_up),
    flag("y-down", On::Any, |a| a.y_down),
    flag("direction-span", On::Folder, |a| a.direction_span.is_some()),
    flag("map", On::Folder, |a| !a.map.is_empty()),
    flag("ignore", On::Folder, |a| !a.ignore.is_empty()),
    flag("roughness", On::Folder, |a| a.roughness.is_some()),
    flag("anisotropy", On::Folder, |a| a.anisotropy.is_some()),
    flag("roughness-is-gloss", On::Folder, |a| a.roughness_is_gloss),
    flag("force-normal", On::Folder, |a| a.force_normal),
    flag("dry-run", On::Run, |a| a.dry_run),
    flag("force", On::One, |a| a.force),
    flag("normal-blue", On::Folder, |a| a.normal_blue),
    flag("color-space", On::Folder, |a| a.color_space.is_some()),
    flag("exr-layer", On::Folder, |a| !a.exr_layer.is_empty()),
    flag("allow-outside", On::Model, |a| !a.model.allow_outside.is_empty()),
    flag("skin", On::Model, |a| !a.curvature.skin.is_empty()),
    flag("curvature", On::Model, |a| a.curvature.curvature != Which::default()),
    flag("curvature-method", On::Curvature, |a| a.curvature.curvature_method != Method::default()),
    flag("curvature-range", On::Curvature, |a| a.curvature.curvature_range.is_some()),
    flag("curvature-blur", On::Curvature, |a| a.curvature.curvature_blur.is_some()),
    flag("unit-mm", On::Curvature, |a| a.curvature.unit_mm.is_some()),
    flag("estimate-normals", On::Model, |a| a.curvature.estimate_normals),
    flag("curvature-dump", On::Curvature, |a| a.curvature.curvature_dump.is_some()),
    flag("watch", On::Library, |a| a.library.watch),
    flag("jobs", On::Library, |a| a.library.jobs.is_some()),
    flag("prune", On::Library, |a| a.library.prune),
    flag("cache", On::Library, |a| a.library.cache.is_some()),
    flag("help", On::Run, |_| false),
];

impl Flag {
    /// The flag of a name.
    pub(super) fn named(name: &str) -> Option<&'static Flag> {
        FLAGS.iter().find(|flag| flag.name == name)
    }

    /// The first flag that is given and acts on what `on` accepts.
    pub(super) fn given(args: &Args, on: impl Fn(On) -> bool) -> Option<&'static Flag> {
        FLAGS.iter().find(|flag| on(flag.on) && (flag.given)(args))
    }

    /// Whether it says how an entry of a manifest is baked, not what a run does.
    pub(super) fn is_of_entries(&self) -> bool {
        !matches!(self.on, On::Run | On::One | On::Library)
    }

    /// Why it cannot act on an input of the other kind.
    pub(super) fn refusal(&self) -> &'static str {
        match self.on {
            On::Folder => "is about folders of maps, and a glTF file says it itself",
            On::Model | On::Curvature => {
                "is about glTF files, and a folder of maps has no meshes and materials"
            }
            On::Library => "needs a kinran.toml as the input",
            On::One => "is for one folder or glTF file, and a kinran.toml needs none",
            On::Any | On::Run => "acts on every input",
        }
    }
}

impl On {
    /// Whether flags of it act on glTF files, or on folders of maps.
    pub(super) fn acts(self, on_model: bool) -> bool {
        match self {
            On::Folder => !on_model,
            On::Model | On::Curvature => on_model,
            On::Any | On::Run | On::One | On::Library => true,
        }
    }
}

impl Args {
    /// The flag that cannot act on one folder or one glTF file.
    pub(super) fn idle_flag(&self, is_model: bool) -> Option<&'static Flag> {
        Flag::given(self, |on| !on.acts(is_model))
    }

    /// A sentence for each flag that has nothing to act on in a glTF file, the curvature of whose meshes is `measured` or not.
    pub(super) fn idle_on_model(&self, measured: bool) -> Vec<String> {
        let curvature = Flag::given(self, |on| on == On::Curvature).filter(|_| !measured);
        let no_mesh = "no mesh is measured; --skin NAME or --curvature all asks for it";
        let no_color = "no colour is baked; --all-textures asks for it";
        [
            curvature.map(|flag| (flag.name, no_mesh)),
            self.color_format.map(|_| ("color-format", no_color)).filter(|_| !self.all_textures),
            (self.alpha_coverage != AlphaCoverage::Masked && !self.all_textures)
                .then_some(("alpha-coverage", no_color)),
        ]
        .into_iter()
        .flatten()
        .map(|(flag, why)| format!("--{flag} has nothing to act on: {why}"))
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::{ArgAction, CommandFactory, Parser};

    use super::super::settings::BakeFlags;
    use super::*;

    /// A value that is not the default.
    fn value(argument: &clap::Arg) -> String {
        let name = argument.get_long().unwrap();
        let known = [
            ("filter", "linear"),
            ("zstd", "9"),
            ("direction-span", "180"),
            ("map", "normal=a.png"),
            ("exr-layer", "a.exr=View.Normal"),
            ("roughness", "0.25"),
            ("anisotropy", "0.25"),
            ("alpha-coverage", "0.25"),
            ("curvature-range", "1"),
            ("curvature-blur", "none"),
            ("unit-mm", "5"),
            ("jobs", "2"),
        ];
        if let Some((_, value)) = known.iter().find(|(known, _)| *known == name) {
            return (*value).into();
        }
        let defaults: Vec<String> =
            argument.get_default_values().iter().map(|value| value.to_string_lossy().into_owned()).collect();
        let possible = argument.get_possible_values();
        let other = possible.iter().map(|value| value.get_name().to_owned()).find(|v| !defaults.contains(v));
        other.unwrap_or_else(|| "a/path".into())
    }

    #[test]
    fn a_flag_is_not_classified_or_not_seen_when_it_is_given() {
        let mut command = BakeFlags::command();
        command.build();
        let names: BTreeSet<&str> = command.get_arguments().filter_map(clap::Arg::get_long).collect();
        let table: BTreeSet<&str> = FLAGS.iter().map(|flag| flag.name).collect();
        assert_eq!(table.len(), FLAGS.len(), "a flag stands twice in the table");
        assert_eq!(names, table, "flags of --help, and those of the table");
        for argument in command.get_arguments() {
            let Some(name) = argument.get_long().filter(|name| *name != "help") else { continue };
            let word = match argument.get_action() {
                ArgAction::SetTrue => format!("--{name}"),
                _ => format!("--{name}={}", value(argument)),
            };
            let args =
                BakeFlags::try_parse_from(["input", &word]).unwrap_or_else(|e| panic!("{word}: {e}")).args;
            let given: Vec<&str> =
                FLAGS.iter().filter(|flag| (flag.given)(&args)).map(|flag| flag.name).collect();
            assert_eq!(given, [name], "{word}");
        }
        let bare = BakeFlags::try_parse_from(["input"]).unwrap().args;
        assert!(Flag::given(&bare, |_| true).is_none());
    }
}
