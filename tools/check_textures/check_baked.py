"""check_baked.py paint FOLDER: paints maps of a material, of sides that are no powers of two.
check_baked.py check PAINTED BAKED: decodes the baked textures with readers that are not ours, from KTX2 (see
read_ktx2.mjs) and from DDS, and compares level 0 with the painted maps.
"""
import json
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import texture2ddecoder
from PIL import Image

WIDTH, HEIGHT = 100, 52
# VkFormat, bytes of a block, decoder.
BC5 = (141, 16, texture2ddecoder.decode_bc5)
BC7 = (145, 16, texture2ddecoder.decode_bc7)
# What BC5 and BC7 may lose of these maps, half as much again as they do: degrees between normals; alpha_t,
# alpha_b and degrees of the direction.
NORMAL_LIMIT = 0.8
LIMITS = {"aniso": (0.013, 0.0055, 1.1), "khr": (0.013, 0.001, 0.6)}
MAPS = {"normal": BC5, "aniso": BC7, "roughness": BC7, "anisotropy": BC7}


def check(condition, message):
    if not condition:
        raise SystemExit(f"WRONG {message}")


def paint(folder):
    """A smooth relief whose grooves turn: normals up to 35 degrees, alphas from 0.04 to 0.64."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    u, v = 2 * np.pi * x / WIDTH, 2 * np.pi * y / HEIGHT
    n = np.stack([0.5 * np.sin(2 * u), 0.5 * np.cos(v + u), np.ones_like(u)], -1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    direction = np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], -1)
    gloss_u, gloss_v = 0.35 + 0.15 * np.sin(v), 0.7 + 0.1 * np.cos(u)
    for name, values in [
        ("normal_gl", n * 0.5 + 0.5),
        ("direction", direction * 0.5 + 0.5),
        ("glossU", gloss_u),
        ("glossV", gloss_v),
    ]:
        Image.fromarray(np.rint(values * 255).astype(np.uint8)).save(folder / f"relief_{name}.png")


def painted(folder):
    """Unit normals and, in their frame, the squared roughness matrices of the painted maps."""
    read = lambda name: np.asarray(Image.open(folder / f"relief_{name}.png")) / 255.0
    n = unit_normals(read("normal_gl"))
    d = read("direction")[..., :2] * 2 - 1
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    return n, matrices((1 - read("glossU")) ** 2, (1 - read("glossV")) ** 2, axes(d, n))


def unit_normals(texels):
    xy = texels[..., :2] * 2 - 1
    z = np.sqrt(np.maximum(0, 1 - (xy**2).sum(-1)))
    return np.concatenate([xy, z[..., None]], -1)


def axes(d, n):
    """The painted direction seen along the first two columns of the shortest-arc rotation of z to n."""
    x, y, z = np.moveaxis(n, -1, 0)
    first = np.stack([z + y * y / (1 + z), -x * y / (1 + z)], -1)
    second = np.stack([-x * y / (1 + z), z + x * x / (1 + z)], -1)
    a = np.stack([(first * d).sum(-1), (second * d).sum(-1)], -1)
    return a / np.linalg.norm(a, axis=-1, keepdims=True)


def matrices(along, across, axis):
    """[xx, xy, yy] of along² on the axis and across² beside it."""
    c, s = axis[..., 0], axis[..., 1]
    p, q = along**2, across**2
    return np.stack([p * c * c + q * s * s, (p - q) * c * s, p * s * s + q * c * c], -1)


def decode_aniso(texels):
    a, rho, b = np.moveaxis(texels[..., :3], -1, 0)
    return np.stack([a * a, a * b * (2 * rho - 1), b * b], -1)


def decode_khr(roughness, anisotropy, n):
    """KHR_materials_anisotropy, as its specification has it."""
    across = roughness[..., 1] ** 2
    along = across + (1 - across) * anisotropy[..., 2] ** 2
    d = anisotropy[..., :2] * 2 - 1
    return matrices(along, across, axes(d / np.linalg.norm(d, axis=-1, keepdims=True), n))


def expected_levels():
    sizes = [(WIDTH, HEIGHT)]
    while sizes[-1] != (1, 1):
        sizes.append(tuple(max(1, s // 2) for s in sizes[-1]))
    return sizes


def decode(path, map):
    """Level 0 of a KTX2 file, RGBA in 0..1, after a look at every level, and at the DDS file beside it."""
    vk, block_bytes, decoder = MAPS[map]
    says = json.loads(path.with_name(path.name + ".json").read_text())
    check(says["vkFormat"] == vk, f"{path.name}: VkFormat {says['vkFormat']}, wanted {vk}")
    for key, value in [("KinranMap", map), ("KinranFilter", "ml")]:
        got = says["keyValue"].get(key)
        check(got == value, f"{path.name}: {key} is {got}, wanted {value}")
    payload = path.with_name(path.name + ".levels").read_bytes()
    dds = path.with_suffix(".dds")
    # The magic number, the header of 124 bytes and the DX10 header of 20 stand before the levels.
    check(dds.read_bytes()[148:] == payload, f"{dds.name}: its levels differ from those of {path.name}")
    file = oiio.ImageInput.open(str(dds))
    check(file, f"{dds.name}: OpenImageIO: {oiio.geterror()}")

    levels, at = [], 0
    for i, (w, h) in enumerate(expected_levels()):
        length = -(-w // 4) * -(-h // 4) * block_bytes
        check(says["levelBytes"][i] == length, f"{path.name}: level {i} has {says['levelBytes'][i]} bytes")
        bgra = np.frombuffer(decoder(payload[at : at + length], w, h), np.uint8).reshape(h, w, 4)
        levels.append(bgra[..., [2, 1, 0, 3]] / 255)
        at += length
        check(file.seek_subimage(0, i), f"{dds.name}: OpenImageIO finds no level {i}")
        spec = file.spec()
        theirs = file.read_image(0, i, 0, spec.nchannels, "float").reshape(h, w, -1)
        channels = min(2 if vk == 141 else 3, spec.nchannels)
        worst = np.abs(theirs[..., :channels] - levels[-1][..., :channels]).max() * 255
        # BC5 interpolates between 8-bit ends, and the two decoders round that each in its own way.
        check(worst <= 1.001, f"{dds.name}: level {i} differs between decoders by {worst}/255")
    check(at == len(payload), f"{path.name}: {len(payload)} bytes of levels, wanted {at}")
    return levels[0]


def alphas(m):
    """Larger and smaller principal alpha."""
    xx, xy, yy = np.moveaxis(m, -1, 0)
    root = np.sqrt((xx - yy) ** 2 + 4 * xy**2)
    larger = 0.5 * (xx + yy + root)
    return np.sqrt(larger), np.sqrt(np.maximum(0, xx * yy - xy**2) / larger)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def compare(what, wanted, got, largest):
    """Direction and alphas of decoded matrices against painted ones. The direction counts where the larger
    alpha is at least twice the smaller one."""
    turn = lambda m: 0.5 * np.arctan2(2 * m[..., 1], m[..., 0] - m[..., 2])
    wanted_t, wanted_b = alphas(wanted)
    got_t, got_b = alphas(got)
    clear = wanted_t > 2 * wanted_b
    check(clear.sum() > 1000, f"{what}: only {clear.sum()} texels have a direction")
    difference = (turn(got) - turn(wanted) + np.pi / 2) % np.pi - np.pi / 2
    for name, error, limit in [
        ("alpha_t", rms(got_t - wanted_t), largest[0]),
        ("alpha_b", rms(got_b - wanted_b), largest[1]),
        ("direction, degrees", np.degrees(rms(difference[clear])), largest[2]),
    ]:
        check(error <= limit, f"{what}: {name} is off by {error:.4f} RMS, allowed is {limit}")
        print(f"ok    {what}: {name} is off by {error:.4f} RMS")


def main():
    if sys.argv[1] == "paint":
        paint(Path(sys.argv[2]))
        return
    n, matrix = painted(Path(sys.argv[2]))
    baked = Path(sys.argv[3])
    texels = {map: decode(baked / f"relief_{map}.ktx2", map) for map in MAPS}

    stored = unit_normals(texels["normal"])
    angle = np.degrees(rms(np.arccos(np.clip((n * stored).sum(-1), -1, 1))))
    check(angle <= NORMAL_LIMIT, f"normals are off by {angle:.3f} degrees RMS, allowed is {NORMAL_LIMIT}")
    print(f"ok    normal: off by {angle:.3f} degrees RMS")
    compare("aniso", matrix, decode_aniso(texels["aniso"]), LIMITS["aniso"])
    khr = decode_khr(texels["roughness"], texels["anisotropy"], stored)
    compare("roughness and anisotropy", matrix, khr, LIMITS["khr"])


main()
