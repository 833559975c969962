"""A heightmap and what a flight asks of it -> GLB tiles of patches, and the tables that scene.json tells of
them.

Tiles are written into a folder as they fill, so that a terrain of any size is never held as meshes in memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.bakers.terrain.grow import Grower
from paradize.bakers.terrain.tree import Patch, Tree, columns_of, rounded_up
from paradize.errors import BakeError
from paradize.formats.glb.tiles import TilePatch, encode_tiles
from paradize.jobs.progress import report_step
from paradize.readers.heightmap import Nodata, read_heightmap
from paradize.store.atomic import write_whole
from paradize.visibility.query import plan_query

TIERS = ("fast", "balanced", "exact")
PATCH_PX = 128


@dataclass(frozen=True)
class Tile:
    """file: its GLB. errors: vertical metres, of all its patches, and of those of the finest level where it
    has some. first_s: the second of the flight that first shows one of its patches."""

    file: Path
    errors: dict[str, float]
    first_s: float


@dataclass(frozen=True)
class TilesProduct:
    """tables: `patches`, `diamonds`, `demand` and `height_range_m` as scene.json holds them."""

    tiles: list[Tile]
    tables: dict[str, Any]
    tier: str
    warnings: list[str]


def bake_tiles(
    path: Path,
    scratch: Path,
    *,
    size_x_m: float,
    size_z_m: float,
    height_m: float | None,
    base_m: float = 0.0,
    height_scale: float = 1.0,
    nodata: Nodata = "auto",
    max_error_m: float = 0.03,
    sand_repeat: float = 1.0,
    patch_px: int = PATCH_PX,
    tile_mb: float = 64.0,
    quantise: bool = False,
    tangents: bool = True,
    sight: dict[str, Any] | None = None,
    tier: str = "balanced",
) -> TilesProduct:
    """Bakes the heightmap at `path` into tiles in the folder `scratch`.

    max_error_m: vertical, of the finest level; tier "exact" makes it 0. patch_px: side of the finest cells,
    pixels. tile_mb: a tile's limit, megabytes, up to 64; a patch that is larger has a tile for itself.
    quantise: vertices as 16-bit codes of one lattice. tangents: whether anything reads them. sight: as
    query.plan_demand takes it; None: every patch is made. Raises SourceError for a picture that is no
    heightmap, BakeError when the bound cannot be held.
    """
    if tier not in TIERS:
        raise ValueError(f"no tier {tier!r}")
    report_step("reading")
    ground, warnings = read_heightmap(
        path,
        size_x_m=size_x_m,
        size_z_m=size_z_m,
        height_m=height_m,
        base_m=base_m,
        height_scale=height_scale,
        nodata=nodata,
    )
    try:
        grower = Grower(
            ground,
            max_error_m=0.0 if tier == "exact" else max_error_m,
            leaf_px=patch_px,
            sand_repeat=sand_repeat,
            demand=None if sight is None else plan_query(sight),
            quantise=quantise,
        )
        report_step("patches")
        tree = grower.grow()
    except BakeError as error:
        raise BakeError(error.what, file=path, place=error.place, mend=error.mend) from None
    report_step("writing")
    tiles, tile_of, node_of = _write(grower, tree, scratch, round(tile_mb * 1e6), tangents)
    finest = tree.patches[-1].level
    tables = columns_of(tree, tile_of, node_of) | {
        "demand": {
            "finest_level": finest,
            "finest_s": tree.asked_s,
            "left_out": tree.left_out,
            "left_out_bytes": tree.left_out_bytes,
        },
        "height_range_m": [float(grower.blocks.low.min()), float(grower.blocks.high.max())],
    }
    return TilesProduct(tiles, tables, tier, warnings)


def _write(
    grower: Grower, tree: Tree, scratch: Path, limit: int, tangents: bool
) -> tuple[list[Tile], list[int], list[int]]:
    """The tiles, and of each patch its tile and its node there."""
    tiles: list[Tile] = []
    tile_of: list[int] = []
    node_of: list[int] = []
    for data, indices in encode_tiles(_patches(grower, tree, tangents), limit):
        file = scratch / f"tile{len(tiles)}.glb"
        write_whole(file, data, durable=False)
        held = [tree.patches[index] for index in indices]
        tile_of += [len(tiles)] * len(held)
        node_of += range(len(held))
        tiles.append(Tile(file, _errors(held, grower.shape.finest), min(patch.first_s for patch in held)))
    return tiles, tile_of, node_of


def _patches(grower: Grower, tree: Tree, tangents: bool) -> Iterator[TilePatch]:
    for index, patch in enumerate(tree.patches):
        mesh = grower.mesh(patch)
        mesh = mesh if tangents else replace(mesh, tangents=None)
        yield TilePatch(index, mesh, patch.told_m, patch.diamond is None, grower.quantized(mesh))


def _errors(held: list[Patch], finest: int) -> dict[str, float]:
    told = {"terrain_tile_max_m": max(patch.told_m for patch in held)}
    known = [(patch.error, patch.area_px) for patch in held if patch.level == finest and patch.error]
    if not known:
        return told
    squares = area = 0.0
    for error, size in known:
        squares += error.rms_m * error.rms_m * size
        area += size
    largest = max(error.max_m for error, _ in known)
    rms = rounded_up(float(np.sqrt(squares / area)))
    return {"terrain_max_m": rounded_up(largest), "terrain_rms_m": rms} | told
