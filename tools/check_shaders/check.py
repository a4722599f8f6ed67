"""Compiles the shader library with compilers that are not ours.

For every module a fragment shader is written that includes the module twice and calls each of its functions with
values that are unknown before it runs; and one for the file of everything. glslang takes the GLSL and the HLSL, DXC the
HLSL once more, Slang makes WGSL and Metal of it, spirv-val takes what came out, and the SPIR-V module is linked to a
program that calls into it.

Usage: check.py LIBRARY_FOLDER WORK_FOLDER SLANGC [DXC_COMMAND...]; SLANGC may be empty.
"""

import pathlib
import re
import subprocess
import sys

library, work, slangc, dxc = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3], sys.argv[4:]
failures = []


def run(what, *command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        failures.append(what)
        print(f"FAILED: {what}: {' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.returncode == 0


class Text:
    """Types and functions of a GLSL or HLSL text, as far as naga writes them."""

    def __init__(self, text):
        self.structs = {
            name: re.findall(r"(\w+) (\w+);", body) for name, body in re.findall(r"struct (\w+) \{(.*?)\};", text, re.S)
        }
        self.typedefs = {name: f"{base}[{n}]" for base, name, n in re.findall(r"typedef (\w+) (\w+)\[(\d+)\];", text)}
        found = re.findall(r"^([\w\[\]]+) (\w+)\(([^)]*)\)\s*\{", text, re.M)
        # What naga calls by a capital letter are constructors.
        self.functions = [f for f in found if not re.match(r"Construct|\w+_Construct", f[1])]

    def numbers(self, type_name, value):
        """Expressions for all numbers of a value."""
        type_name = self.typedefs.get(type_name, type_name)
        if array := re.fullmatch(r"(\w+)\[(\d+)\]", type_name):
            return [n for i in range(int(array[2])) for n in self.numbers(array[1], f"{value}[{i}]")]
        if type_name in self.structs:
            return [n for member, name in self.structs[type_name] for n in self.numbers(member, f"{value}.{name}")]
        if re.fullmatch(r"mat3|float3x3", type_name):
            return [n for i in range(3) for n in self.numbers("vec3", f"{value}[{i}]")]
        if vector := re.fullmatch(r"(?:vec|float)([234])", type_name):
            return [f"{value}.{c}" for c in "xyzw"[: int(vector[1])]]
        if type_name == "float":
            return [value]
        raise SystemExit(f"{type_name}: the check cannot read this type; teach it")

    def calls(self, declare):
        """Declarations of inputs, and statements that call every function and add what it returns to `sum`."""
        declarations, statements = [], []
        for result, name, parameters in self.functions:
            arguments = []
            for parameter in filter(None, (p.strip() for p in parameters.split(","))):
                type_name, parameter, array = re.fullmatch(r"(\w+) (\w+)((?:\[\d+\])?)", parameter).groups()
                arguments.append(f"in_{name}_{parameter}")
                declarations.append(declare(type_name, arguments[-1], array))
            call = f"{name}({', '.join(arguments)})"
            if result in self.typedefs:
                base, count = re.fullmatch(r"(\w+)(\[\d+\])", self.typedefs[result]).groups()
                statements.append(f"{base} out_{name}{count} = {call};")
            else:
                statements.append(f"{result} out_{name} = {call};")
            statements.append(f"sum += {' + '.join(self.numbers(result, f'out_{name}'))};")
        return "\n".join(declarations), "\n".join("    " + s for s in statements)


def names(folder):
    found = re.findall(r"^fn (\w+)\(", (library / "wgsl" / f"{folder}.wgsl").read_text(), re.M)
    return set(found)


def shader(folder, extension, module):
    """The shader that calls all of a module."""
    text = (library / folder / f"{module}.{extension}").read_text()
    everything = Text((library / folder / f"kinran.{extension}").read_text())
    functions = Text(text)
    functions.structs, functions.typedefs = everything.structs, everything.typedefs
    called = {name for _, name, _ in functions.functions}
    if called != names(module):
        raise SystemExit(f"{folder}/{module}: found {sorted(called)}, wanted {sorted(names(module))}")
    include = f'#include "{module}.{extension}"\n' * 2
    if folder == "hlsl":
        inputs, body = functions.calls(lambda t, n, a: f"uniform {t} {n}{a};")
        return f"{include}{inputs}\nfloat4 main() : SV_Target {{\n    float sum = 0.0;\n{body}\n    return sum.xxxx;\n}}\n"
    inputs, body = functions.calls(lambda t, n, a: f"uniform {t} {n}{a};")
    main = f"{inputs}\nout vec4 color;\nvoid main() {{\n    float sum = 0.0;\n{body}\n    color = vec4(sum);\n}}\n"
    if folder == "glsl_450":
        return f"#version 450\n#extension GL_GOOGLE_include_directive : require\n{include}{main}"
    # GLSL ES knows no include: text after text, each after those it needs.
    return f"#version 300 es\nprecision highp float;\nprecision highp int;\n{with_needs(folder, module)}{main}"


def with_needs(folder, module):
    order = []

    def visit(name):
        needs = re.search(r"Needs: (.*)", (library / folder / f"{name}.glsl").read_text())
        for need in needs[1].split(", ") if needs and needs[1] != "nothing else" else []:
            visit(need)
        if name not in order:
            order.append(name)

    visit(module)
    return "".join((library / folder / f"{name}.glsl").read_text() for name in order)


modules = sorted(path.stem for path in (library / "wgsl").glob("*.wgsl"))
for folder, extension in [("glsl_450", "glsl"), ("glsl_es_300", "glsl"), ("hlsl", "hlsl")]:
    (work / folder).mkdir(parents=True, exist_ok=True)
    for module in modules:
        what = f"{folder}/{module}.{extension}"
        source = work / folder / (f"{module}.frag" if extension == "glsl" else f"{module}.ps.hlsl")
        source.write_text(shader(folder, extension, module))
        spirv = source.with_suffix(".spv")
        include = f"-I{library / folder}"
        if extension == "glsl":
            # OpenGL's rules; a Vulkan SPIR-V from GLSL would want its uniforms in blocks.
            output = [] if folder == "glsl_es_300" else ["-G", "--aml", "-o", spirv]
            if run(f"glslang: {what}", "glslangValidator", *output, include, source) and output:
                run(f"spirv-val: {what}", "spirv-val", "--target-env", "opengl4.5", spirv)
            continue
        if run(f"glslang: {what}", "glslangValidator", "-D", "-V", "-S", "frag", "-e", "main", include, "-o", spirv, source):
            run(f"spirv-val: {what}", "spirv-val", "--target-env", "vulkan1.1", spirv)
        for target in ["wgsl", "metal"] if slangc else []:
            run(f"slang, {target}: {what}", slangc, source, f"-I{library / folder}", "-target", target, "-stage", "fragment",
                "-entry", "main", "-o", source.with_suffix(f".{target}"))
        if dxc:
            folder_of_includes = library / folder
            for flags in (["-HV", "2018"], ["-HV", "2021"]):
                run(f"dxc, DXIL, {flags[1]}: {what}", *dxc, source, source.with_suffix(".dxil"), folder_of_includes,
                    "-T", "ps_6_0", "-E", "main", "-WX", *flags)
            if run(f"dxc, SPIR-V: {what}", *dxc, source, spirv, folder_of_includes, "-T", "ps_6_0", "-E", "main", "-spirv"):
                run(f"spirv-val: {what}", "spirv-val", "--target-env", "vulkan1.1", spirv)
    print(f"{folder}: {len(modules)} files")

# The SPIR-V module, and a program that calls one of its functions.
module = library / "spirv" / "kinran.spv"
run("spirv-val: kinran.spv", "spirv-val", "--target-env", "spv1.0", module)
disassembled = subprocess.run(["spirv-dis", module], capture_output=True, text=True, check=True).stdout
exported = set(re.findall(r'LinkageAttributes "(\w+)" Export', disassembled))
if exported != names("kinran"):
    failures.append(f"kinran.spv exports {sorted(exported ^ names('kinran'))} too much or too little")
caller = work / "caller.spvasm"
caller.write_text("""
               OpCapability Shader
               OpCapability Linkage
               OpMemoryModel Logical GLSL450
               OpEntryPoint Fragment %main "main" %roughness %color
               OpExecutionMode %main OriginUpperLeft
               OpDecorate %roughness Location 0
               OpDecorate %color Location 0
               OpDecorate %alpha_from_roughness LinkageAttributes "alpha_from_roughness" Import
       %void = OpTypeVoid
      %float = OpTypeFloat 32
    %to_void = OpTypeFunction %void
   %to_float = OpTypeFunction %float %float
   %ptr_in   = OpTypePointer Input %float
   %ptr_out  = OpTypePointer Output %float
  %roughness = OpVariable %ptr_in Input
      %color = OpVariable %ptr_out Output
%alpha_from_roughness = OpFunction %float None %to_float
          %a = OpFunctionParameter %float
               OpFunctionEnd
       %main = OpFunction %void None %to_void
      %label = OpLabel
          %x = OpLoad %float %roughness
          %y = OpFunctionCall %float %alpha_from_roughness %x
               OpStore %color %y
               OpReturn
               OpFunctionEnd
""")
run("spirv-as: caller", "spirv-as", "--target-env", "spv1.0", caller, "-o", work / "caller.spv")
linked = work / "linked.spv"
if run("spirv-link: caller and kinran.spv", "spirv-link", "--target-env", "spv1.0", work / "caller.spv", module, "-o", linked):
    run("spirv-val: linked", "spirv-val", "--target-env", "vulkan1.0", linked)
print("spirv: kinran.spv, linked")

if failures:
    raise SystemExit(f"{len(failures)} failed: " + "; ".join(failures))
