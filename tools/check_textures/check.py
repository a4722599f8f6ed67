"""Compares every texture in FOLDER, as foreign readers see it, with what our decoder made of it.

The containers are read by ktx-parse (see read_ktx2.mjs) and by OpenImageIO; the blocks are decoded by
texture2ddecoder and OpenImageIO, and for BC1, BC4 and BC5 by the specification's formula besides, since those
decoders round interpolated values to 8 bits, each in its own way. BC7, RGBA8 and RGBA16F must agree exactly, and what
was painted opaque in BC7 must be, in blocks with other texels too. UASTC is decoded by Binomial's transcoder, as three.js
brings it, from the file itself, and must agree exactly.
"""
import json
import struct
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import texture2ddecoder

# Format: VkFormat linear and sRGB, DXGI linear and sRGB (0: none), block side and bytes, KTX colour model.
FORMATS = {
    "bc1": ((133, 134), (71, 72), 4, 8, 128),
    "bc4": ((139, 0), (80, 0), 4, 8, 131),
    "bc5": ((141, 0), (83, 0), 4, 16, 132),
    "bc7": ((145, 146), (98, 99), 4, 16, 134),
    "rgba8": ((37, 43), (28, 29), 1, 4, 1),
    "rgba16f": ((97, 0), (10, 0), 1, 8, 1),
    "uastc": ((0, 0), (0, 0), 4, 16, 166),
}
# Channels that a format has; the others are 0, alpha is 1.
CHANNELS = {"bc1": 3, "bc4": 1, "bc5": 2, "bc7": 4, "rgba8": 4, "rgba16f": 4, "uastc": 4}


def check(condition, message):
    if not condition:
        raise AssertionError(message)


def equal(what, wanted, got):
    check(wanted == got, f"{what}: wanted {wanted}, got {got}")


def close(what, ours, theirs, tolerance):
    """Largest difference, in units of 1/255."""
    worst = float(np.abs(ours.astype(np.float64) - theirs).max()) * 255
    check(worst <= tolerance, f"{what}: differs by {worst:.4f}/255, allowed is {tolerance}/255")


def bc4_by_formula(blocks):
    """(n, 8) bytes -> (n, 16) values in 0..1: Khronos Data Format 1.4, section 18.4 (RGTC)."""
    ends = blocks[:, :2].astype(np.float64)
    bits = sum(blocks[:, 2 + i].astype(np.uint64) << np.uint64(8 * i) for i in range(6))
    index = (bits[:, None] >> (3 * np.arange(16, dtype=np.uint64))) & np.uint64(7)
    first, second = ends[:, :1], ends[:, 1:]
    step = np.arange(8)
    seven = (first * (8 - step) + second * (step - 1)) / 7
    five = (first * (6 - step) + second * (step - 1)) / 5
    table = np.where(first > second, seven, five)
    table[:, 0], table[:, 1] = ends[:, 0], ends[:, 1]
    table[:, 6] = np.where(ends[:, 0] > ends[:, 1], table[:, 6], 0)
    table[:, 7] = np.where(ends[:, 0] > ends[:, 1], table[:, 7], 255)
    return np.take_along_axis(table, index.astype(np.int64), 1) / 255


def bc1_by_formula(blocks):
    """(n, 8) bytes -> (n, 16, 3) values in 0..1: section 18.1 (S3TC), opaque blocks of four colours only,
    or of three without the fourth."""
    words = blocks.copy().view("<u2")
    ends = words[:, :2].astype(np.int64)
    rgb = np.stack([(ends >> 11) / 31, (ends >> 5 & 63) / 63, (ends & 31) / 31], -1)
    a, b = rgb[:, :1], rgb[:, 1:]
    four = np.concatenate([a, b, (2 * a + b) / 3, (a + 2 * b) / 3], 1)
    three = np.concatenate([a, b, (a + b) / 2, np.zeros_like(a)], 1)
    table = np.where((ends[:, 0] > ends[:, 1])[:, None, None], four, three)
    bits = words[:, 2].astype(np.uint64) | words[:, 3].astype(np.uint64) << np.uint64(16)
    index = (bits[:, None] >> (2 * np.arange(16, dtype=np.uint64))) & np.uint64(3)
    check(not ((ends[:, :1] <= ends[:, 1:]) & (index == 3)).any(), "a block uses the transparent index")
    return np.take_along_axis(table, index.astype(np.int64)[:, :, None], 1)


def untile(blocks, width, height):
    """(n, 16, c) texels by block -> (height, width, c)."""
    bw, bh = -(-width // 4), -(-height // 4)
    c = blocks.shape[-1]
    return blocks.reshape(bh, bw, 4, 4, c).swapaxes(1, 2).reshape(bh * 4, bw * 4, c)[:height, :width]


def check_level(what, format, data, width, height, ours):
    n = CHANNELS[format]
    ours = ours.reshape(height, width, 4)
    if format == "rgba16f":
        check((np.frombuffer(data, "<f2").reshape(height, width, 4) == ours).all(), f"{what}: halves differ")
        return
    if format == "uastc":
        return
    if format == "rgba8":
        theirs = np.frombuffer(data, np.uint8).reshape(height, width, 4)
        check((theirs == np.rint(ours * 255)).all(), f"{what}: bytes differ")
        return
    blocks = np.frombuffer(data, np.uint8).reshape(-1, FORMATS[format][3])
    if format == "bc1":
        # Our decoder rounds to 8 bits, correctly.
        close(f"{what} by formula", ours[..., :3], untile(bc1_by_formula(blocks), width, height), 0.5001)
    elif format != "bc7":
        halves = np.stack([bc4_by_formula(blocks[:, i:i + 8]) for i in range(0, 8 * n, 8)], -1)
        close(f"{what} by formula", ours[..., :n], untile(halves, width, height), 1e-4)
    decode = getattr(texture2ddecoder, f"decode_{format}")
    bgra = np.frombuffer(decode(data, width, height), np.uint8).reshape(height, width, 4)
    theirs = bgra[..., [2, 1, 0, 3]][..., :n]
    close(f"{what} by texture2ddecoder", ours[..., :n], theirs / 255, 1e-4 if format == "bc7" else 1.001)


    if format == "bc7":
        opaque = painted_alpha(width, height) > 1.001
        least = theirs[..., 3][opaque].min(initial=255)
        check(least == 255, f"{what}: an opaque texel has alpha {least} by texture2ddecoder")


def painted_alpha(width, height):
    """As in write_samples, before it is cut off at 1."""
    u, v = np.arange(width)[None, :] / width, np.arange(height)[:, None] / height
    return np.where((u < 0.3) & (v < 0.3), 1.3, 1.3 * (0.5 + 0.5 * np.cos(5 * (u - v))))


def expected_levels(width, height):
    sizes = [(width, height)]
    while sizes[-1] != (1, 1):
        sizes.append(tuple(max(1, s // 2) for s in sizes[-1]))
    return sizes


def check_levels(format, payload, width, height, ours):
    _, _, side, block_bytes, _ = FORMATS[format]
    texel = at = 0
    for i, (w, h) in enumerate(expected_levels(width, height)):
        length = -(-w // side) * -(-h // side) * block_bytes
        check_level(f"level {i}", format, payload[at:at + length], w, h, ours[texel:texel + w * h])
        at, texel = at + length, texel + w * h
    equal("bytes of all levels", at, len(payload))
    equal("texels of all levels", texel, len(ours))


def check_ktx2(path, format, srgb, width, height, compressed, ours):
    says = json.loads(path.with_name(path.name + ".json").read_text())
    vk, _, side, block_bytes, model = FORMATS[format]
    equal("vkFormat", vk[srgb], says["vkFormat"])
    equal("typeSize", 2 if format == "rgba16f" else 1, says["typeSize"])
    equal("size", (width, height), (says["pixelWidth"], says["pixelHeight"]))
    equal("supercompressionScheme", 2 if compressed else 0, says["supercompressionScheme"])
    equal("colorModel", model, says["colorModel"])
    equal("transferFunction", 2 if srgb else 1, says["transferFunction"])
    # Only colour has primaries.
    equal("colorPrimaries", 1 if srgb else 0, says["colorPrimaries"])
    equal("texelBlockDimension", [side - 1, side - 1, 0, 0], says["texelBlockDimension"])
    equal("bytesPlane", block_bytes, says["bytesPlane"])
    if format == "uastc":
        # RGBA, for the samples have alpha.
        equal("channel", 3, says["samples"][0]["channelType"])
        theirs = np.fromfile(path.with_name(path.name + ".rgba"), np.uint8).reshape(-1, 4)
        equal("texels by Binomial's transcoder", len(ours), len(theirs))
        close("by Binomial's transcoder", ours, theirs / 255, 1e-4)
    equal("levels", len(expected_levels(width, height)), len(says["levelBytes"]))
    keys = says["keyValue"]
    equal("keys", ["KTXorientation", "KTXwriter", "KinranFilter"], list(keys))
    equal("KTXorientation", "rd", keys["KTXorientation"])
    equal("KinranFilter", "none", keys["KinranFilter"])
    check(keys["KTXwriter"].startswith("Kinran "), f"KTXwriter is {keys['KTXwriter']}")
    check_levels(format, path.with_name(path.name + ".levels").read_bytes(), width, height, ours)


def check_dds(path, format, srgb, width, height, ours):
    data = path.read_bytes()
    magic, size, _, h, w, _, _, levels = struct.unpack_from("<4s7I", data)
    equal("magic", (b"DDS ", 124), (magic, size))
    equal("size", (width, height), (w, h))
    equal("levels", len(expected_levels(width, height)), levels)
    equal("FourCC", b"DX10", data[84:88])
    dxgi, dimension, _, array, _ = struct.unpack_from("<5I", data, 128)
    equal("DXGI format, dimension, array", (FORMATS[format][1][srgb], 3, 1), (dxgi, dimension, array))
    check_levels(format, data[148:], width, height, ours)

    # OpenImageIO knows no half floats in DDS.
    if format == "rgba16f":
        return
    file = oiio.ImageInput.open(str(path))
    check(file, f"OpenImageIO: {oiio.geterror()}")
    texel = 0
    for i, (w, h) in enumerate(expected_levels(width, height)):
        check(file.seek_subimage(0, i), f"OpenImageIO finds no level {i}")
        spec = file.spec()
        equal(f"OpenImageIO: size of level {i}", (w, h), (spec.width, spec.height))
        equal("OpenImageIO: sRGB", srgb, "srgb" in str(spec.getattribute("oiio:ColorSpace") or ""))
        n = CHANNELS[format]
        theirs = file.read_image(0, i, 0, spec.nchannels, "float").reshape(w * h, -1)[:, :n]
        exact = format in ("bc7", "rgba8")
        close(f"level {i} by OpenImageIO", ours[texel:texel + w * h, :n], theirs, 1e-4 if exact else 1.001)
        texel += w * h
    check(not file.seek_subimage(0, i + 1), "OpenImageIO finds a level too many")


def main():
    files = sorted(p for p in Path(sys.argv[1]).iterdir() if p.suffix in (".ktx2", ".dds"))
    # Nine formats with their transfer functions, three sizes, three containers; UASTC twice, in KTX2 alone.
    equal("number of files", 9 * 3 * 3 + 2 * 3 * 2, len(files))
    failures = 0
    for path in files:
        format, transfer, size, container = path.name.split("_")
        width, height = map(int, size.split("x"))
        ours = np.fromfile(path.with_name(path.name + ".f32"), "<f4").reshape(-1, 4)
        srgb = transfer == "srgb"
        try:
            if path.suffix == ".dds":
                check_dds(path, format, srgb, width, height, ours)
            else:
                check_ktx2(path, format, srgb, width, height, container.startswith("zstd"), ours)
            print(f"ok    {path.name}")
        except AssertionError as error:
            failures += 1
            print(f"WRONG {path.name}: {error}")
    print(f"{len(files) - failures} of {len(files)} textures are read alike by foreign readers")
    sys.exit(1 if failures else 0)


main()
