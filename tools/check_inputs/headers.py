"""DDS with headers of older writers, and Radiance HDR with what may stand in its header."""

import struct

import numpy as np
import OpenImageIO as oiio
from common import Gltf, png, relief, stored
from models import quad, sphere

# A normal that no swap of channels keeps: 14 degrees off the mean.
RED, GREEN = 148, 104
MIPS = 5


def bc4(level):
    return bytes([level, level]) + b"\0" * 6


def bc1(red, green, blue):
    """Of 5, 6 and 5 bits."""
    return struct.pack("<HHI", *[red << 11 | green << 5 | blue] * 2, 0)


# Bytes of a block or, of RGBA8, of a texel.
BLOCKS = {
    "bc5": bc4(RED) + bc4(GREEN),
    "bc5_snorm": bc4(20) + bc4(256 - 24),
    "bc4": bc4(128),
    "bc1": bc1(16, 32, 16),
    "bc3": bc4(RED) + bc1(31, 13, 0),
    # Mode 6: a bit after six zeros, then ends and indices of zero.
    "bc7": b"\x40" + b"\0" * 15,
    "bgra": bytes([255, GREEN, RED, 255]),
}


def dds(block, four=b"DX10", dxgi=0, width=16, height=16, mips=MIPS, faces=0, layers=1, masks=None, pitch=None):
    """A DDS file of one block everywhere; with `masks` (red, green, blue, alpha) it has no FourCC."""
    texels = 1 if masks else 4
    count = lambda level: -(-max(width >> level, 1) // texels) * -(-max(height >> level, 1) // texels)
    pitch = pitch if pitch is not None else count(0) * len(BLOCKS[block])
    # Caps, sides and pixel format are there, a linear size and, where there are several, levels.
    header = struct.pack("<7I44x", 124, 0x81007 | (0x20000 if mips > 1 else 0), height, width, pitch, 0, mips)
    if masks:
        header += struct.pack("<2I4x5I", 32, 0x41, 32, *masks)
    else:
        header += struct.pack("<2I4s20x", 32, 4, four)
    header += struct.pack("<2I12x", 0x1000 | (0x400008 if mips > 1 else 0), faces)
    if four == b"DX10" and not masks:
        header += struct.pack("<5I", dxgi, 3, 4 if faces else 0, layers, 0)
    image = b"".join(BLOCKS[block] * count(level) for level in range(mips))
    return b"DDS " + header + image * layers * (6 if faces else 1)


BGRA = (0xFF0000, 0xFF00, 0xFF, 0xFF000000)
RGBA = (0xFF, 0xFF00, 0xFF0000, 0xFF000000)
NORMALS = {
    "ati2": dds("bc5", b"ATI2"),
    "bc5u": dds("bc5", b"BC5U"),
    "dx10_bc5": dds("bc5", dxgi=83),
    "bgra_masks": dds("bgra", masks=BGRA),
    "one_level": dds("bc5", b"ATI2", mips=1),
    "no_levels_said": dds("bc5", b"ATI2", mips=1).replace(struct.pack("<2I", 0, 1), struct.pack("<2I", 0, 0), 1),
    "pitch_0": dds("bc5", b"ATI2", pitch=0),
    "sides_13_7": dds("bc5", b"ATI2", width=13, height=7, mips=4),
    "levels_left_out": dds("bc5", dxgi=83, mips=3),
}
# Format, transfer and mean of red and green that `inspect` must tell.
INSPECTED = {
    "ati1": (dds("bc4", b"ATI1"), "BC4", "linear", 128 / 255, 0),
    "dxt1": (dds("bc1", b"DXT1"), "BC1", "unsaid", (16 << 3 | 16 >> 2) / 255, (32 << 2 | 32 >> 4) / 255),
    "dx10_bc1_srgb": (dds("bc1", dxgi=72), "BC1", "srgb", (16 << 3 | 16 >> 2) / 255, (32 << 2 | 32 >> 4) / 255),
    "bgra_masks": (dds("bgra", masks=BGRA), "RGBA8", "unsaid", RED / 255, GREEN / 255),
    "rgba_masks": (dds("bgra", masks=RGBA), "RGBA8", "unsaid", 1, GREEN / 255),
    "dx10_bc7_srgb": (dds("bc7", dxgi=99), "BC7", "srgb", 0, 0),
    "dx10_bc7_typeless": (dds("bc7", dxgi=97), "BC7", "unsaid", 0, 0),
}
REFUSED = {
    "bc5s": (dds("bc5_snorm", b"BC5S"), "BC5S"),
    "dxt5": (dds("bc3", b"DXT5"), "DXT5"),
    "rxgb": (dds("bc3", b"RXGB"), "RXGB"),
    "dx10_bc5_snorm": (dds("bc5_snorm", dxgi=84), "BC5_SNorm"),
    "dx10_bc3": (dds("bc3", dxgi=77), "BC3"),
    "dx10_bc6h": (dds("bc7", dxgi=95), "BC6H"),
    "cube": (dds("bc5", dxgi=83, faces=0xFE00), "cube"),
    "array": (dds("bc5", dxgi=83, layers=2), "array"),
    "cut_short": (dds("bc5", b"ATI2")[:-40], "16 bytes"),
}


def check_dds(kind):
    for name, data in NORMALS.items():
        sides = (13, 7) if name == "sides_13_7" else (16, 16)
        roughness = png(np.full(sides[::-1], 128, np.uint8))
        folder = kind.inputs(name, {"mat_normal.dds": data, "mat_roughness.png": roughness})
        baked = kind.bake(folder, "--normal-format", "rgba8")
        if baked:
            texels = baked.texels("normal")[..., :2]
            kind.equal(folder, "sides", sides, texels.shape[1::-1])
            # Bytes of a length that 8 bits hold come back as they are.
            kind.near(folder, "normal", np.broadcast_to([RED / 255, GREEN / 255], texels.shape), texels, 1.001 / 255)
            # OpenImageIO reads the input too.
            theirs = oiio.ImageBuf(str(folder / "mat_normal.dds")).get_pixels(oiio.FLOAT)[..., :2]
            kind.near(folder, "normal by OpenImageIO", theirs, texels, 1.001 / 255)
    files = kind.inputs("files", {f"{name}.dds": data for name, (data, *_) in {**INSPECTED, **REFUSED}.items()})
    for name, (_, format, transfer, red, green) in INSPECTED.items():
        path = files / f"{name}.dds"
        code, says = kind.run("inspect", path)
        if kind.equal(path, "exit code", 0, code, says.get("error", "")):
            level = says["levels"][0]
            kind.equal(path, "format and transfer", (format, transfer), (says["format"], says["transfer"]))
            kind.near(path, "red and green", [red, green], [level["red"]["mean"], level["green"]["mean"]], 1e-6)
    for name, (_, word) in REFUSED.items():
        kind.refused(files / f"{name}.dds", f"{name}.dds", "DDS", word, command=("inspect",))


def check_dds_of_models(kind):
    """A DDS that is not read: the PNG beside it is, and whoever draws the DDS says so."""
    normals = relief(16, 16)
    for name in ["ati2", "dxt5", "dx10_bc5_snorm"]:
        model = Gltf()
        model.json["textures"] = [
            {"source": model.image(png(stored(normals))), "extensions": {"MSFT_texture_dds": {"source": 1}}}
        ]
        model.add("images", {"uri": f"{name}.dds"})
        model.json["materials"] = [{"normalTexture": {"index": 0}}]
        model.json["extensionsUsed"] = ["MSFT_texture_dds"]
        model.scene([quad(model)])
        data = REFUSED[name][0] if name in REFUSED else NORMALS[name]
        path = kind.inputs(f"model_{name}", {f"{name}.dds": data, "model.glb": model.bytes()}) / "model.glb"
        baked = kind.bake(path, "--normal-format", "rgba16f")
        if baked:
            kind.near(path, "normal", normals[..., :2] * 0.5 + 0.5, baked.texels("normal")[..., :2], 0.5 / 255 + 3e-4)
        code, says = kind.run("render", path, "-o", path.with_suffix(".png"), "--spp", "1", "--size", "16x16")
        kind.equal(path, "exit code", 0, code, says.get("error", ""))
        if name in REFUSED:
            kind.says(path, says.get("warnings", []), f"{name}.dds", REFUSED[name][1])
        else:
            kind.equal(path, "warnings", [], says.get("warnings"))


# A sky and a ground in values that shared exponents hold.
SKY, GROUND = np.array([2, 1, 0.5]), np.array([0.125, 0.125, 0.125])
FORMAT = "FORMAT=32-bit_rle_rgbe"


def environment():
    return np.concatenate([np.broadcast_to(color, (8, 32, 3)) for color in (SKY, GROUND)])


def hdr(colours, lines=(FORMAT,), order="-Y {h} +X {w}", magic="#?RADIANCE", packed=False, newline="\n"):
    height, width = colours.shape[:2]
    largest = colours.max(-1)
    exponent = np.floor(np.log2(largest)) + 1
    texels = np.dstack([colours * (256 / 2**exponent)[..., None], exponent + 128]).astype(np.uint8)
    body = texels.tobytes()
    if packed:
        # A channel of a row is one run of raw bytes: the length, then the bytes.
        rows = [
            bytes([2, 2, 0, width]) + b"".join(bytes([width]) + channel.tobytes() for channel in row.T)
            for row in texels
        ]
        body = b"".join(rows)
    head = [magic, *lines, "", order.format(w=width, h=height), ""]
    return newline.join(head).encode() + body


def check_hdr(kind):
    colours = environment()
    plain = {
        "plain": hdr(colours),
        "packed": hdr(colours, packed=True),
        "gamma": hdr(colours, [FORMAT, "GAMMA=1.0"]),
        "comments": hdr(colours, ["# made by hand", "SOFTWARE=X 1.0", FORMAT, "VIEW=rvu -vta"]),
        "rgbe": hdr(colours, magic="#?RGBE"),
        "no_format": hdr(colours, []),
        "blanks": hdr(colours, order="-Y  {h}  +X {w}"),
    }
    exposed = {
        "exposure": (hdr(colours * 2, [FORMAT, "EXPOSURE=2.0"]), 2),
        "exposure_twice": (hdr(colours * 4, [FORMAT, "EXPOSURE=2.0", "EXPOSURE=2"]), 4),
        "exposure_first": (hdr(colours * 2, ["EXPOSURE= 2.0", FORMAT]), 2),
    }
    refused = {
        "xyz": (hdr(colours, ["FORMAT=32-bit_rle_xyze"]), "XYZ"),
        "bottom_up": (hdr(colours[::-1], order="+Y {h} +X {w}"), "+Y 16 +X 32"),
        "mirrored": (hdr(colours[:, ::-1], order="-Y {h} -X {w}"), "-Y 16 -X 32"),
        "columns": (hdr(np.swapaxes(colours, 0, 1), order="+X {h} -Y {w}"), "+X 32 -Y 16"),
        "crlf": (hdr(colours, newline="\r\n"), "CR LF"),
    }
    model = Gltf()
    model.json["materials"] = [{"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}]
    model.scene([sphere(model)])
    every = {**plain, **{name: data for name, (data, _) in {**exposed, **refused}.items()}}
    files = kind.inputs(
        "hdr",
        {
            "white.glb": model.bytes(),
            "even.hdr": hdr(np.ones((16, 32, 3))),
            **{f"{name}.hdr": data for name, data in every.items()},
        },
    )

    def render(name):
        code, says = kind.run(
            "render",
            files / "white.glb",
            "-o",
            files / f"{name}.exr",
            "--env",
            files / f"{name}.hdr",
            "--spp",
            "8",
            "--size",
            "24x24",
            "--from",
            "0,0,1",
        )
        kind.equal(files / f"{name}.hdr", "exit code", 0, code, says.get("error", ""))
        return oiio.ImageBuf(str(files / f"{name}.exr")).get_pixels(oiio.FLOAT)[..., :3], says["warnings"]

    # In linear light the sky adds its surplus over the ground, in its colour, to what the ground would give alone.
    even, _ = render("even")
    first, _ = render("plain")
    top, bottom = first[6, 12] - GROUND * even[6, 12], first[17, 12] - GROUND * even[17, 12]
    path = files / "plain.hdr"
    kind.near(path, "colour of the sky's light from above", (SKY - GROUND) / (SKY - GROUND)[0], top / top[0], 0.02)
    # Pixels mirrored up and down see, together, a whole sky.
    above, below = top[0] / even[6, 12, 0], bottom[0] / even[17, 12, 0]
    kind.near(path, "light of the sky above and below", (SKY - GROUND)[0], above + below, 0.05)
    kind.equal(path, "more sky above than below", True, bool(above > 1.5 * below))
    for name in [*plain, *exposed]:
        factor = exposed[name][1] if name in exposed else 1
        path = files / f"{name}.hdr"
        code, says = kind.run("inspect", path)
        if kind.equal(path, "exit code", 0, code, says.get("error", "")):
            means = [channel["mean"] for channel in says["channels"]]
            kind.near(path, "mean colour", (SKY + GROUND) / 2 * factor, means, 1e-6)
        picture, warnings = render(name)
        kind.near(path, "picture", first * factor, picture, 1e-3 * factor)
        if factor > 1:
            # Values are taken as stored; who knows of exposure is told.
            kind.says(path, warnings, f"{name}.hdr", f"EXPOSURE {factor}")
        else:
            kind.equal(path, "warnings", [], warnings)
    for name, (_, word) in refused.items():
        kind.refused(files / f"{name}.hdr", f"{name}.hdr", "HDR", word, command=("inspect",))
        kind.equal(
            files / f"{name}.hdr",
            "exit code of render",
            2,
            kind.run("render", files / "white.glb", "-o", files / "no.exr", "--env", files / f"{name}.hdr")[0],
        )


def check(kind):
    check_dds(kind)
    check_dds_of_models(kind)
    check_hdr(kind)
