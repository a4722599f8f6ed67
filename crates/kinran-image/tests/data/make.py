"""Writes the small image files beside this script, by Pillow, OpenImageIO and by hand: files whose
writer is not ours.

Texel (x, y) of every file is [x * 12 + y, y * 17, 255 - x * 12 - y, 128 + x + y * 7], cut to the file's
channels; 13x11 texels. Run: python make.py
(needs numpy, Pillow, OpenImageIO, tifffile)
"""
from pathlib import Path
import io
import struct
import zlib

import numpy as np
import OpenImageIO as oiio
import tifffile
from PIL import Image

HERE = Path(__file__).parent
W, H = 13, 11
y, x = np.mgrid[0:H, 0:W]
rgba = np.stack([x * 12 + y, y * 17, 255 - x * 12 - y, 128 + x + y * 7], -1).astype(np.uint8)
rgb, grey = rgba[..., :3], rgba[..., 0]

image = {
    "grey": Image.fromarray(grey),
    "grey_alpha": Image.merge("LA", [Image.fromarray(grey), Image.fromarray(rgba[..., 1].copy())]),
    "rgb": Image.fromarray(rgb.copy()),
    "rgba": Image.fromarray(rgba),
}
for name, im in image.items():
    im.save(HERE / f"{name}.png")
    im.save(HERE / f"{name}.tga", compression="tga_rle")
    im.save(HERE / f"{name}_plain.tga")
    if name != "grey_alpha":
        im.save(HERE / f"{name}_lzw.tif", compression="tiff_lzw")
        im.save(HERE / f"{name}_deflate.tif", compression="tiff_deflate")
Image.fromarray(grey.astype(np.float32)).save(HERE / "grey_float.tif")
Image.fromarray(grey.astype(np.uint16) * 257).save(HERE / "grey_16.tif")
Image.fromarray(grey.astype(np.uint16) * 257).save(HERE / "grey_16.png")
image["grey"].point(lambda g: 255 * (g > 80)).convert("1").save(HERE / "one_bit.png")
image["rgb"].quantize(256, dither=0).save(HERE / "palette.png")
for name in ("rgb", "rgba", "grey"):
    image[name].save(HERE / f"{name}.bmp")
for name in ("rgb", "rgba"):
    image[name].save(HERE / f"{name}.webp", lossless=True, exact=True)
image["rgb"].save(HERE / "lossy.webp", quality=100)
image["rgb"].save(HERE / "baseline.jpg", quality=95, subsampling=0)
image["rgb"].save(HERE / "progressive.jpg", quality=95, subsampling=0, progressive=True)
image["grey"].save(HERE / "grey.jpg", quality=95)
image["rgb"].convert("CMYK").save(HERE / "cmyk.jpg")
image["rgb"].convert("CMYK").save(HERE / "cmyk.tif", compression="tiff_lzw")

# 16-bit RGBA, which Pillow cannot write: filter 0 rows, big-endian samples of the 8-bit value twice.
def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

rows = b"".join(b"\0" + np.repeat(row.reshape(-1), 2).tobytes() for row in rgba)
(HERE / "rgba_16.png").write_bytes(
    b"\x89PNG\r\n\x1a\n"
    + chunk(b"IHDR", struct.pack(">IIBBBBB", W, H, 16, 6, 0, 0, 0))
    + chunk(b"IDAT", zlib.compress(rows))
    + chunk(b"IEND", b"")
)

# Radiance HDR, flat scanlines: mantissas are the 8-bit values, exponent 128 + 8 makes them integers.
hdr = np.concatenate([rgb, np.full((H, W, 1), 136, np.uint8)], -1)
(HERE / "flat.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 11 +X 13\n" + hdr.tobytes())

for name, channels, sample, compression in [
    ("y_half", 1, "half", "piz"), ("rgb_float", 3, "float", "zip"), ("rgba_half", 4, "half", "zip"),
]:
    spec = oiio.ImageSpec(W, H, channels, sample)
    spec.attribute("compression", compression)
    if channels == 1:
        spec.channelnames = ("Y",)
    out = oiio.ImageOutput.create(str(HERE / f"{name}.exr"))
    assert out.open(str(HERE / f"{name}.exr"), spec)
    out.write_image(rgba[..., :channels].astype(np.float32))
    out.close()

# Layers and parts: the unnamed and "color" are as painted, "diffuse" is 255 less, normals are channel 0 to 2 as well.
painted, other = rgba.astype(np.float32), 255 - rgba.astype(np.float32)
depth = painted[..., :1]
RGB, RGBA = ["R", "G", "B"], ["R", "G", "B", "A"]


def exr(name, parts):
    """parts: name, channel names, samples, attributes"""
    specs = []
    for part, channels, samples, attributes in parts:
        spec = oiio.ImageSpec(W, H, len(channels), "half")
        spec.channelnames = tuple(channels)
        spec.attribute("compression", "zip")
        if part:
            spec.attribute("oiio:subimagename", part)
        for key, value in attributes.items():
            spec.attribute(key, value)
        specs.append(spec)
    path = str(HERE / f"{name}.exr")
    out = oiio.ImageOutput.create(path)
    assert out.open(path, specs) if len(specs) > 1 else out.open(path, specs[0])
    for i, (_, _, samples, _) in enumerate(parts):
        assert i == 0 or out.open(path, specs[i], "AppendSubimage")
        assert out.write_image(np.ascontiguousarray(samples)), out.geterror()
    out.close()


def under(layer, names):
    return [f"{layer}.{name}" for name in names]


exr("layers", [("", RGB + under("diffuse", RGB) + ["Z"], np.dstack([painted[..., :3], other[..., :3], depth]), {})])
exr("blender", [("", under("View.Combined", RGBA) + under("View.Normal", "XYZ") + ["View.Depth.Z"],
                 np.dstack([painted[..., :3], np.ones_like(depth), other[..., :3], depth]), {})])
exr("xyz", [("", list("XYZ"), painted[..., :3], {})])
exr("only_layer", [("", under("normal", RGB), painted[..., :3], {})])
exr("parts", [("color", RGB, painted[..., :3], {}), ("normal", list("XYZ"), other[..., :3], {})])
exr("srgb", [("", RGB, painted[..., :3], {"colorInteropID": "srgb_rec709_scene"})])
exr("acescg", [("", RGB, painted[..., :3], {"colorInteropID": "lin_ap1_scene"})])

# Colours multiplied by alpha, in 8 bits, and alpha beside grey.
alpha = rgba[..., 3:].astype(np.float64) / 255
associated = np.dstack([np.rint(rgb * alpha), rgba[..., 3:]]).astype(np.uint8)
tifffile.imwrite(HERE / "associated.tif", associated, photometric="rgb", extrasamples=["assocalpha"])
tifffile.imwrite(HERE / "grey_alpha.tif", rgba[..., :2].copy(), photometric="minisblack", planarconfig="contig",
                 extrasamples=["unassalpha"])

# JPEG with Adobe's transform 0: components that are RGB, and such that are YCbCr, which JFIF says.
ADOBE_0 = b"\xff\xee\x00\x0eAdobe\x00\x64\x00\x00\x00\x00\x00"


def jpeg(image):
    """The bytes, and where the JFIF segment begins and ends."""
    file = io.BytesIO()
    image.save(file, "JPEG", quality=95, subsampling=0)
    data = file.getvalue()
    start = data.index(b"\xff\xe0")
    return data, start, start + 2 + struct.unpack_from(">H", data, start + 2)[0]


data, start, end = jpeg(Image.merge("YCbCr", [Image.fromarray(rgb[..., c].copy()) for c in range(3)]))
(HERE / "adobe_0.jpg").write_bytes(data[:start] + ADOBE_0 + data[end:])
data, start, end = jpeg(image["rgb"])
(HERE / "adobe_0_jfif.jpg").write_bytes(data[:end] + ADOBE_0 + data[end:])

# Stored so that they are as painted once they are turned as the tag says.
stored = {2: rgb[:, ::-1], 3: rgb[::-1, ::-1], 4: rgb[::-1], 5: rgb.transpose(1, 0, 2), 6: np.rot90(rgb),
          7: rgb[::-1, ::-1].transpose(1, 0, 2), 8: np.rot90(rgb, -1)}
for orientation, samples in stored.items():
    path = HERE / f"orientation_{orientation}.tif"
    tifffile.imwrite(path, np.ascontiguousarray(samples), photometric="rgb", compression="zlib",
                     extratags=[(274, "H", 1, orientation, True)])
    assert np.array_equal(oiio.ImageBufAlgo.reorient(oiio.ImageBuf(str(path))).get_pixels(oiio.UINT8), rgb), orientation
exif = Image.Exif()
exif[274] = 6
image["rgb"].save(HERE / "exif_turned.jpg", quality=95, subsampling=0, exif=exif)
