"""The angle, in degrees, between a decoded normal map and normals computed in float64 from its heights.

The reference shares no line with the stage: slopes by shifted arrays, angles by an arc tangent of its own
(numpy's differs between CPUs). It applies the derivative filter of the tier that was used, so it measures
arithmetic and storage; filter_angle tells beside it how far that filter is from the eighth-order one, whose
error is below a thousandth of a degree from a wavelength of 8 texels on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    F64 = npt.NDArray[np.float64]
    I32 = npt.NDArray[np.int32]

# Weights of h[+k] - h[-k] for k = 1, 2, ...
_WEIGHTS = {
    "central": (1 / 2,),
    "fourth": (2 / 3, -1 / 12),
    "eighth": (4 / 5, -1 / 5, 4 / 105, -1 / 280),
}
_BAND = 256  # rows at a time: a 16384 x 16384 map is measured in little memory


@dataclass(frozen=True)
class AngleError:
    """Degrees over all texels measured; six significant digits."""

    mean: float
    p99: float
    max: float


def _padded(rows: F64, top: int, bottom: int, reach: int, wrap_x: bool) -> F64:
    """The rows with `reach` columns more on each side: repeated, or reflected oddly about the edge texel."""
    width = rows.shape[1]
    left = np.arange(-reach, 0)
    right = np.arange(width, width + reach)
    if wrap_x:
        return np.concatenate([rows[:, left % width], rows, rows[:, right % width]], axis=1)
    near = np.clip(-left, 0, width - 1)
    far = np.clip(2 * (width - 1) - right, 0, width - 1)
    before = 2.0 * rows[:, :1] - rows[:, near]
    after = 2.0 * rows[:, -1:] - rows[:, far]
    return np.concatenate([before, rows, after], axis=1)


def _window(
    heights: npt.NDArray[np.float32], first: int, last: int, reach: int, wrap: tuple[bool, bool]
) -> F64:
    """Rows first - reach .. last + reach and the columns beside them, float64."""
    count = heights.shape[0]
    rows = np.arange(first - reach, last + reach)
    if wrap[1]:
        band = heights[rows % count].astype(np.float64)
    else:
        about = np.clip(rows, 0, count - 1)
        mirrored = np.clip(2 * about - rows, 0, count - 1)
        band = heights[mirrored].astype(np.float64)
        outside = rows != about
        band[outside] = 2.0 * heights[about[outside]].astype(np.float64) - band[outside]
    return _padded(band, first, last, reach, wrap[0])


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
    """Unit normals (last - first, w, 3) float64 of the rows first..last of heights (h, w)."""
    reach = 1 if filter_name == "scharr" else len(_WEIGHTS[filter_name])
    window = _window(heights, first, last, reach, wrap)
    count, width = last - first, heights.shape[1]

    def shifted(dy: int, dx: int) -> F64:
        return window[reach + dy : reach + dy + count, reach + dx : reach + dx + width]

    if filter_name == "scharr":
        dx = (3.0 * (shifted(-1, 1) - shifted(-1, -1)) + 10.0 * (shifted(0, 1) - shifted(0, -1))) / 32.0
        dx = dx + 3.0 * (shifted(1, 1) - shifted(1, -1)) / 32.0
        dy = (3.0 * (shifted(1, -1) - shifted(-1, -1)) + 10.0 * (shifted(1, 0) - shifted(-1, 0))) / 32.0
        dy = dy + 3.0 * (shifted(1, 1) - shifted(-1, 1)) / 32.0
    else:
        dx, dy = np.zeros((count, width)), np.zeros((count, width))
        for k, weight in enumerate(_WEIGHTS[filter_name], start=1):
            dx = dx + weight * (shifted(0, k) - shifted(0, -k))
            dy = dy + weight * (shifted(k, 0) - shifted(-k, 0))
    dx = dx * slope_scale[0]
    dy = dy * (-slope_scale[1] if green_down else slope_scale[1])
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


def summary(angles: F64) -> AngleError:
    """Mean, 99th percentile (the smallest angle that 99 of 100 do not pass) and largest of angles in
    degrees."""
    if angles.size == 0:
        return AngleError(0.0, 0.0, 0.0)
    flat = angles.ravel()
    rank = min(flat.size - 1, (flat.size * 99 + 99) // 100 - 1)
    p99 = float(np.partition(flat, rank)[rank])
    return AngleError(_six(float(flat.sum()) / flat.size), _six(p99), _six(float(flat.max())))


def _six(value: float) -> float:
    return float(f"{value:.6g}")


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
    """How far the decoded x and y (h, w, 2) are from the heights' (h, w) normals.

    islands: only texels whose 5 x 5 neighbours are of the same island are measured (elsewhere the filter is
    another). less_mean: the decoded map is du/dv, whose mean was taken out.
    """
    count = heights.shape[0]
    bands = [(first, min(first + _BAND, count)) for first in range(0, count, _BAND)]

    def reference(first: int, last: int) -> F64:
        return reference_normals(
            heights,
            first,
            last,
            slope_scale=slope_scale,
            wrap=wrap,
            filter_name=filter_name,
            green_down=green_down,
        )

    mean = np.zeros(2)
    if less_mean:
        for first, last in bands:
            mean = mean + reference(first, last)[:, :, :2].sum(axis=(0, 1))
        mean = mean / heights.size
    inside = _inside(islands, wrap) if islands is not None else None
    found = []
    for first, last in bands:
        truth = reference(first, last)
        if less_mean:
            truth = rebuilt(truth[:, :, :2] - mean)
        angles = angles_deg(rebuilt(decoded_xy[first:last]), truth)
        found.append(angles.ravel() if inside is None else angles[inside[first:last]])
    return summary(np.concatenate(found))


def filter_angle(
    heights: npt.NDArray[np.float32],
    *,
    slope_scale: tuple[float, float],
    wrap: tuple[bool, bool],
    filter_name: str,
) -> float:
    """Mean degrees between the normals of a filter and those of the eighth-order one: what the tier's
    filter costs."""
    total, count = 0.0, heights.shape[0]
    for first in range(0, count, _BAND):
        last = min(first + _BAND, count)
        pair = [
            reference_normals(heights, first, last, slope_scale=slope_scale, wrap=wrap, filter_name=name)
            for name in (filter_name, "eighth")
        ]
        total += float(angles_deg(pair[0], pair[1]).sum())
    return _six(total / heights.size)


def _inside(islands: I32, wrap: tuple[bool, bool]) -> npt.NDArray[np.bool_]:
    """Texels (h, w) on an island, all of whose 5 x 5 neighbours are of it."""
    out = islands >= 0
    rows, columns = np.arange(islands.shape[0]), np.arange(islands.shape[1])
    for step in (-2, -1, 1, 2):
        for axis, index in ((0, rows), (1, columns)):
            size = len(index)
            moved = (index + step) % size if wrap[1 - axis] else np.clip(index + step, 0, size - 1)
            out &= np.take(islands, moved, axis=axis) == islands
    diagonal = out.copy()
    for step in (-2, -1, 1, 2):
        moved = (columns + step) % len(columns) if wrap[0] else np.clip(columns + step, 0, len(columns) - 1)
        diagonal &= np.take(out, moved, axis=1)
    return diagonal
