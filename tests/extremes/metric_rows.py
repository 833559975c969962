"""Rows of the metrics of surfaces, layouts, paths and terrain: closed forms at every extreme."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from paradize.data import Heightfield, Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from paradize.kernels.reference.seen import SeenMaterial
from paradize.metrics.atlas import atlas_quality
from paradize.metrics.draw import draw_costs
from paradize.metrics.filters import taps
from paradize.metrics.flight import flight_error
from paradize.metrics.mapped_normal import normal_error, uv_shift
from paradize.metrics.occlusion import cast_errors
from paradize.metrics.quantised import quantised_errors
from paradize.metrics.seen import seen_difference, seen_mesh
from paradize.metrics.surface import Original, diagonal
from paradize.metrics.switch import switch_flip
from paradize.metrics.tangent import frame_errors, frame_faults
from paradize.metrics.terrain import TerrainError, terrain_error
from paradize.scene.flight import Flight
from paradize.stages.quantise import mesh_grid, quantise
from paradize.stages.tangents import tangent_frames
from paradize.stages.terrain import terrain_mesh
from tests.extremes.ground_rows import PATHS, _flown
from tests.extremes.mesh_rows import GUARDED, sound
from tests.extremes.planes import HEIGHTS
from tests.extremes.shapes import MESHES, angles_deg, side_of
from tests.extremes.table import Row

_SHIFT = 2.0**-4  # of the longest side: exact on any float32 grid of that size
_TILT = 3.0  # degrees

_GREY = 0.25


def _cast(mesh: Mesh) -> dict[str, float]:
    """Of a grey map. All of these surfaces are flat, or round seen from outside: lit all over."""
    mesh = sound(mesh)
    grey = np.full((32, 64), _GREY, np.float32)
    return cast_errors(grey, mesh, mesh.triangles, mesh.triangles, reach=0.05, samples=64)


def _cast_error(mesh: Mesh, made: dict[str, float]) -> float:
    return max((abs(value - (1.0 - _GREY)) for value in made.values()), default=0.0)


def _shifted(mesh: Mesh) -> Mesh:
    """The mesh moved along x, all vertices alike, as float32 rounds it."""
    move = np.array([_SHIFT * side_of(mesh), 0, 0])
    return replace(mesh, positions=(mesh.positions.astype(np.float64) + move).astype(np.float32))


def _distance(mesh: Mesh) -> dict[str, float]:
    """To the mesh moved by a sixteenth of its longest side; NaN and the like as they are."""
    return Original(mesh).distance(_shifted(mesh) if np.isfinite(mesh.positions).all() else mesh, 20_000)


def _distance_error(mesh: Mesh, made: dict[str, float]) -> float:
    """How far the truth lies outside the bounds. A convex body that is moved: no point is farther than the
    move, and its foremost vertex is as far. A flat one moves within its plane: only its border tells."""
    across = diagonal(mesh)
    if across == 0:
        return max(made.values())
    rounded = np.abs(_shifted(mesh).positions.astype(np.float64) - mesh.positions)[:, 0]
    wanted = float(rounded.max()) / across
    above = max(0.0, made["error_max_lower"] - wanted)
    return max(above, wanted - made["error_max"]) if _moves_whole(mesh) else above


def _moves_whole(mesh: Mesh) -> bool:
    return len(np.unique(mesh.positions[:, 0])) > 1


def _tilted(mesh: Mesh) -> Mesh:
    """Its normals turned by three degrees, each towards some direction at right angles to it."""
    assert mesh.normals is not None
    n = mesh.normals.astype(np.float64)
    least = np.eye(3)[np.abs(n).argmin(axis=1)]
    side = np.cross(n, least)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300)
    turn = np.radians(_TILT)
    return replace(mesh, normals=(np.cos(turn) * n + np.sin(turn) * side).astype(np.float32))


def _flat(mesh: Mesh) -> Mesh:
    """One normal for each triangle, so that between vertices nothing is interpolated."""
    clean = sound(mesh)
    corners = clean.positions[clean.triangles].astype(np.float64) / side_of(clean)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    at = clean.triangles.reshape(-1)
    return Mesh(
        clean.positions[at],
        np.arange(len(at), dtype=np.uint32).reshape(-1, 3),
        np.repeat(normal, 3, axis=0).astype(np.float32),
        uvs=None if clean.uvs is None else clean.uvs[at],
    )


def _tilts(mesh: Mesh) -> dict[str, float]:
    flat = _flat(mesh)
    return normal_error(flat, _tilted(flat), 20_000)


def _seen(mesh: Mesh) -> dict[str, float]:
    """Of a mesh whose normals all point up, and the same with all of them turned by three degrees."""
    clean, turn = sound(mesh), np.radians(_TILT)
    one, other = (
        seen_mesh(replace(clean, normals=np.tile(np.array(up, np.float32), (len(clean.positions), 1))), {})
        for up in ((0, 1, 0), (np.sin(turn), np.cos(turn), 0))
    )
    found = seen_difference(one, other, 40.0)
    return {"p99": found.p99_deg, "mean": found.mean_deg, "silhouette": _TILT + found.silhouette}


def _switched(mesh: Mesh) -> dict[str, float]:
    """Of a mesh and itself, the same in another order; 1 where that to a brighter one is not a share."""
    clean = sound(mesh)
    black, white = np.zeros((1, 1, 3), np.float32), np.ones((1, 1, 3), np.float32)
    other = replace(clean, triangles=np.ascontiguousarray(clean.triangles[::-1]), groups=())
    dim, turned, bright = (
        seen_mesh(replace(one, groups=()), {"": SeenMaterial(colors=[black], glow=[glow])})
        for one, glow in ((clean, 0.2 * white), (other, 0.2 * white), (clean, white))
    )
    change = switch_flip(dim, bright, 40.0)
    return {
        "same": switch_flip(dim, dim, 40.0),
        "order": switch_flip(dim, turned, 40.0),
        "brighter": 0.0 if 0.0 <= change <= 1.0 else 1.0,
    }


def _slid(mesh: Mesh) -> dict[str, float]:
    clean = sound(mesh)
    return uv_shift(clean, clean, 20_000)


def _frames(mesh: Mesh) -> dict[str, float]:
    """Of the true frames, each turned about its normal by three degrees."""
    made = tangent_frames(sound(mesh))
    assert made.tangents is not None and made.normals is not None
    t, n = made.tangents[:, :3].astype(np.float64), made.normals.astype(np.float64)
    turn = np.radians(_TILT)
    turned = np.cos(turn) * t + np.sin(turn) * np.cross(n, t)
    off = replace(made, tangents=np.concatenate([turned, made.tangents[:, 3:]], axis=1).astype(np.float32))
    return {**frame_errors(off), **frame_faults(off)}


def _frame_error(mesh: Mesh, made: dict[str, float]) -> float:
    wrong = max(abs(made[f"tangent_{key}_deg"] - _TILT) for key in ("max", "mean"))
    return max(wrong, made["tangent_turned"], made["tangent_length"], made["tangent_lean_deg"])


def _square_layout(mesh: Mesh) -> Mesh:
    """Every triangle the lower left half of a cell of its own, in a grid over the square."""
    clean = sound(mesh)
    count = len(clean.triangles)
    side = int(np.ceil(np.sqrt(count)))
    cell = np.stack(np.divmod(np.arange(count), side)[::-1], axis=1)[:, None, :]
    corner = np.array([[0.25, 0.75], [0.75, 0.75], [0.25, 0.25]])
    at = clean.triangles.reshape(-1)
    uvs = ((cell + corner) / side).reshape(-1, 2).astype(np.float32)
    return Mesh(clean.positions[at], np.arange(3 * count, dtype=np.uint32).reshape(-1, 3), uvs=uvs)


def _quality(mesh: Mesh) -> dict[str, Any]:
    return atlas_quality(_square_layout(mesh), resolution=1024, padding=0)


def _quality_error(mesh: Mesh, made: dict[str, Any]) -> float:
    """As many charts as triangles, an eighth of the square, none mirrored, the density of the middle one."""
    laid = _square_layout(mesh)
    count = len(laid.triangles)
    side = int(np.ceil(np.sqrt(count)))
    scale = side_of(laid)
    p = laid.positions.astype(np.float64)[laid.triangles] / scale
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
    density = np.sort(1024 * np.sqrt((0.125 / side**2) / area))
    off = abs(made["packing"] / (count * 0.125 / side**2) - 1)
    off = max(off, abs(made["texels_per_m"][1] * scale / density[len(density) // 2] - 1))
    return float(max(off, abs(made["charts"] - count), made["flipped"], made["without"]))


def _costs(mesh: Mesh) -> dict[str, float]:
    return draw_costs(sound(mesh))


def _cost_error(mesh: Mesh, made: dict[str, float]) -> float:
    """The cache once more, in a few lines."""
    clean = sound(mesh)
    held: list[int] = []
    missed = 0
    for index in clean.triangles.reshape(-1).tolist()[:30_000]:
        if index not in held:
            held = [*held[-15:], index]
            missed += 1
    off = abs(made["acmr"] - missed / len(clean.triangles)) if len(clean.triangles) <= 10_000 else 0.0
    return max(off, 1 - made["atvr"])


def _coded(mesh: Mesh) -> tuple[Mesh, bytes]:
    clean = replace(sound(mesh), groups=())
    codes = quantise(clean, mesh_grid([clean]), direction_bits=8)
    return clean, encode_glb([Lod(clean, 0.0, 0.0, quantised=codes)], "a")


def _quantised(mesh: Mesh) -> list[dict[str, float]]:
    clean, data = _coded(mesh)
    return quantised_errors(data, [clean])


def _quantised_error(mesh: Mesh, made: list[dict[str, float]]) -> float:
    """From codes that are worked out here; steps, and degrees."""
    clean, found = replace(sound(mesh), groups=()), made[0]
    grid = mesh_grid([clean])
    step, wide = grid.step[0], clean.positions.astype(np.float64) - np.array(grid.origin)
    off = np.linalg.norm((np.rint(wide / step) - wide / step), axis=1).max()
    assert clean.normals is not None
    n = clean.normals.astype(np.float64)
    turned = angles_deg(np.rint(127 * n) / 127, n).max()
    moved = abs(found["quantise_max_m"] / step - off)
    return float(max(moved, abs(found["quantise_normal_max_deg"] - turned)))


def _lifted(heights: np.ndarray) -> TerrainError:
    """Of every pixel as a vertex, all of them lifted by a sixteenth of the range."""
    field = Heightfield(heights, 10.0 * (heights.shape[1] - 1), 10.0 * (heights.shape[0] - 1))
    mesh = terrain_mesh(field, tolerance_m=0.0, tier="grid")
    positions = mesh.positions.copy()
    positions[:, 1] = (positions[:, 1].astype(np.float64) + _lift(heights)).astype(np.float32)
    return terrain_error(replace(mesh, positions=positions), field)


def _lift(heights: np.ndarray) -> float:
    finite = heights[np.isfinite(heights)].astype(np.float64)
    return _SHIFT * (float(np.ptp(finite)) or 1.0) if finite.size else 1.0


def _lift_error(heights: np.ndarray, made: TerrainError) -> float:
    """Of the lift, besides what float32 rounds; a hole or a triangle that faces down counts 9."""
    if made.holes or made.flipped:
        return 9.0
    wide = heights.astype(np.float64)
    true = np.abs((wide + _lift(heights)).astype(np.float32) - wide)
    rms = float(np.sqrt(((true / true.max()) ** 2).mean())) * true.max()
    return float(max(abs(made.max_m - true.max()), abs(made.rms_m - rms)) / _lift(heights))


def _judged_path(points: np.ndarray) -> tuple[Flight, dict[str, float]]:
    flight = _flown(points)
    target = [(x + 1.0, y, z) for x, y, z in points.tolist()]
    return flight, flight_error(flight.as_json(), points.tolist(), target, [1.0] * len(points))


def _judged_error(points: np.ndarray, made: tuple[Flight, dict[str, float]]) -> float:
    """A path of this planner passes through its waypoints; a jump would be a fault of either. In sizes."""
    size = float(np.abs(points).max()) + 1.0
    return max(made[1][key] / size for key in ("path_miss_m", "path_jump_m", "path_time_s"))


def _weights(name: str) -> Any:
    return taps(name)


def _weight_error(name: str, made: Any) -> float:
    """Taps differentiate every monomial that they are made for, and a wave as their symbol says."""
    derivative, smooth = (np.array(values) for values in made)
    k = np.arange(1, len(derivative) + 1)
    slope = abs(2 * (k * derivative).sum() - 1)
    whole = abs(smooth[0] + 2 * smooth[1:].sum() - 1)
    # Least squares of degree 3 and more, and differences of order 4 and more, leave no cubic term.
    cubic = 0.0 if name in ("central", "scharr") else abs((k**3 * derivative).sum()) / (k**3).max()
    return float(max(slope, whole, cubic))


_ONLY_ONE = "a filter is told by its name alone"
NO_CODES = {"denormal": "too small a mesh for 16-bit positions"}
BARE = {"zero": "(m, 3) indices, got (0, 3)", "nan": "not finite", "inf": "not finite"}


def _row(module: str, run: Any, error: Any, unit: str, limit: float, **more: Any) -> Row:
    return Row(f"metrics.{module}", more.pop("inputs", MESHES), run, error, unit, limit, **more)


ROWS = [
    Row("metrics.occlusion", MESHES, _cast, _cast_error, "of the range", 1e-6, refused=GUARDED),
    _row("surface", _distance, _distance_error, "diagonals", 2e-6, refused=BARE),
    _row(
        "mapped_normal",
        _tilts,
        lambda mesh, made: max(abs(value - _TILT) for value in made.values()),
        "degrees",
        1e-4,
        part="normal",
        refused=GUARDED,
    ),
    _row(
        "seen",
        _seen,
        lambda mesh, made: max(abs(value - _TILT) for value in made.values()),
        "degrees",
        1e-4,
        refused=GUARDED,
    ),
    _row("switch", _switched, lambda mesh, made: max(made.values()), "FLIP", 1e-6, refused=GUARDED),
    _row(
        "mapped_normal",
        _slid,
        lambda mesh, made: max(made.values()),
        "diagonals",
        1e-6,
        part="texture",
        refused=GUARDED,
    ),
    _row("tangent", _frames, _frame_error, "degrees", 1e-4, refused=GUARDED),
    _row("atlas", _quality, _quality_error, "of what is due", 1e-4, refused=GUARDED),
    _row("draw", _costs, _cost_error, "of a vertex", 1e-3, refused=GUARDED),
    _row("quantised", _quantised, _quantised_error, "steps, degrees", 1e-5, refused=GUARDED | NO_CODES),
    _row(
        "terrain",
        _lifted,
        _lift_error,
        "of the lift",
        1e-6,
        inputs=HEIGHTS | {"largest": lambda: HEIGHTS["largest"]()[:800, :800].copy()},
        refused=dict.fromkeys(("zero", "one", "degenerate"), "on each side")
        | {"nan": "not a finite number", "inf": "not a finite number"},
    ),
    _row(
        "flight",
        _judged_path,
        _judged_error,
        "of its size",
        1e-9,
        inputs=PATHS,
        refused={
            **dict.fromkeys(("zero", "one"), "a loop needs 3"),
            "constant": "a path has a length",
            **dict.fromkeys(("nan", "inf"), "not at finite numbers"),
        },
    ),
    _row(
        "filters",
        _weights,
        _weight_error,
        "of a weight",
        1e-13,
        inputs={
            "one": lambda: "central",
            "many": lambda: "septic16",
            "degenerate": lambda: "smooth2",
            "largest": lambda: "quintic16",
        },
        absent=dict.fromkeys(
            (
                *(
                    "zero",
                    "constant",
                    "tiny",
                    "huge",
                    "far",
                    "denormal",
                    "nan",
                    "inf",
                    "parallel",
                    "opposite",
                ),
                *("mirrored", "sliver"),
            ),
            _ONLY_ONE,
        ),
    ),
]
