#!/usr/bin/env bash
# Expected: GLTFLoader's `parser.associations` leads from every texture of a loaded material back to the index in the
# file; three.js documents it as the map from objects to glTF indices, and tools that replace, count or report textures
# walk materials with it.
# What happens: a texture whose `texCoord` is 1 is a clone, and the clone has no association, unless it also carries
# KHR_texture_transform: there the loader hands the association on. `associations.get(texture)` is undefined for it,
# and reading `.textures` throws. The clone shares its `source` with the texture that the map does know.
# Why care: occlusion on a second set of UVs is the commonest use of a second set; a tool that works on every model
# with one set stops at the first light-mapped one.
# Version: three 0.187.0. Source: examples/jsm/loaders/GLTFLoader.js, GLTFParser.assignTexture.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-audit --no-fund three@0.187.0 >/dev/null
cat > check.mjs <<'JS'
// Just enough of a browser for the loader; the image is never looked at.
globalThis.self = globalThis;
globalThis.ProgressEvent = class extends Event {};
globalThis.createImageBitmap = async () => ({ width: 1, height: 1, close() {} });
const THREE = await import('three');
const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');

const png = 'data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==';
const positions = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer);
const uvs = Buffer.alloc(24);
const bytes = Buffer.concat([positions, uvs]);
const document = {
	asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
	buffers: [{ byteLength: bytes.length, uri: 'data:application/octet-stream;base64,' + bytes.toString('base64') }],
	bufferViews: [{ buffer: 0, byteLength: 36 }, { buffer: 0, byteOffset: 36, byteLength: 24 }],
	accessors: [
		{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] },
		{ bufferView: 1, componentType: 5126, count: 3, type: 'VEC2' },
	],
	images: [{ uri: png }], textures: [{ source: 0 }],
	materials: [{ occlusionTexture: { index: 0, texCoord: 1 }, pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }],
	meshes: [{ primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1, TEXCOORD_1: 1 }, material: 0 }] }],
};
const gltf = await new GLTFLoader().parseAsync(JSON.stringify(document), '');
let material;
gltf.scene.traverse((node) => { material ??= node.material; });
const of = (texture) => gltf.parser.associations.get(texture)?.textures;
const [first, second] = [of(material.map), of(material.aoMap)];
console.log(`three r${THREE.REVISION}: texCoord 0 is texture ${first}, texCoord 1 is texture ${second}, one source: ${material.map.source === material.aoMap.source}`);
process.exitCode = first === 0 && second === undefined && material.map.source === material.aoMap.source ? 0 : 1;
JS
node check.mjs
