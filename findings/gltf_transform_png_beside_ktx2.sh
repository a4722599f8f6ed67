#!/usr/bin/env bash
# Expected: a tool that only reads a glTF file and writes it again leaves a texture's two images as they are: the PNG in
# `source`, which every viewer can show, and the KTX2 of KHR_texture_basisu, which is optional. That pair is what the
# extension's text recommends for viewers that cannot read KTX2.
# What happens: the texture is written without `source`. The PNG stays in the file as an image that nothing uses (the
# next `prune` takes it away), and KHR_texture_basisu stands in `extensionsUsed` alone, not in `extensionsRequired`: the
# file says that viewers may ignore the extension, but for who does there is no image. No warning is logged.
# Why care: a model with fallbacks is drawn untextured after any step of a pipeline that goes through this library, by
# viewers that drew it before, and nothing in the file tells them that they need the extension.
# Version: @gltf-transform/core and extensions 4.5.1. Source: the reader takes one image a texture, and the extension's
# `preread` puts its own `source` in its place (packages/extensions/src/khr-texture-basisu/texture-basisu.ts).
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-audit --no-fund @gltf-transform/core@4.5.1 @gltf-transform/extensions@4.5.1 >/dev/null
cat > check.mjs <<'JS'
import { readFileSync } from 'node:fs';
import { Logger, NodeIO } from '@gltf-transform/core';
import { KHRTextureBasisu } from '@gltf-transform/extensions';

const version = JSON.parse(readFileSync('node_modules/@gltf-transform/core/package.json')).version;
const png = 'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==';
// The library does not look into a KTX2 file that it only copies: identifier and an empty header will do.
const ktx2 = Buffer.concat([Buffer.from('ab4b5458203230bb0d0a1a0a', 'hex'), Buffer.alloc(68)]);
const uri = (mime, bytes) => `data:${mime};base64,${bytes.toString('base64')}`;
const given = {
	asset: { version: '2.0' },
	extensionsUsed: ['KHR_texture_basisu'],
	images: [{ uri: uri('image/png', Buffer.from(png, 'base64')) }, { uri: uri('image/ktx2', ktx2) }],
	textures: [{ source: 0, extensions: { KHR_texture_basisu: { source: 1 } } }],
	materials: [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }],
};

let warnings = 0;
const logger = { debug() {}, info() {}, warn: () => warnings++, error: () => warnings++ };
const io = new NodeIO().registerExtensions([KHRTextureBasisu]).setLogger(logger);
const { json } = await io.writeJSON(await io.readJSON({ json: given, resources: {} }), {});
const [texture] = json.textures;
const mimes = json.images.map((image) => image.mimeType ?? image.uri);
console.log(`@gltf-transform ${version}: texture ${JSON.stringify(texture)}, images ${mimes}`);
console.log(`used ${json.extensionsUsed}, required ${json.extensionsRequired ?? 'none'}, ${warnings} warnings`);
const lost = texture.source === undefined && texture.extensions.KHR_texture_basisu !== undefined;
process.exitCode = lost && !json.extensionsRequired?.length && warnings === 0 ? 0 : 1;
JS
node check.mjs
