"""Levels of a mesh, or a terrain's mesh -> the same with codes instead of floats, and what that cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from paradize.data import Lod, Mesh, QuantizationGrid, QuantizedValues, rounded_down, rounded_up
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.quantized import decoded_mesh
from paradize.metrics.quantised import quantised_errors
from paradize.stages.quantise import (
    DIRECTION_DEG,
    direction_bits,
    mesh_lattice,
    quantise,
    quantise_levels,
    terrain_lattice,
)

__all__ = ["DIRECTION_DEG", "direction_deg_of", "quantised_levels", "quantised_terrain", "terrain_lattice"]


def direction_deg_of(budget: Mapping[str, float]) -> float:
    """The largest angle that codes may turn a direction by: what a scene accepts, else DIRECTION_DEG."""
    told = [budget[key] for key in ("quantise_normal_max_deg", "quantise_tangent_max_deg") if key in budget]
    return min(told, default=DIRECTION_DEG)


def quantised_levels(lods: Sequence[Lod], *, direction_deg: float = DIRECTION_DEG) -> tuple[Lod, ...]:
    """The levels with codes of one lattice. Their errors hold what metrics/quantised.py finds in the file's
    bytes; its largest way of a vertex is added to every level's error_max and error_rms, which bounds what
    codes do to the surface. Raises BakeError where the mesh is too small for codes."""
    meshes = [lod.mesh for lod in lods]
    codes = quantise_levels(meshes, mesh_lattice(meshes), direction_deg=direction_deg)
    coded = [replace(lod, quantized=code) for lod, code in zip(lods, codes, strict=True)]
    found = quantised_errors(encode_glb(coded, "measured"), meshes)
    most = max(errors["quantise_max"] for errors in found)
    return tuple(
        replace(
            lod,
            error_max=rounded_up(lod.error_max + most),
            error_rms=rounded_up(lod.error_rms + most),
            errors={**lod.errors, **_lower(lod, most), **errors},
        )
        for lod, errors in zip(coded, found, strict=True)
    )


def _lower(lod: Lod, most: float) -> dict[str, float]:
    """What is left of the distance's lower bound where the surface moved by `most`."""
    lower = lod.errors.get("error_max_lower")
    return {} if lower is None else {"error_max_lower": rounded_down(max(0.0, lower - most))}


def quantised_terrain(mesh: Mesh, lattice: QuantizationGrid) -> tuple[Mesh, QuantizedValues]:
    """A terrain's mesh, or a part's, as a reader sees its codes, and these. A vertex that two parts share has
    the same codes in both."""
    codes = quantise(mesh, lattice, direction_bits=direction_bits(lattice))
    return decoded_mesh(mesh, codes), codes
