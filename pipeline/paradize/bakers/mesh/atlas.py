"""Makes a UV atlas where UVs are missing or overlap, and measures it. Runs in a subprocess, which can be
killed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.jobs.isolate import call_isolated
from paradize.metrics.atlas import atlas_quality
from paradize.stages.atlas import PADDING, RESOLUTION, make_atlas
from paradize.stages.unwrappers import require_unwrapper
from paradize.tiers import TIERS, UNWRAPPERS

_TIMEOUT_S = 120.0
_MEMORY_BYTES = 8 << 30
# Authors' charts may touch and share texels: a smaller share of the image is not an overlap.
_OVERLAPPING = 0.005


def overlaps(mesh: Mesh) -> bool:
    """Whether a layout inside the unit square overlaps itself. A layout that leaves the square repeats its
    image and counts as free of overlaps."""
    if mesh.uvs is None:
        return False
    used = mesh.uvs[mesh.triangles]
    if not np.isfinite(used).all() or used.min() < 0 or used.max() > 1:
        return False
    return bool(atlas_quality(mesh, resolution=512, padding=0)["overlap"] > _OVERLAPPING)


def with_atlas(
    mesh: Mesh, path: Path, tier: str, unwrapper: str = UNWRAPPERS[0]
) -> tuple[Mesh, dict[str, Any] | None, list[str]]:
    """Returns the mesh with a new layout if it needs one, the layout's quality, and warnings.

    unwrapper: one of UNWRAPPERS. Raises BakeError if it is not installed, if the layout takes too long, or if
    it is not sound: see sound_quality.
    """
    require_unwrapper(unwrapper)
    if mesh.uvs is not None and not overlaps(mesh):
        return mesh, None, []
    why = "no texture coordinates" if mesh.uvs is None else "texture coordinates that lie over one another"
    loss = "" if mesh.uvs is None else "; pictures painted for the old one no longer fit"
    by = "" if unwrapper == UNWRAPPERS[0] else f" by {unwrapper}"
    unwrapped = call_isolated(
        f"the atlas of {path}{by}",
        make_atlas,
        {"mesh": mesh, "tier": tier if tier in TIERS else "balanced", "unwrapper": unwrapper},
        timeout_s=_TIMEOUT_S,
        memory_bytes=_MEMORY_BYTES,
    )
    return (
        unwrapped,
        sound_quality(unwrapped, path, unwrapper),
        [f"{path}: {why}, so a UV layout was made{by}{loss}"],
    )


def sound_quality(mesh: Mesh, path: Path, unwrapper: str) -> dict[str, Any]:
    """Returns the quality of a new layout. Raises BakeError if charts overlap, are nearer than the gutter
    or mirrored, or if a triangle has no area in the image."""
    quality = atlas_quality(mesh, resolution=RESOLUTION, padding=PADDING)
    for key, problem in (
        ("overlap", "of the texels are covered twice"),
        ("near", "texels have another chart within the gutter"),
        ("flipped", "triangles are mirrored"),
        ("without", "triangles have no area in the image"),
    ):
        if quality[key] > 0:
            mend = None if unwrapper == UNWRAPPERS[0] else f"take the unwrapper {UNWRAPPERS[0]!r}"
            whose = "" if mend is None else f" of {unwrapper}"
            raise BakeError(
                f"the atlas{whose} is not sound: {quality[key]:g} {problem}", file=path, mend=mend
            )
    return quality
