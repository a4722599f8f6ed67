// Reads every FOLDER/NAME.ktx2 with ktx-parse and writes NAME.ktx2.levels (all levels from 0, decompressed)
// and NAME.ktx2.json (what the container says).
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { read } from 'ktx-parse';
import { ZSTDDecoder } from 'zstddec';

const zstd = new ZSTDDecoder();
await zstd.init();
const folder = process.argv[2];
for (const name of readdirSync(folder).filter((name) => name.endsWith('.ktx2')).sort()) {
	const file = read(new Uint8Array(readFileSync(join(folder, name))));
	const levels = file.levels.map(({ levelData, uncompressedByteLength }) =>
		file.supercompressionScheme === 2 ? zstd.decode(levelData, uncompressedByteLength) : levelData);
	writeFileSync(join(folder, name + '.levels'), Buffer.concat(levels));
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
