//! What a shader function takes and returns, flattened to numbers.

use std::collections::BTreeMap;
use std::fmt::Write;

use naga::{ArraySize, Handle, Module, Scalar, ScalarKind, Type, TypeInner, VectorSize};

/// A function of the library.
pub(crate) struct Signature {
    /// Its name.
    pub(crate) name: String,
    arguments: Vec<Shape>,
    result: Shape,
}

/// A type, as far as the library's functions use it.
enum Shape {
    Float,
    Unsigned,
    Vector(u32),
    Matrix(u32, u32),
    Array(u32, Box<Shape>),
    /// Its name and members.
    Struct(String, Vec<(String, Shape)>),
}

impl Shape {
    fn new(module: &Module, ty: Handle<Type>) -> Self {
        let size = |s: VectorSize| s as u32;
        match &module.types[ty].inner {
            TypeInner::Scalar(Scalar { kind: ScalarKind::Float, .. }) => Self::Float,
            TypeInner::Scalar(Scalar { kind: ScalarKind::Uint, .. }) => Self::Unsigned,
            TypeInner::Vector { size: n, scalar: Scalar { kind: ScalarKind::Float, .. } } => {
                Self::Vector(size(*n))
            }
            TypeInner::Matrix { columns, rows, .. } => Self::Matrix(size(*columns), size(*rows)),
            TypeInner::Array { base, size: ArraySize::Constant(n), .. } => {
                Self::Array(n.get(), Box::new(Self::new(module, *base)))
            }
            TypeInner::Struct { members, .. } => Self::Struct(
                module.types[ty].name.clone().unwrap(),
                (members.iter().map(|m| (m.name.clone().unwrap(), Self::new(module, m.ty)))).collect(),
            ),
            other => panic!("the harness cannot pass {other:?}; teach it"),
        }
    }

    /// How many numbers it takes.
    fn len(&self) -> usize {
        match self {
            Self::Float | Self::Unsigned => 1,
            Self::Vector(n) => *n as usize,
            Self::Matrix(columns, rows) => (columns * rows) as usize,
            Self::Array(n, base) => *n as usize * base.len(),
            Self::Struct(_, members) => members.iter().map(|(_, shape)| shape.len()).sum(),
        }
    }

    /// The expression that builds it from numbers `x(at)`, `x(at + 1)` and so on.
    fn read(&self, at: &mut usize) -> String {
        let list = |n: u32, at: &mut usize, one: &dyn Fn(&mut usize) -> String| {
            (0..n).map(|_| one(at)).collect::<Vec<_>>().join(", ")
        };
        let number = |at: &mut usize| {
            *at += 1;
            format!("x({})", *at - 1)
        };
        match self {
            Self::Float => number(at),
            Self::Unsigned => format!("u32({})", number(at)),
            Self::Vector(n) => format!("vec{n}f({})", list(*n, at, &number)),
            Self::Matrix(columns, rows) => {
                format!("mat{columns}x{rows}f({})", list(columns * rows, at, &number))
            }
            Self::Array(n, base) => {
                let name = match **base {
                    Self::Float => "f32".to_owned(),
                    Self::Vector(n) => format!("vec{n}f"),
                    _ => panic!("the harness cannot pass this array; teach it"),
                };
                format!("array<{name}, {n}>({})", list(*n, at, &|at| base.read(at)))
            }
            Self::Struct(name, members) => {
                let values: Vec<String> = members.iter().map(|(_, shape)| shape.read(at)).collect();
                format!("{name}({})", values.join(", "))
            }
        }
    }

    /// The expressions of its numbers.
    fn flatten(&self, expression: &str, into: &mut Vec<String>) {
        match self {
            Self::Float => into.push(expression.to_owned()),
            Self::Unsigned => into.push(format!("f32({expression})")),
            Self::Vector(n) => into.extend((0..*n).map(|i| format!("{expression}[{i}]"))),
            Self::Matrix(columns, rows) => {
                into.extend((0..columns * rows).map(|i| format!("{expression}[{}][{}]", i / rows, i % rows)));
            }
            Self::Array(n, base) => {
                (0..*n).for_each(|i| base.flatten(&format!("{expression}[{i}]"), into));
            }
            Self::Struct(_, members) => {
                members.iter().for_each(|(name, shape)| shape.flatten(&format!("{expression}.{name}"), into));
            }
        }
    }
}

impl Signature {
    /// All functions of a library, by name.
    pub(crate) fn all(library: &str) -> BTreeMap<String, Self> {
        let module =
            naga::front::wgsl::parse_str(library).unwrap_or_else(|e| panic!("{}", e.emit_to_string(library)));
        let one = |function: &naga::Function| Self {
            name: function.name.clone().unwrap(),
            arguments: function.arguments.iter().map(|a| Shape::new(&module, a.ty)).collect(),
            result: Shape::new(&module, function.result.as_ref().unwrap().ty),
        };
        module.functions.iter().map(|(_, f)| one(f)).map(|s| (s.name.clone(), s)).collect()
    }

    /// Numbers in.
    pub(crate) fn inputs(&self) -> usize {
        self.arguments.iter().map(Shape::len).sum()
    }

    /// Numbers out.
    pub(crate) fn outputs(&self) -> usize {
        self.result.len()
    }

    /// An entry point `main` that calls the function once per invocation, on numbers from one buffer to another.
    pub(crate) fn entry_point(&self, count: usize) -> String {
        let mut at = 0;
        let arguments: Vec<String> = self.arguments.iter().map(|a| a.read(&mut at)).collect();
        let mut results = Vec::new();
        self.result.flatten("result", &mut results);
        let mut text = format!(
            "@group(0) @binding(0) var<storage, read> inputs: array<f32>;
@group(0) @binding(1) var<storage, read_write> outputs: array<f32>;
var<private> i: u32;
fn x(at: u32) -> f32 {{ return inputs[i * {}u + at]; }}
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    i = id.x;
    if i >= {count}u {{ return; }}
    let result = {}({});
",
            self.inputs(),
            self.name,
            arguments.join(", ")
        );
        for (j, result) in results.iter().enumerate() {
            writeln!(text, "    outputs[i * {}u + {j}u] = {result};", self.outputs()).unwrap();
        }
        text + "}\n"
    }
}
