"""The bounds of meshes and terrain tiles in pixels, with their terms. They come from scene.json: errors of
levels and patches, spheres, and the rules by which the player chooses levels; where the eye comes into a
sphere, from the published triangles.

The player draws a coarser level only where it is off by at most `lod_error_px` at the distance of the
object's sphere. The error of level 0 is limited only by the nearest distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import inf, isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.errors import FormatError
from paradize.explain.bound import SIX, bound
from paradize.explain.pixels import Camera, Moved, Surfaces
from paradize.files import read_file
from paradize.placement import largest_scale, to_world
from paradize.scene.finest_views import COARSEST_LOD
from paradize.scene.motion import all_stands

F64 = npt.NDArray[np.float64]
_MOST_BYTES = 32_000_000
_FAST = "at quality fast"
# Terms of coarser levels, and how many times lod_error_px the player then accepts.
_QUALITIES = (("{} (drawn where it is off by {:g} px)", 1.0), (_FAST + " {}", COARSEST_LOD))
_TERRAIN_OPEN = (
    "the terrain between the pixels of the heightmap",
    "its normals and light",
    "its shadow, mirror image and view through water",
)
_ELSEWHERE = {
    "shadow": "its shadow",
    "reflection": "its mirror image",
    "refraction": "its view through water",
}


def mesh_bound(
    manifest: dict[str, Any], folder: Path, item: dict[str, Any], camera: Camera
) -> dict[str, Any]:
    """The bound of an object's mesh."""
    levels = manifest["artifacts"][item["mesh"]]["levels"]
    unbounded = [words for view, words in _ELSEWHERE.items() if view in item["views"]]
    unbounded = ["how far its texture slides", "its normals and light", *unbounded]
    errors = [level.get("error_max", inf) * SIX for level in levels]
    # Errors are shares of the diagonal of the source's box, which exceeds the baked box on each side by at
    # most the error.
    wider = 1.0 - 2.0 * sqrt(3.0) * errors[0] if errors else -inf
    if len(errors) != len(item["lods"]) or not wider > 0.0 or not camera.usable:
        return bound(None, "px", "a pixel", [], ["its surface", *unbounded])
    diagonal = 2.0 * item["radius_m"] * SIX / wider
    errors_m = [error * diagonal for error in errors]
    if "camera" not in item["views"]:
        return bound(0.0, "px", "a pixel", [], unbounded)
    item = item | {"instances": all_stands(item["instances"], item["motion"])}
    triangles = _Triangles(folder / manifest["artifacts"][item["mesh"]]["file"], _finest)
    terms: list[dict[str, Any]] = []
    nearest = camera.most_moved(
        _standing(item, 0, errors_m, camera), lambda row: triangles.at(0, item["instances"][row])
    )
    if nearest is not None:
        terms.append(_term("level 0", nearest) | {"parts": _parts(levels, errors_m[0], nearest.px)})
    for name, share in _QUALITIES:
        accepted_px = share * manifest["lod_error_px"]
        movements = [
            (at, moved)
            for at in range(1, len(errors_m))
            if (moved := camera.most_moved(_standing(item, at, errors_m, camera, accepted_px))) is not None
        ]
        if movements:
            at, most = max(movements, key=lambda movement: movement[1].px)
            terms.append(_term(name.format(f"level {at}", accepted_px), most))
    return bound(_largest(terms), "px", "a pixel", terms, unbounded)


def _largest(terms: Sequence[dict[str, Any]]) -> float:
    """The largest term of quality `balanced`."""
    values = [term["value"] for term in terms if not term["name"].startswith(_FAST)]
    return max((inf if value is None else value for value in values), default=0.0)


def _term(name: str, moved: Moved) -> dict[str, Any]:
    value = moved.px if isfinite(moved.px) else None
    where = {"away_m": moved.away_m if isfinite(moved.away_m) else 0.0, "second_s": moved.second_s}
    return {"name": name, "value": value, "unit": "px"} | where


def _parts(levels: Sequence[dict[str, float]], error_m: float, px: float) -> dict[str, float]:
    """The parts of level 0's error, in pixels. Quantisation counts at the level that it moves most."""
    if not (error_m > 0.0 and isfinite(px)):
        return {}
    quantised = max(level.get("quantise_max_m", 0.0) for level in levels)
    parts = {"loading": levels[0].get("load_max_m", 0.0), "quantisation": quantised}
    rest = error_m - sum(parts.values())
    if rest > 1e-3 * error_m:  # less may be rounding
        parts["simplification"] = rest
    total = sum(parts.values())
    return {name: px * part / total for name, part in parts.items() if part > 0.0}


def _standing(
    item: dict[str, Any], at: int, errors_m: Sequence[float], camera: Camera, accepted_px: float = 1.0
) -> Surfaces:
    """A level of a mesh at each instance. accepted_px: the error that the player accepts of coarser ones."""
    center = np.array(
        [_placed(np.array(item["center"]), instance) for instance in item["instances"]]
    ).reshape(-1, 3)
    scale = np.array([largest_scale(instance) for instance in item["instances"]], np.float64)
    core = item["radius_m"] * SIX * scale
    # The published sphere belongs to the finest level; source and level exceed it by at most this.
    beyond = (errors_m[at] + errors_m[0]) * scale
    switch = item["lods"][at]["error_m"] if at else 0.0
    from_m = switch * scale * camera.pixels / accepted_px
    return Surfaces(center, core + beyond, errors_m[at] * scale, from_m, core, beyond)


def _placed(places: F64, instance: dict[str, Any]) -> F64:
    """Points (..., 3) of a mesh, transformed by an instance."""
    return np.stack(to_world(np.moveaxis(places, -1, 0), instance), axis=-1)


class _Triangles:
    """The triangles of the parts of a published file, read at first use. A file that is too large or cannot
    be read has none; then only spheres bound its distance."""

    def __init__(self, path: Path, decode: Callable[[bytes], list[F64]]) -> None:
        self.path, self.decode = path, decode
        self.parts: list[F64] | None = None

    def at(self, part: int, instance: dict[str, Any] | None = None) -> F64 | None:
        """Corners (m, 3, 3) of a part, metres, transformed by the instance."""
        if self.parts is None:
            try:
                self.parts = self.decode(read_file(self.path, _MOST_BYTES))
            except (OSError, FormatError):
                self.parts = []
        if part >= len(self.parts):
            return None
        return self.parts[part] if instance is None else _placed(self.parts[part], instance)


def _finest(data: bytes) -> list[F64]:
    from paradize.formats.glb.reader import decode_glb

    mesh = decode_glb(data, "the mesh")[0].mesh
    return [mesh.absolute_positions[mesh.triangles]]


def _patches(data: bytes) -> list[F64]:
    from paradize.formats.glb.tiles import decode_tile

    return [patch.mesh.absolute_positions[patch.mesh.triangles] for patch in decode_tile(data)]


def _patch(triangles: _Triangles, nodes: npt.NDArray[np.intp], row: int) -> F64 | None:
    return triangles.at(int(nodes[row]))


def terrain_bounds(manifest: dict[str, Any], folder: Path, camera: Camera) -> dict[str, dict[str, Any]]:
    """The bound of each tile of the terrain, by artifact."""
    terrain = manifest["terrain"]
    if not camera.usable:
        unknown = bound(None, "px", "a pixel", [], ["its surface", *_TERRAIN_OPEN])
        return dict.fromkeys(terrain["tiles"], unknown)
    patches, diamonds = terrain["patches"], terrain["diamonds"]
    tile, diamond = (np.array(patches[key], np.int64) for key in ("tile", "diamond"))
    error_m = np.array(patches["error_m"], np.float64) * SIX
    radius_m = np.array(patches["radius_m"], np.float64) * SIX + error_m
    center = np.array(patches["center"], np.float64)
    # A patch is drawn while its diamond is not split: the diamond's error is accepted. -1: no finer patch.
    accepted = np.append(np.array(diamonds["error_m"], np.float64), 0.0)[diamond]
    bounds = {}
    for number, name in enumerate(terrain["tiles"]):
        first = int(np.searchsorted(tile, number))
        triangles = _Triangles(folder / manifest["artifacts"][name]["file"], _patches)
        terms = []
        for words, share in (("the finest patches", 0.0), *_QUALITIES):
            rows = np.flatnonzero((tile == number) & ((diamond < 0) == (share == 0.0)))
            accepted_px = share * manifest["lod_error_px"]
            from_m = accepted[rows] * camera.pixels / accepted_px if share else np.zeros(len(rows))
            # A diamond's sphere contains the patch's, so the eye is at least as far from the patch.
            core = np.zeros(len(rows))
            part = Surfaces(center[rows], radius_m[rows], error_m[rows], from_m, core, error_m[rows])
            moved = camera.most_moved(part, partial(_patch, triangles, rows - first))
            if moved is not None:
                off = {"error_m": float(error_m[rows[moved.row]])}
                terms.append(_term(words.format("coarser patches", accepted_px), moved) | off)
        bounds[name] = bound(_largest(terms), "px", "a pixel", terms, _TERRAIN_OPEN)
    return bounds
