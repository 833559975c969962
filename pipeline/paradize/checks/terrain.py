"""Rules for the tiles of a terrain: they hold the patches of scene.json, and patches meet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.checks.rules import Finding
from paradize.errors import FormatError
from paradize.formats.glb.tiles import decode_tile
from paradize.formats.scene.manifest import read_entry
from paradize.kernels.mesh import project

_Ends = npt.NDArray[np.float32]
_Patch = tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]  # positions, triangles

_FROM_ABOVE = np.array([1, 0, 1], np.float32)
_ROUNDING = 1e-5  # of the height and side of the terrain: positions are float32


def check_tiles(manifest: dict[str, Any], folder: Path) -> Iterator[Finding]:
    """The findings in the tiles of a scene's terrain. Another rule reports files that cannot be read."""
    terrain = manifest["terrain"]
    if terrain is None:
        return
    rims: list[_Ends] = []
    patches: list[_Patch] = []
    counts = Counter(terrain["patches"]["tile"])  # patches of each tile, in the order of the tiles
    first, whole = 0, True
    for number, name in enumerate(terrain["tiles"]):
        entry = manifest["artifacts"][name]
        file = folder / entry["file"]
        row, first = first, first + counts[number]
        try:
            tile = decode_tile(read_entry(folder, entry), str(file))
        except (OSError, FormatError):
            whole = False
            continue
        for node, patch in enumerate(tile):
            wanted = _row(terrain["patches"], row + node) if node < counts[number] else None
            stored = (number, node, patch.index, patch.error_m, patch.finest)
            if wanted != stored:
                what = f"(tile, node, patch, error, finest) is {stored} where scene.json says {wanted}"
                yield Finding("PZ404", str(file), what, f"node {node}")
                whole = False
                break
            rims.append(_rim(patch.mesh.positions, patch.mesh.triangles))
            patches.append((patch.mesh.positions, patch.mesh.triangles))
        else:
            if len(tile) != counts[number]:
                what = f"it holds {len(tile)} patches, not {counts[number]}"
                yield Finding("PZ404", str(file), what, "terrain.patches")
                whole = False
    if not whole:
        return
    yield from _cracks(terrain, rims, folder)
    yield from _bound(terrain, patches, folder)


def _row(patches: dict[str, Any], row: int) -> tuple[int, int, int, float, bool]:
    numbers = (patches["tile"][row], patches["node"][row], row, patches["error_m"][row])
    return (*numbers, patches["diamond"][row] < 0)


def _rim(positions: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32]) -> _Ends:
    """The edges of only one triangle: (n, 2, 3) float32, their ends."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges.sort(axis=1)
    single, count = np.unique(edges, axis=0, return_counts=True)
    ends: _Ends = positions[single[count == 1]]
    return ends


def _cracks(terrain: dict[str, Any], rims: list[_Ends], folder: Path) -> Iterator[Finding]:
    """Patches that do not meet at some level: edges of only one patch, away from the rim of the terrain."""
    ends = np.concatenate(rims) + np.float32(0.0)  # -0 becomes 0
    _, place = np.unique(ends.reshape(-1, 3), axis=0, return_inverse=True)
    pairs = np.sort(place.reshape(-1, 2), axis=1).astype(np.int64)
    edges = pairs[:, 0] << 32 | pairs[:, 1]
    owner = np.repeat(np.arange(len(rims)), [len(rim) for rim in rims])
    half = 0.5 * np.array(terrain["size_m"])
    outer = np.zeros(len(edges), bool)
    for axis, reach in ((0, half[0]), (2, half[1])):
        line = np.abs(ends[:, :, axis])
        outer |= (line >= reach * (1.0 - 1e-6)).all(axis=1) & (ends[:, 0, axis] == ends[:, 1, axis])
    for level in range(max(terrain["patches"]["level"]) + 1):
        here = _drawn(terrain, level)[owner]
        _, first, count = np.unique(edges[here], return_index=True, return_counts=True)
        alone = np.flatnonzero(here)[first[count == 1]]
        alone = alone[~outer[alone]]
        if len(alone):
            what = f"at level {level} patch {owner[alone[0]]} does not meet its neighbour"
            where = ", ".join(f"{x:.6g}" for x in ends[alone[0], 0])
            yield Finding("PZ405", str(folder), what, f"({where})", len(alone))


def _drawn(terrain: dict[str, Any], level: int) -> npt.NDArray[np.bool_]:
    """(patches,): the patches that are drawn when every diamond above a level is split."""
    made_by, diamond = (np.array(terrain["patches"][key], np.int64) for key in ("made_by", "diamond"))
    # The last entry stands for no diamond, -1.
    split = np.append(np.array(terrain["diamonds"]["level"], np.int64) < level, False)
    return np.asarray(((made_by < 0) | split[made_by]) & ~split[diamond])


def _bound(terrain: dict[str, Any], patches: list[_Patch], folder: Path) -> Iterator[Finding]:
    """Patches that lie farther from the finest patches than the errors of both allow. Each level is compared
    at the vertices of the finest patches, seen from above."""
    errors = np.array(terrain["patches"]["error_m"], np.float64)
    finest = np.flatnonzero(np.array(terrain["patches"]["diamond"], np.int64) < 0)
    truth, owner = _joined(patches, finest)
    slack = _ROUNDING * (float(np.ptp(truth[0][:, 1])) + max(terrain["size_m"]))
    for level in range(max(terrain["patches"]["level"])):
        coarse, of_triangle = _joined(patches, np.flatnonzero(_drawn(terrain, level)))
        flat, own = (positions * _FROM_ABOVE for positions in (coarse[0], truth[0]))
        if not np.abs(flat).max() > 0.0:
            return
        charts = np.zeros(len(coarse[1]), np.uint32)
        hit, weights = project(flat, coarse[1], charts, own, truth[1])
        heights = coarse[0][coarse[1][hit], 1].astype(np.float64)
        places = coarse[0][coarse[1][hit]].astype(np.float64)
        at = truth[1].reshape(-1)
        beside = np.abs((places * weights[:, :, None]).sum(axis=1) - truth[0][at])[:, [0, 2]].max(axis=1)
        apart = np.abs((heights * weights).sum(axis=1) - truth[0][at, 1])
        allowed = errors[of_triangle[hit]] + np.repeat(errors[owner], 3) + slack
        bad = (beside <= slack) & (apart > allowed)
        if bad.any():
            worst = int(np.where(bad, apart - allowed, -np.inf).argmax())
            patch, other = int(of_triangle[hit[worst]]), int(np.repeat(owner, 3)[worst])
            what = f"patch {patch} lies {apart[worst]:.4g} m from patch {other}, "
            what += f"their errors allow {allowed[worst]:.4g} m"
            where = ", ".join(f"{x:.6g}" for x in truth[0][at[worst]])
            yield Finding("PZ413", str(folder), what, f"({where})", int(bad.sum()))
            return


def _joined(patches: list[_Patch], which: npt.NDArray[np.intp]) -> tuple[_Patch, npt.NDArray[np.intp]]:
    """Some patches as one mesh, and the patch of each triangle."""
    count, positions, triangles = 0, [], []
    for k in which:
        positions.append(patches[k][0])
        triangles.append(patches[k][1].astype(np.uint32) + np.uint32(count))
        count += len(patches[k][0])
    owner = np.repeat(which, [len(patches[k][1]) for k in which])
    return (np.concatenate(positions), np.concatenate(triangles)), owner
