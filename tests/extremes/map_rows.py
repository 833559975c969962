"""Rows of the stages of height and vector maps, held to numpy's float64."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from paradize.data import HeightMap, Mesh
from paradize.metrics.filters import taps as metric_taps
from paradize.stages.destep import destep
from paradize.stages.dudv import DudvLevels
from paradize.stages.filters import TAPS, choose_filter
from paradize.stages.gloss import GlossSettings, gloss_map
from paradize.stages.gutter import fill_gutter, gutter_source, island_map
from paradize.stages.mips import gloss_bundle, gloss_rows, half_maps, unit_rows
from paradize.stages.normal import normal_rows
from paradize.stages.sweep import level_count, sweep
from tests.extremes.mesh_rows import sound
from tests.extremes.planes import HEIGHTS, field, read_picture, unit_of
from tests.extremes.shapes import MESHES, angles_deg
from tests.extremes.table import EXTREMES, Row
from tests.pipeline import map_truth as truth

F32 = npt.NDArray[np.float32]
STEP = 1.0 / 32.0  # of the unit: what heights of a coarse source are rounded to


def _stepped(heights: F32) -> F32:
    step = STEP * unit_of(heights)
    with np.errstate(all="ignore"):
        return (np.rint(heights.astype(np.float64) / step) * step).astype(np.float32)


def _destep(heights: F32) -> F32:
    return destep(_stepped(heights), STEP * unit_of(heights))


def _steps_off(heights: F32, made: F32) -> float:
    """How far a height left its source, in half steps; a constant must stay what it is."""
    coarse = _stepped(heights)
    if coarse.min() == coarse.max():
        return 0.0 if np.array_equal(made, coarse) else 2.0
    off = np.abs(made.astype(np.float64) - coarse).max()
    return float(off / (0.5 * STEP * unit_of(heights)))


def _chosen(heights: F32) -> str:
    return choose_filter(heights, 32, (True, True), "balanced")


def _other_choice(heights: F32, made: str) -> float:
    """1 where the same heights times a power of two, about 1, would take another filter."""
    scale = 2.0 ** -np.rint(np.log2(unit_of(heights)))
    plain = (heights.astype(np.float64) * scale).astype(np.float32)
    return float(made != _chosen(plain))


def _weights(name: str) -> Any:
    taps = TAPS[name]
    return taps.derivative, taps.smooth


def _weight_error(name: str, made: Any) -> float:
    """From the metrics' own derivation of the taps, in exact fractions; and slopes of a plane are exact."""
    known = metric_taps(name)
    assert known is not None
    off = max(float(np.abs(a - np.array(b)).max()) for a, b in zip(made, known, strict=True))
    slope = sum((2 * k * Fraction(w) for k, w in enumerate(made[0].tolist(), 1)), Fraction(0))
    return max(off, abs(float(slope - 1)))


def ground_of(heights: F32, filter_name: str = "fourth", scale: float = 4.0) -> HeightMap:
    """A ground whose slopes are those of the plane about 1: one unit of height is `scale` texels."""
    steep = scale / unit_of(heights)
    return HeightMap(heights, (steep, steep), (True, True), filter_name)


def _normals(filter_name: str) -> Any:
    def run(heights: F32) -> Any:
        return normal_rows(ground_of(heights, filter_name), 0, len(heights), threads=2)

    return run


def _normal_error(filter_name: str) -> Any:
    def error(heights: F32, made: F32) -> float:
        ground = ground_of(heights, filter_name)
        wanted = truth.normals(heights, metric_taps(filter_name), scale=ground.slope_scale, wrap=(True, True))
        return float(angles_deg(made, wanted).max())

    return error


def _gloss(brightness: F32) -> F32:
    read_picture(brightness[:, :, None])
    return gloss_map(brightness, GlossSettings(specular=(0.1, 0.9), smoothness=(0.3, 0.6)))


def _gloss_error(brightness: F32, made: F32) -> float:
    t = np.clip(brightness.astype(np.float64), 0.0, 1.0)
    return float(np.abs(made - np.stack([0.1 + 0.8 * t, 0.3 + 0.3 * t], axis=2)).max())


def _chain(planes: dict[str, F32], visit: Any, halve: Any = None) -> None:
    height, width = next(iter(planes.values())).shape[:2]
    more = {} if halve is None else {"halve": halve}
    sweep(height, width, lambda a, b: {k: v[a:b] for k, v in planes.items()}, visit, **more)


def _levels_of(planes: dict[str, F32], made_of: Any, halve: Any = None) -> list[np.ndarray]:
    """Every level of a sweep, put together from its bands; what a reader refuses does not come so far."""
    for plane in planes.values():
        read_picture(plane)
    height, width = next(iter(planes.values())).shape[:2]
    found: list[dict[int, np.ndarray]] = [{} for _ in range(level_count(height, width))]

    def visit(level: int, first: int, bundle: Any) -> None:
        found[level][first] = np.array(made_of(bundle, level))

    _chain(planes, visit, halve)
    return [np.concatenate([bands[first] for first in sorted(bands)]) for bands in found]


def _swept(heights: F32) -> list[np.ndarray]:
    return _levels_of({"plane": heights[:, :, None]}, lambda bundle, level: bundle["plane"])


def _mean_error(heights: F32, made: list[np.ndarray]) -> float:
    """From area means of halves in float64, of the largest magnitude."""
    wanted, worst = heights.astype(np.float64)[:, :, None], 0.0
    for level, found in enumerate(made):
        wanted = truth.mean(wanted, 1) if level else wanted
        worst = max(worst, float(np.abs(found - wanted).max()))
    return worst / max(unit_of(heights), np.finfo(np.float32).tiny)


def _vectors(heights: F32) -> F32:
    """Unit vectors of all directions; NaN, infinities and sizes stay as they were given."""
    steep = np.gradient(field(*heights.shape), axis=1) * 9 if min(heights.shape) > 1 else heights
    x, y = steep.astype(np.float32), np.roll(steep, 3).astype(np.float32)
    v = np.stack([x, y, np.ones_like(x)], axis=2)
    return np.asarray(v / np.linalg.norm(v, axis=2, keepdims=True), np.float32)


VECTORS: dict[str, Any] = {
    **{
        name: lambda make=HEIGHTS[name]: _vectors(make())
        for name in ("one", "many", "degenerate", "sliver", "largest")
    },
    "zero": lambda: np.zeros((0, 0, 3), np.float32),
    "constant": lambda: np.tile(np.array([0.6, 0.0, 0.8], np.float32), (48, 64, 1)),
    "parallel": lambda: np.tile(np.array([0, 0, 1], np.float32), (48, 64, 1)),
    "opposite": lambda: (
        (np.indices((48, 64)).sum(axis=0) % 2 * 2 - 1)[:, :, None] * np.array([1, 0, 0])
    ).astype(np.float32),
    "nan": lambda: _spoiled(np.nan),
    "inf": lambda: _spoiled(np.inf),
    "mirrored": lambda: _vectors(HEIGHTS["many"]()) * np.array([-1, 1, 1], np.float32),
    "tiny": lambda: _leaning(1e-30),
    "denormal": lambda: _leaning(1e-40),
}
UNIT_ONLY = dict.fromkeys(("huge", "far"), "normals have length 1: none is long, none lies far off")


def _spoiled(value: float) -> F32:
    v = _vectors(HEIGHTS["many"]())
    v[9, 9, 0] = value
    return v


def _leaning(by: float) -> F32:
    v = np.zeros((48, 64, 3), np.float32)
    v[:, :, 0], v[:, :, 2] = by, 1.0
    return v


def _unit_levels(vectors: F32) -> list[np.ndarray]:
    return _levels_of({"normal": vectors}, unit_rows, half_maps)


def _unit_error(vectors: F32, made: list[np.ndarray]) -> float:
    """Degrees from the float64 mean of means, made unit; where vectors cancel out, (0, 0, 1)."""
    wanted, worst = vectors.astype(np.float64), 0.0
    for level, found in enumerate(made):
        wanted = truth.mean(wanted, 1) if level else wanted
        worst = max(worst, float(angles_deg(found, truth.normalised(wanted)).max()))
    return worst


def _gloss_levels(vectors: F32) -> list[np.ndarray]:
    gloss = np.full((*vectors.shape[:2], 2), 0.5, np.float32)
    return _levels_of({"normal": vectors, **gloss_bundle(gloss)}, gloss_rows, half_maps)


def _gloss_level_error(vectors: F32, made: list[np.ndarray]) -> float:
    """A vanishing mean is as rough as can be, no spread leaves smoothness: its bounds, and its monotony."""
    worst = max(float(np.abs(level[:, :, 0] - 0.5).max()) for level in made)
    smooth = [float(level[:, :, 1].max()) for level in made]
    over = max([0.0, *(b - a for a, b in pairwise(smooth))])
    below = max(0.0, -min(float(level[:, :, 1].min()) for level in made))
    spread = np.abs(vectors - vectors[:1, :1]).max()
    kept = abs(smooth[-1] - 0.5) if spread == 0 and np.abs(np.linalg.norm(vectors[0, 0]) - 1) < 1e-7 else 0.0
    return max(worst, over, below, kept)


def _dudv(vectors: F32) -> list[bytes]:
    read_picture(vectors)
    height, width = vectors.shape[:2]
    mean = vectors.astype(np.float64).mean(axis=(0, 1)) if vectors.size else np.zeros(3)
    count = level_count(height, width)
    writer = DudvLevels(height, width, count, (float(mean[0]), float(mean[1])))
    _chain({"normal": vectors}, lambda level, first, bundle: writer.put(level, first, bundle["normal"]))
    return writer.levels()


def _dudv_error(vectors: F32, made: list[bytes]) -> float:
    """Codes from 127 times the float64 mean less the map's; a sum that is not zero counts 127."""
    exact = vectors.astype(np.float64)[:, :, :2]
    exact, worst = exact - exact.mean(axis=(0, 1)), 0.0
    for level, data in enumerate(made):
        exact = truth.mean(exact, 1) if level else exact
        codes = np.frombuffer(data, np.int8).reshape(exact.shape).astype(np.int64)
        if codes.sum(axis=(0, 1)).any():
            return 127.0
        worst = max(worst, float(np.abs(codes - np.clip(127 * exact, -127, 127)).max()))
    return worst


def _around(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """The islands of a layout, and a map whose gutters are filled: each texel holds its own number."""
    islands = island_map(sound(mesh), height=96, width=96)
    texels = np.arange(96 * 96, dtype=np.int32).reshape(96, 96, 1)
    return islands, fill_gutter(texels, gutter_source(islands >= 0, (False, False)))


def _gutter_error(mesh: Mesh, made: tuple[np.ndarray, np.ndarray]) -> float:
    """Texels by which a filled one is farther from its source than the nearest covered one is."""
    islands, filled = made
    if (islands < 0).all():
        return 0.0
    row, column = np.divmod(filled[:, :, 0].astype(np.int64), 96)
    i, j = np.indices((96, 96))
    return float(np.abs(np.hypot(row - i, column - j) - distance_transform_edt(islands < 0)).max())


def _layouts() -> dict[str, Any]:
    """Layouts: what the other inputs are of places is here said of texture coordinates."""

    def of(change: Any) -> Any:
        mesh = MESHES["many"]()
        assert mesh.uvs is not None
        with np.errstate(all="ignore"):
            return lambda: replace(mesh, uvs=change(mesh.uvs.copy()).astype(np.float32))

    def put(value: float) -> Any:
        def change(uvs: F32) -> F32:
            uvs[11, 0] = value
            return uvs

        return of(change)

    return {
        **{name: MESHES[name] for name in ("zero", "one", "many", "parallel", "opposite", "degenerate")},
        "constant": of(lambda uvs: uvs * 0 + 0.5),
        "tiny": of(lambda uvs: uvs * 1e-30),
        "huge": of(lambda uvs: uvs * 1e30),
        "far": of(lambda uvs: uvs + 1e6),
        "denormal": of(lambda uvs: uvs * 1e-40),
        "nan": put(np.nan),
        "inf": put(np.inf),
        "mirrored": of(lambda uvs: np.float32([1, 0]) + uvs * np.float32([-1, 1])),
        "sliver": of(lambda uvs: uvs * np.float32([1, 1e-6])),
        "largest": MESHES["largest"],
    }


NOT_FINITE = {"nan": "not a finite number", "inf": "not a finite number"}
NOT_READ = {"nan": "maps need finite numbers", "inf": "maps need finite numbers"}
NO_PLANE = {"zero": "shape (0, 0)"}
NO_TEXEL = {"zero": "no levels of 0 x 0 texels"}
ROWS = [
    Row(
        "stages.destep",
        HEIGHTS,
        _destep,
        _steps_off,
        "half steps",
        1.0001,
        refused=NO_PLANE | NOT_FINITE | {"denormal": "cannot be smoothed"},
    ),
    Row("stages.filters", HEIGHTS, _chosen, _other_choice, "choices", 0, part="choice", refused=NO_PLANE),
    Row(
        "stages.filters",
        {"one": lambda: "central", "many": lambda: "septic6", "largest": lambda: "smooth16"},
        _weights,
        _weight_error,
        "of a weight",
        1e-15,
        part="weights",
        absent={
            name: "weights follow from a name alone"
            for name in EXTREMES
            if name not in ("one", "many", "largest")
        },
    ),
    *[
        Row(
            "stages.normal",
            HEIGHTS,
            _normals(name),
            _normal_error(name),
            "degrees",
            0.001,
            part=name,
            refused=NO_PLANE | NOT_FINITE,
        )
        for name in ("fourth", "septic4")
    ],
    Row("stages.gloss", HEIGHTS, _gloss, _gloss_error, "of 1", 1e-6, refused=NO_PLANE | NOT_READ),
    Row("stages.sweep", HEIGHTS, _swept, _mean_error, "of the largest", 2e-6, refused=NO_TEXEL | NOT_READ),
    Row(
        "stages.mips",
        VECTORS,
        _unit_levels,
        _unit_error,
        "degrees",
        0.01,
        part="normals",
        absent=UNIT_ONLY,
        refused=NO_TEXEL | NOT_READ,
    ),
    Row(
        "stages.mips",
        VECTORS,
        _gloss_levels,
        _gloss_level_error,
        "of 1",
        1e-5,
        part="gloss",
        absent=UNIT_ONLY,
        refused=NOT_READ | {"zero": "smoothness has shape (0, 0)"},
    ),
    Row(
        "stages.dudv",
        VECTORS,
        _dudv,
        _dudv_error,
        "codes",
        1.51,
        absent=UNIT_ONLY,
        refused=NO_TEXEL | NOT_READ,
    ),
    Row(
        "stages.gutter",
        _layouts(),
        _around,
        _gutter_error,
        "texels",
        1e-9,
        refused={
            "zero": "no triangles",
            "huge": "the UVs tile too often",
            "nan": "uvs are not finite",
            "inf": "uvs are not finite",
        },
    ),
]
