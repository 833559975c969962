"""The angle, in degrees, between a decoded normal map and normals computed in float64 from its heights.

The same as levels.py measures natively, for arrays that are no texture; and, in numpy, the float64 normals
themselves. The angle's arc tangent is its own: numpy's differs between CPUs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from paradize.kernels import reference_maps
from paradize.metrics.filters import taps
from paradize.metrics.levels import filter_error, six

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]
    I32 = npt.NDArray[np.int32]


@dataclass(frozen=True)
class AngleError:
    """Degrees over all texels measured; six significant digits."""

    mean: float
    p99: float
    max: float


def _extended(values: F64, reach: int, wrap: bool) -> F64:
    """The values with `reach` more before and after, along axis 0: repeated, or reflected oddly about the
    last."""
    n = len(values)
    at = np.arange(-reach, n + reach)
    if wrap:
        return np.asarray(values[at % n])
    edge = np.clip(at, 0, n - 1)
    mirrored = values[np.clip(2 * edge - at, 0, n - 1)]
    outside = (edge != at).reshape(-1, *([1] * (values.ndim - 1)))
    return np.asarray(np.where(outside, 2.0 * values[edge] - mirrored, mirrored))


def _slope(values: F64, derivative: tuple[float, ...], smooth: tuple[float, ...]) -> F64:
    """Slope along axis 0 of values that are extended on both axes by as much as the filter reaches."""
    reach = max(len(derivative), len(smooth) - 1)
    rows, columns = (size - 2 * reach for size in values.shape)

    def part(k: int, j: int) -> F64:
        return values[reach + k : reach + k + rows, reach + j : reach + j + columns]

    total = np.zeros((rows, columns))
    for k, weight in enumerate(derivative, start=1):
        for j in range(1 - len(smooth), len(smooth)):
            total = total + weight * smooth[abs(j)] * (part(k, j) - part(-k, j))
    return total


def reference_normals(
    heights: npt.NDArray[np.float32],
    first: int,
    last: int,
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
    green_down: bool = False,
) -> F64:
    """Unit normals (last - first, w, 3) float64 of the rows first..last of heights (h, w), by any filter that
    has taps. In numpy: for tests and small maps."""
    found = taps(filter_name)
    if found is None:
        raise ValueError(f"the filter {filter_name!r} has no taps")
    reach = max(len(found[0]), len(found[1]) - 1)
    tall = _extended(heights.astype(np.float64), reach, wrap[1])[first : last + 2 * reach]
    window = _extended(tall.T, reach, wrap[0])
    dx = _slope(window, *found).T * slope_scale[0]
    dy = _slope(np.ascontiguousarray(window.T), *found) * (-slope_scale[1] if green_down else slope_scale[1])
    largest = np.maximum(np.maximum(np.abs(dx), np.abs(dy)), 1.0)
    dx, dy, z = dx / largest, dy / largest, 1.0 / largest
    length = np.sqrt(dx * dx + dy * dy + z * z)
    return np.stack([-dx / length, dy / length, z / length], axis=2)


def _atan(t: F64) -> F64:
    """Arc tangent of t >= 0 (infinity too) from + - * / sqrt: three halvings of the angle, then the
    series."""
    steep = t > 1.0
    t = np.where(steep, 1.0 / np.maximum(t, 1.0), t)
    for _ in range(3):
        t = t / (1.0 + np.sqrt(1.0 + t * t))
    square = t * t
    total = np.zeros_like(t)
    for n in range(19, 0, -2):
        total = 1.0 / n - square * total
    angle = 8.0 * t * total
    return np.where(steep, np.pi / 2 - angle, angle)


def angles_deg(a: F64, b: F64) -> F64:
    """Degrees between unit vectors (..., 3), exact for small angles too: 2 atan(|a - b| / |a + b|).

    Source: W. Kahan, "How futile are mindless assessments of roundoff", 2006.
    """
    minus, plus = a - b, a + b
    apart = np.sqrt(_squares(minus))
    together = np.sqrt(_squares(plus))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(together > 0.0, apart / together, np.inf)
    return 2.0 * _atan(ratio) * (180.0 / np.pi)


def _squares(v: F64) -> F64:
    return np.asarray(v[..., 0] * v[..., 0] + v[..., 1] * v[..., 1] + v[..., 2] * v[..., 2])


def rebuilt(xy: npt.NDArray[np.floating]) -> F64:
    """The unit vector (..., 3) that a shader rebuilds from x and y: z = sqrt(max(0, 1 - x^2 - y^2)),
    normalised."""
    x, y = xy[..., 0].astype(np.float64), xy[..., 1].astype(np.float64)
    z = np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))
    length = np.sqrt(x * x + y * y + z * z)
    return np.stack([x / length, y / length, z / length], axis=-1)


def normal_error(
    decoded_xy: npt.NDArray[np.floating],
    heights: npt.NDArray[np.float32],
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
    green_down: bool = False,
    islands: I32 | None = None,
    less_mean: bool = False,
) -> AngleError:
    """How far the decoded x and y (h, w, 2) are from the heights' (h, w) normals: level 0 as levels.py's
    normal_levels measures it. less_mean: the decoded map is du/dv, whose mean was taken out."""
    ground = reference_maps.Ground(
        heights,
        taps=taps(filter_name),
        scale=slope_scale,
        wrap=wrap,
        green_down=green_down,
        islands=islands,
    )
    level = np.ascontiguousarray(decoded_xy, "<f4")
    height, width = level.shape[:2]
    view = reference_maps.Texture("float32", height, width, [level.data.cast("B")], 2)
    found = reference_maps.normal_levels(view, ground, offsets=less_mean)[0]
    mean = found.sum / found.number if found.number else 0.0
    return AngleError(six(mean), six(found.p99), six(found.max))


def filter_angle(
    heights: npt.NDArray[np.float32],
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
) -> float:
    """The mean of levels.py's filter_error alone."""
    found = filter_error(heights, slope_scale=slope_scale, wrap=wrap, filter_name=filter_name)
    return found["mean_deg"]
