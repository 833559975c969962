"""Rows of terrain, its tree, the camera's path and the numbers of an OBJ, held to fractions and float64."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from paradize.data import Heightfield, Mesh
from paradize.scene.flight import Flight, plan_flight
from paradize.scene.settings import EyePoint, TargetPoint
from paradize.scene.settings import Flight as Settings
from paradize.stages.terrain import terrain_mesh
from paradize.stages.terrain_tree import Blocks, Shape
from tests.extremes.planes import HEIGHTS
from tests.extremes.shapes import read_text
from tests.extremes.table import Row

F32 = npt.NDArray[np.float32]


def _field(heights: F32) -> Heightfield:
    """Ten metres a pixel, so that x and z are exact."""
    rows, columns = heights.shape
    return Heightfield(heights, 10.0 * (columns - 1), 10.0 * (rows - 1))


def _bound(heights: F32) -> float:
    """A hundredth of how high the ground is above its lowest place."""
    finite = heights[np.isfinite(heights)].astype(np.float64)
    return 0.01 * (float(np.ptp(finite)) or 1.0) if finite.size else 1.0


def _meshed(tier: str) -> Any:
    def run(heights: F32) -> Mesh:
        return terrain_mesh(_field(heights), tolerance_m=_bound(heights), tier=tier)

    return run


def _beyond_bound(heights: F32, made: Mesh) -> float:
    """The largest vertical error at any pixel, in bounds, by drawing each triangle in float64; a ground that
    is not covered counts 9. Vertices are pixels, and a triangle of half a cell has no pixel beside its
    corners (Pick): only larger ones are drawn."""
    field = _field(heights)
    at = made.positions.astype(np.float64)
    column, row = (at[:, 0] + field.size_x_m / 2) / 10.0, (at[:, 2] + field.size_z_m / 2) / 10.0
    off = np.full(heights.shape, np.nan)
    wide = heights.astype(np.float64)
    used = np.unique(made.triangles)
    pixel = row[used].round().astype(int), column[used].round().astype(int)
    off[pixel] = np.abs(at[used, 1] - wide[pixel])
    (x0, x1, x2), (y0, y1, y2) = column[made.triangles].T, row[made.triangles].T
    areas = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    whole = 2.0 * (heights.shape[0] - 1) * (heights.shape[1] - 1)
    if (areas == 0).any() or abs(np.abs(areas).sum() - whole) > 1e-9 * whole:
        return 9.0
    large = np.abs(areas) > 1.5
    for t, area in zip(made.triangles[large], areas[large], strict=True):
        (x0, x1, x2), (y0, y1, y2), high = column[t], row[t], at[t, 1]
        down, across = (slice(int(min(line)), int(max(line)) + 1) for line in ((y0, y1, y2), (x0, x1, x2)))
        box = (down, across)
        y, x = np.arange(down.start, down.stop)[:, None], np.arange(across.start, across.stop)
        b = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
        c = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
        inside = (b >= -1e-12) & (c >= -1e-12) & (b + c <= 1 + 1e-12)
        plane = high[0] + b * (high[1] - high[0]) + c * (high[2] - high[0])
        old = off[box]
        off[box] = np.where(inside, np.fmax(old, np.abs(plane - wide[box])), old)
    if np.isnan(off).any():
        return 9.0
    bound = _bound(heights)
    return float(off.max()) / bound if off.max() > 0 else 0.0


TREES: dict[str, Any] = {
    "zero": (0, 0),
    "one": (2, 2),
    "many": (1025, 769),
    "sliver": (2, 4097),
    "degenerate": (1, 40),
    "largest": (16385, 16385),
}


def _tree(size: tuple[int, int]) -> tuple[list[float], list[int], list[tuple[float, float]]]:
    """Of each level the area of its patches, their number, and the range of heights of the roots."""
    shape = Shape(*size, leaf_px=64)
    counts, level, areas = shape.count() if max(size) < 9000 else [], shape.roots(), []
    for _ in range(min(shape.finest, 8) + 1):
        areas.append(sum(_area(shape.clipped(corners)) for corners in level))
        level = [half for corners in level for half in shape.halves(corners)]
    heights = np.arange(min(size[0], 1025) * min(size[1], 1025), dtype=np.float32)
    blocks = Blocks.of(heights.reshape(min(size[0], 1025), min(size[1], 1025)), 16)
    ranges = [blocks.range(corners) for corners in shape.roots()]
    return areas, counts, ranges


def _area(polygon: list[tuple[float, float]]) -> float:
    turned = zip(polygon, [*polygon[1:], polygon[0]], strict=True)
    return abs(sum(a[0] * b[1] - b[0] * a[1] for a, b in turned)) / 2


def _area_lost(size: tuple[int, int], made: Any) -> float:
    """Of every level, what its patches do not cover of the field or cover twice, as a share of it."""
    whole = (size[0] - 1) * (size[1] - 1)
    return float(max(abs(area / whole - 1) for area in made[0]))


def _ring(count: int, radius: float, centre: float = 0.0) -> np.ndarray:
    """Waypoints on a level circle."""
    angle = 2 * np.pi * np.arange(count) / count
    return np.stack([centre + radius * np.cos(angle), 0 * angle, centre + radius * np.sin(angle)], axis=1)


def _with_point(value: float) -> np.ndarray:
    points = _ring(8, 20.0)
    points[3, 0] = value
    return points


PATHS: dict[str, Any] = {
    "zero": lambda: np.zeros((0, 3)),
    "one": lambda: _ring(1, 20.0),
    "many": lambda: _ring(300, 400.0),
    "constant": lambda: np.ones((5, 3)),
    "tiny": lambda: _ring(8, 1e-30),
    "huge": lambda: _ring(8, 1e30),
    "far": lambda: _ring(8, 20.0, 1e6),
    "denormal": lambda: _ring(8, 1e-40),
    "nan": lambda: _with_point(np.nan),
    "inf": lambda: _with_point(np.inf),
    "parallel": lambda: np.stack([np.array([0.0, 4, 8, 12, 8, 4]), np.zeros(6), np.zeros(6)], axis=1),
    "opposite": lambda: np.array([[0.0, 0, 0], [9, 0, 0], [0, 0, 0], [-9, 0, 0]]),
    "degenerate": lambda: np.repeat(_ring(4, 20.0), 2, axis=0),
    "mirrored": lambda: _ring(8, 20.0)[::-1],
    "sliver": lambda: _ring(8, 20.0) * [1.0, 1.0, 1e-6],
    "largest": lambda: _ring(600, 2000.0),
}


def _flown(points: np.ndarray) -> Flight:
    eye = tuple(EyePoint(position=tuple(p)) for p in points.tolist())
    target = tuple(TargetPoint(position=(x + 1.0, y, z)) for x, y, z in points.tolist())
    return plan_flight(Settings(eye=eye, target=target, duration_s=60.0))


def _path_error(points: np.ndarray, made: Flight) -> float:
    """From scipy's periodic spline through the same knots, in sizes of the path; plus the largest jump of
    the time table back."""
    knots = np.array([*made.waypoint_u, len(made.eye)], np.float64)
    spline = CubicSpline(knots, np.concatenate([points, points[:1]]), bc_type="periodic")
    u = (np.arange(len(made.eye))[:, None] + np.linspace(0, 1, 9)[:-1]).ravel()
    index, x = u.astype(int), (u % 1.0)[:, None]
    a, b, c, d = (np.array(made.eye)[index, :, k] for k in range(4))
    size = np.ptp(points, axis=0).max()
    off = float(np.abs(a + x * (b + x * (c + x * d)) - spline(u)).max() / size)
    back = -np.diff(np.array(made.table)[:, :2], axis=0).min()
    return max(off, float(back), 0.0)


def _text(values: list[str]) -> str:
    rows = [f"v {' '.join(values[k : k + 3])}" for k in range(0, len(values) - 2, 3)]
    faces = [f"f {k + 1} {(k + 1) % len(rows) + 1} {(k + 2) % len(rows) + 1}" for k in range(len(rows))]
    return "\n".join(rows + faces)


NUMBERS: dict[str, list[str]] = {
    "zero": [],
    "one": ["1"] * 9,
    "many": [repr(0.1 * k) for k in range(9999)],
    "constant": ["0.3"] * 9,
    "tiny": ["1e-30", "1.17549435e-30", "-2.5e-30"] * 3,
    "huge": ["1e30", "3.3e30", "-2.5E+30"] * 3,
    "far": ["1000000.0625", "999999.97", "-1000000.03125"] * 3,
    "denormal": ["1e-40", "1.4e-45", "0.7e-45", "0.7006492e-45", "-1e-44", "1e-60", "1e-400", "0", "-0"],
    "nan": ["nan", *["1"] * 8],
    "inf": ["1e39", *["1"] * 8],
    "sliver": ["1" * 40 + "e-39", "0." + "0" * 50 + "1e51", "16777217.0000000000000001"] * 3,
    "largest": [repr(0.001 * k) for k in range(99_999)],
}


def _numbers(values: list[str]) -> np.ndarray:
    return read_text(_text(values)).mesh.positions


def _wrongly_rounded(values: list[str], made: np.ndarray) -> float:
    """Numbers that are not the float32 nearest to what the text says, by exact fractions."""
    known = {float(x) for x in made.ravel()}
    wrong = 0
    for text in values[: 3000 - 3000 % 3]:
        exact = Fraction(text)
        near = np.float32(float(exact))
        around = [np.nextafter(near, np.float32(-np.inf)), near, np.nextafter(near, np.float32(np.inf))]
        best = min(around, key=lambda x: (abs(Fraction(float(x)) - exact), int(x.view(np.uint32)) & 1))
        wrong += float(best) not in known
    return float(wrong)


NO_PATH = {
    "zero": "a loop needs 3",
    "one": "a loop needs 3",
    "constant": "a path has a length",
    "nan": "not at finite numbers",
    "inf": "not at finite numbers",
}
TOO_SMALL = dict.fromkeys(("zero", "one", "degenerate"), "on each side")
ROWS = [
    *[
        Row(
            "stages.terrain",
            HEIGHTS | {"largest": lambda: HEIGHTS["largest"]()[:400, :400].copy()},
            _meshed(tier),
            _beyond_bound,
            "bounds",
            1.0,
            part=tier,
            refused=TOO_SMALL | {"nan": "not a finite number", "inf": "not a finite number"},
        )
        for tier in ("fast", "balanced", "exact")
    ],
    Row(
        "stages.terrain_tree",
        {name: lambda size=size: size for name, size in TREES.items()},
        _tree,
        _area_lost,
        "of the field",
        1e-9,
        refused={"zero": "pixels", "degenerate": "pixels"},
        absent=dict.fromkeys(
            (
                *("constant", "tiny", "huge", "far", "denormal", "nan", "inf", "parallel", "opposite"),
                "mirrored",
            ),
            "a tree follows from whole numbers of pixels",
        ),
    ),
    Row("flight", PATHS, _flown, _path_error, "of its size", 1e-9, refused=NO_PATH),
    Row(
        "readers.obj",
        {name: lambda values=values: values for name, values in NUMBERS.items()},
        _numbers,
        _wrongly_rounded,
        "numbers",
        0,
        part="numbers",
        refused={"zero": "is an empty file", "nan": "line 1", "inf": "line 1"},
        absent=dict.fromkeys(
            ("parallel", "opposite", "degenerate", "mirrored"), "numbers are read one by one"
        ),
    ),
]
