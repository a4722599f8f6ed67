"""A map of a folder that is not read, or is no picture, is told or refused; never is the surface flat in its stead."""

import io

from common import STEP, flat, png, relief, stored
from PIL import Image

NORMALS = relief(32, 32)
N8 = stored(NORMALS)


def saved(format, **options):
    file = io.BytesIO()
    Image.fromarray(N8).save(file, format, **options)
    return file.getvalue()


READ = {
    "webp": saved("WEBP", lossless=True),
    "bmp": saved("BMP"),
    "PNG": saved("PNG"),
    "jpe": saved("JPEG", quality=98, subsampling=0),
    "jfif": saved("JPEG", quality=98, subsampling=0),
}
NOT_READ = {
    "jp2": saved("JPEG2000"),
    "gif": saved("GIF"),
    "avif": b"\0\0\0\x20ftypavif" + b"\0" * 200,
    "psd": b"8BPS\0\x01" + b"\0" * 200,
}
NO_PICTURE = ["dds", "ktx2", "png", "tif", "exr", "jpg", "webp", "bmp", "hdr"]
REST = {"mat_roughness.png": png(flat(128)), "mat_color.png": png(flat(90, 90, 90))}


def check(kind):
    for suffix, data in READ.items():
        folder = kind.inputs(f"read_{suffix}", {f"mat_normal.{suffix}": data, **REST})
        baked = kind.bake(folder, "--normal-format", "rgba8")
        if baked:
            lost = 0.016 if suffix.startswith("j") else 0
            kind.near(folder, "normal", NORMALS[..., :2] * 0.5 + 0.5, baked.texels("normal")[..., :2], STEP + lost)
            kind.silent(folder, baked)
    for suffix, data in NOT_READ.items():
        file = f"mat_normal.{suffix}"
        folder = kind.inputs(f"not_read_{suffix}", {file: data, **REST})
        kind.refused(folder, file, "normal", f".{suffix}", "save it as PNG")
    for suffix in NO_PICTURE:
        for name, data in [("noise", b"x" * 1000), ("empty", b"")]:
            file = f"mat_normal.{suffix}"
            kind.refused(kind.inputs(f"{name}_{suffix}", {file: data, **REST}), file)
    # Half a picture is no map either.
    for suffix, data in [("png", png(N8)), ("jpg", READ["jpe"]), ("webp", READ["webp"]), ("bmp", READ["bmp"])]:
        file = f"mat_normal.{suffix}"
        kind.refused(kind.inputs(f"half_{suffix}", {file: data[: len(data) // 2], **REST}), file)
