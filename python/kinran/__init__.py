"""Kinran: anisotropic specular maps, fuzz, skin and detail maps.

``bake`` makes engine-ready textures of a glTF file or of a folder of maps, ``bake_library`` of all that a kinran.toml lists,
``solve_detail`` of a target and its tiles, ``skin_lut`` the tables of skin. ``inspect`` and ``check`` look into files.
``filter_mips``, ``encode_texture``, ``decode_texture``, ``read_image`` and ``curvature`` work on arrays,
``kinran.formulas`` has every formula over arrays, and ``shader`` gives the shader library's text.

Functions that take long release the interpreter's lock, stop at Ctrl-C with nothing half-written, and tell of their progress:
by ``progress=callback(what, done, total)``, or by a bar of their own in a terminal.
"""

import json as _json
import os as _os
from dataclasses import dataclass as _dataclass

import numpy as _np

from . import _kinran, formulas
from ._errors import Cancelled, FileError, InputError, KinranError
from ._options import Options as _Options
from ._progress import watched as _watched

__version__ = _kinran.__version__
__all__ = [
    "Cancelled", "FileError", "InputError", "KinranError", "Level", "Texture", "bake", "bake_library", "check",
    "curvature", "decode_texture", "encode_texture", "filter_mips", "fit_fuzz", "formulas", "inspect", "read_image",
    "shader", "skin_lut", "solve_detail",
]

#: What a run does, not how something is baked.
_OF_THE_RUN = ("dry_run", "force", "watch", "jobs", "prune", "cache")
_BAKE = _Options("bake", without=_OF_THE_RUN)
_SOLVE = _Options("detail", "solve", without=("force",))
_SKIN = _Options("skin-lut", without=("force",))
_RUN = _Options("bake")


def _input(function, what, name, files):
    """The path of an input, and the files in memory where it is bytes."""
    if isinstance(what, (bytes, bytearray, memoryview)):
        return name, {**{n: bytes(b) for n, b in (files or {}).items()}, name: bytes(what)}
    if files is not None:
        return _os.fspath(what), {n: bytes(b) for n, b in files.items()}
    return _os.fspath(what), None


def _bake(function, kind, what, words, output, name, files, force, progress):
    path, files = _input(function, what, name, files)
    if files is None and output is None:
        raise TypeError(f"{function}() needs an output folder")
    if files is not None and output is not None:
        raise TypeError(f"{function}() of files in memory gives them back; leave output out")
    with _watched(progress) as tell:
        report, baked = _kinran.bake(kind, path, words, output and _os.fspath(output), files, force, tell)
    report = _json.loads(report)
    return report if baked is None else (report, baked)


def bake(input, output=None, *, name="model.glb", files=None, force=False, progress=None, **options):
    """Bakes a glTF file, or a folder of authored maps, into textures with right mips.

    Parameters
    ----------
    input : path, or bytes
        A .glb or .gltf, a folder of maps, or the bytes of a model.
    output : path, optional
        The folder of the files; it is made. Not with bytes.
    name : str
        What bytes are called; its ending says what they are.
    files : dict of str to bytes, optional
        Files that a model in memory names, or all files of a folder that is in memory alone.
    force : bool
        Overwrites files in ``output`` that Kinran did not write.
    progress : callable or bool, optional
        Is called with what is being done, units done, and units in all (0 while nobody knows); False for no bar.
    {options}

    Returns
    -------
    dict, or (dict, dict of str to bytes)
        The report, docs/json.md; of files in memory also what was baked.

    Raises
    ------
    InputError
        A file or an option is wrong; nothing was written.

    Examples
    --------
    >>> kinran.bake("lamp.glb", "baked", all_textures=True)  # doctest: +SKIP
    >>> report, files = kinran.bake(data, form="both")  # doctest: +SKIP
    """
    is_bytes = isinstance(input, (bytes, bytearray, memoryview))
    ending = (name if is_bytes else _os.fspath(input)).lower()
    kind = "model" if is_bytes or ending.endswith((".glb", ".gltf", ".vrm")) else "folder"
    words = _BAKE.words("bake", options)
    return _bake("bake", kind, input, words, output, name, files, force, progress)


def solve_detail(target, output=None, *, layer, files=None, force=False, progress=None, **options):
    """Solves a map against its tiles, so that the blend of both is the map.

    Parameters
    ----------
    target : path
        The image that is to come out.
    output : path, optional
        The folder of the files.
    layer : str or list of str
        Tiles from the lowest up, as ``kinran detail solve --layer`` has them: ``"steel.png,scale=4"``.
    files : dict of str to bytes, optional
        All images, where they are in memory.
    force, progress
        As those of :func:`bake`.
    {options}

    Returns
    -------
    dict, or (dict, dict of str to bytes)
        The report; of files in memory also what was made.
    """
    options = {"layer": [layer] if isinstance(layer, str) else layer, **options}
    words = _SOLVE.words("solve_detail", options)
    return _bake("solve_detail", "detail", target, words, output, "target.png", files, force, progress)


def skin_lut(output, *, force=False, progress=None, **options):
    """Integrates the tables that light skin, into a folder.

    Parameters
    ----------
    output : path
        The folder.
    force, progress
        As those of :func:`bake`.
    {options}
    """
    words = _SKIN.words("skin_lut", options)
    _bake("skin_lut", "skin", options.get("profile") or "", words, output, "", None, force, progress)


def bake_library(manifest, *, progress=None, **options):
    """Bakes what a kinran.toml lists, each thing once; what has not changed is not baked again.

    Parameters
    ----------
    manifest : path
        The kinran.toml.
    progress
        As that of :func:`bake`.
    output, dry_run, jobs, prune, cache
        As the flags of ``kinran bake``.

    Returns
    -------
    dict
        The report, docs/json.md. Entries that failed have the status ``failed`` and an ``error``.
    """
    run = {k: options.pop(k) for k in ("dry_run", "jobs", "prune", "cache") if k in options}
    output = options.pop("output", None)
    if options:
        raise TypeError(f"bake_library() got an unexpected keyword argument '{next(iter(options))}'")
    words = _RUN.words("bake_library", run)
    if output is not None:
        words.append(f"--output={_os.fspath(output)}")
    with _watched(progress) as tell:
        return _json.loads(_kinran.bake_library(_os.fspath(manifest), words, tell))


def inspect(path, *, role=None, exr_layer=None, allow_outside=(), name="model.glb", files=None):
    """Tells what is in a texture, a model, an image or a report.

    Parameters
    ----------
    path : path, or bytes called ``name``
    role : str, optional
        What a texture holds, as ``kinran inspect --role`` has it.
    exr_layer : str, optional
        Of an EXR file, the layer to look at.
    allow_outside : list of paths
        Folders outside of a model's own whose files it may name.

    Returns
    -------
    dict
        docs/json.md.
    """
    path, files = _input("inspect", path, name, files)
    allowed = [_os.fspath(folder) for folder in allow_outside]
    return _json.loads(_kinran.inspect(path, role, exr_layer, allowed, files))


def check(path):
    """Tells what of a baked texture, model or report breaks the rules for what Kinran writes.

    Returns
    -------
    dict
        ``looked_at``, how many things in it have rules, and ``findings``, a list of ``place`` and ``problem``.
    """
    return _json.loads(_kinran.check(_os.fspath(path)))


def fit_fuzz(tilt=0.0, spread=0.5, *, table=False):
    """Fits the coefficients of fuzz whose fibres lean by ``tilt`` degrees (0 to 90) and spread by ``spread`` (0 to 1).

    Returns
    -------
    dict
        The coefficients and their errors, as ``kinran fit fuzz --json`` prints them.
    """
    return _json.loads(_kinran.fit_fuzz(tilt, spread, table))


def shader(language, module=None):
    """The text of the shader library.

    Parameters
    ----------
    language : str
        ``wgsl``, ``glsl-450``, ``glsl-es-300``, ``hlsl`` or ``msl``; ``wesl`` with a module.
    module : str, optional
        One module with what it needs, such as ``aniso``; else all.
    """
    return _kinran.shader(language, module)


@_dataclass
class Texture:
    """A texture with its levels."""

    levels: list
    """Each a float32 array, height x width x 4, as stored: colour is not decoded."""
    format: str
    """Its texel format, such as ``bc7``."""
    transfer: str
    """``srgb``, ``linear`` or ``unsaid``."""
    keys: dict
    """Key/values of a KTX2 file."""


@_dataclass
class Level:
    """A level of a filtered surface."""

    normal: _np.ndarray
    """height x width x 3, unit vectors, +Y up."""
    roughness: _np.ndarray
    """height x width x 3: squared GGX alpha as a symmetric matrix (xx, xy, yy) about the normal;
    :func:`kinran.formulas.aniso_encode` makes a texel of it."""


def _image(function, name, array, channels):
    array = _np.asarray(array)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{function}(): {name} is of {array.dtype}; give numbers")
    if array.ndim == 2 and channels == 1:
        array = array[..., None]
    if array.ndim != 3 or array.shape[-1] != channels:
        wanted = "height x width" + (f" x {channels}" if channels > 1 else "")
        raise ValueError(f"{function}(): {name} has the shape {array.shape}; it must be {wanted}")
    if 0 in array.shape:
        raise ValueError(f"{function}(): {name} is empty, {array.shape}")
    array = _np.ascontiguousarray(array, dtype=_np.float32)
    if not _np.isfinite(array).all():
        raise ValueError(f"{function}(): {name} has numbers that are not finite")
    return array


def read_image(path, *, data=None, layer=None):
    """Reads PNG, JPEG, TGA, BMP, WebP, TIFF, HDR, EXR, KTX2 or DDS as an array.

    Parameters
    ----------
    path : path
        The file, or what ``data`` is called.
    data : bytes, optional
        The file's bytes.
    layer : str, optional
        Of an EXR file.

    Returns
    -------
    array, float32, height x width x channels
        As stored: integers from 0 to 1, colour is not decoded.
    """
    (flat, width, height, channels), _, _ = _kinran.read_image(_os.fspath(path), data, layer)
    return flat.reshape(height, width, channels)


def decode_texture(file, *, name="texture.ktx2"):
    """Decodes every level of a KTX2 or DDS file.

    Parameters
    ----------
    file : path or bytes

    Returns
    -------
    Texture
    """
    if not isinstance(file, (bytes, bytearray, memoryview)):
        name = _os.fspath(file)
        try:
            with open(name, "rb") as stream:
                file = stream.read()
        except OSError as error:
            raise FileError.of(name, error) from error
    levels, form, transfer, keys = _kinran.decode_levels(name, bytes(file))
    levels = [flat.reshape(height, width, 4) for flat, width, height, _ in levels]
    return Texture(levels, form, transfer, dict(keys))


def encode_texture(
    levels, *, format="bc7", srgb=False, container="ktx2", encoder="portable", preset="normal", zstd=3, keys=None
):
    """Compresses levels into the bytes of a KTX2 or DDS file.

    Parameters
    ----------
    levels : list of arrays
        Level 0 first, each height x width x 1 to 4 from 0 to 1, half as large as the one before, rounded down.
    format : str
        ``bc1``, ``bc4``, ``bc5``, ``bc7``, ``rgba8`` or ``rgba16f``.
    srgb : bool
        Whether colours are encoded by the sRGB curve.
    container : "ktx2" or "dds"
    encoder : "portable" or "ispc"
        ``portable`` gives the same bytes on every processor.
    preset : "fast", "normal" or "best"
    zstd : int
        Zstandard level of KTX2 files, 0 for none.
    keys : dict of str to str, optional
        Key/values of a KTX2 file.

    Returns
    -------
    bytes
    """
    flat = []
    for i, level in enumerate(levels):
        level = _np.asarray(level)
        if level.ndim == 2:
            level = level[..., None]
        channels = level.shape[-1] if level.ndim == 3 else 0
        if not 1 <= channels <= 4:
            raise ValueError(f"encode_texture(): level {i} has the shape {level.shape}; give height x width x 1 to 4")
        level = _image("encode_texture", f"level {i}", level, channels)
        if channels < 4:
            full = _np.ones(level.shape[:2] + (4,), _np.float32)
            full[..., :3] = level if channels in (1, 3) else _np.concatenate([level, level[..., :1] * 0], -1)
            level = full
        flat.append((level.reshape(-1), level.shape[1], level.shape[0]))
    if not flat:
        raise ValueError("encode_texture(): there are no levels")
    return _kinran.encode_levels(flat, format, srgb, container, encoder, preset, zstd, list((keys or {}).items()))


def filter_mips(
    normal, roughness, roughness_across=None, direction=None, *, filter="ml", kernel="box", edges="wrap"
):
    """Filters normals and roughness so that every level keeps the shape of the highlight.

    Parameters
    ----------
    normal : array, height x width x 3, or None
        Vectors from -1 to 1, +Y up; None for a flat surface.
    roughness : array, height x width
        Perceptual roughness, 0 to 1; where ``roughness_across`` is given, that along the direction.
    roughness_across : array, height x width, optional
        Perceptual roughness across the direction.
    direction : array, height x width x 2, optional
        Where the roughness lies along, -1 to 1; else along the tangent.
    filter : str
        ``ml``, ``linear``, ``lean``, ``naive`` and others that ``kinran bake --filter`` has.
    kernel : "box" or "tent"
    edges : "wrap", "clamp" or "mirror"

    Returns
    -------
    list of Level
        Level 0 first, down to 1 x 1.
    """
    roughness = _image("filter_mips", "roughness", roughness, 1)
    height, width = roughness.shape[:2]
    others = [("normal", normal, 3), ("roughness_across", roughness_across, 1), ("direction", direction, 2)]
    arrays = []
    for name, array, channels in others:
        if array is not None:
            array = _image("filter_mips", name, array, channels)
            if array.shape[:2] != (height, width):
                raise ValueError(f"filter_mips(): {name} is {array.shape[:2]}, roughness is {(height, width)}")
            array = array.reshape(-1)
        arrays.append(array)
    if direction is not None and roughness_across is None:
        raise TypeError("filter_mips(): a direction says nothing without roughness_across")
    normal, across, direction = arrays
    flat = roughness.reshape(-1)
    levels = _kinran.filter_surface((width, height), normal, flat, across, direction, filter, kernel, edges)
    return [Level(n.reshape(h, w, 3), s.reshape(h, w, 3)) for w, h, n, s in levels]


def curvature(
    positions, triangles, *, normals=None, tangents=None, method="normals", millimetres=1000.0, blur=None, clamp=True
):
    """Curvature tensors of a mesh, for skin.

    Parameters
    ----------
    positions : array, vertices x 3
    triangles : array of integers, triangles x 3
        Counter-clockwise seen from outside.
    normals : array, vertices x 3, optional
        Unit length; estimated where there are none.
    tangents : array, vertices x 4, optional
        As glTF has them; arbitrary ones are chosen where there are none.
    method : "normals" or "fit"
    millimetres : float
        In a unit of length: 1000 for metres.
    blur : list of float, optional
        Deviations in mm of the Gaussians whose mean blurs the tensors; an empty list for none.
    clamp : bool
        Concave curvature becomes zero.

    Returns
    -------
    (tensors, tangents, report)
        vertices x 3, (xx, xy, yy) in 1/mm in the frame of the tangents; vertices x 4; a dict of what was found.
    """

    def rows(name, array, width, kinds, dtype):
        array = _np.asarray(array)
        if array.dtype.kind not in kinds:
            raise TypeError(f"curvature(): {name} is of {array.dtype}")
        if array.ndim != 2 or array.shape[1] != width:
            raise ValueError(f"curvature(): {name} has the shape {array.shape}; it must be (..., {width})")
        if kinds == "iu" and array.size and (array.min() < 0 or array.max() >= 1 << 32):
            raise ValueError(f"curvature(): {name} has numbers that no vertex has")
        return _np.ascontiguousarray(array, dtype=dtype).reshape(-1)

    count = len(positions)
    positions = rows("positions", positions, 3, "fiu", _np.float32)
    triangles = rows("triangles", triangles, 3, "iu", _np.uint32)
    optional = {}
    for name, array, width in (("normals", normals, 3), ("tangents", tangents, 4)):
        if array is not None and len(array) != count:
            raise ValueError(f"curvature(): {len(array)} {name} for {count} positions")
        optional[name] = None if array is None else rows(name, array, width, "fiu", _np.float32)
    blur = None if blur is None else [float(sigma) for sigma in blur]
    tensors, frames, report = _kinran.curvature(
        positions, triangles, optional["normals"], optional["tangents"], method, millimetres, blur, clamp
    )
    return tensors.reshape(-1, 3), frames.reshape(-1, 4), _json.loads(report)


_BAKE.describe(bake)
_SOLVE.flags.pop("layer", None)
_SOLVE.describe(solve_detail)
_SOLVE = _Options("detail", "solve", without=("force",))
_SKIN.describe(skin_lut)
