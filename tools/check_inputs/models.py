"""Textures of glTF: shared and packed, moved by transforms, of vectors of any length, with green down."""

import io

import numpy as np
import OpenImageIO as oiio
from common import STEP, Gltf, flat, png, relief, stored, unit
from PIL import Image

SIZE = 64
NORMALS = relief(SIZE, SIZE)
N8 = stored(NORMALS)


def quad(model, material=0, second_set=None):
    """A square of 2 by 2 in the xy plane."""
    attributes = {
        "POSITION": model.accessor(np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)),
        "NORMAL": model.accessor(np.tile(np.array([[0, 0, 1]], np.float32), (4, 1))),
        "TEXCOORD_0": model.accessor(np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)),
    }
    if second_set is not None:
        attributes["TEXCOORD_1"] = model.accessor(np.array(second_set, np.float32))
    return {
        "attributes": attributes,
        "indices": model.accessor(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
        "material": material,
    }


def globe(radius=1.0, columns=48, rows=32):
    """Positions, normals, UVs and triangles of a sphere, columns from pole to pole."""
    v, u = np.mgrid[0 : rows + 1, 0 : columns + 1]
    theta, phi = np.pi * v / rows, 2 * np.pi * u / columns
    normals = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), -np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    uvs = np.stack([u / columns, v / rows], -1).reshape(-1, 2)
    a = (v * (columns + 1) + u)[:-1, :-1]
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    triangles = np.concatenate(
        [np.stack([a, c, b], -1)[1:].reshape(-1, 3), np.stack([b, c, d], -1)[:-1].reshape(-1, 3)]
    )
    return (normals * radius).astype(np.float32), normals.astype(np.float32), uvs.astype(np.float32), triangles


def sphere(model):
    positions, normals, uvs, triangles = globe()
    attributes = {
        "POSITION": model.accessor(positions),
        "NORMAL": model.accessor(normals),
        "TEXCOORD_0": model.accessor(uvs),
    }
    return {"attributes": attributes, "indices": model.accessor(triangles.reshape(-1).astype(np.uint16)), "material": 0}


def document(images, materials, second_set=None, **more):
    """A square for each material; texture i is image i."""
    model = Gltf()
    for data in images:
        model.add("textures", {"source": model.image(data)})
    model.json["materials"] = materials
    used = {name for texture in walk(materials) for name in texture.get("extensions", {})}
    if used:
        model.json["extensionsUsed"] = sorted(used)
    model.json.update(more)
    model.scene([quad(model, i, second_set) for i in range(len(materials))])
    return model


def walk(value):
    """All objects in a value of JSON."""
    if isinstance(value, dict):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else []:
        yield from walk(inner)


def bake(kind, name, model, *flags):
    path = kind.inputs(name, {"model.glb": model.bytes()}) / "model.glb"
    return path, kind.bake(path, "--normal-format", "rgba8", "--aniso-format", "rgba8", *flags)


def factors(texture, **more):
    return {"metallicRoughnessTexture": {"index": texture}, **more}


def check_shared(kind):
    """One image, several factors: each material gets textures of its own, and of the right roughness."""
    normal = {"index": 0}
    materials = [
        {"name": "smooth", "normalTexture": normal, "pbrMetallicRoughness": {"roughnessFactor": 0.2}},
        {"name": "rough", "normalTexture": normal, "pbrMetallicRoughness": {"roughnessFactor": 0.7}},
        {"name": "weak", "normalTexture": {**normal, "scale": 0.25}, "pbrMetallicRoughness": {"roughnessFactor": 0.2}},
        {"name": "weak", "normalTexture": {**normal, "scale": -1}, "pbrMetallicRoughness": {"roughnessFactor": 0.2}},
    ]
    path, baked = bake(kind, "one_normal_map", document([png(N8)], materials))
    if baked:
        for i, (roughness, scale) in enumerate([(0.2, 1), (0.7, 1), (0.2, 0.25), (0.2, -1)]):
            wanted = unit((N8 / 127.5 - 1) * [scale, scale, 1])[..., :2] * 0.5 + 0.5
            kind.near(path, f"normal of material {i}", wanted, baked.texels("normal", i)[..., :2], STEP)
            kind.near(path, f"roughness of material {i}", roughness, baked.texels("roughness", i)[..., 1], STEP)
        baked_materials = baked.model()[0]["materials"]
        indices = [material["normalTexture"]["index"] for material in baked_materials]
        kind.equal(path, "number of normal textures", 4, len(set(indices)))
        scales = [material["normalTexture"].get("scale", 1) for material in baked_materials]
        kind.equal(path, "scales, which are in the texels now", [1, 1, 1, 1], scales)
        kind.silent(path, baked)


def check_packed(kind):
    """Occlusion in red of the roughness map stays what it was."""
    orm = png(flat(200, 100, 255, size=SIZE))
    occluded = {"index": 1, "strength": 0.5}
    one = {
        "name": "a",
        "normalTexture": {"index": 0},
        "occlusionTexture": occluded,
        "pbrMetallicRoughness": factors(1, roughnessFactor=0.5, metallicFactor=0.5),
    }
    other = {"name": "b", "occlusionTexture": {"index": 1}, "pbrMetallicRoughness": factors(1)}
    path, baked = bake(kind, "packed", document([png(N8), orm], [one, other]))
    if baked:
        for i, roughness in enumerate([50 / 255, 100 / 255]):
            texels = baked.texels("roughness", i)
            kind.near(path, f"occlusion in material {i}", 200 / 255, texels[..., 0], 0.001)
            kind.near(path, f"roughness in material {i}", roughness, texels[..., 1], STEP)
            kind.near(path, f"metal in material {i}", 1, texels[..., 2], 0.001)
        first, second = baked.model()[0]["materials"]
        kind.equal(path, "strength of occlusion", 0.5, first["occlusionTexture"].get("strength"))
        kind.equal(path, "metal's factor", 0.5, first["pbrMetallicRoughness"].get("metallicFactor"))
        for material in (first, second):
            images = {
                texture_images(
                    baked.model()[0], material[slot] if slot in material else material["pbrMetallicRoughness"][slot]
                )
                for slot in ("occlusionTexture", "metallicRoughnessTexture")
            }
            kind.equal(path, "images of occlusion and roughness", 1, len(images))
        kind.silent(path, baked)


def texture_images(model, slot):
    """What images a slot's texture names."""
    texture = model["textures"][slot["index"]]
    return texture.get("source"), texture.get("extensions", {}).get("MSFT_texture_dds", {}).get("source")


def check_extensions(kind):
    """Slots of other extensions keep their images, known or not."""
    rough = png(flat(0, 100, 255, size=SIZE))
    dirt = png(flat(10, 20, 30, size=SIZE))
    base = {"normalTexture": {"index": 0}, "pbrMetallicRoughness": factors(1)}

    coat = {
        "KHR_materials_clearcoat": {
            "clearcoatFactor": 1,
            "clearcoatRoughnessTexture": {"index": 1},
            "clearcoatNormalTexture": {"index": 0},
        },
        "KHR_materials_iridescence": {"iridescenceTexture": {"index": 2}},
    }
    vendor = {"ACME_dirt": {"dirtTexture": {"index": 2}}}
    for name, extensions, slots, words in [
        (
            "clearcoat",
            coat,
            [
                ("KHR_materials_clearcoat", "clearcoatRoughnessTexture", rough),
                ("KHR_materials_clearcoat", "clearcoatNormalTexture", png(N8)),
                ("KHR_materials_iridescence", "iridescenceTexture", dirt),
            ],
            [],
        ),
        ("vendor", vendor, [("ACME_dirt", "dirtTexture", dirt)], ["ACME_dirt"]),
    ]:
        path, baked = bake(kind, name, document([png(N8), rough, dirt], [{**base, "extensions": extensions}]))
        if not baked:
            continue
        kind.near(path, "normal", N8[..., :2] / 255, baked.texels("normal")[..., :2], STEP)
        kind.near(path, "roughness", 100 / 255, baked.texels("roughness")[..., 1], STEP)
        kind.says(path, baked.warnings, *words)
        kind.equal(path, "number of warnings", len(words), len(baked.warnings))
        for extension, slot, wanted in slots:
            got = image_bytes(baked, baked.model()[0]["materials"][0]["extensions"][extension][slot])
            kind.equal(path, f"the image of {slot} is as it was", True, wanted == got)


def image_bytes(baked, slot):
    model, blob = baked.model()
    image = model["images"][model["textures"][slot["index"]]["source"]]
    if "uri" in image:
        return (baked.folder / image["uri"]).read_bytes()
    view = model["bufferViews"][image["bufferView"]]
    return blob[view.get("byteOffset", 0) :][: view["byteLength"]]


def check_sources(kind):
    """WebP beside a PNG and alone; a texture without a source; specular-glossiness."""
    rough = png(flat(0, 100, 255, size=SIZE))
    file = io.BytesIO()
    Image.fromarray(N8).save(file, "WEBP", lossless=True)
    for name, beside in [("webp_beside_png", True), ("webp_alone", False)]:
        model = document(
            [png(N8), rough],
            [{"normalTexture": {"index": 0}, "pbrMetallicRoughness": factors(1)}],
            extensionsUsed=["EXT_texture_webp"],
        )
        webp = {"EXT_texture_webp": {"source": model.image(file.getvalue(), "image/webp")}}
        model.json["textures"][0] = {**({"source": 0} if beside else {}), "extensions": webp}
        path, baked = bake(kind, name, model)
        if baked:
            kind.near(path, "normal", N8[..., :2] / 255, baked.texels("normal")[..., :2], STEP)
            kind.silent(path, baked)
    model = document(
        [png(N8), rough],
        [
            {
                "name": "lit",
                "normalTexture": {"index": 0},
                "emissiveTexture": {"index": 2},
                "pbrMetallicRoughness": {"roughnessFactor": 0.3},
            }
        ],
    )
    model.add("textures", {})
    path, baked = bake(kind, "no_source", model)
    if baked:
        kind.near(path, "roughness", 0.3, baked.texels("roughness")[..., 1], STEP)
        kind.says(path, baked.warnings, "lit", "emissiveTexture", "texture 2")
    gloss = {"KHR_materials_pbrSpecularGlossiness": {"specularGlossinessTexture": {"index": 1}}}
    path, baked = bake(
        kind,
        "gloss",
        document(
            [png(N8), png(flat(60, 60, 60, 200, size=SIZE))],
            [{"name": "sg", "normalTexture": {"index": 0}, "extensions": gloss}],
        ),
    )
    if baked:
        kind.says(path, baked.warnings, "sg", "specular-glossiness")


def moved(**transform):
    return {"extensions": {"KHR_texture_transform": transform}}


def check_transforms(kind):
    """Maps that lie differently cannot be filtered together, and are left alone, with a warning that says why."""
    # Left and right, which a bake must not mix up.
    halves = flat(255, 51, 0, size=SIZE)
    halves[:, SIZE // 2 :, 1] = 153
    thrice = [[0, 3], [3, 3], [3, 0], [0, 0]]
    apart = {
        "turned": (moved(rotation=np.pi / 2, scale=[6, 2]), {}, "KHR_texture_transform"),
        "finer": (moved(scale=[8, 8]), {}, "KHR_texture_transform"),
        "other_set": ({"texCoord": 1}, {}, "UV set"),
        "set_of_the_transform": (moved(texCoord=1, scale=[2, 2]), {}, "UV set"),
    }
    for name, (normal, roughness, word) in apart.items():
        material = {
            "name": "grooved",
            "normalTexture": {"index": 0, **normal},
            "pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 1, **roughness}},
        }
        path, baked = bake(kind, name, document([png(N8), png(halves)], [material], thrice))
        if baked:
            kind.equal(path, "surfaces", 0, sum(len(surface["outputs"]) for surface in baked.document["surfaces"]))
            kind.equal(path, "material", material, baked.model()[0]["materials"][0])
            kind.says(path, baked.warnings, "grooved", word)
    wrapped = document(
        [png(N8), png(halves)],
        [{"name": "grooved", "normalTexture": {"index": 0}, "pbrMetallicRoughness": factors(1)}],
        samplers=[{"wrapS": 33071, "wrapT": 33648}],
    )
    wrapped.json["textures"][0]["sampler"] = 0
    path, baked = bake(kind, "other_wrapping", wrapped)
    if baked:
        kind.says(path, baked.warnings, "grooved", "wrapping")

    alike = moved(scale=[4, 4], offset=[0.25, 0])
    for name, normal, roughness in [
        ("moved_alike", alike, {"metallicRoughnessTexture": {"index": 1, **alike}}),
        ("moved_alone", moved(scale=[8, 8]), {"roughnessFactor": 0.4}),
        ("mirrored_alone", moved(scale=[-2, 2]), {"roughnessFactor": 0.4}),
    ]:
        material = {"normalTexture": {"index": 0, **normal}, "pbrMetallicRoughness": roughness}
        path, baked = bake(kind, name, document([png(N8), png(halves)], [material]))
        if baked:
            kind.near(path, "normal", N8[..., :2] / 255, baked.texels("normal")[..., :2], STEP)
            wanted = halves[..., 1] / 255 if name == "moved_alike" else 0.4
            kind.near(path, "roughness", wanted, baked.texels("roughness")[..., 1], STEP)
            got = baked.model()[0]["materials"][0]
            for slot in (got["normalTexture"], got["pbrMetallicRoughness"]["metallicRoughnessTexture"]):
                kind.equal(path, "transform", normal["extensions"], slot.get("extensions"))
            kind.silent(path, baked)


def check_lengths(kind):
    """glTF's normal is the texel brought to unit length, blue included, not what red and green alone say."""
    vectors = {
        "unit": ([0.6, 0, 0.8], 1, False),
        "blue_255": ([0.7, 0, 1], 1, True),
        "short": ([0.42, 0, 0.56], 1, True),
        "a_little_short": ([0.51, 0, 0.68], 1, True),
        "long": ([0.9, 0.9, 1], 1, True),
        "scale_2": ([0.6, 0, 0.8], 2, False),
        "scale_half": ([0.6, 0, 0.8], 0.5, False),
    }
    for name, (vector, scale, told) in vectors.items():
        pixels = flat(*stored(np.array(vector)).tolist())
        material = {"name": "m", "normalTexture": {"index": 0, "scale": scale}}
        path, baked = bake(kind, name, document([png(pixels)], [material]))
        if baked:
            wanted = unit((pixels[0, 0] / 127.5 - 1) * [scale, scale, 1])[:2] * 0.5 + 0.5
            texels = baked.texels("normal")[..., :2]
            kind.near(path, "normal", np.broadcast_to(wanted, texels.shape), texels, STEP)
            kind.equal(path, "told of lengths", told, any("unit length" in warning for warning in baked.warnings))


def check_lengths_drawn(kind):
    """A map with blue of 255 looks as the map of unit length does that means the same, filtered, baked or not."""
    long = np.array([0.7, 0, 1])
    pictures = {}
    for name, vector in [("drawn_long", long), ("drawn_unit", unit(long))]:
        material = {
            "normalTexture": {"index": 0},
            "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.3},
        }
        path, baked = bake(kind, name, document([png(flat(*stored(vector)))], [material]))
        models = {"none": path, "ml": path, "baked": baked.folder / path.name if baked else path}
        for filter, model in models.items():
            picture = path.with_name(f"{filter}.exr")
            light = ["--env", "none", "--light", "1,0,0.3", "--from", "0,0,1", "--spp", "4", "--size", "32x32"]
            code, says = kind.run(
                "render", model, "-o", picture, *light, *(["--filter", filter] if model == path else [])
            )
            if kind.equal(model, "exit code", 0, code, says.get("error", "")):
                pictures[name, filter] = oiio.ImageBuf(str(picture)).get_pixels(oiio.FLOAT)[16, 16, 0]
    for filter in ["none", "ml", "baked"]:
        wanted, got = pictures.get(("drawn_unit", filter), 0), pictures.get(("drawn_long", filter), 0)
        kind.equal(path, "there is light", True, wanted > 0.5)
        # Unit vectors are stored half a step off, which moves the highlight a little.
        kind.near(path, f"light of the long vectors, {filter}", wanted, got, 0.02 * wanted)


def check_green(kind):
    """Green down is told by the slopes, and turned round by a flag."""
    down = N8.copy()
    down[..., 1] = 255 - down[..., 1]
    model = document([png(down)], [{"name": "a", "normalTexture": {"index": 0}}])
    path, baked = bake(kind, "green_down", model)
    if baked:
        kind.near(path, "normal", down[..., :2] / 255, baked.texels("normal")[..., :2], STEP)
        kind.says(path, baked.warnings, "green points down", "--y-down")
    code, says = kind.run("inspect", path)
    kind.equal(path, "exit code", 0, code, says.get("error", ""))
    kind.says(path, says.get("warnings", []), "green points down", "--y-down")
    path, baked = bake(kind, "green_turned", model, "--y-down")
    if baked:
        kind.near(path, "normal", N8[..., :2] / 255, baked.texels("normal")[..., :2], STEP)
        kind.silent(path, baked)
    path, baked = bake(kind, "green_up", document([png(N8)], [{"name": "a", "normalTexture": {"index": 0}}]))
    if baked:
        kind.silent(path, baked)


def check(kind):
    check_shared(kind)
    check_packed(kind)
    check_extensions(kind)
    check_sources(kind)
    check_transforms(kind)
    check_lengths(kind)
    check_lengths_drawn(kind)
    check_green(kind)
