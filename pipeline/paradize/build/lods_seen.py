"""Measures at which size each level of detail may take over, from the published bytes: the GLB's levels with
the maps that decide their normals and their holes. Runs in a worker.

The player takes a level where its error covers few enough pixels. A level may be near the surface and still
be lit differently, so that its error in metres is raised until it also looks like the finest level there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels.reference.seen import SeenMaterial
from paradize.metrics.seen import (
    LARGEST_PX,
    SMALLEST_PX,
    Limits,
    diagonal_of,
    largest_size,
    seen_difference,
    seen_mesh,
)
from paradize.metrics.texels import decode_texels

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Texture

SEEN = ("seen_px", "seen_p99_deg", "seen_mean_deg", "seen_silhouette")
_FINEST_TEXELS = 2048  # along a side: finer mips are not read, because no picture here is so large
_BLENDED = 0.5  # of alpha: what has less counts as a hole


def measure_lods_seen(
    glb: bytes,
    textures: Mapping[str, bytes],
    *,
    name: str,
    materials: Mapping[str, Mapping[str, Any]],
    errors_m: Sequence[float],
    error_px: float,
    limits: Mapping[str, float],
) -> list[dict[str, float | None]]:
    """Returns of each level, the finest (0) first: `seen_px`, the size in pixels along the diagonal at which
    it takes over; `seen_p99_deg`, `seen_mean_deg` and `seen_silhouette`, how it differs there from the finest
    level (metrics/seen.py); and `switch_m`, the error in metres by which a player selects it. A level that
    differs too much at any size has the values of the smallest, and `switch_m` is None.

    textures: KTX2 by the names that `materials` use. materials: by name, "normal" and "alpha" (a texture or
    None), "cutoff" (None: blended), "wrap", "two_sided". errors_m: by which a player would select each
    level for its distance and its texture alone. error_px: the error that it accepts. limits: fields of
    Limits. name: for messages. Raises FormatError for bytes that Paradize did not write.
    """
    finest, *coarser = [lod.mesh for lod in decode_glb(glb, name)]
    decoded = {key: decode_ktx2(data, key) for key, data in textures.items()}
    normals = {one["normal"]: _normals(decoded[one["normal"]]) for one in materials.values() if one["normal"]}
    alphas = {one["alpha"]: _alphas(decoded[one["alpha"]]) for one in materials.values() if one["alpha"]}
    drawn = {
        material: SeenMaterial(
            normals.get(one["normal"], ()),
            alphas.get(one["alpha"], ()),
            _BLENDED if one["cutoff"] is None else one["cutoff"],
            one["wrap"] or ("clamp", "clamp"),
            one["two_sided"],
        )
        for material, one in materials.items()
    }
    allowed = Limits(**limits)
    reference = seen_mesh(finest, drawn)
    diagonal_m = diagonal_of(reference)
    levels: list[dict[str, float | None]] = [{**dict.fromkeys(SEEN, 0.0), "switch_m": 0.0}]
    before_px: float | None = (
        LARGEST_PX  # a coarser level takes over no earlier, and never where one never does
    )
    for mesh, error_m in zip(coarser, errors_m[1:], strict=True):
        level = seen_mesh(mesh, drawn)
        near_px = error_px * diagonal_m / error_m if error_m > 0 else LARGEST_PX
        most_px = None if before_px is None else min(near_px, before_px)
        found = None if most_px is None else largest_size(reference, level, allowed, most_px)
        seen = found or seen_difference(reference, level, SMALLEST_PX)
        before_px = switch_m = None
        if found is not None:
            before_px, switch_m = found.size_px, error_m
            if found.size_px < min(near_px, LARGEST_PX):
                switch_m = max(error_m, _six_digits(error_px * diagonal_m / found.size_px))
        values = (seen.size_px, seen.p99_deg, seen.mean_deg, seen.silhouette)
        levels.append({**dict(zip(SEEN, map(_six_digits, values), strict=True)), "switch_m": switch_m})
    return levels


def _six_digits(value: float) -> float:
    return float(f"{value:.6g}")


def _mips(texture: Texture) -> list[npt.NDArray[np.float32]]:
    sides = [max(texture.width >> k, texture.height >> k) for k in range(len(texture.levels))]
    first = next((k for k, side in enumerate(sides) if side <= _FINEST_TEXELS), len(sides) - 1)
    return [decode_texels(texture, k) for k in range(first, len(sides))]


def _normals(texture: Texture) -> list[npt.NDArray[np.float32]]:
    """The unit vectors (h, w, 3) of each mip, green up."""
    out = []
    for texels in _mips(texture):
        x, y = texels[:, :, 0], texels[:, :, 1]
        out.append(
            np.stack([x, y, np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))], axis=-1).astype(np.float32)
        )
    return out


def _alphas(texture: Texture) -> list[npt.NDArray[np.float32]]:
    """The alpha (h, w) of each mip; none where it has no such channel."""
    mips = _mips(texture)
    return [np.ascontiguousarray(texels[:, :, 3]) for texels in mips] if mips[0].shape[2] == 4 else []
