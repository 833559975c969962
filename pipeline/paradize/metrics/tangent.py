"""How sound tangent frames are: length, right angles, sign; and how far from MikkTSpace's, in degrees."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, six
from paradize.kernels.reference import angles_deg, mikktspace_tangents

# The reference takes about a microsecond a triangle: of larger meshes a part is measured.
_MOST_TRIANGLES = 50_000
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93], np.uint64)


def frame_faults(mesh: Mesh) -> dict[str, float]:
    """tangent_length: largest |1 - length|; tangent_lean_deg: largest angle that a tangent leans from the
    plane of its normal; tangent_sign: how many w are neither 1 nor -1. All 0 for perfect frames."""
    if mesh.tangents is None or mesh.normals is None:
        return {"tangent_length": 0.0, "tangent_lean_deg": 0.0, "tangent_sign": 0.0}
    t = mesh.tangents.astype(np.float64)
    length = np.sqrt(t[:, 0] * t[:, 0] + t[:, 1] * t[:, 1] + t[:, 2] * t[:, 2])
    lean = np.abs(90.0 - angles_deg(mesh.tangents[:, :3], mesh.normals))
    return {
        "tangent_length": six(float(np.abs(1.0 - length).max())),
        "tangent_lean_deg": six(float(lean.max())),
        "tangent_sign": float((np.abs(mesh.tangents[:, 3]) != 1).sum()),
    }


def frame_errors(
    mesh: Mesh,
    most: int = _MOST_TRIANGLES,
    *,
    counted: npt.NDArray[np.bool_] | None = None,
    truth: npt.NDArray[np.float32] | None = None,
) -> dict[str, float]:
    """Angle between each corner's tangent and the one that a float64 MikkTSpace gives it: tangent_max_deg,
    tangent_p99_deg, tangent_mean_deg; tangent_turned: share of the corners whose w is the other one. All 0
    without tangents.

    Corners of triangles without area in the image have no defined frame and are not counted. Of meshes with
    more than `most` triangles the corners of about most / 4 vertices, evenly spread, are: there the largest
    is of a sample, else of all corners. counted: (3 m,) the corners that count, of a mesh that is such a part
    itself (part_of); truth: (3 m, 4) its true_tangents, where they are known.
    """
    if mesh.tangents is None or mesh.normals is None or mesh.uvs is None:
        return _told(np.zeros(0), 0)
    triangles, measured = (mesh.triangles, counted.copy()) if counted is not None else _part(mesh, most)
    if truth is None:
        truth = true_tangents(replace(mesh, triangles=triangles, groups=()))
    measured &= np.repeat(_image_areas(mesh.uvs, triangles) > np.finfo(np.float32).tiny, 3)
    ours = mesh.tangents[triangles.reshape(-1)[measured]]
    truth = truth[measured]
    return _told(angles_deg(ours[:, :3], truth[:, :3]), int((ours[:, 3] != truth[:, 3]).sum()))


def true_tangents(mesh: Mesh) -> npt.NDArray[np.float32]:
    """(3 m, 4) tangents of every corner as MikkTSpace defines them, of a mesh with normals and uvs."""
    assert mesh.normals is not None and mesh.uvs is not None
    return mikktspace_tangents(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles).reshape(-1, 4)


def part_of(mesh: Mesh, most: int = _MOST_TRIANGLES) -> tuple[Mesh, npt.NDArray[np.bool_]]:
    """What frame_errors looks at of a mesh, as a mesh of about `most` triangles in one group; and which of
    its corners (3 m,) have all their neighbours there, so that frames made of the part are the whole's."""
    triangles, counted = _part(mesh, most)
    return replace(mesh, triangles=triangles, groups=()), counted


def _part(mesh: Mesh, most: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.bool_]]:
    """Triangles (m, 3) to hand to the reference, and which of their corners (3 m,) have all their neighbours
    there."""
    count = len(mesh.triangles)
    if count <= most:
        return mesh.triangles, np.ones(count * 3, np.bool_)
    # A place by 24 bits of its hash: those that share them are taken together, with all their triangles.
    bits = (mesh.positions + np.float32(0)).view(np.uint32).astype(np.uint64)
    mixed = (bits * _MIX[:3]).sum(axis=1, dtype=np.uint64)
    corners = ((mixed ^ (mixed >> np.uint64(32))) * _MIX[3] >> np.uint64(40))[mesh.triangles]
    # A vertex has about six triangles, one triangle's vertices have about thirteen.
    chosen = np.zeros(1 << 24, np.bool_)
    chosen[corners[np.arange(max(1, most // 13)) * count // max(1, most // 13)]] = True
    near = chosen[corners]
    kept = near.any(axis=1)
    return np.ascontiguousarray(mesh.triangles[kept]), near[kept].reshape(-1)


def _image_areas(uvs: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32]) -> npt.NDArray[np.float64]:
    a, b, c = (uvs[triangles[:, k]].astype(np.float64) for k in range(3))
    area: npt.NDArray[np.float64] = np.abs(
        (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    )
    return area


def _told(angles: npt.NDArray[np.float64], turned: int) -> dict[str, float]:
    count = max(1, len(angles))
    last = min(len(angles) - 1, math.ceil(0.99 * len(angles)))
    return {
        "tangent_max_deg": six(float(angles.max(initial=0.0))),
        "tangent_p99_deg": six(float(np.partition(angles, last)[last]) if len(angles) else 0.0),
        "tangent_mean_deg": six(math.fsum(angles.tolist()) / count),
        "tangent_turned": six(turned / count),
    }
