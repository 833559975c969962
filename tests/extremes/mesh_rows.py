"""Rows of the stages that take meshes, each held to float64, exact fractions or a count of its own."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from paradize.data import Mesh, QuantisedValues
from paradize.metrics.atlas import atlas_quality
from paradize.metrics.occlusion import cast_errors
from paradize.metrics.surface import Original
from paradize.metrics.tangent import frame_errors, frame_faults
from paradize.stages.atlas import make_atlas
from paradize.stages.lod import simplify
from paradize.stages.lod.meshoptimizer import meshopt_simplify
from paradize.stages.lod.surface import joined_vertices, normalised, used_only
from paradize.stages.normals import complete_normals
from paradize.stages.occlusion import mesh_occlusion
from paradize.stages.order import draw_order
from paradize.stages.quantise import mesh_grid, quantise
from paradize.stages.refine import fit_normals, fit_positions
from paradize.stages.reproject import take_attributes
from paradize.stages.split import split_by
from paradize.stages.sway import sway
from paradize.stages.tangents import tangent_frames
from paradize.stages.validate import Report, validate_mesh
from paradize.stages.weld import Welding, weld
from tests.extremes.shapes import MESHES, angles_deg, areas, side_of, sliver, turned_over, unit
from tests.extremes.table import Row
from tests.pipeline.searched import searched

NOT_FINITE = {"nan": "not finite", "inf": "not finite"}
# Meshes that validate refuses go to no stage after it.
GUARDED = {"zero": "no triangles", "constant": "all 528 triangles are degenerate", **NOT_FINITE}


def sound(mesh: Mesh) -> Mesh:
    """The mesh as every stage after validate gets it."""
    return validate_mesh(mesh)[0]


def _is_flat(corners: np.ndarray) -> bool:
    """Whether three float32 places have no area: in fractions, so exactly."""
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in corners)
    u, v = ([x - y for x, y in zip(end, a, strict=True)] for end in (b, c))
    return all(u[k - 2] * v[k - 1] == u[k - 1] * v[k - 2] for k in range(3))


def _wrongly_kept(mesh: Mesh, made: tuple[Mesh, Report]) -> float:
    """Triangles that are kept or dropped against what exact fractions say; of many some thousand."""
    step = max(1, len(mesh.triangles) // 3000)
    flat = np.array([_is_flat(mesh.positions[t]) for t in mesh.triangles[::step]])
    seen: set[tuple[int, ...]] = set()
    doubled = np.zeros(len(mesh.triangles), np.bool_)
    for at, t in enumerate(mesh.triangles.tolist()):
        key = min((*t[k:], *t[:k]) for k in range(3)) if len(mesh.triangles) < 9999 else tuple(t)
        doubled[at] = key in seen
        seen.add(key)
    return float((made[1].kept[::step] == (flat | doubled[::step])).sum())


def _beyond_tolerance(mesh: Mesh, made: tuple[Mesh, Welding]) -> float:
    """By how much of the tolerance a place went too far, or two that stay are too near each other."""
    welded, done = made
    if not len(mesh.positions):
        return 0.0
    scale = side_of(mesh)
    tolerance = done.tolerance_m / scale
    before = mesh.positions.astype(np.float64) / scale
    after = np.unique(welded.positions.astype(np.float64) / scale, axis=0)
    away = cKDTree(after).query(before)[0].max()
    apart = cKDTree(after).query(after, k=2)[0][:, 1].min() if len(after) > 1 else np.inf
    return max(0.0, away / tolerance - 1, 1 - apart / tolerance)


def _away_from_weighted(mesh: Mesh, made: tuple[Mesh, int]) -> float:
    """Degrees from the angle-weighted mean of all triangles at a place, in float64."""
    mesh = sound(mesh)
    points = unit(mesh.positions)
    _, place = np.unique(mesh.positions + np.float32(0), axis=0, return_inverse=True)
    place = place.reshape(-1)
    total = np.zeros((place.max() + 1, 3))
    corner = points[mesh.triangles]
    ab, ac = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    face = np.cross(_unit(ab), _unit(ac))
    face = _unit(face)
    for k in range(3):
        one, two = (corner[:, (k + j) % 3] - corner[:, k] for j in (1, 2))
        weight = np.radians(angles_deg(_unit(one), _unit(two)))
        np.add.at(total, place[mesh.triangles[:, k]], face * weight[:, None])
    found = made[0]
    _, there = np.unique(
        np.concatenate([mesh.positions, found.positions]) + np.float32(0), axis=0, return_inverse=True
    )
    truth = np.zeros((there.max() + 1, 3))
    truth[there.reshape(-1)[: len(mesh.positions)]] = total[place]
    truth = truth[there.reshape(-1)[len(mesh.positions) :]]
    defined = np.linalg.norm(truth, axis=1) > 1e-6
    assert found.normals is not None
    return float(angles_deg(found.normals[defined], truth[defined]).max(initial=0.0))


def _unit(v: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.asarray(v / np.where(length > 0, length, 1.0))


def _bare(mesh: Mesh) -> tuple[Mesh, int]:
    return complete_normals(replace(sound(mesh), normals=None), crease_deg=180.0)


def _corners(mesh: Mesh) -> np.ndarray:
    """Values per corner that differ at every other corner, of every size a float32 has."""
    number = np.arange(1, 3 * len(mesh.triangles) + 1).reshape(-1, 3, 1) % 7 + 1
    return number.astype(np.float32) * mesh.positions.max(initial=0.0)


def _split(mesh: Mesh) -> Mesh:
    return split_by(mesh, colors=np.repeat(_corners(mesh), 4, axis=2))


def _changed_corners(mesh: Mesh, made: Mesh) -> float:
    """Corners that do not hold the position and the value that they were given."""
    assert made.colors is not None
    same = (made.positions[made.triangles] == mesh.positions[mesh.triangles]).all(axis=2)
    return float((~same | (made.colors[made.triangles] != _corners(mesh)).any(axis=2)).sum())


def _frame_error(mesh: Mesh, made: Mesh) -> float:
    """Degrees from a float64 MikkTSpace, or from a right angle to the normal; a turned sign counts 180."""
    faults, errors = frame_faults(made), frame_errors(made)
    turned = 180.0 * (errors["tangent_turned"] > 0 or faults["tangent_sign"] > 0)
    lean = faults["tangent_lean_deg"] + np.degrees(faults["tangent_length"])
    return float(max(errors["tangent_max_deg"], lean, turned))


def _lean(made: Mesh) -> float:
    faults = frame_faults(made)
    return float(faults["tangent_lean_deg"] + np.degrees(faults["tangent_length"]) + faults["tangent_sign"])


def _faces(mesh: Mesh) -> Counter[bytes]:
    """The triangles by their corners' places, whichever is first."""
    corners = mesh.positions[mesh.triangles] + np.float32(0)
    keys = [[t[turn].tobytes() for turn in ([0, 1, 2], [2, 0, 1], [1, 2, 0])] for t in corners]
    return Counter(min(three) for three in keys)


def _other_triangles(mesh: Mesh, made: Mesh) -> float:
    before, after = _faces(sound(mesh)), _faces(made)
    return float(((before - after) + (after - before)).total())


def _coded(mesh: Mesh) -> QuantisedValues:
    clean = sound(mesh)
    return quantise(clean, mesh_grid([clean]))


def _steps_off(mesh: Mesh, made: QuantisedValues) -> float:
    """How far a vertex moved along an axis, in steps of the quantisation grid: half of one at most."""
    step, origin = np.array(made.grid.step), np.array(made.grid.origin)
    places = made.positions * step + origin
    return float((np.abs(places - sound(mesh).positions.astype(np.float64)) / step).max())


def _taken(mesh: Mesh) -> Mesh:
    clean = sound(mesh)
    return take_attributes(clean, replace(clean, normals=None, uvs=None), ("normals", "uvs"))


def _own_attributes_lost(mesh: Mesh, made: Mesh) -> float:
    """A mesh takes from itself: each corner's normal and place in the picture must be its own."""
    clean = sound(mesh)
    worst = 0.0
    for name in ("normals", "uvs"):
        before, after = getattr(clean, name)[clean.triangles], getattr(made, name)[made.triangles]
        worst = max(worst, float(np.abs(before - after).max()))
    return worst


def _halved(method: str) -> Any:
    def run(mesh: Mesh) -> Mesh:
        clean = sound(mesh)
        return simplify(clean, max(1, len(clean.triangles) // 2), method).mesh

    return run


def _creased(mesh: Mesh) -> Mesh:
    """Every corner has a normal of its own, so meshoptimizer collapses nothing until normals are released."""
    clean = sound(mesh)
    axes = np.eye(3, dtype=np.float32)
    return split_by(clean, normals=axes[np.arange(3 * len(clean.triangles)) % 3])


def _released(mesh: Mesh) -> Mesh:
    return _halved("meshoptimizer")(_creased(mesh))


def _released_error(mesh: Mesh, made: Mesh) -> float:
    """The error of a level; 1 if its creases kept a fifth more triangles than the smooth mesh keeps."""
    smooth = _halved("meshoptimizer")(mesh)
    return _level_error(mesh, made) if len(made.triangles) <= 1.2 * len(smooth.triangles) else 1.0


def _prepared(mesh: Mesh) -> tuple[Mesh, np.ndarray, float]:
    """As every simplifier begins: vertices joined, those without a triangle dropped, the box made 1."""
    found = used_only(joined_vertices(_creased(mesh), ("normals",))[0])
    return found, *normalised(found.positions)[:2]


def _prepared_error(mesh: Mesh, made: tuple[Mesh, np.ndarray, float]) -> float:
    """How far a corner moved, in diagonals; of one that is doubled, lost or not normalised all of it."""
    clean, (found, points, metres) = sound(mesh), made
    keys = np.concatenate([clean.positions, clean.uvs], axis=1)[clean.triangles].reshape(-1, 5)
    lost = len(np.unique(keys + np.float32(0), axis=0)) - len(found.positions)
    wide = clean.positions.astype(np.float64)[clean.triangles]
    low, high = wide.min(axis=(0, 1)), wide.max(axis=(0, 1))
    diagonal = math.hypot(*(high - low))
    moved = np.abs(points[found.triangles] - (wide - (low + high) / 2) / diagonal).max()
    return float(max(moved, abs(metres / diagonal - 1), lost != 0))


def _fitted(mesh: Mesh) -> Mesh:
    clean = sound(mesh)
    level = simplify(clean, max(1, len(clean.triangles) // 2)).mesh
    judge = Original(clean)
    reach_m = judge.distance(level, samples=0)["error_max"] * judge.diagonal_m
    moved = replace(level, positions=fit_positions(clean, level, reach_m).astype(np.float32))
    return replace(moved, normals=fit_normals(clean, moved))


def _level_error(mesh: Mesh, made: Mesh) -> float:
    """The largest distance between the level and the surface, of the diagonal."""
    return Original(sound(mesh)).distance(made, samples=0)["error_max"]  # a bound without samples


def _meshopt(mesh: Mesh) -> np.ndarray:
    """As stages.lod calls it: a sound mesh of diagonal 1; what is not goes in as it is."""
    finite = len(mesh.triangles) and np.isfinite(mesh.positions).all()
    mesh = sound(mesh) if finite else mesh
    points = unit(mesh.positions) / 3.0**0.5 if finite else mesh.positions.astype(np.float64)
    locked, weights = np.zeros(len(points), np.uint8), np.full(3, 0.02, np.float32)
    assert mesh.normals is not None
    target = max(1, len(mesh.triangles) // 2)
    return meshopt_simplify(points, mesh.triangles, mesh.normals, weights, locked, target)


def _meshopt_error(mesh: Mesh, made: np.ndarray) -> float:
    if not len(made):
        return 0.0
    mesh = sound(mesh)
    scaled = replace(mesh, positions=unit(mesh.positions).astype(np.float32), groups=())
    return Original(scaled).distance(replace(scaled, triangles=made), samples=0)["error_max"]


def _layout_faults(mesh: Mesh, made: Mesh) -> float:
    """Triangles without area or mirrored in the picture, by float64; and what covers another's texels."""
    assert made.uvs is not None
    corners = np.concatenate([made.uvs, np.zeros_like(made.uvs[:, :1])], axis=1).astype(np.float64)
    turned = areas(corners, made.triangles)[:, 2]
    surface = np.linalg.norm(areas(unit(made.positions), made.triangles), axis=1)
    wrong = (turned >= 0) & (surface > 1e-9 * surface.max())  # v grows downwards
    found = atlas_quality(made)
    return float(wrong.sum() + found["overlap"] + found["near"])


def _inside_out(mesh: Mesh) -> tuple[Mesh, Any]:
    """Seen from inside, where round surfaces are dark at a flat angle: the wall there is within reach."""
    mesh = turned_over(sound(mesh))
    made = mesh_occlusion(mesh, mesh.triangles, mesh.triangles, height=16, width=32, reach=0.3, rays=256)
    return mesh, made


def _occlusion_error(mesh: Mesh, made: tuple[Mesh, Any]) -> float:
    inside, found = made
    on = inside.triangles
    return cast_errors(found.values, inside, on, on, reach=0.3, samples=64).get("cast_mean", 0.0)


def _lean_error(mesh: Mesh, made: np.ndarray) -> float:
    """The error of the lean, by the search; of large meshes, what is known of root and tip."""
    mesh = sound(mesh)
    if len(mesh.positions) > 2000:
        return float(abs(made[:, 0].max() - 1.0) + abs(made[:, 0].min()))
    reached = searched(mesh)
    return float(np.abs(made[:, 0] - (reached / max(reached.max(), 1e-300)) ** 2).max())


def _row(module: str, run: Any, error: Any, unit: str, limit: float, **more: Any) -> Row:
    inputs: Mapping[str, Any] = more.pop("inputs", MESHES)
    return Row(f"stages.{module}", inputs, run, error, unit, limit, **more)


ROWS = [
    _row("validate", validate_mesh, _wrongly_kept, "triangles", 0, refused=GUARDED),
    _row(
        "weld",
        lambda mesh: weld(mesh, 0.05 * side_of(mesh)),
        _beyond_tolerance,
        "tolerance",
        1e-6,
        refused=NOT_FINITE,
    ),
    _row("normals", _bare, _away_from_weighted, "degrees", 1e-4, refused=GUARDED),
    _row("occlusion", _inside_out, _occlusion_error, "of the range", 0.01, refused=GUARDED),
    _row("split", _split, _changed_corners, "corners", 0, refused=NOT_FINITE),
    *[
        _row(
            "tangents",
            lambda mesh, method=method: tangent_frames(sound(mesh), method),
            _frame_error if method == "mikktspace" else lambda mesh, made: _lean(made),
            "degrees",
            0.05,
            part=method,
            refused=GUARDED,
        )
        for method in ("mikktspace", "vertex")
    ],
    _row("order", lambda mesh: draw_order(sound(mesh)), _other_triangles, "triangles", 0, refused=GUARDED),
    _row(
        "quantise",
        _coded,
        _steps_off,
        "steps",
        0.5 + 1e-9,
        refused=GUARDED | {"denormal": "too small a mesh for 16-bit positions"},
    ),
    _row("reproject", _taken, _own_attributes_lost, "of 1", 1e-5, refused=GUARDED),
    _row("sway", lambda mesh: sway(sound(mesh)), _lean_error, "of 1", 1e-6, refused=GUARDED),
    *[
        _row(
            f"lod.{module}",
            _halved(method),
            _level_error,
            "diagonals",
            limit,
            part=method,
            refused=GUARDED | ({"opposite": "the surface is not a manifold"} if method == "openmesh" else {}),
        )
        for module, method, limit in (
            ("collapse", "paradize", 0.02),
            ("meshoptimizer", "meshoptimizer", 0.25),
            ("positions", "fast-simplification", 0.25),
            ("positions", "openmesh", 0.25),
        )
    ],
    _row("lod.methods", _released, _released_error, "diagonals", 0.25, refused=GUARDED),
    _row("lod.surface", _prepared, _prepared_error, "diagonals", 1e-12, refused=GUARDED),
    _row("refine", _fitted, _level_error, "diagonals", 0.02, refused=GUARDED),
    _row(
        "lod.meshoptimizer",
        _meshopt,
        _meshopt_error,
        "diagonals",
        0.25,
        part="the library",
        refused=GUARDED | dict.fromkeys(("zero", "nan", "inf"), "only sound meshes"),
    ),
    *[
        _row(
            module,
            lambda mesh, unwrapper=unwrapper: make_atlas(sound(mesh), unwrapper=unwrapper),
            _layout_faults,
            "triangles, shares",
            0,
            part=unwrapper,
            refused=GUARDED,
            # xatlas rasterises a chart of this shape for seconds, so it gets few triangles.
            inputs=MESHES if unwrapper == "paradize" else {**MESHES, "sliver": lambda: sliver(3)},
        )
        for module, unwrapper in (("atlas", "paradize"), ("unwrappers", "xatlas"))
    ],
]
