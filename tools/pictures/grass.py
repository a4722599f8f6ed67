#!/usr/bin/env python3
"""Writes a card of grass that is cut out: python3 tools/pictures/grass.py OUT.gltf

Blades two to four texels wide on a square of 512, alphaMode MASK. Needs Python 3.9 and nothing else.
"""
import base64
import json
import random
import struct
import sys
import zlib

SIDE = 512


def blades():
    """RGBA rows of the card."""
    rows = [bytearray(bytes([70, 120, 30, 0]) * SIDE) for _ in range(SIDE)]
    chance = random.Random(3)
    for _ in range(60):
        foot, lean = chance.uniform(0, SIDE), chance.uniform(-0.3, 0.3)
        half, top = chance.uniform(1.0, 2.2), int(chance.uniform(0, 0.6 * SIDE))
        color = [chance.randrange(50, 110), chance.randrange(110, 170), chance.randrange(20, 60)]
        for y in range(top, SIDE):
            middle = foot + lean * (SIDE - y)
            for x in range(int(middle) - 4, int(middle) + 5):
                alpha = min(max(half - abs(x - middle) + 0.5, 0.0), 1.0)
                at = x % SIDE * 4
                if alpha > 0.3:
                    rows[y][at:at + 3] = bytes(color)
                rows[y][at + 3] = max(rows[y][at + 3], round(alpha * 255))
    return rows


def png(rows):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 6, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def uri(mime, data):
    return f"data:{mime};base64,{base64.b64encode(data).decode()}"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    parts = [
        struct.pack("<12f", -1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0),
        struct.pack("<12f", *[0, 0, 1] * 4),
        struct.pack("<8f", 0, 1, 1, 1, 1, 0, 0, 0),
        struct.pack("<6H", 0, 1, 2, 0, 2, 3),
    ]
    starts = [sum(map(len, parts[:i])) for i in range(len(parts))]
    views = [{"buffer": 0, "byteOffset": at, "byteLength": len(part)} for at, part in zip(starts, parts)]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "buffers": [{"byteLength": sum(map(len, parts)), "uri": uri("application/octet-stream", b"".join(parts))}],
        "bufferViews": views,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0,
        }]}],
        "materials": [{
            "name": "grass", "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True,
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0}, "metallicFactor": 0, "roughnessFactor": 0.8,
            },
        }],
        "textures": [{"source": 0}],
        "images": [{"uri": uri("image/png", png(blades()))}],
    }
    with open(sys.argv[1], "w", encoding="utf-8") as out:
        json.dump(document, out)


main()
