//! All modules as one WGSL text, resolved by the `wesl` crate and validated by naga.

use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use wesl::{ManglerKind, ModulePath, VirtualResolver, Wesl, syntax::GlobalDeclaration};

use crate::{Error, source::Module};

/// naga's module, validated.
pub(crate) type Validated = (naga::Module, ModuleInfo);

/// Resolves the imports of all modules; names stay as they are.
pub(crate) fn flatten(modules: &[Module]) -> Result<String, Error> {
    let mut resolver = VirtualResolver::new();
    let path = |name: &str| format!("package::{name}").parse::<ModulePath>();
    for module in modules {
        resolver.add_module(path(&module.name)?, module.text.as_str().into());
    }
    let root: String = (modules.iter())
        .filter_map(|m| Some(format!("import package::{}::{};\n", m.name, m.declarations.first()?.name)))
        .collect();
    resolver.add_module(path("kinran")?, root.into());

    let mut wesl = Wesl::new_barebones().set_custom_resolver(resolver);
    // Without stripping everything is kept; with it, what no entry point calls would go.
    wesl.use_imports(true).use_stripping(false).set_mangler(ManglerKind::None);
    let mut flat = wesl.compile(&path("kinran")?)?.syntax;
    // The resolver's order differs from run to run.
    let names: Vec<_> = modules.iter().flat_map(|m| &m.declarations).map(|d| d.name.as_str()).collect();
    flat.global_declarations.sort_by_key(|declaration| {
        let ident = match declaration.node() {
            GlobalDeclaration::Declaration(constant) => constant.ident.name().to_string(),
            GlobalDeclaration::Struct(structure) => structure.ident.name().to_string(),
            GlobalDeclaration::Function(function) => function.ident.name().to_string(),
            _ => return None,
        };
        names.iter().position(|name| **name == ident)
    });
    Ok(flat.to_string())
}

/// Parses and validates WGSL.
pub(crate) fn validate(wgsl: &str) -> Result<Validated, Error> {
    let module = naga::front::wgsl::parse_str(wgsl).map_err(|e| e.emit_to_string(wgsl))?;
    // No capability beyond WebGPU's own.
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
    let info = validator.validate(&module).map_err(|e| e.emit_to_string(wgsl))?;
    Ok((module, info))
}
