"""Measures the normals of each level of detail under the normal map, against the finest level.

Uses the published bytes: the GLB's levels with their tangent frames, and level 0 of the normal map as the
hardware decodes it. Separate from the mesh's bake, so that a changed picture bakes no mesh again.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.mapped_normal import SAMPLES, normal_error
from paradize.metrics.surface import Original
from paradize.metrics.texels import decode_texels

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Texture
    from paradize.material import Wrap

MAPPED = ("mapped_mean_deg", "mapped_p99_deg", "mapped_max_deg")


def measure_lod_normal_error(
    glb: bytes, texture: bytes, *, name: str, wrap: tuple[Wrap, Wrap] | None, materials: Collection[str]
) -> list[dict[str, float]]:
    """Returns mapped_mean_deg, mapped_p99_deg and mapped_max_deg of each level, the finest (0) first: degrees
    between the normals of the level and the finest one at the same point, both turned by the map in their own
    tangent frames.

    texture: the normal map's KTX2. wrap: of its sampler; None: its UVs stay inside. materials: those that it
    lies on. name: of its set, for messages. Raises FormatError for bytes that Paradize did not write.
    """
    finest, *coarser = decode_glb(glb, name)
    vectors = _vectors(decode_ktx2(texture, f"{name}_normal"))
    own = finest.mesh.of_materials(materials)
    if not len(own.triangles):
        return [dict.fromkeys(MAPPED, 0.0) for _ in (finest, *coarser)]
    reference = Original(own)
    levels = [dict.fromkeys(MAPPED, 0.0)]
    for lod in coarser:
        mesh = lod.mesh.of_materials(materials)
        if not len(mesh.triangles):  # the level has lost the material
            levels.append(dict.fromkeys(MAPPED, 0.0))
            continue
        whole = own is finest.mesh
        error_max = lod.error_max if whole else None
        errors = normal_error(
            reference,
            mesh,
            SAMPLES,
            surface_error=error_max,
            normal_map=vectors,
            wrap=wrap or ("clamp", "clamp"),
        )
        levels.append({key: errors[key] for key in MAPPED})
    return levels


def _vectors(texture: Texture) -> npt.NDArray[np.float32]:
    """Returns the unit vectors (h, w, 3) of a normal map's finest level, green up."""
    xy = decode_texels(texture, 0)[:, :, :2]
    out = np.empty((*xy.shape[:2], 3), np.float32)
    out[:, :, :2] = xy
    out[:, :, 2] = np.sqrt(np.maximum(0.0, 1.0 - xy[:, :, 0] * xy[:, :, 0] - xy[:, :, 1] * xy[:, :, 1]))
    return out
