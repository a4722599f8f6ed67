#!/usr/bin/env bash
# Expected: DDSLoader refuses a file of a format that it does not read: `load` calls onError, `loadAsync` rejects, as
# KTX2Loader does, so that a page can show its PNG instead.
# What happens: of files with a DX10 header it reads BC6H alone. For all others it writes a line to the console and then
# *succeeds*: the promise resolves with a texture of 0 x 0 without levels, whose format is null. That holds for BC7 and
# BC5, which every desktop has, and for BC1 too, which the loader reads under its older FourCC, DXT1: the very same
# block is a texture or nothing by the header it stands behind.
# Why care: BC7 has no FourCC, so every BC7 file has a DX10 header, and writers of the last ten years give one to BC5 and
# sRGB BC1 too. A fallback that waits for an error never comes: the material is drawn with an empty texture.
# Version: three 0.187.0. Source: examples/jsm/loaders/DDSLoader.js, `parse`, case FOURCC_DX10.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-audit --no-fund three@0.187.0 >/dev/null
cat > check.mjs <<'JS'
globalThis.self = globalThis;
globalThis.ProgressEvent = class extends Event {};
const { REVISION } = await import('three');
const { DDSLoader } = await import('three/addons/loaders/DDSLoader.js');
let complaints = 0;
console.error = () => complaints++;

// One block of 4 x 4 texels, with a DX10 header or a FourCC.
function dds({ code, fourCC = 'DX10', bytes = 16 }) {
	const words = new Uint32Array(fourCC === 'DX10' ? 37 : 32);
	words.set([0x20534444, 124, 0xa1007, 4, 4, bytes, 0, 1]);
	words.set([32, 4, Buffer.from(fourCC).readUInt32LE()], 19);
	words[27] = 0x1000;
	if (fourCC === 'DX10') words.set([code, 3, 0, 1, 0], 32);
	return Buffer.concat([Buffer.from(words.buffer), Buffer.alloc(bytes, 0x40)]);
}
async function load(name, file) {
	const before = complaints;
	const url = 'data:application/octet-stream;base64,' + file.toString('base64');
	const texture = await new DDSLoader().loadAsync(url).catch((error) => error);
	const { format, mipmaps, image } = texture;
	console.log(`${name}: resolved ${texture.isTexture === true}, format ${format}, ${mipmaps?.length} levels, ${image?.width} x ${image?.height}, ${complaints - before} lines on the console`);
	return texture.isTexture === true && format === null && mipmaps.length === 0;
}
console.log(`three r${REVISION}`);
const empty = [
	await load('BC7, DX10 header', dds({ code: 98 })),
	await load('BC5, DX10 header', dds({ code: 83 })),
	await load('BC1, DX10 header', dds({ code: 71, bytes: 8 })),
];
const read = [
	await load('BC1 as DXT1', dds({ fourCC: 'DXT1', bytes: 8 })),
	await load('BC6H, DX10 header', dds({ code: 95 })),
];
process.exitCode = empty.every(Boolean) && !read.some(Boolean) ? 0 : 1;
JS
node check.mjs
