"""Compares every level of a KTX2 file, as WebGL sampled it, with what texture2ddecoder makes of the file.

Usage: compare.py FILE.ktx2 TEXELS.rgba. The container is read here by the specification (KTX 2.0, section 3), the
blocks by texture2ddecoder, so that nothing is shared with three.js or with the writer. BC7 must agree exactly when
it is not sRGB; decoders of the others may round interpolated values up or down: 1/255, sRGB after a round trip too.
"""
import struct
import sys

import numpy as np
import texture2ddecoder
import zstandard

# VkFormat: decoder, channels, sRGB.
FORMATS = {
    131: ("bc1", 3, False), 132: ("bc1", 3, True), 133: ("bc1", 3, False), 134: ("bc1", 3, True),
    139: ("bc4", 1, False), 141: ("bc5", 2, False), 145: ("bc7", 4, False), 146: ("bc7", 4, True),
}  # fmt: skip


def main():
    path, texels = sys.argv[1:]
    data = open(path, "rb").read()
    vk_format, _, width, height, _, _, _, levels, scheme = struct.unpack_from("<9I", data, 12)
    format, channels, srgb = FORMATS[vk_format]
    tolerance = 0 if format == "bc7" and not srgb else 1
    ours = np.fromfile(texels, np.uint8)
    at = 0
    worst = means = 0.0
    for level in range(levels):
        offset, length, raw = struct.unpack_from("<3Q", data, 80 + 24 * level)
        blocks = data[offset:offset + length]
        if scheme == 2:
            blocks = zstandard.ZstdDecompressor().decompress(blocks, max_output_size=raw)
        w, h = max(1, width >> level), max(1, height >> level)
        decode = getattr(texture2ddecoder, f"decode_{format}")
        bgra = np.frombuffer(decode(blocks, w, h), np.uint8).reshape(h, w, 4)
        wanted = bgra[..., [2, 1, 0, 3]][..., :channels].astype(np.float64)
        # The first row of the file has v = 0, and so is the first row that WebGL reads back.
        got = ours[at:at + w * h * 4].reshape(h, w, 4)[..., :channels].astype(np.float64)
        at += w * h * 4
        difference = np.abs(got - wanted)
        if difference.max() > tolerance:
            y, x, c = np.unravel_index(difference.argmax(), difference.shape)
            sys.exit(f"level {level}, texel {x}, {y}, channel {c}: "
                     f"WebGL {got[y, x, c]:.0f}, texture2ddecoder {wanted[y, x, c]:.0f}, allowed are {tolerance}")
        worst = max(worst, difference.max())
        means = max(means, np.abs(got.mean((0, 1)) - wanted.mean((0, 1))).max())
    if at != len(ours):
        sys.exit(f"{len(ours)} bytes were sampled, the file's levels have {at}")
    print(f"texels within {worst:.0f}/255, level means within {means:.3f}/255")


main()
