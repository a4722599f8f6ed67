"""The formulas of Kinran over arrays.

Every function takes numbers or arrays of any shape that broadcast against each other and gives float32. A parameter that is a
vector or a matrix has it in its last axis: 2 and 3 numbers for vectors, (xx, xy, yy) for a symmetric 2 x 2 matrix and
(xx, xy, xz, yy, yz, zz) for one of 3 x 3. Angles are radians. The functions are those of ``kinran-shading`` in Rust and of the
shader library, which have the same names, and run on all cores without the interpreter's lock.
"""

import inspect as _inspect

import numpy as _np

from . import _kinran

#: Results that are two things in one row, and where they are parted.
_PAIRS = {"ggx_from_sggx": 3, "curvature_decode": 3}


def _vectors(name, parameter, width, value):
    array = _np.asarray(value)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name}(): {parameter} is of {array.dtype}; give numbers")
    if width > 1 and (array.ndim == 0 or array.shape[-1] != width):
        raise ValueError(f"{name}(): {parameter} has the shape {array.shape}; its last axis must be of {width}")
    return array


def _function(name, parameters, width, text):
    def call(*values):
        arrays = [_vectors(name, p, w, value) for (p, w), value in zip(parameters, values)]
        leading = [a.shape if w == 1 else a.shape[:-1] for a, (_, w) in zip(arrays, parameters)]
        shape = _np.broadcast_shapes(*leading)
        count = int(_np.prod(shape, dtype=_np.int64))
        flat = []
        for array, own, (_, w) in zip(arrays, leading, parameters):
            tail = () if w == 1 else (w,)
            is_one = int(_np.prod(own, dtype=_np.int64)) == 1
            if not is_one and own != shape:
                array = _np.broadcast_to(array, shape + tail)
            flat.append(_np.ascontiguousarray(array, dtype=_np.float32).reshape(-1))
        result = _kinran.formula(name, flat, count)
        result = result.reshape(shape + (() if width == 1 else (width,)))
        if name in _PAIRS:
            at = _PAIRS[name]
            rest = result[..., at:]
            return result[..., :at], rest[..., 0] if rest.shape[-1] == 1 else rest
        return result if result.shape else _np.float32(result)

    names = [p for p, _ in parameters]
    code = f"lambda {', '.join(names)}: call({', '.join(names)})"
    function = eval(code, {"call": call})  # Named parameters, as help() and editors show them.
    function.__name__ = function.__qualname__ = name
    function.__module__ = __name__
    widths = ", ".join(f"{p} (..., {w})" if w > 1 else f"{p} (...)" for p, w in parameters)
    shape = "(...)" if width == 1 else f"(..., {width})"
    if name in _PAIRS:
        at, rest = _PAIRS[name], width - _PAIRS[name]
        shape = f"(..., {at}) and (...{f', {rest}' if rest > 1 else ''})"
    function.__doc__ = f"{text}\n\nShapes: {widths} -> {shape}."
    function.__signature__ = _inspect.Signature(
        [_inspect.Parameter(p, _inspect.Parameter.POSITIONAL_OR_KEYWORD) for p in names]
    )
    return function


__all__ = []
for _name, _parameters, _width, _text in _kinran.formulas():
    globals()[_name] = _function(_name, _parameters, _width, _text)
    __all__.append(_name)
del _name, _parameters, _width, _text
