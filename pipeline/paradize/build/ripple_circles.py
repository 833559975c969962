"""Finds what stands in the water: where objects cross its surface, a circle for ripples to run from.

A section that is about as wide as long becomes a circle; hulls and walls have none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.build.artifacts import read_artifact
from paradize.build.entries import RIPPLES, fits
from paradize.jobs.code import code_digest
from paradize.placement import largest_scale, to_world
from paradize.player_limits import MOST_RIPPLES
from paradize.store.local import Store, key_of

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

LEAST_RADIUS_M = 0.05
LARGEST_RADIUS_M = 2.5
_ROUND = 0.6  # of its length, the least width of a section that counts as round
_ASIDE_M = 0.3  # nearer than this to the rim of a larger circle, a circle is part of it

Circle = tuple[float, float, float]  # x, z, radius, metres


def add_ripples(
    manifest: dict[str, Any],
    height_m: float,
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    store: Store,
    *,
    force: bool,
) -> list[str]:
    """Adds `ripples` to the water of a manifest. data, sha256: by artifact. The result is kept in the store;
    force: nothing is read from it. Returns warnings."""
    water = manifest["water"]
    standing: dict[str, list[dict[str, Any]]] = {}
    for item in manifest["objects"]:
        if "camera" in item["views"] and item["motion"] is None and item["sway"] is None:
            some = [
                instance for instance in item["instances"] if _may_cross(item, instance, water["level_m"])
            ]
            if some:
                standing[item["mesh"]] = standing.get(item["mesh"], []) + some
    meshes = {name: sha256[name] for name in standing}
    key = key_of("ripples", code_digest(__name__), meshes, standing, water["level_m"])
    stored = None if force else store.get_product(key)
    if not fits(stored, RIPPLES):
        found: list[Circle] = []
        for name, instances in standing.items():
            found += circles_of_glb(read_artifact(data[name]), instances, water["level_m"])
        stored = {"circles": [list(circle) for circle in merged(found)]}
        store.put_product(key, stored)
    floor = manifest["terrain"].get("floor") if manifest["terrain"] else None
    wet = [
        circle
        for circle in stored["circles"]
        if not floor or _is_wet(circle, floor, manifest["terrain"]["size_m"], water["level_m"])
    ]
    kept = wet[:MOST_RIPPLES]
    if kept:
        x, z, radius_m = (list(column) for column in zip(*kept, strict=True))
        water["ripples"] = {"height_m": height_m, "x_m": x, "z_m": z, "radius_m": radius_m}
    if len(wet) > len(kept):
        return [f"water.ripple_height_m: {len(wet)} things stand in the water; {MOST_RIPPLES} have ripples"]
    return []


def _may_cross(item: Mapping[str, Any], instance: Mapping[str, Any], level_m: float) -> bool:
    middle_m = to_world(item["center"], instance)[1]
    return bool(abs(middle_m - level_m) <= item["radius_m"] * largest_scale(instance))


def _is_wet(circle: Sequence[float], floor: Mapping[str, Any], size_m: list[float], level_m: float) -> bool:
    """Whether the ground in the circle's cell lies below the water. True outside the terrain."""
    columns = floor["columns"]
    rows = len(floor["highest_m"]) // columns
    across = (circle[0] + 0.5 * size_m[0]) / floor["cell_m"][0]
    down = (circle[1] + 0.5 * size_m[1]) / floor["cell_m"][1]
    if not (0.0 <= across < columns and 0.0 <= down < rows):
        return True
    return bool(floor["highest_m"][int(down) * columns + int(across)] < level_m)


def circles_of_glb(glb: bytes, instances: Sequence[Mapping[str, Any]], level_m: float) -> list[Circle]:
    """Returns the circles of a mesh's finest level at each instance."""
    import numpy as np

    from paradize.formats.glb.reader import decode_glb

    mesh = decode_glb(glb)[0].mesh
    places, same = np.unique(mesh.absolute_positions, axis=0, return_inverse=True)
    triangles = same.reshape(-1)[mesh.triangles]
    found: list[Circle] = []
    for instance in instances:
        x, y, z = to_world(places.T, instance)
        found += _circles(np.stack([x, y - level_m, z], axis=1), triangles)
    return found


def _circles(points: npt.NDArray[np.float64], triangles: npt.NDArray[np.int64]) -> list[Circle]:
    """points : (n, 3) float64, metres above the water in y; no two are equal. triangles : (m, 3)."""

    below = points[:, 1] < 0.0
    sides = below[triangles].sum(axis=1)
    crossing = triangles[(sides > 0) & (sides < 3)]
    first: dict[tuple[int, int], tuple[int, int]] = {}  # an edge that crosses: another of its section

    def root(edge: tuple[int, int]) -> tuple[int, int]:
        while first.setdefault(edge, edge) != edge:
            first[edge] = first[first[edge]]
            edge = first[edge]
        return edge

    for a, b, c in crossing.tolist():
        edges = [(min(i, j), max(i, j)) for i, j in ((a, b), (b, c), (c, a)) if below[i] != below[j]]
        first[root(edges[0])] = root(edges[1])
    sections: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for edge in first:
        sections.setdefault(root(edge), []).append(edge)
    found: list[Circle] = []
    for edges in sections.values():
        a, b = points[[i for i, _ in edges]], points[[j for _, j in edges]]
        share = a[:, 1] / (a[:, 1] - b[:, 1])
        cut = (a + (b - a) * share[:, None])[:, [0, 2]]
        low, high = cut.min(axis=0), cut.max(axis=0)
        size, middle = high - low, 0.5 * (low + high)
        radius = 0.25 * float(size[0] + size[1])
        if LEAST_RADIUS_M <= radius <= LARGEST_RADIUS_M and size.min() >= _ROUND * size.max():
            found.append((round(float(middle[0]), 3), round(float(middle[1]), 3), round(radius, 3)))
    return found


def merged(circles: Sequence[Circle]) -> list[Circle]:
    """Returns the circles without those in or close beside larger ones, the largest first."""
    kept: list[Circle] = []
    for x, z, radius in sorted(circles, key=lambda circle: (-circle[2], circle[0], circle[1])):
        if all(
            (x - u) * (x - u) + (z - v) * (z - v) > (around + _ASIDE_M) * (around + _ASIDE_M)
            for u, v, around in kept
        ):
            kept.append((x, z, radius))
    return kept
