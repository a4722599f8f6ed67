"""Curvature of a sphere of 10 mm: 0.1 /mm in every direction, however its positions, indices and joints are stored."""

import numpy as np
from common import COMPONENTS, Gltf
from models import globe

RADIUS = 0.010
POSITIONS, NORMALS, UVS, TRIANGLES = globe(RADIUS)
INDICES = TRIANGLES.reshape(-1).astype(np.uint32)
COLUMNS, ROWS = 48, 32
QUANTISED = {"extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]}
# What a step of 14 bits on the sphere's width is in metres.
STEP = 2 * RADIUS / 16383
# Of 95 % of vertices, 1/mm: a step of a code is 2/255 of the curvature, and normals of bytes are off by half of 1/127
# at either end of an edge that turns by a 48th of a circle.
FROM_FLOATS = 0.1 / 127
FROM_BYTES = FROM_FLOATS + 0.1 / 127 / (2 * np.pi / COLUMNS)


def primitive(model, positions=POSITIONS, normals=NORMALS, uvs=UVS, indices=INDICES, **more):
    attributes = {
        "POSITION": model.accessor(positions.astype(np.float32)),
        "NORMAL": model.accessor(normals),
        "TEXCOORD_0": model.accessor(uvs),
    }
    return {"attributes": attributes, "indices": model.accessor(indices), "material": 0, **more}


def quantised(model):
    """Positions and UVs of 14 and 12 bits as whole numbers, normals of 8 bits."""
    positions = np.rint((POSITIONS / RADIUS * 0.5 + 0.5) * 16383).astype(np.uint16)
    normals = np.rint(NORMALS * 127).astype(np.int8)
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals, normalized=True),
        "TEXCOORD_0": model.accessor(np.rint(UVS * 4095).astype(np.uint16)),
    }
    return {"attributes": attributes, "indices": model.accessor(INDICES), "material": 0}


def normalised(model):
    """Positions of 16 bits as fractions."""
    made = primitive(model)
    made["attributes"]["POSITION"] = model.accessor(
        np.rint(POSITIONS / RADIUS * 32767).astype(np.int16), normalized=True
    )
    return made


def skinned(model, primitive, inverse_bind, joint=1.0, mesh=1.0, armature=1.0):
    """Scales of the inverse bind matrix, of the joint, of the mesh's node and of what is above both."""
    count = len(POSITIONS)
    weights = np.zeros((count, 4), np.float32)
    weights[:, 0] = 1
    primitive["attributes"] |= {
        "JOINTS_0": model.accessor(np.zeros((count, 4), np.uint8)),
        "WEIGHTS_0": model.accessor(weights),
    }
    matrix = np.diag([inverse_bind] * 3 + [1]).astype(np.float32).reshape(1, 16)
    model.json["skins"] = [{"joints": [2], "inverseBindMatrices": model.accessor(matrix)}]
    nodes = [
        {"children": [1, 2], "scale": [armature] * 3},
        {"mesh": 0, "skin": 0, "scale": [mesh] * 3},
        {"scale": [joint] * 3},
    ]
    model.scene([primitive], nodes)


def strip():
    """One strip for each row of the sphere, joined by triangles without area."""
    rows = [
        np.stack([np.arange(COLUMNS + 1) + row * (COLUMNS + 1), np.arange(COLUMNS + 1) + (row + 1) * (COLUMNS + 1)], 1)
        for row in range(ROWS)
    ]
    joined = [part for row in rows for part in ([row[0, 0]], row.reshape(-1), [row[-1, 1]])]
    return np.concatenate(joined)[1:-1].astype(np.uint32)


def sparse(model, view):
    """Positions of nothing, or of zeros, replaced one and all."""
    made = primitive(model)
    accessor = model.json["accessors"][made["attributes"]["POSITION"]]
    accessor["bufferView"] = model.view(bytes(POSITIONS.nbytes))
    if not view:
        del accessor["bufferView"]
    indices = np.arange(len(POSITIONS), dtype=np.uint16)
    accessor["sparse"] = {
        "count": len(POSITIONS),
        "indices": {"bufferView": model.view(indices.tobytes()), "componentType": 5123},
        "values": {"bufferView": model.view(POSITIONS.tobytes())},
    }
    return made


def interleaved(model):
    made = primitive(model)
    view = model.view(np.concatenate([POSITIONS, NORMALS, UVS], 1).astype(np.float32).tobytes(), byteStride=32)
    for name, offset in [("POSITION", 0), ("NORMAL", 12), ("TEXCOORD_0", 24)]:
        model.json["accessors"][made["attributes"][name]] |= {"bufferView": view, "byteOffset": offset}
    return made


def one(build, nodes=None, **more):
    """A document of one primitive under these nodes."""

    def make(model):
        model.scene([build(model)], nodes)
        model.json |= more

    return make


def several(*primitives):
    return lambda model: model.scene([build(model) for build in primitives])


def shared(model):
    """Two primitives, one of them skin, of the same vertices."""
    half = len(INDICES) // 6 * 3
    skin = primitive(model, indices=INDICES[:half])
    cloth = {"attributes": dict(skin["attributes"]), "indices": model.accessor(INDICES[half:]), "material": 1}
    model.scene([skin, cloth])


def fan(model):
    """A pole as a fan, the rest as triangles."""
    rest = primitive(model, indices=INDICES[3 * COLUMNS :])
    pole = np.array([0, *range(COLUMNS + 1, 2 * COLUMNS + 2)], np.uint32)
    model.scene(
        [rest, {"attributes": dict(rest["attributes"]), "indices": model.accessor(pole), "material": 0, "mode": 6}]
    )


def fin(model):
    """A triangle that stands on an edge of two others."""
    edge = ROWS // 2 * (COLUMNS + 1)
    tip = np.array([[0, 3 * RADIUS, 0]], np.float32)
    model.scene(
        [
            primitive(
                model,
                np.concatenate([POSITIONS, tip]),
                np.concatenate([NORMALS, np.eye(3, dtype=np.float32)[2:]]),
                np.concatenate([UVS, np.zeros((1, 2), np.float32)]),
                np.concatenate([INDICES, [edge, edge + 1, len(POSITIONS)]]).astype(np.uint32),
            )
        ]
    )


def scaled(*scale, **more):
    return [{"mesh": 0, "scale": list(scale), **more}]


def no_normal(model):
    normals = NORMALS.copy()
    normals[5] = 0
    return primitive(model, normals=normals)


def morphed(model):
    target = {
        "POSITION": model.accessor((POSITIONS * 0.5).astype(np.float32)),
        "NORMAL": model.accessor(np.zeros_like(NORMALS)),
    }
    return primitive(model, targets=[target])


def without_indices(model):
    made = primitive(model, POSITIONS[INDICES], NORMALS[INDICES], UVS[INDICES])
    del made["indices"]
    return made


# What makes the document, millimetres of its unit of length, and what a warning must say.
MESHES = {
    "floats": (one(primitive), 1000, ""),
    "quantised": (one(quantised, scaled(STEP, STEP, STEP, translation=[-RADIUS] * 3), **QUANTISED), 1000 * STEP, ""),
    "normalised": (one(normalised, scaled(RADIUS, RADIUS, RADIUS), **QUANTISED), 1000 * RADIUS, ""),
    "skin_quantised": (
        lambda model: (skinned(model, quantised(model), STEP), model.json.update(QUANTISED)),
        1000 * STEP,
        "rest pose",
    ),
    "skin_small_joint": (
        lambda model: skinned(model, primitive(model, POSITIONS * 100), 1, joint=0.01),
        10,
        "rest pose",
    ),
    "skin_node_without_effect": (lambda model: skinned(model, primitive(model), 1, mesh=100), 1000, "rest pose"),
    "skin_small_armature": (
        lambda model: skinned(model, primitive(model, POSITIONS * 100), 1, armature=0.01),
        10,
        "rest pose",
    ),
    "skin_armature_undone": (lambda model: skinned(model, primitive(model), 100, armature=0.01), 1000, "rest pose"),
    "mirrored": (one(primitive, scaled(-1, 1, 1)), 1000, ""),
    "mirrored_thrice": (one(lambda model: primitive(model, POSITIONS * 100), scaled(-0.01, -0.01, -0.01)), 10, ""),
    "strip": (one(lambda model: primitive(model, indices=strip(), mode=5)), 1000, ""),
    "small_indices": (one(lambda model: primitive(model, indices=INDICES.astype(np.uint16))), 1000, ""),
    "no_indices": (one(without_indices), 1000, ""),
    "sparse": (one(lambda model: sparse(model, True)), 1000, ""),
    "sparse_of_nothing": (one(lambda model: sparse(model, False)), 1000, ""),
    "interleaved": (one(interleaved), 1000, ""),
    "shared_vertices": (shared, 1000, ""),
    "morphed": (one(morphed), 1000, "morph targets"),
    "turned_triangles": (
        one(lambda model: primitive(model, indices=TRIANGLES[:, ::-1].reshape(-1).astype(np.uint32))),
        1000,
        "",
    ),
    "normal_of_no_length": (one(no_normal), 1000, "no length"),
    "points_and_lines": (
        several(
            primitive,
            lambda model: primitive(model, indices=INDICES[:200], mode=1),
            lambda model: primitive(model, mode=0),
        ),
        1000,
        "points or lines",
    ),
    "fan": (fan, 1000, ""),
    "triangles_twice": (
        one(lambda model: primitive(model, indices=np.concatenate([INDICES, INDICES[:900]]))),
        1000,
        "",
    ),
    "fin": (fin, 1000, ""),
}


def baked_tensors(kind, name, make):
    """xx, xy, yy and mean of each primitive's vertices, or None where it has none; its millimetres; the warnings."""
    model = Gltf()
    model.json["materials"] = [{"name": "skin"}, {"name": "cloth"}]
    make(model)
    path = kind.inputs(name, {"model.glb": model.bytes()}) / "model.glb"
    baked = kind.bake(path, "--skin", "skin", "--curvature-blur", "none")
    if not baked:
        return path, [], [], []
    document, blob = baked.model()
    tensors, units = [], []
    for made in document["meshes"][0]["primitives"]:
        says = made.get("extensions", {}).get("KINRAN_mesh_curvature", {})
        units.append(says.get("millimetres", 1000))
        tensors.append(tensor(document, blob, made["attributes"], says.get("range", 0.5)))
    return path, tensors, units, baked.warnings


def tensor(document, blob, attributes, range):
    """The schema of KINRAN_mesh_curvature: bytes of sqrt(xx / range), (127 rho + 128) / 255 and so on."""
    if "_CURVATURE" not in attributes:
        return None
    accessor = document["accessors"][attributes["_CURVATURE"]]
    view = document["bufferViews"][accessor["bufferView"]]
    assert accessor["componentType"] == COMPONENTS[np.dtype("u1")] and view.get("byteStride", 4) == 4, accessor
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    codes = np.frombuffer(blob, np.uint8, 4 * accessor["count"], start).reshape(-1, 4) / 255
    xx, yy, mean = codes[:, 0] ** 2 * range, codes[:, 2] ** 2 * range, codes[:, 3] ** 2 * range
    rho = (codes[:, 1] * 255 - 128) / 127
    return np.stack([xx, rho * np.sqrt(xx * yy), yy, mean], 1)


def check(kind):
    for name, (make, millimetres, word) in MESHES.items():
        path, tensors, units, warnings = baked_tensors(kind, name, make)
        # Cloth, points and lines have none.
        bare = {"shared_vertices": 1, "points_and_lines": 2}.get(name, 0)
        kind.equal(path, "primitives without curvature", bare, sum(tensor is None for tensor in tensors))
        for tensor, unit in zip(tensors, units):
            if tensor is not None:
                kind.near(path, "median of xx, xy, yy, mean, 1/mm", [0.1, 0, 0.1, 0.1], np.median(tensor, 0), 0.001)
                most = np.quantile(np.abs(tensor - [0.1, 0, 0.1, 0.1]), 0.95, axis=0)
                within = FROM_BYTES if "quantised" in name else FROM_FLOATS
                kind.near(path, "deviation of 95 % of vertices, 1/mm", [0] * 4, most, within)
                kind.near(path, "millimetres of the unit", 1, unit / millimetres, 1e-3)
        kind.says(path, warnings, *[word] * bool(word))
        kind.equal(path, "warned", bool(word), bool(warnings), warnings)

    # Where nodes of several sizes use a mesh, the largest counts, and is told.
    nodes = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "scale": [3] * 3}]
    path, tensors, units, warnings = baked_tensors(kind, "two_sizes", one(primitive, nodes))
    for tensor in tensors:
        kind.near(path, "median of the largest, 1/mm", 0.1 / 3, np.median(tensor[:, 3]), 0.0005)
    kind.equal(path, "millimetres of the unit", [3000], units)
    kind.says(path, warnings, "several sizes", "--unit-mm")

    # A node that stretches along the axis makes a spheroid of half axes 10 and 20 mm, whose principal curvatures are
    # known on each row.
    path, tensors, _, _ = baked_tensors(kind, "stretched", one(primitive, scaled(1, 2, 1)))
    for tensor in tensors:
        theta = np.pi * np.arange(ROWS + 1) / ROWS
        root = np.sqrt((10 * np.cos(theta)) ** 2 + (20 * np.sin(theta)) ** 2)
        around, along = 20 / (10 * root), 10 * 20 / root**3
        rows = tensor.reshape(ROWS + 1, COLUMNS + 1, 4)[4:-4].mean(1)
        kind.near(path, "mean curvature of rows, 1/mm", (around + along)[4:-4] / 2, rows[:, 3], 0.003)
        product = rows[:, 0] * rows[:, 2] - rows[:, 1] ** 2
        kind.near(path, "Gaussian curvature of rows, 1/mm²", (around * along)[4:-4], product, 0.0008)
