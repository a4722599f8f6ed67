//! What the shader library costs on AMD hardware: instructions, registers and cycles of every lobe and function, as
//! Mesa's compiler tells without the hardware. Writes `budget.json` and `docs/shader_cost.md`, or compares with the
//! budget.

mod compiler;
mod harness;
mod report;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, ExitCode};

use compiler::Compiler;
use serde_json::{Value, json};

/// What went wrong, in words.
type Error = Box<dyn std::error::Error>;

/// Hardware: the driver's name for it, ours, and the variable that names the manifest of a driver that knows it.
pub(crate) const FAMILIES: [(&str, &str, &str); 3] = [
    ("bonaire", "GCN, GFX7: PlayStation 4's generation", "KINRAN_RADV"),
    ("navi21", "RDNA 2, GFX10.3: PlayStation 5's and Xbox Series' generation", "KINRAN_RADV"),
    ("navi31", "RDNA 3, GFX11", "KINRAN_RADV_NEW"),
];

/// The family whose numbers stand at the functions.
const FUNCTIONS_ON: &str = "bonaire";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments[..] {
        [] => write(),
        ["--check"] => check(),
        ["--measure", family] => measure(family).map(|measured| println!("{measured}")),
        _ => Err("usage: shader_cost [--check]".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("shader_cost: {error}");
            ExitCode::FAILURE
        }
    }
}

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

fn library() -> Result<String, Error> {
    let path = root().join("crates/kinran-shaders/wgsl/kinran.wgsl");
    Ok(std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?)
}

/// Measures everything on the family that the environment makes the driver's.
fn measure(family: &str) -> Result<Value, Error> {
    let compiler = Compiler::open()?;
    let library = library()?;
    let compile = |wgsl: &str| -> Result<_, Error> { compiler.compile(&harness::to_spirv(wgsl)?) };

    let mut rows = serde_json::Map::new();
    let mut lambert = None;
    let mut wave = 0;
    for row in harness::rows() {
        let mut of = |lights| -> Result<[f64; 3], Error> {
            let compiled = compile(&row.shader(&library, lights))?;
            wave = compiled.wave;
            let numbers =
                ["Instructions", "Inverse Throughput", "VGPRs"].map(|name| compiled.statistics.get(name));
            let [Some(instructions), Some(cycles), Some(vgprs)] = numbers else {
                return Err("the driver does not tell instructions, throughput and registers".into());
            };
            Ok([*instructions, *cycles, *vgprs].map(|number| number as f64))
        };
        let (four, eight) = (of(4)?, of(8)?);
        let light = [0, 1].map(|i| (eight[i] - four[i]) / 4.0);
        let rest = [0, 1].map(|i| four[i] - 4.0 * light[i]);
        let base = *lambert.get_or_insert(rest);
        let cost = json!({
            "light": { "instructions": light[0], "cycles": light[1] },
            "pixel": { "instructions": rest[0] - base[0], "cycles": rest[1] - base[1] },
            "vgprs": four[2],
        });
        rows.insert(row.id.to_owned(), cost);
    }

    let mut functions = serde_json::Map::new();
    if family == FUNCTIONS_ON {
        let module = naga::front::wgsl::parse_str(&library).map_err(|e| e.emit_to_string(&library))?;
        for (name, function) in harness::functions(&module) {
            let of = |calls| -> Result<_, Error> {
                let compiled = compile(&harness::function_shader(&library, &module, function, calls))?;
                Ok(harness::computing_instructions(&compiled.code))
            };
            // Of two calls more; what both share, constants in registers, costs a shader once.
            let (two, four) = (of(2)?, of(4)?);
            let cost = json!({
                "instructions": (four.0 - two.0).div_ceil(2),
                "quarter_rate": (four.1 - two.1).div_ceil(2),
                "loops": function.body.iter().any(|s| matches!(s, naga::Statement::Loop { .. })),
            });
            functions.insert(name, cost);
        }
    }
    Ok(json!({ "driver": compiler.driver, "wave": wave, "rows": rows, "functions": functions }))
}

/// Measures a family in a process of its own: the driver reads its environment once, and may abort.
fn measured(family: &str, manifest: &str) -> Result<Value, Error> {
    let manifest = std::env::var(manifest).map_err(|_| format!("{manifest} names no driver"))?;
    // A driver that is unpacked and not installed has its libraries beside its manifest.
    let folder = Path::new(&manifest).parent().ok_or("a manifest without a folder")?;
    let output = Command::new(std::env::current_exe()?)
        .args(["--measure", family])
        .env("RADV_FORCE_FAMILY", family)
        .env("MESA_SHADER_CACHE_DISABLE", "true")
        .env("VK_ICD_FILENAMES", &manifest)
        .env("LD_LIBRARY_PATH", folder)
        .output()?;
    if !output.status.success() {
        return Err(format!("{}: {}", output.status, String::from_utf8_lossy(&output.stderr).trim()).into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// All families that can be measured here; the others with the reason.
fn measure_all() -> BTreeMap<&'static str, Result<Value, Error>> {
    FAMILIES.iter().map(|(family, _, manifest)| (*family, measured(family, manifest))).collect()
}

fn budget_path() -> std::path::PathBuf {
    root().join("tools/shader_cost/budget.json")
}

fn read_budget() -> Result<Value, Error> {
    Ok(serde_json::from_slice(&std::fs::read(budget_path())?)?)
}

/// Measures, and writes budget and page. A family that cannot be measured here keeps its numbers.
fn write() -> Result<(), Error> {
    let old = read_budget().unwrap_or_else(|_| json!({}));
    let mut families = serde_json::Map::new();
    let mut functions = old["functions"].clone();
    for (family, now) in measure_all() {
        match now {
            Ok(mut now) => {
                if family == FUNCTIONS_ON {
                    functions = now["functions"].take();
                }
                families.insert(
                    family.to_owned(),
                    json!({ "driver": now["driver"], "wave": now["wave"], "rows": now["rows"] }),
                );
            }
            Err(error) => {
                eprintln!("SKIPPED: {family}, its numbers stay: {error}");
                if !old["families"][family].is_null() {
                    families.insert(family.to_owned(), old["families"][family].clone());
                }
            }
        }
    }
    let budget = json!({ "families": families, "functions": functions });
    std::fs::write(budget_path(), format!("{budget:#}\n"))?;
    std::fs::write(root().join("docs/shader_cost.md"), report::page(&budget)?)?;
    Ok(())
}

/// Compares what can be measured here with the budget.
fn check() -> Result<(), Error> {
    let budget = read_budget()?;
    let mut grown = Vec::new();
    for (family, now) in measure_all() {
        let allowed = &budget["families"][family];
        match now {
            Err(error) => println!("SKIPPED: {family}: {error}"),
            Ok(now) if now["driver"] != allowed["driver"] => {
                println!(
                    "SKIPPED: {family}: this is {}, the budget is for {}",
                    now["driver"], allowed["driver"]
                );
            }
            Ok(now) => {
                let before = grown.len();
                report::compare(family, &now["rows"], &allowed["rows"], &mut grown);
                if family == FUNCTIONS_ON {
                    report::compare(family, &now["functions"], &budget["functions"], &mut grown);
                }
                println!("{family}, {}: {} over budget", now["driver"], grown.len() - before);
            }
        }
    }
    let page = root().join("docs/shader_cost.md");
    if std::fs::read_to_string(&page)? != report::page(&budget)? {
        grown.push(format!("{} is not what the budget says", page.display()));
    }
    if grown.is_empty() {
        Ok(())
    } else {
        Err(format!("{}; if it is worth it: ./x cost", grown.join("; ")).into())
    }
}
