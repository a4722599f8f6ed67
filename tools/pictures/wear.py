#!/usr/bin/env python3
"""Puts the maps of a folder on a model: python3 tools/pictures/wear.py MODEL.glb FOLDER OUT.glb

MODEL.glb is one that `kinran demo` wrote; FOLDER holds albedo.png, normal.png (green up), roughness.png and metallic.png of one
size, 8 bits and not interlaced; without metallic.png all is metal. The first material wears them in place of its own maps, three
times across. Needs Python 3.9 and nothing else.
"""

import json
import struct
import sys
import zlib
from pathlib import Path


def read_png(path):
    """Width, height, channels and the bytes of an 8-bit PNG."""
    data = path.read_bytes()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, depth, color, _, _, interlaced = struct.unpack(">IIBBBBB", body)
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    channels = {0: 1, 2: 3, 4: 2, 6: 4}.get(color)
    if depth != 8 or channels is None or interlaced:
        sys.exit(f"{path}: save it with 8 bits a channel, without a palette, not interlaced")
    raw, row = zlib.decompress(packed), width * channels
    pixels, above = bytearray(), bytes(row)
    for y in range(height):
        kind, line = raw[y * (row + 1)], bytearray(raw[y * (row + 1) + 1 : (y + 1) * (row + 1)])
        for x in range(row):
            left = line[x - channels] if x >= channels else 0
            corner = above[x - channels] if x >= channels else 0
            if kind == 1:
                add = left
            elif kind == 2:
                add = above[x]
            elif kind == 3:
                add = (left + above[x]) // 2
            elif kind == 4:
                # Paeth: the neighbour nearest to what a plane would have.
                plane = left + above[x] - corner
                add = min((left, above[x], corner), key=lambda v: abs(plane - v))
            else:
                add = 0
            line[x] = (line[x] + add) & 255
        pixels += line
        above = bytes(line)
    return width, height, channels, bytes(pixels)


def write_png(width, height, rgb):
    """The bytes of an 8-bit RGB PNG."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    row = 3 * width
    raw = b"".join(b"\0" + rgb[y * row : (y + 1) * row] for y in range(height))
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")


def main(model, folder, out):
    data = Path(model).read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    document, binary = json.loads(data[20 : 20 + length]), bytearray(data[28 + length :])
    folder = Path(folder)
    width, height, of_roughness, roughness = read_png(folder / "roughness.png")
    size, of_metallic, metallic = [width, height], 1, bytes([255]) * (width * height)
    if (folder / "metallic.png").exists():
        *size, of_metallic, metallic = read_png(folder / "metallic.png")
    if size != [width, height]:
        sys.exit(f"{folder}: roughness.png and metallic.png differ in size")
    green, blue = roughness[::of_roughness], metallic[::of_metallic]
    packed = bytes(v for pair in zip(green, blue) for v in (255, *pair))
    maps = {
        "albedo": (folder / "albedo.png").read_bytes(),
        "normal": (folder / "normal.png").read_bytes(),
        "metallicRoughness": write_png(width, height, packed),
    }
    places = {}
    for name, png in maps.items():
        binary += bytes(-len(binary) % 4)
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(png)})
        binary += png
        document["images"].append(
            {"name": name, "mimeType": "image/png", "bufferView": len(document["bufferViews"]) - 1}
        )
        document["textures"].append({"sampler": 0, "source": len(document["images"]) - 1})
        scale = {"KHR_texture_transform": {"scale": [3, 3]}}
        places[name] = {"index": len(document["textures"]) - 1, "extensions": scale}
    document["materials"][0] = {
        "name": folder.name,
        "doubleSided": True,
        "normalTexture": places["normal"],
        "pbrMetallicRoughness": {
            "baseColorTexture": places["albedo"],
            "metallicRoughnessTexture": places["metallicRoughness"],
        },
    }
    used = set(document.get("extensionsUsed", [])) | {"KHR_texture_transform"}
    document["extensionsUsed"] = sorted(used - {"KHR_materials_anisotropy"})
    binary += bytes(-len(binary) % 4)
    document["buffers"][0]["byteLength"] = len(binary)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    whole = 12 + 8 + len(text) + 8 + len(binary)
    head = struct.pack("<4sII", b"glTF", 2, whole) + struct.pack("<I4s", len(text), b"JSON")
    Path(out).write_bytes(head + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
