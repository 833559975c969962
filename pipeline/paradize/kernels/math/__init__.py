"""Python interface of math/functions.hpp: elementary functions with the same bits on all machines.

Arguments are float64 arrays or numbers; results are float64 arrays of the same shape. Use these instead of
numpy's for everything that reaches an artifact. Slow beside a kernel's inner loop: meant for a few thousand
values.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.kernels.maps import _maps

F64 = npt.NDArray[np.float64]


def _call(name: str, first: npt.ArrayLike, second: npt.ArrayLike | None = None) -> F64:
    a = np.ascontiguousarray(first, np.float64)
    b = np.zeros(0) if second is None else np.ascontiguousarray(second, np.float64)
    if second is not None:
        a, b = (np.ascontiguousarray(part) for part in np.broadcast_arrays(a, b))
    out = np.empty_like(a)
    _maps.elementary(name, a, b, out)
    return out.reshape(
        np.shape(first) if second is None else np.broadcast_shapes(np.shape(first), np.shape(second))
    )


def exp(x: npt.ArrayLike) -> F64:
    """e^x."""
    return _call("exp", x)


def log(x: npt.ArrayLike) -> F64:
    """Natural logarithm; -inf at 0, NaN below."""
    return _call("log", x)


def pow(x: npt.ArrayLike, y: npt.ArrayLike) -> F64:  # noqa: A001
    """x^y for x >= 0."""
    return _call("pow", x, y)


def sin(x: npt.ArrayLike) -> F64:
    """Sine of radians, |x| < 8e5."""
    return _call("sin", x)


def cos(x: npt.ArrayLike) -> F64:
    """Cosine of radians, |x| < 8e5."""
    return _call("cos", x)


def acos(x: npt.ArrayLike) -> F64:
    """Arc cosine in radians, its argument clamped to [-1, 1]."""
    return _call("acos", x)


def atan2(y: npt.ArrayLike, x: npt.ArrayLike) -> F64:
    """The angle of (x, y) from +x in radians, -pi..pi."""
    return _call("atan2", y, x)


def srgb_to_linear(x: npt.ArrayLike) -> F64:
    """Encoded sRGB -> linear light."""
    return _call("srgb_to_linear", x)


def linear_to_srgb(x: npt.ArrayLike) -> F64:
    """Linear light -> encoded sRGB."""
    return _call("linear_to_srgb", x)
