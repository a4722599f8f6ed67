#!/usr/bin/env bash
# Expected: a vertex attribute that is stored in bytes with `normalized: true`, as glTF's codes for weights, wear or
# curvature in [0, 1] are, means the same numbers after it was loaded and exported.
# What happens: trimesh keeps such an attribute (its name begins with an underscore) and even its bytes, but not the
# flag: it hands out raw uint8, and the exported accessor has no `normalized`. By glTF's rules 255 now means 255.0
# where it meant 1.0. Both files are valid, and a comparison of the buffers finds no difference.
# Why care: a mask or tensor that went through a script which only moved or merged meshes is read 255 times too large
# by every tool that follows the specification, though the tool that wrote it and one that ignores the flag agree.
# Version: trimesh 5.2.0, numpy 2.4.6. Source: trimesh/exchange/gltf.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3 -m venv venv
venv/bin/pip install --quiet trimesh==5.2.0 numpy==2.4.6
cat > check.py <<'PY'
import base64
import io
import json
import struct
import sys

import trimesh

positions = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
wear = bytes([0, 64, 128, 255] * 3)
indices = struct.pack("<3H", 0, 1, 2)
data = positions + wear + indices
given = {
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "buffers": [{
        "byteLength": len(data),
        "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
    }],
    "bufferViews": [
        {"buffer": 0, "byteLength": 36},
        {"buffer": 0, "byteOffset": 36, "byteLength": 12},
        {"buffer": 0, "byteOffset": 48, "byteLength": 6},
    ],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5121, "normalized": True, "count": 3, "type": "VEC4"},
        {"bufferView": 2, "componentType": 5123, "count": 3, "type": "SCALAR"},
    ],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "_WEAR": 1}, "indices": 2}]}],
}
scene = trimesh.load(io.BytesIO(json.dumps(given).encode()), file_type="gltf")
[mesh] = scene.geometry.values()
held = mesh.vertex_attributes["_WEAR"]
files = scene.export(file_type="gltf")
document = json.loads(files["model.gltf"])
accessor = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["_WEAR"]]
view = document["bufferViews"][accessor["bufferView"]]
buffer = files[document["buffers"][view["buffer"]]["uri"]]
start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
kept = bytes(buffer[start:start + 12]) == wear
print(f"trimesh {trimesh.__version__}: in memory {held.dtype} {held[0].tolist()}; bytes kept: {kept}")
print(f"component type {accessor['componentType']}, normalized {accessor.get('normalized', False)}, was True")
sys.exit(0 if kept and accessor["componentType"] == 5121 and not accessor.get("normalized") else 1)
PY
venv/bin/python check.py
