"""Writes the small image files beside this script, by Pillow, OpenImageIO and by hand: files whose
writer is not ours.

Texel (x, y) of every file is [x * 12 + y, y * 17, 255 - x * 12 - y, 128 + x + y * 7], cut to the file's
channels; 13x11 texels. Run: python make.py
"""
from pathlib import Path
import struct
import zlib

import numpy as np
import OpenImageIO as oiio
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
