#!/usr/bin/env bash
# Expected: `wgslFn` takes any WGSL function. One without a result, such as one that gives several numbers through
# pointers, is a function of type void: the parser has that word as its default.
# What happens: the default is never reached. The pattern wants a word behind the parameters, so a function without `->`
# is refused with "Function is not a WGSL code", unless a word follows by chance. Attributes in front (`@must_use`) are
# refused in the same words. A structure as a parameter is taken, and its type is undefined in silence; as the result it
# is its own name.
# Why care: whoever moves a library of WGSL into three.js (several results by pointers, structures) is told that valid
# code is none, without a place. What works is one `wgsl(text)` with everything in it, and small functions that call it.
# Version: three 0.187.0. Source: src/renderers/webgpu/nodes/WGSLNodeFunction.js, `declarationRegexp`, `wgslTypeLib`.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-audit --no-fund three@0.187.0 >/dev/null
cat > check.mjs <<'JS'
globalThis.self = globalThis;
const { REVISION } = await import('three');
const { default: WGSLNodeFunction } = await import('three/src/renderers/webgpu/nodes/WGSLNodeFunction.js');
console.log(`three r${REVISION}`);
const told = (source) => {
	try {
		const { type, inputs } = new WGSLNodeFunction(source);
		return `${type} of ${inputs.map((input) => String(input.type)).join(', ')}`;
	} catch (error) {
		return error.message;
	}
};
const refused = 'THREE.WGSLNodeFunction: Function is not a WGSL code.';
const cases = [
	['fn f(a: f32) -> f32 { return a; }', 'float of float'],
	['fn f(a: ptr<function, f32>) { *a = 1.0; }', refused],
	['@must_use fn f(a: f32) -> f32 { return a; }', refused],
	['fn f(s: Lobe) -> f32 { return s.alpha; }', 'float of undefined'],
	['fn f(a: f32) -> Lobe { return Lobe(a); }', 'Lobe of float'],
];
let same = true;
for (const [source, wanted] of cases) {
	const got = told(source);
	console.log(`${source}\n    ${got}`);
	same &&= got === wanted;
}
process.exit(same ? 0 : 1);
JS
node check.mjs
