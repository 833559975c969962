"""The rule for parts of an object whose triangles face inwards, or away from their normals: the side that
should be seen is culled."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding, isolated
from paradize.data import Mesh
from paradize.errors import ParadizeError
from paradize.formats.glb.reader import decode_glb
from paradize.formats.scene.manifest import read_entry
from paradize.kernels.mesh import number_rows, topology

_FLAT = 1e-6  # volume over area^1.5 (a sphere has 0.094), up to which rounding may decide the sign
_ASLANT = 0.3  # of three normals' sum along the triangle's: those of upright leaves may point up
_MOST = 0.25  # share of the area: of models in order hardly any has more than a few percent


def check_winding(manifest: dict[str, Any], folder: Path) -> Iterator[Finding]:
    """The findings in the finest levels of all objects. Another rule reports meshes that cannot be read."""
    for item in manifest["objects"]:
        entry = manifest["artifacts"][item["mesh"]]
        file = str(folder / entry["file"])
        try:
            mesh = decode_glb(read_entry(folder, entry))[0].mesh
        except (OSError, ParadizeError):
            continue
        culled = [name for name, material in item["materials"].items() if not material["two_sided"]]
        yield from isolated(find_turned(mesh, culled, file), file)


def find_turned(mesh: Mesh, culled: list[str], file: str) -> Iterator[Finding]:
    """The findings in a mesh. culled: its materials of one side."""
    parts = inside_out(mesh)
    drawn = np.concatenate(
        [np.full(group.count, group.material in culled, np.bool_) for group in mesh.groups]
    )
    parts = [part for part in parts if drawn[part].all()]
    if parts:
        first = int(parts[0].argmax())
        corner = ", ".join(f"{value:.4g}" for value in mesh.positions[mesh.triangles[first, 0]] + mesh.origin)
        what = f"a closed part of {int(parts[0].sum())} triangles at {corner} faces inwards"
        yield Finding("PZ234", file, what, f"lod0 triangle {first}", len(parts))
    elif mesh.normals is not None and drawn.any():
        a, b, c = np.moveaxis(mesh.positions[mesh.triangles[drawn]].astype(np.float64), 1, 0)
        facet = np.cross(b - a, c - a)
        area = np.sqrt((facet * facet).sum(axis=1))
        along = (facet * mesh.normals[mesh.triangles[drawn]].sum(axis=1)).sum(axis=1)
        wrong = along < -_ASLANT * area
        if area[wrong].sum() > _MOST * area.sum():
            once = ~_there_twice(mesh, drawn)
            share = area[wrong & once].sum() / max(area[once].sum(), np.finfo(np.float64).tiny)
            if share > _MOST:
                what = f"normals of {share:.0%} of its surface point away from the side that is drawn"
                yield Finding("PZ234", file, what, "lod0")


def _there_twice(mesh: Mesh, drawn: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which of the drawn triangles have the corners of another. Leaves with a back share normals with it."""
    corners = np.sort(number_rows(mesh.positions)[0][mesh.triangles[drawn]], axis=1)
    _, number, times = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    return np.asarray(times[number.reshape(-1)] > 1)


def inside_out(mesh: Mesh) -> list[npt.NDArray[np.bool_]]:
    """Returns the triangles, (m,) each, of all closed parts with a negative volume. Vertices at one position
    are joined. A cavity is no such part: it lies in the box of a closed part that faces outwards."""
    places, first = number_rows(mesh.positions)
    triangles = places[mesh.triangles].astype(np.int64)
    sound = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = triangles[sound]
    found = topology(triangles, len(first))
    part, count = found.component, found.components
    corners = mesh.positions[first].astype(np.float64)[triangles]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    a, b, c = np.moveaxis(corners - (0.5 * (low + high))[part][:, None], 1, 0)
    facet = np.cross(b - a, c - a)
    area = np.bincount(part, 0.5 * np.sqrt((facet * facet).sum(axis=1)), count)
    volume = np.bincount(part, (a * facet).sum(axis=1) / 6.0, count)
    solid = _closed(triangles, part, count, len(first)) & (np.abs(volume) > _FLAT * area**1.5)
    outward = np.flatnonzero(solid & (volume > 0.0))
    parts = []
    for k in np.flatnonzero(solid & (volume < 0.0)):
        holds = (low[outward] <= low[k]) & (high[outward] >= high[k])
        if not holds.all(axis=1).any():
            mask = np.zeros(len(sound), np.bool_)
            mask[np.flatnonzero(sound)[part == k]] = True
            parts.append(mask)
    return parts


def _closed(
    triangles: npt.NDArray[np.int64], part: npt.NDArray[np.uint32], count: int, vertices: int
) -> npt.NDArray[np.bool_]:
    """Which of `count` parts have two triangles at each edge, which name its ends in opposite order."""
    start, stop = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    walked, back = start * vertices + stop, stop * vertices + start
    once, edge, times = np.unique(walked, return_inverse=True, return_counts=True)
    open_edge = (times[edge] > 1) | ~np.isin(back, once)
    closed = np.ones(count, np.bool_)
    closed[np.repeat(part, 3)[open_edge]] = False
    return closed
