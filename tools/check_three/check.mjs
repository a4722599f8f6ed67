// The outer half of the check: serves the files, runs the page in Chromium, judges what it reports.
// Called by check.sh: check.mjs TOOLS CHROMIUM BAKED [SCREENSHOT [AUTHORED BESIDE]].
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { basename, dirname, extname, join, resolve, sep } from 'node:path';
import { fileURLToPath } from 'node:url';

const [tools, chromium, baked, screenshot, authored, beside] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const texels = mkdtempSync(join(tmpdir(), 'check-three-'));

// What each VkFormat must become, by three.js' names (three/src/constants.js).
const EXPECTED = {
	131: 'RGB_S3TC_DXT1_Format', 132: 'RGB_S3TC_DXT1_Format', 133: 'RGBA_S3TC_DXT1_Format', 134: 'RGBA_S3TC_DXT1_Format',
	139: 'RED_RGTC1_Format', 141: 'RED_GREEN_RGTC2_Format', 145: 'RGBA_BPTC_Format', 146: 'RGBA_BPTC_Format',
	37: 'RGBAFormat', 43: 'RGBAFormat', 97: 'RGBAFormat',
};
const SRGB_VK_FORMATS = new Set([43, 132, 134, 146]);
// Black background: a picture with fewer lit pixels shows nothing of the model, and a lit model has many colours.
const MIN_COVERED = 0.02;
const MIN_COLOURS = 100;

const MEDIA = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm',
	'.png': 'image/png', '.jpg': 'image/jpeg', '.gltf': 'model/gltf+json', '.glb': 'model/gltf-binary' };
const folders = { '': here, three: join(tools, 'node_modules/three'), baked: dirname(resolve(baked)) };
if (authored) folders.authored = dirname(resolve(authored));

function fileOf(url) {
	const parts = decodeURIComponent(new URL(url, 'http://x').pathname).split('/').slice(1);
	const folder = parts.length > 1 ? folders[parts.shift()] : here;
	const path = folder && resolve(folder, ...parts);
	return path && path.startsWith(folder + sep) ? path : undefined;
}

const server = createServer((request, response) => {
	if (request.method === 'POST') {
		// The texels of all levels of one texture, as WebGL samples them.
		const chunks = [];
		request.on('data', (chunk) => chunks.push(chunk)).on('end', () => {
			writeFileSync(join(texels, basename(request.url)), Buffer.concat(chunks));
			response.end();
		});
		return;
	}
	const path = fileOf(request.url);
	try {
		const bytes = readFileSync(path);
		response.writeHead(200, { 'Content-Type': MEDIA[extname(path).toLowerCase()] ?? 'application/octet-stream' });
		response.end(bytes);
	} catch {
		response.writeHead(404).end();
	}
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const origin = `http://127.0.0.1:${server.address().port}`;

const problems = [];
const { chromium: driver } = createRequire(join(tools, 'x.js'))('playwright-core');
const browser = await driver.launch({
	executablePath: chromium,
	// SwiftShader: the same picture on every machine, with or without a GPU.
	args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
try {
	const page = await browser.newPage({ viewport: { width: 1700, height: 1100 } });
	page.setDefaultTimeout(300000);
	page.on('console', (message) => {
		if (message.type() === 'error') problems.push(`console: ${message.text()}`);
		// Chromium tells that a read-back waits for the picture, which is what it is for.
		else if (message.type() === 'warning' && !/GPU stall due to ReadPixels/.test(message.text()))
			console.log(`warning ${message.text()}`);
	});
	page.on('pageerror', (error) => problems.push(`page: ${error.message}`));
	page.on('response', (r) => {
		if (r.status() >= 400 && !r.url().endsWith('/favicon.ico')) problems.push(`${r.status()} ${r.url()}`);
	});
	await page.goto(`${origin}/page.html`);
	await page.waitForFunction(() => window.check !== undefined);

	const url = (role, file) => `${origin}/${role}/${encodeURIComponent(basename(file))}`;
	const said = await page.evaluate((url) => window.check.load('baked', url), url('baked', baked));
	console.log(`three.js r${said.revision} on ${said.device}`);
	for (const texture of said.textures) await judge(texture);
	if (!said.textures.some((texture) => texture.ktx2)) problems.push(`${basename(baked)} refers to no KTX2 file`);
	for (const unused of said.unused) problems.push(`KTX2 texture ${unused} is on no material`);

	const picture = await page.evaluate(() => window.check.show('baked', 1));
	if (picture.covered < MIN_COVERED || picture.colours < MIN_COLOURS)
		problems.push(`picture: ${(100 * picture.covered).toFixed(1)} % covered with ${picture.colours} colours: empty?`);
	console.log(`picture ${(100 * picture.covered).toFixed(1)} % covered, ${picture.colours} colours`);
	if (screenshot) await page.locator('#shown').screenshot({ path: screenshot });

	if (authored) {
		await page.evaluate((url) => window.check.load('authored', url), url('authored', authored));
		for (const away of [1, 4]) {
			const { baked, authored } = await page.evaluate((away) => window.check.beside(away), away);
			console.log(`${away} x as far: RMSE to 64 samples a pixel: authored ${authored.toFixed(5)}, baked ${baked.toFixed(5)}`);
		}
		await page.locator('#sheet').screenshot({ path: beside });
	}
	const errors = await page.evaluate(() => window.check.errors());
	for (const error of errors) problems.push(`WebGL error ${error}`);
} catch (error) {
	problems.push(error.message.split('\n')[0]);
} finally {
	await browser.close();
	server.close();
	rmSync(texels, { recursive: true });
}
for (const problem of problems) console.log(`WRONG ${problem}`);
console.log(problems.length ? `${problems.length} wrong in ${basename(baked)}` : `ok ${basename(baked)}`);
process.exitCode = problems.length ? 1 : 0;

async function judge(texture) {
	const { name, slots, ktx2, format, width, height, levels, colorSpace } = texture;
	const before = problems.length;
	let compared = ktx2 && !texture.texels ? 'texels not compared: not blocks' : '';
	if (ktx2) {
		const path = fileOf(ktx2);
		const bytes = readFileSync(path);
		const vkFormat = bytes.readUInt32LE(12);
		const count = 1 + Math.floor(Math.log2(Math.max(bytes.readUInt32LE(20), bytes.readUInt32LE(24))));
		if (EXPECTED[vkFormat] !== format) problems.push(`${name}: VkFormat ${vkFormat} became ${format}, wanted ${EXPECTED[vkFormat]}`);
		if (levels !== count) problems.push(`${name}: ${levels} levels arrived, wanted ${count}`);
		if (SRGB_VK_FORMATS.has(vkFormat) !== (colorSpace === 'srgb')) problems.push(`${name}: VkFormat ${vkFormat} is read as "${colorSpace}"`);
		if (texture.texels && problems.length === before) {
			const run = spawnSync(join(tools, 'venv/bin/python'),
				[join(here, 'compare.py'), path, join(texels, texture.texels)], { encoding: 'utf8' });
			if (run.status !== 0) problems.push(`${name}: ${(run.stderr || run.stdout).trim()}`);
			else compared = run.stdout.trim();
		}
	}
	const space = colorSpace || 'data';
	console.log(`${problems.length > before ? 'WRONG  ' : 'texture'} ${name}  ${format}  ${width}x${height}  ${levels} levels  ${space}  [${slots.join(', ')}]  ${compared}`);
}
