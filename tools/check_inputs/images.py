"""One normal map and one roughness map in many forms of PNG, TGA, TIFF and JPEG: what a file says beside its samples
(gamma, profiles, alpha, orientation of cameras) changes no map, and what says where texels lie is obeyed."""

import io
import struct
import zlib

import numpy as np
import tifffile
from common import png, relief, stored
from PIL import Image, ImageCms

WIDTH, HEIGHT = 64, 48
NORMALS = relief(WIDTH, HEIGHT)
N8, N16 = stored(NORMALS), stored(NORMALS, 16)
R8 = np.tile(np.linspace(40, 220, WIDTH).astype(np.uint8), (HEIGHT, 1))
R8[:10] = 100
NOTHING = np.zeros_like(R8)
# Texels come back as half floats. Inputs of 8 bits are half a step off.
FINE, COARSE = 3e-4, 0.5 / 255 + 3e-4
# What JPEG of quality 98 may lose of a texel, with and without a quarter of the colour's resolution.
JPEG, JPEG_420 = 0.016, 0.12


def check_maps(kind, name, files, within=COARSE, alpha_within=2e-3):
    """A folder of these maps; plain PNGs stand in for what is missing."""
    for map, pixels in [("normal", N8), ("roughness", R8)]:
        if not any(file.startswith(f"mat_{map}.") for file in files):
            files = {**files, f"mat_{map}.png": png(pixels)}
    folder = kind.inputs(name, files)
    baked = kind.bake(folder, "--normal-format", "rgba16f", "--aniso-format", "rgba16f")
    if baked:
        kind.near(folder, "normal", NORMALS[..., :2] * 0.5 + 0.5, baked.texels("normal")[..., :2], within)
        kind.near(folder, "alpha", (R8 / 255.0) ** 2, baked.texels("aniso")[..., 0], alpha_within)
        kind.silent(folder, baked)


def check_refused(kind, name, file, content, *words):
    plain = {"mat_normal.png": png(N8), "mat_roughness.png": png(R8)}
    kept = {other: data for other, data in plain.items() if not other.startswith(file.split(".")[0])}
    kind.refused(kind.inputs(name, {file: content, **kept}), file, *words)


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png_by_hand(pixels, *chunks, interlaced=False):
    """PNG of 8 or 16 bits with chunks before the texels, interlaced by Adam7."""
    height, width = pixels.shape[:2]
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    adam7 = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]
    rows = b""
    for x, y, dx, dy in adam7 if interlaced else [(0, 0, 1, 1)]:
        rows += b"".join(b"\0" + row.astype(row.dtype.newbyteorder(">")).tobytes() for row in pixels[y::dy, x::dx])
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[channels]
    header = struct.pack(">IIBBBBB", width, height, pixels.itemsize * 8, kind, 0, 0, interlaced)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        [chunk(b"IHDR", header), *chunks, chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b"")]
    )


def check_png(kind):
    gamma = lambda value: chunk(b"gAMA", struct.pack(">I", round(value * 100000)))
    primaries = chunk(b"cHRM", struct.pack(">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000))
    srgb = chunk(b"sRGB", b"\0")
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    icc = chunk(b"iCCP", b"sRGB\0\0" + zlib.compress(profile))
    turned = chunk(b"eXIf", b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0")
    key = chunk(b"tRNS", struct.pack(">3H", *N8[5, 5]))
    for name, data, within in [
        ("png", png(N8), COARSE),
        ("png_linear_gamma", png_by_hand(N8, gamma(1)), COARSE),
        ("png_gamma_and_primaries", png_by_hand(N8, gamma(0.45455), primaries), COARSE),
        ("png_srgb", png_by_hand(N8, srgb), COARSE),
        ("png_icc", png_by_hand(N8, icc), COARSE),
        ("png_16_linear_gamma", png_by_hand(N16, gamma(1)), FINE),
        ("png_16_srgb", png_by_hand(N16, srgb), FINE),
        ("png_16_interlaced", png_by_hand(N16, interlaced=True), FINE),
        ("png_interlaced_alpha_0", png_by_hand(np.dstack([N8, NOTHING]), interlaced=True), COARSE),
        ("png_alpha_is_height", png(np.dstack([N8, R8])), COARSE),
        ("png_16_alpha_0", png_by_hand(np.dstack([N16, NOTHING.astype(np.uint16)])), FINE),
        ("png_colour_key", png_by_hand(N8, key), COARSE),
        ("png_trailing_bytes", png(N8) + b"\0" * 37, COARSE),
        ("png_camera_orientation", png_by_hand(N8, turned), COARSE),
    ]:
        check_maps(kind, name, {"mat_normal.png": data}, within)
    check_maps(kind, "png_called_jpg", {"mat_normal.jpg": png(N8)})
    grey = Image.fromarray(R8)
    indexed = grey.convert("P")
    indexed.putpalette([level for level in range(256) for _ in range(3)])
    file = io.BytesIO()
    indexed.save(file, "PNG")
    for name, data in [
        ("grey_16_interlaced", png_by_hand(R8.astype(np.uint16) * 257, interlaced=True)),
        ("grey_alpha_gamma", png_by_hand(np.dstack([R8, np.full_like(R8, 9)]), gamma(0.45455))),
        ("grey_as_rgb_srgb", png_by_hand(np.dstack([R8] * 3), srgb)),
        ("grey_palette", file.getvalue()),
    ]:
        check_maps(kind, name, {"mat_roughness.png": data})


def tga(pixels, origin, packed=False, field=b"", attribute_bits=None, footer=False):
    """Truevision TGA; origin: 0 bottom left, 1 bottom right, 2 top left, 3 top right."""
    height, width = pixels.shape[:2]
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    pixels = pixels.reshape(height, width, channels)
    rows = pixels[..., [2, 1, 0, 3][:channels]] if channels > 1 else pixels
    rows = rows if origin & 2 else rows[::-1]
    rows = rows[:, ::-1] if origin & 1 else rows
    bits = attribute_bits if attribute_bits is not None else 8 * (channels == 4)
    kind = (2 if channels > 1 else 3) + 8 * packed
    header = struct.pack(
        "<BBBHHBHHHHBB", len(field), 0, kind, 0, 0, 0, 0, 0, width, height, 8 * channels, bits | origin << 4
    )
    body = np.ascontiguousarray(rows).tobytes()
    if packed:
        # Runs of raw texels, as long as a row or 128.
        runs = [row[at : at + 128] for row in rows for at in range(0, width, 128)]
        body = b"".join(bytes([len(run) - 1]) + run.tobytes() for run in runs)
    tail = struct.pack("<II", 0, 0) + b"TRUEVISION-XFILE.\0" if footer else b""
    return header + field + body + tail


def check_tga(kind):
    transparent = np.dstack([N8, NOTHING])
    for origin, name in enumerate(["bottom_left", "bottom_right", "top_left", "top_right"]):
        check_maps(kind, f"tga_{name}", {"mat_normal.tga": tga(N8, origin)})
        check_maps(kind, f"tga_packed_{name}", {"mat_normal.tga": tga(transparent, origin, packed=True, footer=True)})
        check_maps(kind, f"tga_grey_{name}", {"mat_roughness.tga": tga(R8, origin, packed=bool(origin & 1))})
    check_maps(kind, "tga_field", {"mat_normal.tga": tga(N8, 2, field=b"x" * 20)})
    check_maps(kind, "tga_no_attribute_bits", {"mat_normal.tga": tga(transparent, 2, attribute_bits=0)})
    check_maps(kind, "tga_capitals", {"mat_normal.TGA": tga(N8, 0)})


def tiff(pixels, **options):
    file = io.BytesIO()
    tifffile.imwrite(file, pixels, **options)
    return file.getvalue()


def check_tiff(kind):
    rgb = {"photometric": "rgb"}
    floats = (NORMALS * 0.5 + 0.5).astype(np.float32)
    half_clear = np.dstack([N8, np.full_like(R8, 128)])
    multiplied = np.dstack([np.rint(N8 * (230 / 255)).astype(np.uint8), np.full_like(R8, 230)])
    upside_down = {"extratags": [(274, "H", 1, 4, True)]}
    for name, data, within in [
        ("tiff", tiff(N8, **rgb), COARSE),
        ("tiff_tiles_deflate", tiff(N16, tile=(16, 16), compression="zlib", **rgb), FINE),
        ("tiff_tiles_lzw_predictor", tiff(N16, tile=(32, 32), compression="lzw", predictor=True, **rgb), FINE),
        ("tiff_big_endian", tiff(N16, byteorder=">", **rgb), FINE),
        ("tiff_bigtiff", tiff(N16, bigtiff=True, **rgb), FINE),
        ("tiff_alpha", tiff(half_clear, extrasamples=["unassalpha"], **rgb), COARSE),
        # Rounded once more, before the division by 230/255.
        ("tiff_multiplied_by_alpha", tiff(multiplied, extrasamples=["assocalpha"], **rgb), 2.2 * COARSE),
        (
            "tiff_five_channels",
            tiff(np.dstack([half_clear, R8]), extrasamples=["unassalpha", "unspecified"], **rgb),
            COARSE,
        ),
        ("tiff_float", tiff(floats, **rgb), FINE),
        ("tiff_float_predictor", tiff(floats, compression="zlib", predictor=True, **rgb), FINE),
        ("tiff_half", tiff(floats.astype(np.float16), **rgb), 2 * FINE),
        ("tiff_strips", tiff(N8, rowsperstrip=7, compression="zlib", **rgb), COARSE),
        ("tiff_packbits", tiff(N8, compression="packbits", **rgb), COARSE),
        ("tiff_upside_down", tiff(N8[::-1], **rgb, **upside_down), COARSE),
    ]:
        check_maps(kind, name, {"mat_normal.tif": data}, within)
    for name, data in [
        ("tiff_white_is_0", tiff(255 - R8, photometric="miniswhite")),
        ("tiff_two_pages", tiff(np.stack([R8, 255 - R8]), photometric="minisblack")),
        ("tiff_grey_upside_down", tiff(R8[::-1], photometric="minisblack", **upside_down)),
    ]:
        check_maps(kind, name, {"mat_roughness.tif": data})
    grey_ramp = np.tile(np.arange(256, dtype=np.uint16) * 257, (3, 1))
    for name, file, data, word in [
        (
            "tiff_planes",
            "mat_normal.tif",
            tiff(np.moveaxis(N16, 2, 0), planarconfig="separate", **rgb),
            "separate planes",
        ),
        ("tiff_jpeg", "mat_normal.tif", tiff(N8, compression="jpeg", **rgb), "YCbCr"),
        ("tiff_zstd", "mat_normal.tif", tiff(N8, compression="zstd", **rgb), "ZSTD"),
        ("tiff_palette", "mat_roughness.tif", tiff(R8, photometric="palette", colormap=grey_ramp), "Palette"),
        ("tiff_32_bits", "mat_roughness.tif", tiff(R8.astype(np.uint32) * 0x01010101), "32-bit"),
    ]:
        check_refused(kind, name, file, data, "TIFF", word, "save" if word != "YCbCr" else "convert")


def jpeg(image, **options):
    file = io.BytesIO()
    image.save(file, "JPEG", **{"quality": 98, "subsampling": 0, **options})
    return file.getvalue()


def without_jfif(data):
    start = data.index(b"\xff\xe0")
    length = struct.unpack_from(">H", data, start + 2)[0]
    return data[:start] + data[start + 2 + length :]


def with_adobe(data, transform, behind_jfif=False):
    """Adobe's marker: 0 says that the three components are not YCbCr."""
    at = 2
    if behind_jfif:
        at = data.index(b"\xff\xe0") + 2
        at += struct.unpack_from(">H", data, at)[0]
    return data[:at] + b"\xff\xee\x00\x0eAdobe\x00\x64\x00\x00\x00\x00" + bytes([transform]) + data[at:]


def with_components(data, names):
    """Other identifiers of the components, in the frame's header and the scan's."""
    data, at = bytearray(data), 2
    while True:
        marker, length = data[at + 1], struct.unpack_from(">H", data, at + 2)[0]
        # Start of frame: precision, two sides and the count stand before the components; start of scan: the count.
        if marker in (0xC0, 0xC2, 0xDA):
            first, each = (at + 5, 2) if marker == 0xDA else (at + 10, 3)
            data[first : first + 3 * each : each] = names
        if marker == 0xDA:
            return bytes(data)
        at += 2 + length


def check_jpeg(kind):
    image = Image.fromarray(N8)
    plain = jpeg(image)
    # Red, green and blue where a writer that is told YCbCr puts them: an RGB file, once its markers say so.
    as_rgb = without_jfif(jpeg(Image.merge("YCbCr", image.split())))
    turned = Image.Exif()
    turned[274] = 6
    for name, data, within in [
        ("jpeg", plain, JPEG),
        ("jpeg_progressive_420", jpeg(image, progressive=True, subsampling=2), JPEG_420),
        ("jpeg_rgb_by_adobe", with_adobe(as_rgb, 0), JPEG),
        ("jpeg_ycc_by_jfif_and_adobe", with_adobe(plain, 1, behind_jfif=True), JPEG),
        ("jpeg_ycc_by_jfif_against_adobe", with_adobe(plain, 0, behind_jfif=True), JPEG),
        ("jpeg_no_markers", without_jfif(plain), JPEG),
        ("jpeg_rgb_by_components", with_components(as_rgb, b"RGB"), JPEG),
        ("jpeg_components_from_0", with_components(plain, bytes([0, 1, 2])), JPEG),
        ("jpeg_camera_orientation", jpeg(image, exif=turned), JPEG),
        ("jpeg_trailing_bytes", plain + b"\0" * 100, JPEG),
        ("jpeg_second_picture", plain + plain, JPEG),
    ]:
        check_maps(kind, name, {"mat_normal.jpg": data}, within)
    check_maps(kind, "jpeg_grey", {"mat_roughness.jpg": jpeg(Image.fromarray(R8))}, alpha_within=0.012)
    check_refused(kind, "jpeg_cmyk", "mat_normal.jpg", jpeg(image.convert("CMYK")), "JPEG", "CMYK", "convert")


def check(kind):
    check_png(kind)
    check_tga(kind)
    check_tiff(kind)
    check_jpeg(kind)
