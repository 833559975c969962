"""Python interface of math/functions.hpp: elementary functions with the same bits on all machines.

Arguments are float64 arrays or numbers; results are float64 arrays of the same shape. Use these instead of
numpy's for everything that reaches an artifact. `_maps.elementary` has the other functions of functions.hpp
by name. Slow beside a kernel's inner loop: meant for a few thousand values.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from paradize.kernels.maps import _maps

F64 = npt.NDArray[np.float64]


def srgb_to_linear(x: npt.ArrayLike) -> F64:
    """Encoded sRGB -> linear light."""
    return _call("srgb_to_linear", x)


def linear_to_srgb(x: npt.ArrayLike) -> F64:
    """Linear light -> encoded sRGB."""
    return _call("linear_to_srgb", x)


def _call(name: str, x: npt.ArrayLike) -> F64:
    values = np.ascontiguousarray(x, np.float64)
    out = np.empty_like(values)
    _maps.elementary(name, values, np.zeros(0), out)
    return out.reshape(np.shape(x))
