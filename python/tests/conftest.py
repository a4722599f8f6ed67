import io
import json
import struct
import zlib

import numpy as np
import pytest


def png(array):
    """The bytes of an 8-bit PNG of height x width x 1 or 3, by the format's own text."""
    height, width, channels = array.shape
    rows = b"".join(b"\0" + row.tobytes() for row in array)
    out = io.BytesIO(b"\x89PNG\r\n\x1a\n")
    out.seek(0, 2)
    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2}[channels], 0, 0, 0)
    for name, data in ((b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
        out.write(struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)))
    return out.getvalue()


def bumps(side=32):
    """Codes of a normal map of two waves, +Y up."""
    y, x = np.mgrid[0:side, 0:side] * (2 * np.pi / 8)
    n = np.stack([0.6 * np.sin(x), 0.4 * np.sin(y), np.ones_like(x)], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    return np.round((0.5 * n + 0.5) * 255).astype(np.uint8)


@pytest.fixture
def normals():
    return bumps()


@pytest.fixture
def model():
    """A .gltf of one material and its file in memory."""
    document = {
        "asset": {"version": "2.0"},
        "materials": [{"name": "brass", "normalTexture": {"index": 0}}],
        "textures": [{"source": 0}],
        "images": [{"uri": "bumps.png"}],
    }
    return json.dumps(document).encode(), {"bumps.png": png(bumps())}


@pytest.fixture
def folder(tmp_path):
    """A folder of maps."""
    maps = tmp_path / "tin"
    maps.mkdir()
    (maps / "tin_normal.png").write_bytes(png(bumps()))
    (maps / "tin_roughness.png").write_bytes(png(np.full((32, 32, 1), 100, np.uint8)))
    return maps
