"""The error of normals after mapping: what light sees of a level of detail, against the original surface.

Two surfaces can lie close together and yet be lit differently. At dense samples of both, the normal that
the level shows is compared with the one that the original shows at the same place: interpolated from the
vertices, and with a normal map turned by it in the tangent frame of each surface, so that frames and texture
coordinates that went astray count too. Measured by a kernel that no stage imports (`reference/places.hpp`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Mesh
from paradize.kernels.reference import Shading, Surface
from paradize.metrics.surface import Judge

if TYPE_CHECKING:
    import numpy.typing as npt

SAMPLES = 50_000
# A sheet's other side, or a wall's, may lie this share of the diagonal nearer than the side that is meant,
# besides what the two surfaces lie apart: where a plank became a sheet, its underside lies on the top that
# was, and is the underside all the same.
_NEAR = 1e-3


def _told(value: float) -> float:
    """Six digits; what float64 alone left is 0."""
    return float(f"{value:.6g}") if value > 1e-9 else 0.0


def normal_error(
    original: Mesh | Judge,
    level: Mesh,
    samples: int = SAMPLES,
    *,
    apart: float | None = None,
    normal_map: npt.NDArray[np.float32] | None = None,
    repeat: bool = True,
) -> dict[str, float]:
    """normal_mean_deg, normal_p99_deg and normal_max_deg, each the larger of both directions, over area; with
    a map mapped_mean_deg and so on too, of the normals that it turned, found in the same search.

    Meshes with normals; map: (h, w, 3) unit vectors of tangent space, green up; where a mesh lacks tangents
    or texture coordinates it turns nothing. samples: about how many each way, besides four or more in every
    triangle. apart: the level's error_max, where it is known (default: measured). All zero where a mesh has
    no normals. The largest is of samples, no bound. Rounded to six digits.
    """
    judge = original if isinstance(original, Judge) else Judge(original)
    names = ("normal",) if normal_map is None else ("normal", "mapped")
    if judge.mesh.normals is None or level.normals is None:
        return {f"{name}_{key}_deg": 0.0 for name in names for key in ("mean", "p99", "max")}
    truth = _shading_of(judge.mesh, judge.surface)
    seen = _shading_of(level, judge.surface_of(level))
    if apart is None:
        apart = judge.distance(level, samples)["error_max"]
    near = (_NEAR + apart) * judge.diagonal_m
    both = [
        a.angles_to(b, near=near, samples=samples, normal_map=normal_map, repeat=repeat)
        for a, b in ((seen, truth), (truth, seen))
    ]
    return {
        f"{name}_{key}_deg": _told(max(pair))
        for name, there, back in zip(names, *both, strict=False)
        for key, pair in zip(("mean", "p99", "max"), zip(there, back, strict=True), strict=True)
    }


def uv_shift(original: Mesh | Judge, level: Mesh, samples: int = SAMPLES) -> dict[str, float]:
    """uv_shift_p99 and uv_shift_max: the distance on the surface, as a fraction of the diagonal, between
    where the level shows a point of the texture and where the original shows it. Zero without texture
    coordinates. The largest is of samples, no bound. Rounded to six digits."""
    judge = original if isinstance(original, Judge) else Judge(original)
    if judge.mesh.uvs is None or level.uvs is None or not judge.diagonal_m > 0:
        return {"uv_shift_p99": 0.0, "uv_shift_max": 0.0}
    flat = judge.mesh.uvs[judge.mesh.triangles.reshape(-1)].astype(np.float64)
    spread = float((flat.max(axis=0) - flat.min(axis=0)).max())
    # The whole image counts as far as the surface is large.
    unit = judge.diagonal_m / spread if spread > 0 else 0.0
    found = _shading_of(level, judge.surface_of(level)).shift_from(
        _shading_of(judge.mesh, judge.surface), unit=unit if np.isfinite(unit) else 0.0, samples=samples
    )
    p99, largest = (value / judge.diagonal_m for value in found[1:])
    return {"uv_shift_p99": _told(p99), "uv_shift_max": _told(largest)}


def _shading_of(mesh: Mesh, surface: Surface) -> Shading:
    """The same for a mesh that may have no normals, which slid textures do not need."""
    normals = np.zeros_like(mesh.positions) if mesh.normals is None else mesh.normals
    return Shading(surface, normals, mesh.tangents, mesh.uvs, mesh.triangles)
