"""Rules over a terrain's tiles: they hold the patches that scene.json tells of, and patches meet."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.check.files import read_file
from paradize.check.rules import Finding
from paradize.errors import FormatError
from paradize.formats.glb_tiles import decode_tile

_Ends = npt.NDArray[np.float32]


def check_tiles(manifest: dict[str, Any], folder: Path) -> Iterator[Finding]:
    """The findings in the tiles of a scene's terrain; files that cannot be read are told elsewhere."""
    terrain = manifest["terrain"]
    if terrain is None:
        return
    rims: list[_Ends] = []
    for number, name in enumerate(terrain["tiles"]):
        file = folder / manifest["artifacts"][name]["file"]
        try:
            tile = decode_tile(read_file(file), str(file))
        except (OSError, FormatError):
            return
        for node, patch in enumerate(tile):
            row = len(rims)
            wanted = _row(terrain["patches"], row)
            found = (number, node, patch.index, patch.error_m, patch.finest)
            if wanted != found:
                what = f"(tile, node, patch, error, finest) is {found} where scene.json says {wanted}"
                yield Finding("PZ404", str(file), what, f"node {node}")
                return
            rims.append(_rim(patch.mesh.positions, patch.mesh.triangles))
    if len(rims) != len(terrain["patches"]["level"]):
        what = f"the tiles hold {len(rims)} patches of {len(terrain['patches']['level'])}"
        yield Finding("PZ404", str(folder), what, "terrain.patches")
        return
    yield from _cracks(terrain, rims, folder)


def _row(patches: dict[str, Any], row: int) -> tuple[int, int, int, float, bool] | None:
    if row >= len(patches["level"]):
        return None
    numbers = (patches["tile"][row], patches["node"][row], row, patches["error_m"][row])
    return (*numbers, patches["diamond"][row] < 0)


def _rim(positions: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32]) -> _Ends:
    """The edges that one triangle has alone: (n, 2, 3) float32, their ends."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges.sort(axis=1)
    single, count = np.unique(edges, axis=0, return_counts=True)
    ends: _Ends = positions[single[count == 1]]
    return ends


def _cracks(terrain: dict[str, Any], rims: list[_Ends], folder: Path) -> Iterator[Finding]:
    """Patches of the cut at each level that do not meet: edges of one patch alone, off the terrain's rim."""
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
    levels = np.array(terrain["diamonds"]["level"])
    made_by, diamond = (np.array(terrain["patches"][key]) for key in ("made_by", "diamond"))
    for level in range(max(terrain["patches"]["level"]) + 1):
        split = np.append(levels < level, False)  # the last stands for none: -1
        drawn = ((made_by < 0) | split[made_by]) & ~split[diamond]
        here = drawn[owner]
        _, first, count = np.unique(edges[here], return_index=True, return_counts=True)
        alone = np.flatnonzero(here)[first[count == 1]]
        alone = alone[~outer[alone]]
        if len(alone):
            what = f"at level {level} patch {owner[alone[0]]} does not meet its neighbour"
            where = ", ".join(f"{x:.6g}" for x in ends[alone[0], 0])
            yield Finding("PZ405", str(folder), what, f"({where})", len(alone))
