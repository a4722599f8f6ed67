// Serves the packages and the models, and takes a picture of every model in every viewer: check.mjs TOOLS CHROMIUM MODEL OUT,
// where OUT has a folder for each target. Pictures go to OUT/VIEWER_MODEL_VIEW.png, what viewers said to OUT/said.json.
import { readFileSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { basename, dirname, extname, join, resolve, sep } from 'node:path';
import { fileURLToPath } from 'node:url';

const [tools, chromium, model, out] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const VIEWERS = {
	three: 'three', 'three-r183': 'three-r183', 'model-viewer': '@google/model-viewer', babylon: 'babylonjs',
	playcanvas: 'playcanvas', filament: 'filament', cesium: 'cesium',
};
const chosen = (process.env.VIEWERS ?? Object.keys(VIEWERS).join(' ')).split(' ');
// Sides of the pictures. From afar a texel's footprint is four times as wide; truth has 8 x 8 samples a pixel of it.
const VIEWS = { near: 256, far: 64, truth: 512 };
const ROUNDS = { authored: ['near', 'far', 'truth'], web: ['near', 'far'], desktop: ['near'], engine: ['near'] };

// What cannot be had.
const NOT_RUN = { babylon: { web: 'not run: its KTX2 decoder is in no npm package', desktop: 'not run: its KTX2 decoder is in no npm package' } };

const MEDIA = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm',
	'.json': 'application/json', '.css': 'text/css', '.png': 'image/png', '.jpg': 'image/jpeg',
	'.gltf': 'model/gltf+json', '.glb': 'model/gltf-binary' };
const packages = join(tools, 'node_modules');
const folders = { '': here, npm: packages, authored: dirname(resolve(model)) };
for (const target of Object.keys(ROUNDS).slice(1)) folders[target] = resolve(out, target);

const server = createServer((request, response) => {
	const parts = decodeURIComponent(new URL(request.url, 'http://x').pathname).split('/').slice(1);
	const folder = parts[0] in folders ? folders[parts.shift()] : here;
	const path = resolve(folder, ...parts);
	try {
		if (!path.startsWith(folder + sep)) throw new Error('outside');
		const bytes = readFileSync(path);
		response.writeHead(200, { 'Content-Type': MEDIA[extname(path).toLowerCase()] ?? 'application/octet-stream' });
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
	// SwiftShader: the same picture on every machine, with or without a GPU.
	args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const said = { viewers: {}, said: {} };
for (const viewer of chosen) {
	said.viewers[viewer] = JSON.parse(readFileSync(join(packages, VIEWERS[viewer], 'package.json'))).version;
	for (const [role, views] of Object.entries(ROUNDS)) {
		const words = (said.said[`${viewer} ${role}`] = []);
		if (NOT_RUN[viewer]?.[role]) {
			words.push(NOT_RUN[viewer][role]);
			continue;
		}
		for (const view of views) {
			const begun = Date.now();
			const page = await browser.newPage({ viewport: { width: VIEWS[view], height: VIEWS[view] } });
			page.setDefaultTimeout(120000);
			const say = (text) => { if (words.length < 6 && !words.includes(text)) words.push(text.slice(0, 200)); };
			page.on('console', (message) => { if (message.type() === 'error') say(message.text()); });
			page.on('pageerror', (error) => say(error.message));
			page.on('request', (r) => { if (!/^(data|blob):/.test(r.url()) && !r.url().startsWith(origin)) say(`asks for ${r.url()}`); });
			// Nothing but what is served here.
			await page.route((url) => url.origin !== origin && /^http/.test(url.protocol), (route) => route.abort());
			try {
				const url = encodeURIComponent(`/${role}/${basename(model)}`);
				await page.goto(`${origin}/page.html?viewer=${viewer}&model=${url}&side=${VIEWS[view]}`);
				await page.waitForFunction(() => window.result !== undefined, undefined);
				const result = await page.evaluate(() => window.result);
				if (result !== 'drawn') say(`refused: ${result}`);
				else await page.locator('#stage').screenshot({ path: join(out, `${viewer}_${role}_${view}.png`) });
			} catch (error) {
				say(`refused: ${error.message.split('\n')[0]}`);
			}
			await page.close();
			console.error(`${viewer} ${role} ${view}: ${((Date.now() - begun) / 1000).toFixed(1)} s ${words.join('; ')}`);
		}
	}
}
await browser.close();
server.close();
writeFileSync(join(out, 'said.json'), JSON.stringify(said, null, 1));
