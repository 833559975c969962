"""Python interface of the normal kernels: heights or slopes -> unit normals.

Wrong shapes and types raise ValueError: they are faults of the program, not of a source file. Heights that
are not finite raise SourceError with their place. Results depend neither on `threads` nor on the CPU.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from paradize.errors import SourceError
from paradize.kernels.normals import _normals
from paradize.kernels.threads import default_threads

if TYPE_CHECKING:
    from collections.abc import Sequence

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
I32 = npt.NDArray[np.int32]

THREADS = default_threads(2)
MAX_REACH = 64  # of a filter, texels to each side
_WIDTHS = {"widest": 0, "baseline": 1, "avx2": 2, "avx512": 3}


def widths() -> list[str]:
    """The instruction sets of this CPU, for tests. All give the same bits."""
    return [name for name, code in _WIDTHS.items() if _normals.has_width(code)]


def _plane(array: npt.NDArray[Any], name: str) -> F32:
    if array.dtype != np.float32 or array.ndim != 2 or array.size == 0:
        raise ValueError(f"{name} have shape {array.shape} of {array.dtype}, not (h, w) of float32")
    return np.ascontiguousarray(array)


def _weights(values: npt.ArrayLike, name: str, max_count: int) -> F64:
    weights = np.ascontiguousarray(values, np.float64)
    if weights.ndim != 1 or not 1 <= weights.size <= max_count or not bool(np.isfinite(weights).all()):
        raise ValueError(f"{name} has shape {weights.shape}; 1 to {max_count} finite weights are taken")
    return weights


def _not_finite(planes: Sequence[F32], what: str) -> SourceError:
    for plane in planes:
        for row, values in enumerate(plane):
            bad = np.flatnonzero(~np.isfinite(values))
            if bad.size:
                place = f"row {row}, column {int(bad[0])}"
                return SourceError(f"{what} is {values[bad[0]]}, not a finite number", place=place)
    return SourceError(f"{what} is not a finite number")


def normals_from_heights(
    heights: F32,
    *,
    derivative: npt.ArrayLike,
    smooth: npt.ArrayLike = (1.0,),
    scale: tuple[float, float],
    wrap: tuple[bool, bool],
    green_down: bool = False,
    islands: I32 | None = None,
    rows: tuple[int, int] | None = None,
    threads: int = THREADS,
    width: str = "widest",
) -> F32:
    """Unit normals (n, w, 3) float32, green up, of rows [first, end) of heights (h, w) (`rows`; None: all).

    derivative: weights of h[+k] - h[-k], k = 1, 2, ..., along an axis. smooth: weights of the centre and of
    both neighbours at 1, 2, ... across it; centre + 2 * rest = 1. scale: slope along (x, y) of one unit of
    height between neighbours, finite. wrap: whether (x, y) repeat; where they do not, heights are continued
    by odd reflection about the edge texel. green_down: y points down the image. width: one of widths().

    islands: (h, w) int32, an id per UV island, negative outside. Where a tap lies on another island or
    outside the map, it is replaced by the odd reflection about the texel; where both taps of a pair are lost,
    the axis uses the difference of the adjacent texels of its island. Normals outside all islands are slopes
    across borders, to be replaced by a gutter.

    Where all taps are equal the normal is exactly (0, 0, 1). Slopes beyond 1e18 are computed in double.
    Raises SourceError for a height that is not finite, with its row and column.
    """
    heights = _plane(heights, "heights")
    if islands is None:
        islands = np.empty((0,), np.int32)
    elif islands.shape != heights.shape or islands.dtype != np.int32:
        raise ValueError(f"islands have shape {islands.shape} of {islands.dtype}; heights {heights.shape}")
    first, end = (0, heights.shape[0]) if rows is None else rows
    if not 0 <= first <= end <= heights.shape[0]:
        raise ValueError(f"rows {first} to {end} of {heights.shape[0]}")
    out = np.empty((end - first, heights.shape[1], 3), np.float32)
    done = _normals.normals_from_heights(
        heights,
        np.ascontiguousarray(islands),
        _weights(derivative, "derivative", MAX_REACH),
        _weights(smooth, "smooth", MAX_REACH + 1),
        float(scale[0]),
        float(scale[1]),
        wrap[0],
        wrap[1],
        green_down,
        first,
        end,
        out,
        threads,
        _WIDTHS[width],
    )
    if not done:
        raise _not_finite([heights], "a height")
    return out


def normals_from_slopes(
    dx: F32,
    dy: F32,
    *,
    scale: tuple[float, float],
    green_down: bool = False,
    threads: int = THREADS,
    width: str = "widest",
) -> F32:
    """Unit normals, green up, of slopes dx, dy (h, w): height per texel along the rows and down the columns.

    scale: factors of the slopes along (x, y). Other arguments as in normals_from_heights. Raises SourceError
    for a slope that is not finite, with its row and column.
    """
    dx, dy = _plane(dx, "dx"), _plane(dy, "dy")
    if dx.shape != dy.shape:
        raise ValueError(f"dx has shape {dx.shape}, dy {dy.shape}")
    out = np.empty((*dx.shape, 3), np.float32)
    done = _normals.normals_from_slopes(
        dx,
        dy,
        float(scale[0]),
        float(scale[1]),
        green_down,
        out,
        threads,
        _WIDTHS[width],
    )
    if not done:
        raise _not_finite([dx, dy], "a slope")
    return out
