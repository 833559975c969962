"""The error of normals of a level of detail as lighting sees it, against the original surface.

Two surfaces can be close and still be lit differently. At dense samples of both, the level's normal is
compared with the original's at the nearest place: the interpolated vertex normal, and the normal of a normal
map in each surface's own tangent frame, so that wrong frames and texture coordinates count as well. The
kernel is not imported by any stage (`reference/places.hpp`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.kernels.reference import Shading, Surface
from paradize.material import REPEATED, Wrap
from paradize.metrics.surface import Original

if TYPE_CHECKING:
    import numpy.typing as npt

SAMPLES = 50_000
# The opposite side of a thin part may be nearer than the matching side by this share of the diagonal, plus
# the distance of the two surfaces. Example: a plank that became a sheet, whose two sides coincide.
_MAX_OVERLAP = 1e-3


def _six_digits(value: float) -> float:
    """Rounds to six digits; rounding errors of float64 become 0."""
    return float(f"{value:.6g}") if value > 1e-9 else 0.0


def normal_error(
    original: Mesh | Original,
    level: Mesh,
    samples: int = SAMPLES,
    *,
    surface_error: float | None = None,
    normal_map: npt.NDArray[np.float32] | None = None,
    wrap: tuple[Wrap, Wrap] = REPEATED,
) -> dict[str, float]:
    """normal_mean_deg, normal_p99_deg and normal_max_deg over the area, each the larger of both directions.
    With a normal map also mapped_mean_deg, mapped_p99_deg and mapped_max_deg of the mapped normals.

    original, level: meshes with normals. normal_map: (h, w, 3) unit vectors in tangent space, green up; a
    mesh without tangents or UVs shows it flat. wrap: of its sampler, along u and v. samples: approximate
    number in each direction; each triangle has at least four. surface_error: the level's error_max, if known
    (default: measured). All 0 where a mesh has no normals. The maximum is that of the samples, not a bound.
    Six digits.
    """
    reference = original if isinstance(original, Original) else Original(original)
    names = ("normal",) if normal_map is None else ("normal", "mapped")
    if reference.mesh.normals is None or level.normals is None:
        return {f"{name}_{key}_deg": 0.0 for name in names for key in ("mean", "p99", "max")}
    reference_shading = _shading_of(reference.mesh, reference.surface)
    level_shading = _shading_of(level, reference.surface_of(level))
    if surface_error is None:
        surface_error = reference.distance(level, samples)["error_max"]
    near = (_MAX_OVERLAP + surface_error) * reference.diagonal_m
    both = [
        a.angles_to(b, near=near, samples=samples, normal_map=normal_map, wrap=wrap)
        for a, b in ((level_shading, reference_shading), (reference_shading, level_shading))
    ]
    return {
        f"{name}_{key}_deg": _six_digits(max(pair))
        for name, forward, backward in zip(names, *both, strict=False)
        for key, pair in zip(("mean", "p99", "max"), zip(forward, backward, strict=True), strict=True)
    }


def uv_shift(original: Mesh | Original, level: Mesh, samples: int = SAMPLES) -> dict[str, float]:
    """uv_shift_p99, uv_shift_max: distance on the surface, as a fraction of the diagonal, between the places
    at which level and original show the same point of the texture. 0 without UVs. The maximum is that of the
    samples, not a bound. Six digits."""
    reference = original if isinstance(original, Original) else Original(original)
    if reference.mesh.uvs is None or level.uvs is None or not reference.diagonal_m > 0:
        return {"uv_shift_p99": 0.0, "uv_shift_max": 0.0}
    flat = reference.mesh.uvs[reference.mesh.triangles.reshape(-1)].astype(np.float64)
    extent = float((flat.max(axis=0) - flat.min(axis=0)).max())
    # A shift across the whole UV extent counts as the diagonal.
    unit = reference.diagonal_m / extent if extent > 0 else 0.0
    unit = unit if np.isfinite(unit) else 0.0
    distances = _shading_of(level, reference.surface_of(level)).shift_from(
        _shading_of(reference.mesh, reference.surface),
        unit=unit,
        samples=samples,
    )
    p99, largest = (value / reference.diagonal_m for value in distances[1:])
    return {"uv_shift_p99": _six_digits(p99), "uv_shift_max": _six_digits(largest)}


def _shading_of(mesh: Mesh, surface: Surface) -> Shading:
    """The shading of a mesh; zeros for missing normals, which uv_shift does not need."""
    normals = np.zeros_like(mesh.positions) if mesh.normals is None else mesh.normals
    return Shading(surface, normals, mesh.tangents, mesh.uvs, mesh.triangles)
