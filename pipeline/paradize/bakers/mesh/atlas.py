"""A UV layout where a mesh lacks one or its own lies over itself: made where it can be killed, measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.jobs.isolate import call_isolated
from paradize.metrics.atlas import atlas_quality
from paradize.stages.atlas import PADDING, RESOLUTION, TIERS, make_atlas
from paradize.stages.unwrappers import UNWRAPPERS, require_unwrapper

_TIMEOUT_S = 120.0
_MEMORY_BYTES = 8 << 30
# Authors' charts touch, and share texels where they do: only more of the image than this is an overlap.
_OVERLAPPING = 0.005


def overlaps(mesh: Mesh) -> bool:
    """Whether a layout inside the unit square lies over itself; one that leaves the square repeats its image,
    and is left alone."""
    if mesh.uvs is None:
        return False
    used = mesh.uvs[mesh.triangles]
    if not np.isfinite(used).all() or used.min() < 0 or used.max() > 1:
        return False
    return bool(atlas_quality(mesh, resolution=512, padding=0)["overlap"] > _OVERLAPPING)


def with_atlas(
    mesh: Mesh, path: Path, tier: str, unwrapper: str = UNWRAPPERS[0]
) -> tuple[Mesh, dict[str, Any] | None, list[str]]:
    """The mesh with a new layout where it needs one; what was measured of that, and warnings.

    unwrapper: one of UNWRAPPERS. Raises BakeError where it is not there, where the layout takes too long, or
    where it is not sound: see sound_quality.
    """
    require_unwrapper(unwrapper)
    if mesh.uvs is not None and not overlaps(mesh):
        return mesh, None, []
    why = "no texture coordinates" if mesh.uvs is None else "texture coordinates that lie over one another"
    by = "" if unwrapper == UNWRAPPERS[0] else f" by {unwrapper}"
    made = call_isolated(
        f"the atlas of {path}{by}",
        make_atlas,
        {"mesh": mesh, "tier": tier if tier in TIERS else "balanced", "unwrapper": unwrapper},
        timeout_s=_TIMEOUT_S,
        memory_bytes=_MEMORY_BYTES,
    )
    return made, sound_quality(made, path, unwrapper), [f"{path}: {why}, so a UV layout was made{by}"]


def sound_quality(mesh: Mesh, path: Path, unwrapper: str) -> dict[str, Any]:
    """atlas_quality of a layout that was made. Raises BakeError where it is not sound: charts over one
    another, nearer than the gutter, mirrored, or a triangle without an area in the image."""
    told = atlas_quality(mesh, resolution=RESOLUTION, padding=PADDING)
    for key, what in (
        ("overlap", "of the texels are covered twice"),
        ("near", "texels have another chart within the gutter"),
        ("flipped", "triangles are mirrored"),
        ("without", "triangles have no area in the image"),
    ):
        if told[key] > 0:
            mend = None if unwrapper == UNWRAPPERS[0] else f"take the unwrapper {UNWRAPPERS[0]!r}"
            whose = "" if mend is None else f" of {unwrapper}"
            raise BakeError(f"the atlas{whose} is not sound: {told[key]:g} {what}", file=path, mend=mend)
    return told
