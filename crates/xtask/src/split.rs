//! Takes the text that a naga back end wrote apart into its top-level declarations.

/// A top-level declaration of GLSL, HLSL or MSL.
pub struct Declaration {
    /// What it declares; empty for directives such as `#include` and `using`.
    pub name: String,
    /// Its text, without blank lines around it.
    pub text: String,
}

/// The name that a declaration's text declares.
fn name_of(text: &str) -> String {
    let word = |s: &str| {
        s.trim_end().rsplit(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default().to_owned()
    };
    let head = text.split(['{', '=', ';']).next().unwrap_or_default();
    if text.starts_with('#') || text.starts_with("using ") || text.starts_with("precision ") {
        String::new()
    } else if text.starts_with("typedef ") {
        // `typedef float ret_Construct[9];`, and naga's `typedef float ret_Construct(...)`.
        word(head.split('[').next().unwrap_or_default())
    } else if text.starts_with("struct ") || !head.contains('(') {
        word(head.split('[').next().unwrap_or_default())
    } else {
        word(head.split('(').next().unwrap_or_default())
    }
}

/// The declarations of `text` in order. A declaration ends with a brace that closes at the top level, a semicolon
/// there, or, for a directive, with its line.
pub fn declarations(text: &str) -> Vec<Declaration> {
    let mut found = Vec::new();
    let mut current = String::new();
    let mut depth = 0_usize;
    for line in text.lines() {
        if line.trim().is_empty() && depth == 0 {
            continue;
        }
        current += line;
        current.push('\n');
        depth += line.matches('{').count();
        depth -= line.matches('}').count();
        let ends = line.starts_with('#') || line.trim_end().ends_with([';', '}']);
        if depth == 0 && ends {
            let text = std::mem::take(&mut current).trim_end().to_owned();
            found.push(Declaration { name: name_of(&text), text });
        }
    }
    found
}
