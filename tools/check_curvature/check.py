"""Curvature by Kinran, libigl and PyMeshLab, vertex by vertex: of OBJ meshes, or without any of two made here.

Each mesh is handed to Kinran as glTF without normals; curvature comes back as the JSON dump of `kinran bake`, without
blur and with concave curvature clamped at zero, so that of the others is clamped too. Differences are medians over
vertices of the larger difference of both principal curvatures (libigl) and of the mean curvature where nothing was
clamped (PyMeshLab), over the median of libigl's larger principal curvature. Where the truth is known, on a torus without
and with the noise of a scan, Kinran's fit and libigl's, over two rings both, are held against it.
"""

import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import igl
import numpy as np
import pymeshlab


def read_obj(path):
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        parts = line.split()
        if parts[:1] == ["v"]:
            vertices.append([float(x) for x in parts[1:4]])
        elif parts[:1] == ["f"]:
            corners = [int(p.split("/")[0]) - 1 for p in parts[1:]]
            faces += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    return np.array(vertices, np.float32), np.array(faces, np.uint32)


def write_glb(path, vertices, faces):
    blob = vertices.tobytes() + faces.tobytes()
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"name": "mesh", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(vertices),
                "type": "VEC3",
                "min": vertices.min(0).tolist(),
                "max": vertices.max(0).tolist(),
            },
            {"bufferView": 1, "componentType": 5125, "count": int(faces.size), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": vertices.nbytes},
            {"buffer": 0, "byteOffset": vertices.nbytes, "byteLength": faces.nbytes},
        ],
        "buffers": [{"byteLength": len(blob)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(blob)) + b"BIN\0" + blob
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)


def ours(kinran, vertices, faces, method):
    """Of each given vertex; the dump may have several for one place."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        write_glb(folder / "mesh.glb", vertices, faces)
        subprocess.run(
            [kinran, "--quiet", "bake", folder / "mesh.glb", "-o", folder / "out", "--curvature", "all"]
            + ["--estimate-normals", "--unit-mm", "1", "--curvature-blur", "none", "--curvature-method", method]
            + ["--curvature-dump", "json"],
            check=True,
        )
        dump = json.loads((folder / "out" / "mesh_mesh_curvature.json").read_text())
    known = {tuple(np.float32(v["position"])): v["principal"] for v in dump["vertices"]}
    return np.array([known.get(tuple(v), (np.nan, np.nan)) for v in vertices])


def libigl(vertices, faces):
    result = igl.principal_curvature(vertices.astype(np.float64), faces.astype(np.int64), radius=2)
    pair = np.stack([result[2], result[3]], 1)
    return np.sort(pair, 1)[:, ::-1]


def meshlab(vertices, faces):
    """Mean curvature by quadric fitting, as the vertices' scalar."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices.astype(np.float64), faces.astype(np.int32)))
    meshes.compute_curvature_principal_directions_per_vertex(
        method="Quadric Fitting", curvcolormethod="Mean Curvature", autoclean=False
    )
    return meshes.current_mesh().vertex_scalar_array()


def made():
    """A torus, as it is and with noise of shares of an edge, and a lumpy ellipsoid: rows of vertices round and along them,
    moved by a sixth of a cell. The last of each is its principal curvatures where they are known."""
    random = np.random.default_rng(1)
    rows, columns = 48, 96
    step = 2 * np.pi / columns
    faces = np.array([[r, c] for r in range(rows) for c in range(columns)])

    def corner(right, up):
        r, c = (faces + [up, right]).T
        return r % rows * columns + c % columns

    quads = np.concatenate([np.stack([corner(0, 0), corner(1, 0), corner(1, 1)], 1),
                            np.stack([corner(0, 0), corner(1, 1), corner(0, 1)], 1)])  # fmt: skip
    r, c = (x.astype(float) for x in np.divmod(np.arange(rows * columns), columns))
    jitter = random.uniform(-1 / 6, 1 / 6, (2, rows * columns))
    along, u = (2 * np.pi / rows) * (r + jitter[0]), step * (c + jitter[1])
    ring = 1 + 0.4 * np.cos(along)
    torus = np.stack([ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(along)], 1)
    truth = np.sort(np.stack([np.full(len(u), 1 / 0.4), np.cos(along) / ring], 1), 1)[:, ::-1]
    edge = np.median(np.linalg.norm(torus[quads[:, 0]] - torus[quads[:, 1]], axis=1))
    for noise in [0, 0.005, 0.02]:
        name = f"torus, {noise:.1%} noise" if noise else "torus"
        moved = torus + random.normal(0, noise * edge, torus.shape) if noise else torus
        yield name, moved.astype(np.float32), quads.astype(np.uint32), truth

    # Rows from pole to pole, and a vertex at each.
    v = np.pi * (r + 1 + jitter[0]) / (rows + 1)
    lump = 1 + 0.08 * np.sin(3 * u) * np.sin(v) ** 3 + 0.1 * np.cos(4 * v)
    body = np.stack([np.sin(v) * np.cos(u), 0.7 * np.sin(v) * np.sin(u), 1.4 * np.cos(v)], 1) * lump[:, None]
    poles = [[0, 0, 1.4 * 1.1], [0, 0, -1.4 * 1.1]]
    inner = quads[np.tile(faces[:, 0] < rows - 1, 2)][:, [0, 2, 1]]
    around, top, bottom = np.arange(columns), rows * columns, rows * columns + 1
    after, last = (around + 1) % columns, (rows - 1) * columns
    caps = [np.stack([np.full(columns, top), around, after], 1),
            np.stack([np.full(columns, bottom), last + after, last + around], 1)]  # fmt: skip
    yield ("lumps", np.concatenate([body, poles]).astype(np.float32),
           np.concatenate([inner, *caps]).astype(np.uint32), None)  # fmt: skip


# Largest differences of both methods, half as much again as was measured, of meshes not in the list half as much again as
# of the scan. Of the torus they are the libraries' own error, 1.4 % as of a parabola, and with noise their noise, see the
# lines about its truth. Triangles of the goat's head are as large as its features, and the boot's laces are as thin as its
# triangles: what a vertex has there depends on the neighbours asked and their weights.
BOUNDS = {
    "torus": (0.021, 0.017),
    "torus, 0.5% noise": (0.033, 0.035),
    "torus, 2.0% noise": (0.12, 0.13),
    "lumps": (0.03, 0.03),
    "spot_triangulated": (0.11, 0.135),
    "goathead": (0.185, 0.19),
    "hand_closed": (0.06, 0.055),
    "boot": (0.68, 0.72),
}


def main():
    kinran = sys.argv[1]
    meshes = [(Path(p).stem, *read_obj(Path(p)), None) for p in sys.argv[2:]] or made()
    apart = []
    print(f"{'':16} {'':>9} {'':>9} {'libigl':^19} {'PyMeshLab':^19}")
    print(f"{'mesh':16} {'vertices':>9} {'median k':>9} {'normals':>9} {'fit':>9} {'normals':>9} {'fit':>9}")
    for name, vertices, faces, known in meshes:
        pair = libigl(vertices, faces)
        mean = meshlab(vertices, faces)
        convex = pair[:, 1] > 0
        # Convex is positive here; versions of PyMeshLab that have it the other way round are turned.
        mean = mean if np.median(mean[convex]) > 0 else -mean
        clamped = np.maximum(pair, 0)
        size = np.median(clamped[:, 0])
        row = []
        for method in ["normals", "fit"]:
            got = ours(kinran, vertices, faces, method)
            row.append(np.nanmedian(np.abs(got - clamped).max(1)) / size)
            row.append(np.nanmedian(np.abs(got.mean(1) - mean)[convex]) / size)
        row = [row[0], row[2], row[1], row[3]]
        if known is not None:
            # Both clamped at zero; got is of the fit.
            errors = [np.nanmedian(np.abs(one - np.maximum(known, 0)).max(1)) / size for one in [got, clamped]]
            print(f"{name:16} to the truth: fit {errors[0]:.3f}, libigl {errors[1]:.3f}")
            if not errors[0] < 0.6 * errors[1]:
                apart.append(f"{name} by its truth")
        print(f"{name:16} {len(vertices):9} {size:9.4f} " + " ".join(f"{x:9.3f}" for x in row))
        normals, fit = BOUNDS.get(name, (0.26, 0.27))
        if not (max(row[0], row[2]) < normals and max(row[1], row[3]) < fit):
            apart.append(name)
    if apart:
        sys.exit("curvature is not libigl's on " + ", ".join(apart))


main()
