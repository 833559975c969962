"""Quantises the levels of a mesh, or a terrain's mesh, and measures the error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from paradize.data import Lod, Mesh, QuantisationGrid, QuantisedValues, rounded_down, rounded_up
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.quantised import decoded_mesh
from paradize.metrics.quantised import quantised_errors
from paradize.stages.quantise import (
    DIRECTION_DEG,
    direction_bits,
    mesh_grid,
    quantise,
    quantise_levels,
    terrain_grid,
)

__all__ = ["DIRECTION_DEG", "direction_deg_of", "quantised_levels", "quantised_terrain", "terrain_grid"]


def direction_deg_of(budget: Mapping[str, float]) -> float:
    """Returns the largest angle by which quantisation may turn a direction: the budget's, else
    DIRECTION_DEG."""
    limits = [budget[key] for key in ("quantise_normal_max_deg", "quantise_tangent_max_deg") if key in budget]
    return min(limits, default=DIRECTION_DEG)


def quantised_levels(lods: Sequence[Lod], *, direction_deg: float = DIRECTION_DEG) -> tuple[Lod, ...]:
    """Returns the levels quantised to one grid. Their errors hold what metrics/quantised.py measures in
    the file's bytes. The largest move of a vertex is added to every level's error_max and error_rms; that
    bounds the change of the surface. Raises BakeError if the mesh is too small."""
    meshes = [lod.mesh for lod in lods]
    quantised = quantise_levels(meshes, mesh_grid(meshes), direction_deg=direction_deg)
    quantised_lods = [replace(lod, quantised=values) for lod, values in zip(lods, quantised, strict=True)]
    errors_by_level = quantised_errors(encode_glb(quantised_lods, "measured"), meshes)
    most = max(errors["quantise_max"] for errors in errors_by_level)
    return tuple(
        replace(
            lod,
            error_max=rounded_up(lod.error_max + most),
            error_rms=rounded_up(lod.error_rms + most),
            errors={**lod.errors, **_lower(lod, most), **errors},
        )
        for lod, errors in zip(quantised_lods, errors_by_level, strict=True)
    )


def _lower(lod: Lod, most: float) -> dict[str, float]:
    """Returns what is left of the distance's lower bound after the surface moved by `most`."""
    lower = lod.errors.get("error_max_lower")
    return {} if lower is None else {"error_max_lower": rounded_down(max(0.0, lower - most))}


def quantised_terrain(mesh: Mesh, grid: QuantisationGrid) -> tuple[Mesh, QuantisedValues]:
    """Returns a terrain's mesh, or a part of it, as a reader decodes it, and the quantised values. A
    vertex that two parts share has the same values in both."""
    quantised = quantise(mesh, grid, direction_bits=direction_bits(grid))
    return decoded_mesh(mesh, quantised), quantised
