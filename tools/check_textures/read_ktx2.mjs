// Reads every FOLDER/NAME.ktx2 with ktx-parse and writes NAME.ktx2.levels (all levels from 0, decompressed)
// and NAME.ktx2.json (what the container says); of UASTC also NAME.ktx2.rgba, all levels as Binomial's transcoder has them.
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { read } from 'ktx-parse';
import { ZSTDDecoder } from 'zstddec';

const zstd = new ZSTDDecoder();
await zstd.init();

// Binomial's transcoder, which three.js has as a script for workers.
const libs = new URL('./node_modules/three/examples/jsm/libs/basis/', import.meta.url);
const script = readFileSync(new URL('basis_transcoder.js', libs), 'utf8');
const load = new Function('require', '__dirname', `${script}; return BASIS;`);
const basis = await load(createRequire(import.meta.url), libs.pathname)({ wasmBinary: readFileSync(new URL('basis_transcoder.wasm', libs)) });
basis.initializeBasis();
const RGBA32 = 13;
function transcode(bytes) {
	const file = new basis.KTX2File(bytes);
	if (!file.isValid() || !file.startTranscoding()) throw new Error('Binomial\'s transcoder refuses the file');
	const levels = [];
	for (let level = 0; level < file.getLevels(); level++) {
		const texels = new Uint8Array(file.getImageTranscodedSizeInBytes(level, 0, 0, RGBA32));
		if (!file.transcodeImage(texels, level, 0, 0, RGBA32, 0, -1, -1)) throw new Error(`level ${level} is not transcoded`);
		levels.push(texels);
	}
	file.close();
	file.delete();
	return Buffer.concat(levels);
}

const folder = process.argv[2];
for (const name of readdirSync(folder).filter((name) => name.endsWith('.ktx2')).sort()) {
	const file = read(new Uint8Array(readFileSync(join(folder, name))));
	const levels = file.levels.map(({ levelData, uncompressedByteLength }) =>
		file.supercompressionScheme === 2 ? zstd.decode(levelData, uncompressedByteLength) : levelData);
	writeFileSync(join(folder, name + '.levels'), Buffer.concat(levels));
	if (file.dataFormatDescriptor[0].colorModel === 166)
		writeFileSync(join(folder, name + '.rgba'), transcode(new Uint8Array(readFileSync(join(folder, name)))));
	const { vkFormat, typeSize, pixelWidth, pixelHeight, supercompressionScheme } = file;
	// Values of keys that are not KTX's own come as bytes; ours are text with a NUL at the end.
	const keyValue = Object.fromEntries(Object.entries(file.keyValue).map(([key, value]) =>
		[key, typeof value === 'string' ? value : new TextDecoder().decode(value).replace(/\0$/, '')]));
	const { colorModel, transferFunction, colorPrimaries, texelBlockDimension, bytesPlane } =
		file.dataFormatDescriptor[0];
	writeFileSync(join(folder, name + '.json'), JSON.stringify({
		vkFormat, typeSize, pixelWidth, pixelHeight, supercompressionScheme, keyValue,
		colorModel, transferFunction, colorPrimaries, texelBlockDimension, bytesPlane: bytesPlane[0],
		samples: file.dataFormatDescriptor[0].samples.map(({ channelType, bitOffset, bitLength }) =>
			({ channelType, bitOffset, bitLength })),
		levelBytes: levels.map((level) => level.length),
	}));
}
