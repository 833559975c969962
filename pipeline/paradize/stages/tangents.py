"""Tangent frames, MikkTSpace-compatible: the same split rules and weights as the reference.

Source: M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", master's thesis, University of
Copenhagen, 2008. Sign: B = w * cross(N, T) points up the image; MikkTSpace run on top-left UVs gives the
opposite w.
"""

from __future__ import annotations

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.kernels.mesh import corner_tangents
from paradize.stages.split import split_by

TIERS = ("balanced",)


def tangent_frames(mesh: Mesh) -> Mesh:
    """The mesh with tangents (n, 4): xyz unit and at right angles to the normal, w = +-1; always finite.

    A vertex is split where its corners' frames differ (mirrored images, for one). Needs normals and uvs.
    """
    if mesh.normals is None or mesh.uvs is None:
        missing = "normals" if mesh.normals is None else "texture coordinates"
        raise BakeError(f"tangent frames need {missing}")
    corners = corner_tangents(mesh.positions, mesh.normals, mesh.uvs, mesh.triangles)
    return split_by(mesh, tangents=corners)
