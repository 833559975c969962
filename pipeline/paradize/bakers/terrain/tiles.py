"""Bakes a heightmap into GLB tiles of patches, as fine as a flight needs, and the tables for scene.json.

Tiles are written to a folder as they fill, so that memory does not limit the size of a terrain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.bakers.terrain.grow import Grower
from paradize.bakers.terrain.mesh import height_map_of
from paradize.bakers.terrain.tree import Patch, Tree, columns_of, rounded_up
from paradize.data import Heightfield
from paradize.errors import BakeError
from paradize.formats.glb.tiles import TilePatch, encode_tiles
from paradize.jobs.progress import report_step
from paradize.scene.baker_settings import TileSettings
from paradize.stages.terrain_tree import Blocks
from paradize.store.atomic import write_whole
from paradize.tiers import TIERS
from paradize.visibility.query import plan_query


@dataclass(frozen=True)
class Tile:
    """file: its GLB. errors: vertical metres, of all its patches, and of those of the finest level if it
    has some. first_s: when one of its patches is first shown, seconds."""

    file: Path
    errors: dict[str, float]
    first_s: float


@dataclass(frozen=True)
class TilesProduct:
    """tables: `patches`, `diamonds`, `demand`, `height_range_m` and perhaps `floor` of scene.json."""

    tiles: list[Tile]
    tables: dict[str, Any]
    tier: str
    warnings: list[str]


def bake_tiles(path: Path, scratch: Path, settings: TileSettings, *, tier: str = "balanced") -> TilesProduct:
    """Bakes the heightmap at `path` into tiles in the folder `scratch`. Raises SourceError for a picture
    that is not a heightmap, BakeError if the bound cannot be held."""
    if tier not in TIERS:
        raise ValueError(f"no tier {tier!r}")
    report_step("reading")
    heightfield, warnings = height_map_of(path, settings)
    flight_views = settings.flight_views
    try:
        grower = Grower(
            heightfield,
            max_error_m=0.0 if tier == "exact" else settings.max_error_m,
            leaf_px=settings.patch_px,
            sand_repeat=settings.sand_repeat,
            query=None if flight_views is None else plan_query(flight_views),
            quantise=settings.quantise,
        )
        report_step("patches")
        tree = grower.grow()
    except BakeError as error:
        raise BakeError(error.what, file=path, place=error.place, mend=error.mend) from None
    report_step("writing")
    limit = round(settings.tile_mb * 1e6)
    tiles, tile_of, node_of = _write(grower, tree, scratch, limit, settings.tangents)
    finest = tree.patches[-1].level
    tables = columns_of(tree, tile_of, node_of) | {
        "demand": {
            "finest_level": finest,
            "finest_s": tree.needed_s,
            "left_out": tree.left_out,
            "left_out_bytes": tree.left_out_bytes,
        },
        "height_range_m": [float(grower.blocks.low.min()), float(grower.blocks.high.max())],
    }
    if settings.floor_cells:
        tables["floor"] = floor_of(heightfield, settings.floor_cells)
    return TilesProduct(tiles, tables, tier, warnings)


def floor_of(heightfield: Heightfield, most_cells: int) -> dict[str, Any]:
    """The highest ground in each cell of a grid, borders included, rounded up to 0.1 m. Water is nowhere in
    a cell shallower than above it. Cells are squares of pixels; the last of a row or column may be cut."""
    rows, columns = heightfield.heights_m.shape
    side = -(-(max(rows, columns) - 1) // most_cells)
    high = Blocks.of(heightfield.heights_m, side).high
    step_x_m, step_z_m = heightfield.size_x_m / (columns - 1), heightfield.size_z_m / (rows - 1)
    return {
        "columns": high.shape[1],
        "cell_m": [side * step_x_m, side * step_z_m],
        "highest_m": [float(tenths) / 10.0 for tenths in np.ceil(high.ravel().astype(np.float64) * 10.0)],
    }


def _write(
    grower: Grower, tree: Tree, scratch: Path, limit: int, tangents: bool
) -> tuple[list[Tile], list[int], list[int]]:
    """Returns the tiles, and for each patch its tile and its node there."""
    tiles: list[Tile] = []
    tile_of: list[int] = []
    node_of: list[int] = []
    for data, indices in encode_tiles(_patches(grower, tree, tangents), limit):
        file = scratch / f"tile{len(tiles)}.glb"
        write_whole(file, data, durable=False, option="PARADIZE_STORE")
        patches = [tree.patches[index] for index in indices]
        tile_of += [len(tiles)] * len(patches)
        node_of += range(len(patches))
        tiles.append(
            Tile(file, _errors(patches, grower.shape.finest), min(patch.first_s for patch in patches))
        )
    return tiles, tile_of, node_of


def _patches(grower: Grower, tree: Tree, tangents: bool) -> Iterator[TilePatch]:
    for index, patch in enumerate(tree.patches):
        mesh = grower.mesh(patch)
        mesh = mesh if tangents else replace(mesh, tangents=None)
        yield TilePatch(index, mesh, patch.reported_error_m, patch.diamond is None, grower.quantised(mesh))


def _errors(patches: list[Patch], finest: int) -> dict[str, float]:
    errors = {"terrain_tile_max_m": max(patch.reported_error_m for patch in patches)}
    known = [(patch.error, patch.area_px) for patch in patches if patch.level == finest and patch.error]
    if not known:
        return errors
    squares = area = 0.0
    for error, size in known:
        squares += error.rms_m * error.rms_m * size
        area += size
    largest = max(error.max_m for error, _ in known)
    rms = rounded_up(float(np.sqrt(squares / area)))
    return {"terrain_max_m": rounded_up(largest), "terrain_rms_m": rms} | errors
