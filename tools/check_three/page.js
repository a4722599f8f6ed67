// The inner half of the check: loads glTF files with three.js, tells what arrived, draws.
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';

const SIDE = 512; // pixels of a picture
const FIELD_OF_VIEW = 30; // degrees
const VIEW = new THREE.Vector3(0.55, 0.35, 1).normalize(); // chosen by eye: from the front, a little aside and above
const LIGHT = new THREE.Vector3(-0.5, 0.8, 0.6); // chosen by eye: across the view, so that highlights are seen
const GROUND_TRUTH = 8; // samples along a pixel's side
const TILE = 1024; // samples along the side of what is drawn at once: SwiftShader's memory ends a little above

const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true });
renderer.toneMapping = THREE.ACESFilmicToneMapping;
renderer.setPixelRatio(1);
const gl = renderer.getContext();
const pmrem = new THREE.PMREMGenerator(renderer);
const environment = pmrem.fromScene(new RoomEnvironment(), 0.04).texture;

const ktx2Loader = new KTX2Loader().setTranscoderPath('/three/examples/jsm/libs/basis/').detectSupport(renderer);
const gltfLoader = new GLTFLoader().setKTX2Loader(ktx2Loader);

const formatNames = new Map(Object.entries(THREE).filter(([name]) => name.endsWith('Format')).map(([name, value]) => [value, name]));
const models = {};

// A full-screen triangle whose fragment shader is `body`.
const screen = new THREE.Mesh(new THREE.BufferGeometry(), null);
screen.geometry.setAttribute('position', new THREE.Float32BufferAttribute([-1, -1, 0, 3, -1, 0, -1, 3, 0], 3));
screen.frustumCulled = false;
function pass(uniforms, body) {
	return new THREE.ShaderMaterial({
		uniforms, depthTest: false, depthWrite: false, vertexShader: 'void main() { gl_Position = vec4(position, 1.0); }',
		fragmentShader: `uniform sampler2D map; uniform float level, side; uniform vec2 size, corner; void main() { ${body} }`,
	});
}
const levelPass = pass({ map: {}, level: {}, size: { value: new THREE.Vector2() } },
	'gl_FragColor = textureLod(map, gl_FragCoord.xy / size, level);');
// The mean of side x side texels, then the tone curve: filtering comes before it, as light adds up on a sensor.
const developPass = pass({ map: {}, side: {}, corner: { value: new THREE.Vector2() } }, `
	int n = int(side);
	vec4 sum = vec4(0.0);
	for (int y = 0; y < n; y++) for (int x = 0; x < n; x++) sum += texelFetch(map, ivec2(gl_FragCoord.xy - corner) * n + ivec2(x, y), 0);
	gl_FragColor = vec4(sum.rgb / float(n * n), 1.0);
	#include <tonemapping_fragment>
	#include <colorspace_fragment>`.replace(/#include/g, '\n#include') + '\n');
const noCamera = new THREE.Camera();
function run(material, target) {
	screen.material = material;
	renderer.setRenderTarget(target);
	renderer.render(screen, noCamera);
	renderer.setRenderTarget(null);
}

// Loads a file; what it says of its textures, in the file's order.
async function load(role, url) {
	const gltf = await gltfLoader.loadAsync(url);
	models[role] = gltf.scene;
	const { json, associations } = gltf.parser;
	// Of a map on a second set of UVs three.js makes a copy, of which the parser knows nothing but its image.
	const ofImage = new Map();
	for (const [object, { textures }] of associations) if (object.isTexture) ofImage.set(object.source, textures);
	const indexOf = (texture) => associations.get(texture)?.textures ?? ofImage.get(texture.source);
	const seen = new Map();
	gltf.scene.traverse((node) => {
		for (const material of [node.material ?? []].flat())
			for (const [slot, texture] of Object.entries(material))
				if (texture?.isTexture) {
					const index = indexOf(texture);
					if (!seen.has(texture)) seen.set(texture, { index, slots: new Set() });
					seen.get(texture).slots.add(slot);
				}
	});
	const source = (index) => json.textures[index].extensions?.KHR_texture_basisu?.source;
	const textures = [];
	for (const [texture, { index, slots }] of [...seen].sort((a, b) => a[1].index - b[1].index)) {
		const image = json.images[source(index) ?? json.textures[index].source];
		const ktx2 = source(index) === undefined ? undefined : new URL(image.uri, url).href;
		const levels = texture.mipmaps.length || (texture.generateMipmaps ? 'own' : 1);
		textures.push({
			name: image.uri && !image.uri.startsWith('data:') ? image.uri : image.name ?? `texture ${index}`,
			slots: [...slots].sort(), ktx2, levels, colorSpace: texture.colorSpace,
			format: (texture.isCompressedTexture || !ktx2 || texture.isDataTexture ? '' : 'fallen back to ') + formatNames.get(texture.format),
			width: texture.image.width, height: texture.image.height,
			...(ktx2 && texture.isCompressedTexture ? await sendTexels(texture, textures.length) : {}),
		});
	}
	const used = new Set([...seen.values()].map(({ index }) => index));
	const unused = (json.textures ?? []).map((_, i) => i).filter((i) => source(i) !== undefined && !used.has(i));
	const info = gl.getExtension('WEBGL_debug_renderer_info');
	return { textures, unused, revision: THREE.REVISION, device: gl.getParameter(info.UNMASKED_RENDERER_WEBGL) };
}

// Every level as a draw call samples it, to the server as RGBA bytes; the name under which it finds them.
async function sendTexels(texture, number) {
	const bytes = [];
	for (const [level, { width, height }] of texture.mipmaps.entries()) {
		const target = new THREE.WebGLRenderTarget(width, height, { depthBuffer: false, colorSpace: texture.colorSpace });
		levelPass.uniforms.map.value = texture;
		levelPass.uniforms.level.value = level;
		levelPass.uniforms.size.value.set(width, height);
		run(levelPass, target);
		const pixels = new Uint8Array(width * height * 4);
		renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
		bytes.push(pixels);
		target.dispose();
	}
	const texels = `${number}.rgba`;
	await fetch(`/${texels}`, { method: 'POST', body: new Blob(bytes) });
	return { texels };
}

// Draws a model onto the canvas as it looks from `away` times the distance that fills SIDE pixels: only the part
// that it covers, so SIDE / away pixels a side, with `samples` x `samples` shading samples a pixel.
function draw(role, away, samples) {
	const model = models[role];
	const scene = new THREE.Scene();
	scene.environment = environment;
	scene.environmentIntensity = 0.5; // chosen by eye: white stays below white
	const sphere = new THREE.Box3().setFromObject(model).getBoundingSphere(new THREE.Sphere());
	const distance = away * sphere.radius / Math.sin(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2)) * 0.85;
	const angle = 2 * Math.atan(Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2)) / away);
	const camera = new THREE.PerspectiveCamera(THREE.MathUtils.radToDeg(angle), 1, distance / 100, distance * 4);
	camera.position.copy(sphere.center).addScaledVector(VIEW, distance);
	camera.lookAt(sphere.center);
	const light = new THREE.DirectionalLight(0xffffff, 1.5);
	light.target.position.copy(sphere.center);
	light.position.copy(sphere.center).addScaledVector(LIGHT, sphere.radius);
	scene.add(model, light, light.target);

	const side = SIDE / away;
	const tile = Math.min(side, TILE / samples);
	const target = new THREE.WebGLRenderTarget(tile * samples, tile * samples, { type: THREE.FloatType, samples: samples === 1 ? 4 : 0 });
	renderer.setSize(side, side);
	developPass.uniforms.map.value = target.texture;
	developPass.uniforms.side.value = samples;
	for (let y = 0; y < side; y += tile) for (let x = 0; x < side; x += tile) {
		camera.setViewOffset(side, side, x, y, tile, tile);
		renderer.setRenderTarget(target);
		renderer.render(scene, camera);
		developPass.uniforms.corner.value.set(x, side - tile - y);
		renderer.setViewport(x, side - tile - y, tile, tile);
		renderer.autoClear = false;
		run(developPass, null);
		renderer.autoClear = true;
	}
	renderer.setViewport(0, 0, side, side);
	target.dispose();
	const pixels = new Uint8Array(side * side * 4);
	gl.readPixels(0, 0, side, side, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
	return { pixels, url: renderer.domElement.toDataURL() };
}

async function show(role, away) {
	const { pixels, url } = draw(role, away, 1);
	const image = document.getElementById('shown');
	image.src = url;
	await image.decode();
	const colours = new Uint32Array(pixels.buffer);
	const black = colours.filter((colour) => (colour & 0xffffff) === 0).length;
	return { covered: 1 - black / colours.length, colours: new Set(colours).size };
}

// Adds a row to the sheet: authored, baked, ground truth; the root mean square differences to the last, of 0..1.
async function beside(away) {
	const views = [
		[`authored, ${away} x as far`, draw('authored', away, 1)],
		[`baked, ${away} x as far`, draw('baked', away, 1)],
		['64 samples a pixel of the authored maps', draw('authored', away, GROUND_TRUTH)],
	];
	for (const [caption, { url }] of views) {
		const figure = document.createElement('figure');
		figure.append(Object.assign(new Image(), { src: url }), Object.assign(document.createElement('figcaption'), { textContent: caption }));
		document.getElementById('sheet').append(figure);
		await figure.firstChild.decode();
	}
	const [authored, baked, truth] = views.map(([, { pixels }]) => pixels);
	const rmse = (a) => Math.sqrt(a.reduce((sum, value, i) => sum + (value - truth[i]) ** 2, 0) / (a.length * 3 / 4)) / 255;
	return { authored: rmse(authored), baked: rmse(baked) };
}

function errors() {
	const found = [];
	for (let error = gl.getError(); error !== gl.NO_ERROR; error = gl.getError()) found.push(error);
	return found;
}

window.check = { load, show, beside, errors };
