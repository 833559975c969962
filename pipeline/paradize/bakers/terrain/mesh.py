"""Bakes a heightmap into a GLB of the terrain, with its measured error."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from paradize.bakers.quantise import quantised_terrain, terrain_grid
from paradize.data import Heightfield, Lod, QuantisationGrid
from paradize.errors import BakeError
from paradize.formats.glb.encode import encode_glb
from paradize.jobs.progress import report_step
from paradize.metrics.quantised import quantised_errors
from paradize.metrics.terrain import TerrainError, terrain_error
from paradize.readers.heightmap import read_heightmap
from paradize.scene.baker_settings import TerrainSettings
from paradize.stages.terrain import terrain_mesh
from paradize.tiers import TIERS

TRIES = 6


@dataclass(frozen=True)
class TerrainProduct:
    """glb: one node at one level. bound_m: what was asked for, vertical metres. max_error_m, rms_error_m:
    vertical metres, measured at every pixel, of the codes where there are such. quantisation_errors: what
    they cost by themselves, as metrics/quantised.py names it."""

    glb: bytes
    triangles: int
    vertices: int
    bound_m: float
    max_error_m: float
    rms_error_m: float
    tier: str
    warnings: list[str]
    quantisation_errors: dict[str, float] = field(default_factory=dict)


def bake_terrain(path: Path, settings: TerrainSettings, *, tier: str = "balanced") -> TerrainProduct:
    """Bakes the heightmap at `path`; no pixel is farther than the settings' max_error_m from the mesh.

    tier: "fast", "balanced" or "exact"; the product says which was used. Raises SourceError for a picture
    that is not a heightmap, BakeError when the bound cannot be held (finer than float32 positions at that
    slope, or than 16-bit heights).
    """
    report_step("reading")
    heightfield, warnings = height_map_of(path, settings)
    max_error_m = settings.max_error_m
    if max_error_m is None:
        max_error_m = _default_bound_m(heightfield, settings)
    if tier not in TIERS:
        raise ValueError(f"no tier {tier!r}")
    used = tier
    grid = _grid(heightfield, max_error_m) if settings.quantise else None
    reached = "float32 positions" if grid is None else "16-bit positions"
    tolerance = max_error_m
    if grid is not None:
        tolerance = max(0.0, tolerance - 0.5 * grid.step[1])
    if tolerance == 0.0:
        used = "exact"
    every_pixel = False
    for _ in range(TRIES + 1):
        way = "grid" if every_pixel else used
        report_step("triangles")
        source = mesh = terrain_mesh(
            heightfield, tolerance_m=tolerance, sand_repeat=settings.sand_repeat, tier=way
        )
        quantised = None
        if grid is not None:
            mesh, quantised = quantised_terrain(source, grid)
        report_step("measuring")
        error = terrain_error(mesh, heightfield)
        _require_whole(error, path)
        if error.max_m <= max_error_m or every_pixel or (used == "exact" and max_error_m == 0.0):
            break
        if used == "exact":
            every_pixel = True  # where positions are rounded, more of them may be nearer
            continue
        # Positions are float32: on a steep slope their rounding can cost a little of the bound.
        tolerance -= 4.0 * (error.max_m - max_error_m)
        if tolerance <= 0.0:
            tolerance, used = 0.0, "exact"
    if error.max_m > max_error_m and (max_error_m > 0.0 or grid is not None):
        row, column = error.worst
        raise BakeError(
            f"the error is {error.max_m:.6g} m, allowed {max_error_m:.6g} m: {reached} reach no less",
            file=path,
            place=f"pixel ({column}, {row})",
            mend="allow a larger error, or a smaller terrain"
            + ("" if quantised is None else ", or keep floats"),
        )
    report_step("writing")
    diagonal = _diagonal(mesh.positions)
    share = 1.0 / diagonal if diagonal > 0.0 else 0.0
    lod = Lod(mesh, error_max=error.max_m * share, error_rms=error.rms_m * share, quantised=quantised)
    cost: dict[str, float] = {}
    if quantised is not None:
        cost = quantised_errors(encode_glb([lod], "terrain"), [source])[0]
        lod = replace(lod, errors=cost)
    return TerrainProduct(
        glb=encode_glb([lod], "terrain"),
        triangles=len(mesh.triangles),
        vertices=len(mesh.positions),
        bound_m=max_error_m,
        max_error_m=_six(error.max_m),
        rms_error_m=_six(error.rms_m),
        tier=used,
        warnings=warnings,
        quantisation_errors=cost,
    )


def _default_bound_m(heightfield: Heightfield, settings: TerrainSettings) -> float:
    """At least a step of the source: two pixels of a slope may be off by half a step each."""
    step_m = 1.0001 * heightfield.step_m  # heights are rounded to float32
    if settings.height_m is None or not step_m or settings.encoding != "grey":
        return max(float(np.ptp(heightfield.heights_m)) / 1000.0, step_m) or 0.001
    return max(abs(settings.height_m * settings.height_scale) / 1000.0, step_m)


def height_map_of(path: Path, settings: TerrainSettings) -> tuple[Heightfield, list[str]]:
    """The heightmap as the settings say, in metres, and warnings. Raises SourceError."""
    return read_heightmap(
        path,
        size_x_m=settings.size_m[0],
        size_z_m=settings.size_m[1],
        height_m=settings.height_m,
        base_m=settings.base_m,
        height_scale=settings.height_scale,
        nodata=settings.nodata,
        encoding=settings.encoding,
    )


def _grid(heightfield: Heightfield, max_error_m: float) -> QuantisationGrid:
    heights = heightfield.heights_m
    return terrain_grid(
        (heights.shape[0], heights.shape[1]),
        (heightfield.size_x_m, heightfield.size_z_m),
        (float(heights.min()), float(heights.max())),
        max_error_m,
    )


def _require_whole(error: TerrainError, path: Path) -> None:
    if error.holes or error.flipped:
        raise BakeError(
            f"the mesh misses {error.holes} pixels and has {error.flipped} triangles that do not face up; "
            "neighbouring pixels fall on one float32 position",
            file=path,
            mend="give the terrain a larger size, or the heightmap fewer pixels",
        )


def _diagonal(positions: npt.NDArray[np.float32]) -> float:
    size = positions.max(axis=0).astype(np.float64) - positions.min(axis=0).astype(np.float64)
    return float(np.sqrt(size[0] * size[0] + size[1] * size[1] + size[2] * size[2]))


def _six(value: float) -> float:
    """Six significant digits, rounded up: the error that an artifact claims is never less than measured."""
    rounded = float(f"{value:.5e}")
    return rounded if rounded >= value else float(f"{value * (1.0 + 1e-5):.5e}")
