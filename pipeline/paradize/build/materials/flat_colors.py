"""Measures how many of the finest mips a texture can lose where triangles show only a line or a point of it
(swatches of a palette, seams of a careless layout).

Along such a triangle the texture hardly changes from pixel to pixel, so the hardware reads the finest mip
from any distance, and a single triangle would keep the whole texture at full size. But a line or a point has
no detail to lose: a coarser mip only changes its colour. So that change is measured. The rest of the surface
decides as long as at most SHARE of the surface shows a colour that is more than OFF from the finest mip's.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.build.materials.shown_texels import centres, owners_of
from paradize.build.measurements.gutter_limits import sampled_levels
from paradize.data import Mesh
from paradize.formats.glb.reader import decode_glb
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels.math import linear_to_srgb
from paradize.map_table import MAPS
from paradize.material import REPEATED, Wrap, texels_within
from paradize.metrics.levels import psnr
from paradize.stages.gutter import goes_around
from paradize.vectors import doubled_areas
from paradize.visibility.finest_mip import flat_triangles

F32 = npt.NDArray[np.float32]
F64 = npt.NDArray[np.float64]
SHARE = 0.01  # of the surface
OFF = 1.0 / 32.0  # of the range; of colour in square roots of linear light, of normals half the chord
_INSIDE: tuple[Wrap, Wrap] = ("clamp", "clamp")
SAME = 1.5 / 255.0  # a colour that changes by less is the same
# Ten points of a triangle, as barycentric weights.
_PLACES = np.array([(i, j, 3 - i - j) for i in range(4) for j in range(4 - i)], np.float64)
_WEIGHTS = (_PLACES + 1.0 / 3.0) / 4.0
_WITH_CORNERS = np.concatenate([_WEIGHTS, np.eye(3)])  # where the next swatch shows first


def measure_flat(
    name: str,
    glb: bytes,
    textures: Mapping[str, bytes],
    levels: Mapping[str, int],
    wrap: tuple[Wrap, Wrap] | None,
    materials: Collection[str] | None = None,
) -> dict[str, int]:
    """Returns by map the coarsest level, at most that of `levels`, up to which flat triangles keep their
    colours on all levels of detail. textures: KTX2 by map ("color", "normal", ...). wrap: of
    their samplers; None: it does not matter. materials: those that the maps lie on; None: all."""
    meshes = [lod.mesh for lod in decode_glb(glb, name)]
    if materials is not None:
        meshes = [mesh.of_materials(materials) for mesh in meshes]
    coarsest = {}
    for key, data in textures.items():
        texture = decode_ktx2(data, f"{name}_{key}")
        chain = sampled_levels(texture, key)[: levels[key] + 1]
        if MAPS[key].kind == "color":
            chain = [np.sqrt(np.maximum(level, 0.0)) for level in chain]
        unit = 0.5 if MAPS[key].kind == "normal" else 1.0
        size = (texture.width, texture.height)
        coarsest[key] = min(
            _coarsest_level(mesh, size, chain, unit, wrap or _of_layout(mesh)) for mesh in meshes
        )
    return coarsest


def measure_palette(
    name: str, glb: bytes, texture: bytes, wrap: tuple[Wrap, Wrap] | None, materials: Collection[str]
) -> dict[str, Any]:
    """Returns how coarse a palette may be: `level`, the coarsest mip with which no colour of any level of
    detail changes by more than SAME, on no texel that its triangles cover; `max_level`, the coarsest mip that
    may be sampled before swatches mix; `level_psnr_db`, of the colours of `level` against the finest on all
    these texels. texture: KTX2 of the colour map. materials: those that it lies on."""
    decoded = decode_ktx2(texture, f"{name}_color")
    chain = [np.sqrt(np.maximum(level, 0.0)) for level in sampled_levels(decoded, "color")]
    size = (decoded.width, decoded.height)
    meshes = [lod.mesh.of_materials(materials) for lod in decode_glb(glb, name)]
    level, last = (
        min(
            _coarsest_level(mesh, size, chain, 1.0, wrap or _INSIDE, off=off, share=share, flat=False)
            for mesh in meshes
        )
        for off, share in ((SAME, 0.0), (OFF, SHARE))
    )
    level = min(level, last)
    owners = [owners_of(mesh, (decoded.height, decoded.width), wrap or _INSIDE) for mesh in meshes]
    squares, number = 0.0, 0
    while level:
        found = [(np.inf, np.inf, 1)]
        if all(own is not None for own in owners):
            found = [_changed(chain, level, own, wrap or _INSIDE) for own in owners if own is not None]
        squares, number = sum(change[1] for change in found), sum(change[2] for change in found)
        if max(change[0] for change in found) <= SAME:
            break
        level, squares = level - 1, 0.0
    return {"level": level, "max_level": last, "level_psnr_db": psnr(squares, number)}


def _changed(
    chain: Sequence[F32], level: int, owners: npt.NDArray[np.int32], wrap: tuple[Wrap, Wrap]
) -> tuple[float, float, int]:
    """How far a mip is from the finest at the centres of all texels that have an owner: the most, in square
    roots of linear light; the sum of squares of sRGB, and their number."""
    most, squares, number = 0.0, 0.0, 0
    for at in centres(owners):
        ours, finest = _sampled(chain[level], at, wrap), _sampled(chain[0], at, wrap)
        most = max(most, float(np.abs(ours - finest).max()))
        off = linear_to_srgb(ours[:, :3] ** 2) - linear_to_srgb(finest[:, :3] ** 2)
        squares, number = squares + float((off * off).sum()), number + off.size
    return most, squares, number


def _coarsest_level(
    mesh: Mesh,
    size: tuple[int, int],
    chain: Sequence[F32],
    unit: float,
    wrap: tuple[Wrap, Wrap],
    *,
    off: float = OFF,
    share: float = SHARE,
    flat: bool = True,
) -> int:
    """Returns the coarsest level with which at most `share` of the surface is more than `off` from the
    finest. Where none may be, the corners of triangles count too. flat: of the flat triangles alone."""
    if mesh.uvs is None or not len(mesh.triangles):
        return len(chain) - 1
    area = doubled_areas(mesh.absolute_positions[mesh.triangles])
    chosen = flat_triangles(mesh, mesh.uvs, *size) if flat else np.ones(len(area), np.bool_)
    weights = _WITH_CORNERS if share == 0.0 else _WEIGHTS
    uvs = mesh.uvs.astype(np.float64)[mesh.triangles[chosen]]
    # (places, triangles, 2)
    at = sum(weights[:, k, None, None] * uvs[None, :, k] for k in range(3)) + np.zeros((len(weights), 1, 1))
    shown = np.broadcast_to(area[chosen] / len(weights), at.shape[:2])
    accepted = share * math.fsum(area.tolist())
    finest = _sampled(chain[0], at, wrap)
    level = 0
    while level + 1 < len(chain):
        changed = unit * np.abs(_sampled(chain[level + 1], at, wrap) - finest).max(axis=-1)
        if math.fsum(shown[changed > off].tolist()) > accepted:
            break
        level += 1
    return level


def _of_layout(mesh: Mesh) -> tuple[Wrap, Wrap]:
    """Returns how the player samples maps that follow a layout."""
    return REPEATED if goes_around(mesh) else _INSIDE


def _sampled(level: F32, at: F64, wrap: tuple[Wrap, Wrap]) -> F64:
    """Returns bilinear samples (..., c) at texture coordinates (..., 2)."""
    height, width, _ = level.shape
    x, y = at[..., 0] * width - 0.5, at[..., 1] * height - 0.5
    left, top = np.floor(x), np.floor(y)

    def texel(column: F64, row: F64) -> F64:
        i, j = texels_within(column, width, wrap[0]), texels_within(row, height, wrap[1])
        return np.asarray(level[j, i], np.float64)

    s, t = (x - left)[..., None], (y - top)[..., None]
    upper = texel(left, top) * (1.0 - s) + texel(left + 1.0, top) * s
    lower = texel(left, top + 1.0) * (1.0 - s) + texel(left + 1.0, top + 1.0) * s
    return np.asarray(upper * (1.0 - t) + lower * t, np.float64)
