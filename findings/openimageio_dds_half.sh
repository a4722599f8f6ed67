#!/usr/bin/env bash
# Expected: OpenImageIO reads DDS with a DX10 header, BC6H among it, which it decodes to half floats; so it reads the plain
# half-float form as well: DXGI format 10, R16G16B16A16_FLOAT, in which Direct3D and most tools keep HDR textures.
# What happens: BC6H opens, format 10 is refused with "Unsupported DXGI format: 10"; the compressed form is read and the
# plain one that it decodes to is not.
# Why care: who checks or converts HDR textures of an engine with `oiiotool` or its Python module can only do so after
# compressing them.
# Version: OpenImageIO 3.2.2.0 (PyPI). Source: src/dds.imageio/ddsinput.cpp, DDSInput::open.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv env
env/bin/pip install --quiet --disable-pip-version-check --only-binary :all: OpenImageIO==3.2.2.0
cat > check.py <<'PY'
import struct
from importlib.metadata import version

import OpenImageIO as oiio


def dds(dxgi, pixels, pitch, flag):
    """Four by four texels, one level, with a DX10 header."""
    pixel_format = struct.pack("<II4s5I", 32, 4, b"DX10", 0, 0, 0, 0, 0)
    header = struct.pack("<7I44x", 124, 0x1007 | flag, 4, 4, pitch, 0, 1) + pixel_format + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    return b"DDS " + header + struct.pack("<5I", dxgi, 3, 0, 1, 0) + pixels


files = {
    "BC6H_UF16 (95)": dds(95, bytes(16), 16, 0x80000),
    "R16G16B16A16_FLOAT (10)": dds(10, struct.pack("<4e", 0.5, 1.0, 2.0, 1.0) * 16, 32, 0x8),
}
print("OpenImageIO", version("OpenImageIO"))
answers = {}
for name, data in files.items():
    with open("a.dds", "wb") as out:
        out.write(data)
    image = oiio.ImageInput.open("a.dds")
    answers[name] = "read as " + str(image.spec().format) if image else oiio.geterror()
    print(f"{name}: {answers[name]}")
assert answers["BC6H_UF16 (95)"].startswith("read as half"), "BC6H is no longer read"
assert "Unsupported DXGI format" in answers["R16G16B16A16_FLOAT (10)"], "half floats are read now"
PY
env/bin/python check.py
