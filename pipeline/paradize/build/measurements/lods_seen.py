"""Measures at which size each level of detail may take over, from the published bytes: the GLB's levels with
the maps that decide their normals, their holes, their colours and the light that they give off. Runs in a
worker.

The player takes a level where its error covers few enough pixels. A level may be near the surface and still
be lit differently, so that its error in metres is raised until it also looks like the finest level there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.artifact import SEEN
from paradize.data import rounded
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
from paradize.metrics.source import linear_light
from paradize.metrics.switch import ROOM, drawn_size, switch_flip
from paradize.metrics.texels import decode_texels

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Texture

_FINEST_TEXELS = 2048  # along a side: finer mips are not read, because no picture here is so large
_COLOR_TEXELS = 512  # the same of colours: metrics/switch.py draws no picture that is larger
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
    flip: float,
) -> list[dict[str, float | None]]:
    """Returns of each level, the finest (0) first: `seen_px`, the size in pixels along the diagonal at which
    it takes over; `seen_p99_deg`, `seen_mean_deg` and `seen_silhouette`, how it differs there from the finest
    level (metrics/seen.py); `seen_flip`, from the level before it (metrics/switch.py); and `switch_m`, the
    error in metres by which a player selects it. A level that differs too much at any size has the values of
    the smallest, and `switch_m` is None.

    textures: KTX2 by the names that `materials` use. materials: by name, "normal", "alpha", "color" and
    "emission" (a texture or None), "color_factor", "emission_factor" (linear), "cutoff" (None: blended),
    "wrap", "two_sided". errors_m: by which a player would select each level for its distance and its texture
    alone. error_px: the error that it accepts. limits: fields of Limits. flip: what a switch may change of a
    player's picture, 0..1; 1: anything. name: for messages. Raises FormatError for bytes that Paradize did
    not write.
    """
    finest, *coarser = [lod.mesh for lod in decode_glb(glb, name)]
    decoded = {key: decode_ktx2(data, key) for key, data in textures.items()}
    normals = {
        material["normal"]: _normals(decoded[material["normal"]])
        for material in materials.values()
        if material["normal"]
    }
    alphas = {
        material["alpha"]: _alphas(decoded[material["alpha"]])
        for material in materials.values()
        if material["alpha"]
    }
    lights = {
        key: _linear_colors(decoded[key])
        for key in {material[role] for material in materials.values() for role in ("color", "emission")}
        - {None}
    }
    drawn = {
        material: SeenMaterial(
            normals=normals.get(maps["normal"], ()),
            alpha=alphas.get(maps["alpha"], ()),
            cutoff=_BLENDED if maps["cutoff"] is None else maps["cutoff"],
            wrap=maps["wrap"] or ("clamp", "clamp"),
            two_sided=maps["two_sided"],
            colors=_times(lights.get(maps["color"]), maps["color_factor"]),
            glow=_times(lights.get(maps["emission"]), maps["emission_factor"]),
        )
        for material, maps in materials.items()
    }
    allowed = Limits(**limits)
    reference = seen_mesh(finest, drawn)
    diagonal_m = diagonal_of(reference)
    levels: list[dict[str, float | None]] = [{**dict.fromkeys(SEEN, 0.0), "switch_m": 0.0}]
    before = reference
    before_px: float | None = (
        LARGEST_PX  # a coarser level takes over no earlier, and never where one never does
    )
    for mesh, error_m in zip(coarser, errors_m[1:], strict=True):
        level = seen_mesh(mesh, drawn)
        near_px = error_px * diagonal_m / error_m if error_m > 0 else LARGEST_PX
        most_px = None if before_px is None else min(near_px, before_px)
        change = cache(partial(switch_flip, before, level))

        def quiet(size_px: float, change: Callable[[float], float] = change) -> bool:
            return flip >= 1.0 or change(drawn_size(size_px)) <= ROOM * flip

        found = None if most_px is None else largest_size(reference, level, allowed, most_px, quiet)
        seen = found or seen_difference(reference, level, SMALLEST_PX)
        before = level
        before_px = switch_m = None
        if found is not None:
            before_px, switch_m = found.size_px, error_m
            if found.size_px < min(near_px, LARGEST_PX):
                switch_m = max(error_m, rounded(error_px * diagonal_m / found.size_px))
        flipped = change(drawn_size(seen.size_px))
        values = (seen.size_px, seen.p99_deg, seen.mean_deg, seen.silhouette, flipped)
        levels.append({**dict(zip(SEEN, map(rounded, values), strict=True)), "switch_m": switch_m})
    return levels


def _mips(texture: Texture, texels: int = _FINEST_TEXELS) -> list[npt.NDArray[np.float32]]:
    sides = [max(texture.width >> k, texture.height >> k) for k in range(len(texture.levels))]
    first = next((k for k, side in enumerate(sides) if side <= texels), len(sides) - 1)
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


def _linear_colors(texture: Texture) -> list[npt.NDArray[np.float32]]:
    """The linear colours (h, w, 3) of each mip."""
    return [
        linear_light(texels[:, :, :3], encoded=True).astype(np.float32)
        for texels in _mips(texture, _COLOR_TEXELS)
    ]


def _times(
    mips: list[npt.NDArray[np.float32]] | None, factor: Sequence[float]
) -> list[npt.NDArray[np.float32]]:
    """The mips times a factor; the factor alone where there are none."""
    color = np.asarray(factor, np.float32)
    return [color.reshape(1, 1, 3)] if mips is None else [texels * color for texels in mips]
