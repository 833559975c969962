"""Faults of tangent frames (length, right angle, sign) and their angles to MikkTSpace's tangents."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, rounded
from paradize.kernels.reference import angles_deg, mikktspace_tangents
from paradize.vectors import cross_2d, lengths

# The reference takes about 1 µs per triangle, so larger meshes are sampled.
_MAX_TRIANGLES = 50_000
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0xD6E8FEB86659FD93], np.uint64)


def frame_faults(mesh: Mesh) -> dict[str, float]:
    """tangent_length: largest |1 - length|. tangent_lean_deg: largest deviation from a right angle to the
    normal, degrees. tangent_sign: number of vertices whose w is neither 1 nor -1. All 0 for correct frames.
    """
    if mesh.tangents is None or mesh.normals is None:
        return {"tangent_length": 0.0, "tangent_lean_deg": 0.0, "tangent_sign": 0.0}
    length = lengths(mesh.tangents[:, :3].astype(np.float64))
    lean = np.abs(90.0 - angles_deg(mesh.tangents[:, :3], mesh.normals))
    return {
        "tangent_length": rounded(float(np.abs(1.0 - length).max())),
        "tangent_lean_deg": rounded(float(lean.max())),
        "tangent_sign": float((np.abs(mesh.tangents[:, 3]) != 1).sum()),
    }


def frame_errors(
    mesh: Mesh,
    max_triangles: int = _MAX_TRIANGLES,
    *,
    valid: npt.NDArray[np.bool_] | None = None,
    reference: npt.NDArray[np.float32] | None = None,
) -> dict[str, float]:
    """tangent_max_deg, tangent_p99_deg, tangent_mean_deg: angle between each corner's tangent and that of a
    float64 MikkTSpace. tangent_turned: share of the corners with the opposite w. All 0 without tangents.

    Corners of triangles without area in the texture have no defined frame and are not counted. Of meshes with
    more than max_triangles triangles the corners of about max_triangles / 4 evenly spread vertices are
    measured, and the maximum is that of the sample. valid: (3 m,) bool, the corners to count, for a mesh that
    is itself such a sample (sample_of). reference: (3 m, 4) its true_tangents, if known.
    """
    if mesh.tangents is None or mesh.normals is None or mesh.uvs is None:
        return _summary(np.zeros(0), 0)
    mesh, _ = mesh.laid_out_for_frames()
    assert mesh.tangents is not None and mesh.uvs is not None
    triangles, counted = (mesh.triangles, valid.copy()) if valid is not None else _sample(mesh, max_triangles)
    if reference is None:
        reference = true_tangents(replace(mesh, triangles=triangles, groups=()))
    counted &= np.repeat(_image_areas(mesh.uvs, triangles) > np.finfo(np.float32).tiny, 3)
    ours = mesh.tangents[triangles.reshape(-1)[counted]]
    reference = reference[counted]
    return _summary(angles_deg(ours[:, :3], reference[:, :3]), int((ours[:, 3] != reference[:, 3]).sum()))


def true_tangents(mesh: Mesh) -> npt.NDArray[np.float32]:
    """(3 m, 4) float32: MikkTSpace's tangent of each corner of a mesh with normals and UVs."""
    mesh, _ = mesh.laid_out_for_frames()
    assert mesh.normals is not None and mesh.uvs is not None
    return mikktspace_tangents(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles).reshape(-1, 4)


def sample_of(mesh: Mesh, max_triangles: int = _MAX_TRIANGLES) -> tuple[Mesh, npt.NDArray[np.bool_]]:
    """The triangles that frame_errors measures, as a mesh of about max_triangles triangles in one group, and
    which of its corners (3 m,) have all their neighbours in it, so that their frames equal the whole mesh's.
    """
    mesh, _ = mesh.laid_out_for_frames()
    triangles, valid = _sample(mesh, max_triangles)
    return replace(mesh, triangles=triangles, groups=()), valid


def _sample(mesh: Mesh, max_triangles: int) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.bool_]]:
    """Triangles (m, 3) for the reference, and which of their corners (3 m,) have all their neighbours among
    them."""
    count = len(mesh.triangles)
    if count <= max_triangles:
        return mesh.triangles, np.ones(count * 3, np.bool_)
    # Positions are chosen by 24 bits of a hash: equal ones together, with all their triangles.
    bits = (mesh.positions + np.float32(0)).view(np.uint32).astype(np.uint64)
    mixed = (bits * _MIX[:3]).sum(axis=1, dtype=np.uint64)
    corners = ((mixed ^ (mixed >> np.uint64(32))) * _MIX[3] >> np.uint64(40))[mesh.triangles]
    # A vertex has about 6 triangles; the vertices of one triangle have about 13.
    chosen = np.zeros(1 << 24, np.bool_)
    chosen[corners[np.arange(max(1, max_triangles // 13)) * count // max(1, max_triangles // 13)]] = True
    in_sample = chosen[corners]
    any_in_sample = in_sample.any(axis=1)
    return np.ascontiguousarray(mesh.triangles[any_in_sample]), in_sample[any_in_sample].reshape(-1)


def _image_areas(uvs: npt.NDArray[np.float32], triangles: npt.NDArray[np.uint32]) -> npt.NDArray[np.float64]:
    a, b, c = (uvs[triangles[:, k]].astype(np.float64) for k in range(3))
    return np.asarray(np.abs(cross_2d(b - a, c - a)))


def _summary(angles: npt.NDArray[np.float64], turned: int) -> dict[str, float]:
    count = max(1, len(angles))
    index = min(len(angles) - 1, math.ceil(0.99 * len(angles)))
    return {
        "tangent_max_deg": rounded(float(angles.max(initial=0.0))),
        "tangent_p99_deg": rounded(float(np.partition(angles, index)[index]) if len(angles) else 0.0),
        "tangent_mean_deg": rounded(math.fsum(angles.tolist()) / count),
        "tangent_turned": rounded(turned / count),
    }
