"""EXR as Poly Haven, Blender and Nuke write it: compressions, names of channels, layers, alpha, colour."""

import numpy as np
import OpenImageIO as oiio
from common import STEP, flat, png, relief

SIZE = 64
NORMALS = relief(SIZE, SIZE)
TEXELS = NORMALS * 0.5 + 0.5
# Perceptual roughness; alpha is its square.
ROUGHNESS = np.full((SIZE, SIZE), 0.5)
ROUGHNESS[:, SIZE // 2 :] = 0.25
# Compressions that lose something, and what they may lose of a normal's texel.
LOSSY = {"b44": 0.012, "b44a": 0.012, "dwaa": 0.012, "dwab": 0.012}


def exr(parts, type="half", window=None, **attributes):
    """A function that writes a file of the parts [(channels, array)]; `window` says where its texels lie."""

    def write(path):
        specs = []
        for i, (channels, array) in enumerate(parts):
            spec = oiio.ImageSpec(array.shape[1], array.shape[0], len(channels), type)
            spec.channelnames = tuple(channels)
            spec.attribute("oiio:subimagename", f"part{i}")
            for side, value in (window or {}).items():
                setattr(spec, side, value)
            for key, value in attributes.items():
                spec.attribute(key, value)
            specs.append(spec)
        file = oiio.ImageOutput.create(str(path))
        if not (file.open(str(path), tuple(specs)) if len(specs) > 1 else file.open(str(path), specs[0])):
            raise SystemExit(f"{path}: OpenImageIO: {file.geterror()}")
        for i, (_, array) in enumerate(parts):
            if i > 0:
                file.open(str(path), specs[i], "AppendSubimage")
            file.write_image(np.ascontiguousarray(array, np.float32).reshape(array.shape[0], array.shape[1], -1))
        file.close()

    return write


def check_maps(kind, name, normal, roughness, lost=0.0, flags=()):
    folder = kind.inputs(name, {"mud_nor_gl_2k.exr": normal, "mud_rough_2k.exr": roughness})
    baked = kind.bake(folder, "--normal-format", "rgba8", "--aniso-format", "rgba8", *flags)
    if baked:
        kind.near(folder, "normal", TEXELS[..., :2], baked.texels("normal")[..., :2], STEP + lost)
        kind.near(folder, "alpha", ROUGHNESS**2, baked.texels("aniso")[..., 0], STEP)
        kind.silent(folder, baked)


def check_colour(kind, name, color, wanted, *flags):
    folder = kind.inputs(
        name,
        {
            "mud_color.exr" if callable(color) else "mud_color.png": color,
            "mud_roughness.png": png(flat(128)),
            "mud_normal.png": png(flat(128, 128, 255)),
        },
    )
    baked = kind.bake(folder, "--color-format", "rgba8", *flags)
    if baked:
        texels = baked.texels("color")[..., :3]
        kind.near(folder, "colour", np.broadcast_to(wanted, texels.shape), texels, STEP)


def srgb(linear):
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)


def check(kind):
    rough = exr([("Y", ROUGHNESS)])
    for compression in ["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"]:
        check_maps(
            kind,
            compression,
            exr([("RGB", TEXELS)], compression=compression),
            exr([("Y", ROUGHNESS)], compression=compression),
            LOSSY.get(compression, 0),
        )
    with_alpha = np.dstack([TEXELS, np.ones((SIZE, SIZE))])
    half = np.dstack([ROUGHNESS * 0.5, np.full((SIZE, SIZE), 0.5)])
    other = np.full((SIZE, SIZE, 3), 0.9)
    layer = ["normal.R", "normal.G", "normal.B"]
    layers = exr([(["base.R", "base.G", "base.B", *layer], np.dstack([other, TEXELS]))])
    for name, normal, roughness in [
        ("float", exr([("RGB", TEXELS)], "float"), exr([("R", ROUGHNESS)], "float")),
        ("a_layer_by_name", exr([(layer, TEXELS)]), rough),
        ("xyz", exr([("XYZ", TEXELS)]), rough),
        ("signed", exr([("RGB", NORMALS)]), rough),
        ("alpha_of_1", exr([("RGBA", with_alpha)]), exr([("RGB", np.dstack([ROUGHNESS] * 3))])),
        ("alpha_of_a_half", exr([("RGB", TEXELS)]), exr([("YA", half)])),
        ("beside_a_layer", exr([(["R", "G", "B", "base.R", "base.G", "base.B"], np.dstack([TEXELS, other]))]), rough),
    ]:
        check_maps(kind, name, normal, roughness)
    check_maps(kind, "a_layer_of_two", layers, rough, flags=["--exr-layer", "mud_nor_gl_2k.exr=normal"])
    parts = exr([("RGB", TEXELS), ("RGB", other)])
    check_maps(kind, "a_part_of_two", parts, rough, flags=["--exr-layer", "mud_nor_gl_2k.exr=part0"])
    window = {"x": 8, "y": 8, "full_x": 0, "full_y": 0, "full_width": 100, "full_height": 100}
    for name, normal, words, flags in [
        ("two_layers", layers, ["base", "normal", "--exr-layer"], []),
        ("two_parts", parts, ["part0", "part1", "--exr-layer"], []),
        ("no_such_layer", layers, ["base", "normal", "no layer"], ["--exr-layer", "mud_nor_gl_2k.exr=specular"]),
        ("data_window", exr([("RGB", TEXELS)], window=window), ["data window"], []),
    ]:
        folder = kind.inputs(name, {"mud_nor_gl_2k.exr": normal, "mud_rough_2k.exr": rough})
        kind.refused(folder, "mud_nor_gl_2k.exr", *words, command=("bake", *flags))

    # Floats are linear and are stored by the sRGB curve; integers have it already.
    linear = np.array([0.02, 0.18, 0.6])
    color = exr([("RGB", np.broadcast_to(linear, (32, 32, 3)))])
    check_colour(kind, "linear_colour", color, srgb(linear))
    check_colour(kind, "colour_called_srgb", color, linear, "--color-space", "srgb")
    levels = np.array([40, 118, 203])
    check_colour(kind, "png_colour", png(flat(*levels)), levels / 255)
    check_colour(kind, "png_colour_called_linear", png(flat(*levels)), srgb(levels / 255), "--color-space", "linear")
    premultiplied = np.broadcast_to([*linear * 0.5, 0.5], (32, 32, 4))
    check_colour(kind, "premultiplied_colour", exr([("RGBA", premultiplied)]), srgb(linear))
