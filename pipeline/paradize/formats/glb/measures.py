"""Measures of a material that a player needs before it loads the mesh: where its triangles are, and how large
its textures lie on them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Lod, rounded
from paradize.vectors import doubled_areas, doubled_areas_2d

_STRETCHED_SHARE = 0.05
MAX_UV_PER_M = 1e30  # the player refuses more


def material_measures(coarsest: Lod) -> dict[str, dict[str, Any]]:
    """The `extras` of each material that this level draws, by name.

    center: the middle of the box of the material's triangles, in the units in which the file stores
    positions. uv_per_m, uv1_per_m (only with uvs, uvs1): texture coordinates per metre where they are
    stretched, so that a twentieth of the area has fewer; 0 without area, at most 1e30. Six digits.
    """
    stored = coarsest.mesh if coarsest.quantised is None else coarsest.quantised
    step = np.array((1.0, 1.0, 1.0) if coarsest.quantised is None else coarsest.quantised.grid.step)
    uv_sets = {"uv_per_m": stored.uvs, "uv1_per_m": stored.uvs1}
    out: dict[str, dict[str, Any]] = {}
    for material in dict.fromkeys(group.material for group in coarsest.mesh.all_groups):
        triangles = np.concatenate(
            [
                coarsest.mesh.triangles[group.first : group.first + group.count]
                for group in coarsest.mesh.all_groups
                if group.material == material
            ]
        )
        corners = stored.positions[triangles].astype(np.float64)
        low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        areas = doubled_areas(corners * step)
        extras: dict[str, Any] = {"center": [rounded(float(x)) for x in (low + high) / 2.0]}
        for key, uvs in uv_sets.items():
            if uvs is not None:
                unit = 1.0 if uvs.dtype == np.float32 else 1.0 / 65535.0
                extras[key] = rounded(_stretched(areas, _uv_areas(uvs[triangles].astype(np.float64) * unit)))
        out[material] = extras
    return out


def measured_entries(entries: Iterable[Mapping[str, Any]], coarsest: Lod) -> list[dict[str, Any]]:
    """The entries of `materials` with these extras; without any where this level does not draw the
    material."""
    measures = material_measures(coarsest)
    bare = [{key: value for key, value in entry.items() if key != "extras"} for entry in entries]
    return [
        entry | ({"extras": measures[entry["name"]]} if entry["name"] in measures else {}) for entry in bare
    ]


def _uv_areas(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Twice the area of triangles (n, 3, 2) in the texture."""
    return np.asarray(np.abs(doubled_areas_2d(corners)))


def _stretched(areas: npt.NDArray[np.float64], uv_areas: npt.NDArray[np.float64]) -> float:
    """Texture coordinates per metre that triangles with a share of the area do not exceed."""
    kept = areas > 0.0
    if not kept.any():
        return 0.0
    areas = areas[kept]
    with np.errstate(over="ignore"):
        densities = uv_areas[kept] / areas
    order = np.argsort(densities, kind="stable")
    sums = np.cumsum(areas[order])
    at = int(np.searchsorted(sums, _STRETCHED_SHARE * sums[-1]))
    return min(float(np.sqrt(densities[order[at]])), MAX_UV_PER_M)
