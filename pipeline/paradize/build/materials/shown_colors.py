"""Looks at what the triangles of a material show of its colour map: swatches and gradients of a palette, and
alpha."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.build.materials.model_pictures import read_picture
from paradize.build.materials.shown_texels import BEND, PLAIN, centres, owners_of, without_drawn
from paradize.data import Image, Mesh
from paradize.errors import ParadizeError
from paradize.kernels.maps import uv_islands
from paradize.kernels.reference.atlas import layout_raster
from paradize.material import MapSource, Picture, Wrap, texels_within
from paradize.scene.map_sets import HIDDEN, KIT, PAINTED, PALETTE, VARIED
from paradize.vectors import cross_2d, doubled_areas

_SHARED = 0.1  # of the texels shows on several places, where gradients are a palette's
_SIDE = 1024  # texels a side of the raster in which these are counted
_SAME = 1.0 / 255.0
_HALF = (0.05, 0.95)  # alpha between these is neither a hole nor opaque
_FEW = 0.01  # of the texels that show: too few to say what alpha means
_BUSY = 2.0 / 255.0  # mean change from texel to texel of heights or gloss; glass, fog and water change less
_FIRM = 0.1  # of the texels in between: at least so many are opaque in a mask; smoke has none
_DETAIL = 0.5 / 255.0  # mean change of colour from texel to texel of a painted surface, at least
_PAINTED = 1.1  # times as much as where alpha is 1: a photograph cut out may have as much around the shape
_WASTED = 0.4  # of the texels that show lie in UV islands of holes alone: cut shapes have no such island
_GREEN = 0.02  # of the range by which the mean green of a leaf exceeds red and blue
_GREENEST = 0.4  # of a leaf's texels hold more green than red and blue; of orange beside teal few do


def shown_colors(
    mesh: Mesh,
    color: Picture,
    decoded: dict[Any, Any],
    wrap: tuple[Wrap, Wrap],
    *,
    alpha_map: MapSource | None = None,
) -> tuple[float, int, str]:
    """Returns what triangles show of a colour map: MaterialFacts' palette, shrink and alpha. decoded:
    pictures that were read before. wrap: of their sampler. alpha_map: it is this picture of alpha, read as
    ColorSettings says."""
    pixels = _decoded(color, decoded)
    if pixels is None and alpha_map is not None:  # so that the bake reads it, and says what is wrong
        return 0.0, 0, "mask"
    if pixels is None or mesh.uvs is None or not len(mesh.triangles):
        return 0.0, 0, "opaque"
    rows, columns, _ = pixels.shape
    corners = mesh.uvs[mesh.triangles].astype(np.float64)
    seen, middle, weights, texels = [], [], [], []
    for i in range(5):
        for j in range(5 - i):
            weights.append((np.array([i, j, 4 - i - j], np.float64) + 1e-3) / (4.0 + 3e-3))
            middle.append((corners * weights[-1][None, :, None]).sum(axis=1))
            at = middle[-1] * [columns, rows]
            x, y = np.floor(at).T
            texels.append((texels_within(y, rows, wrap[1]), texels_within(x, columns, wrap[0])))
            seen.append(pixels[texels[-1]])
    colors = np.stack(seen)  # (places, triangles, channels)
    places = np.concatenate(middle)
    area = areas_of(mesh)
    palette = 0.0
    p, q = (corners[:, k] - corners[:, 0] for k in (1, 2))
    sides = np.array([columns, rows])
    p, q = p * sides, q * sides
    longest = np.sqrt(np.maximum.reduce([(edge * edge).sum(axis=1) for edge in (p, q, q - p)]))
    flat = np.abs(cross_2d(p, q)) <= 1e-3 * longest
    plain = flat | (np.ptp(colors[:, :, :3], axis=0).max(axis=1) <= PLAIN)
    enough = KIT * area.sum()
    if area[plain].sum() < PALETTE * area.sum():
        gradient = ~plain & (_off_gradient(colors[:, :, :3], weights) <= PLAIN)
        if area[plain | gradient].sum() >= enough:
            gradient &= _bend(pixels, texels) <= BEND
        if area[plain | gradient].sum() >= enough and _are_shared(mesh, corners, (plain | gradient) & ~flat):
            plain |= gradient
    middles = colors[len(colors) // 2, :, :3]
    if area.sum() > 0.0 and area[plain].sum() >= enough and (np.ptp(middles, axis=0) > PLAIN).any():
        solid = ~flat
        share = enough - area[plain & flat].sum()
        kept = without_drawn(mesh, pixels[:, :, :3], wrap, plain & solid, area, share)
        if area[kept].sum() >= share:
            palette = float(area[kept | (plain & flat)].sum() / area.sum())
    shrink = _shrink(mesh, pixels[:, :, :3], places, wrap) if palette else 0
    if is_solid(color, decoded, alpha_map):
        return palette, shrink, "opaque"
    channel = _alpha_channel(pixels, alpha_map)
    whole, sampled = pixels[:, :, channel], colors[:, :, channel]
    if alpha_map is not None and alpha_map.inverted:
        whole, sampled = 1.0 - whole, 1.0 - sampled
    owners = owners_of(mesh, pixels.shape, wrap)
    shown = sampled if owners is None or (owners >= 0).sum() < sampled.size else whole[owners >= 0]
    holes, full = float((shown <= _HALF[0]).mean()), float((shown >= _HALF[1]).mean())
    between = 1.0 - holes - full
    if full == 1.0:
        return palette, shrink, "opaque"
    if alpha_map is None:
        if holes == 1.0:  # a channel that the program that wrote it left empty
            return palette, shrink, HIDDEN
        if holes + between < _FEW:
            return palette, shrink, "opaque"
        if min(holes, full) >= _FEW and _is_painted_below(pixels, owners, mesh):
            return palette, shrink, PAINTED
        if max(holes, full) < _FEW and _changes(whole, owners) > _BUSY:
            return palette, shrink, VARIED
    return palette, shrink, "mask" if between <= holes and between * _FIRM <= full else "blend"


def _is_painted_below(
    pixels: npt.NDArray[np.float32], owners: npt.NDArray[np.int32] | None, mesh: Mesh
) -> bool:
    """Whether colours change more from texel to texel where alpha is 0 than where it is 1, or change there
    and whole UV islands would be hidden. Alpha is another quantity then, such as gloss or a mask of paint:
    who cuts shapes out leaves a plain colour around them, or one that bleeds.

    pixels (h, w, 2 or 4); owners (h, w): -1 where no triangle shows a texel; None: all are shown.
    """
    colors, alpha = pixels[:, :, :-1], pixels[:, :, -1]
    shown = np.ones(alpha.shape, np.bool_) if owners is None else owners >= 0
    parts = (shown & (alpha <= _HALF[0]), shown & (alpha >= _HALF[1]))
    totals, numbers = np.zeros(2), np.zeros(2)
    for axis in (0, 1):
        change = np.abs(np.diff(colors, axis=axis)).max(axis=2)
        for k, part in enumerate(parts):
            pairs = np.delete(part, 0, axis) & np.delete(part, -1, axis)
            totals[k] += change[pairs].sum(dtype=np.float64)
            numbers[k] += pairs.sum()
    below, above = totals / np.maximum(numbers, 1)
    enough = _DETAIL if _wasted(parts[0], owners, mesh) >= _WASTED else max(_PAINTED * above, _DETAIL)
    return bool(below >= enough)


def _wasted(holes: npt.NDArray[np.bool_], owners: npt.NDArray[np.int32] | None, mesh: Mesh) -> float:
    """The share of the texels that show in UV islands that show holes alone. holes, owners: (h, w)."""
    if owners is None or mesh.uvs is None:
        return 0.0
    islands = uv_islands(mesh.uvs, mesh.triangles)
    shown = np.bincount(islands[owners[owners >= 0]])
    hidden = np.bincount(islands[owners[holes]], minlength=len(shown))
    return float(shown[hidden == shown].sum() / max(shown.sum(), 1))


def _changes(values: npt.NDArray[np.float32], owners: npt.NDArray[np.int32] | None) -> float:
    """The mean change from texel to texel, along rows and columns, of values (h, w) that show."""
    shown = np.ones(values.shape, np.bool_) if owners is None else owners >= 0
    total = number = 0.0
    for axis in (0, 1):
        pairs = np.delete(shown, 0, axis) & np.delete(shown, -1, axis)
        total += float(np.abs(np.diff(values, axis=axis))[pairs].sum(dtype=np.float64))
        number += float(pairs.sum())
    return total / max(number, 1.0)


def is_solid(picture: Picture, decoded: dict[Any, Any], alpha_map: MapSource | None = None) -> bool:
    """Whether alpha is 1 in all of a picture that can be read. decoded, alpha_map: as of shown_colors."""
    pixels = _decoded(picture, decoded)
    if pixels is None:
        return False
    channel = _alpha_channel(pixels, alpha_map)
    if channel is None:
        return True
    transparent = 1.0 if alpha_map is not None and alpha_map.inverted else 0.0
    return bool((np.abs(pixels[:, :, channel] - transparent) >= 1.0).all())


def _alpha_channel(pixels: npt.NDArray[np.float32], alpha_map: MapSource | None) -> int | None:
    """The channel that holds alpha; None where none does."""
    channels = pixels.shape[2]
    channel = "a" if alpha_map is None else alpha_map.channel
    if channel == "a":
        return -1 if channels in (2, 4) else None
    own = channels in (2, 4) and bool((pixels[:, :, -1] < 1.0).any())
    at = {"r": 0, "g": 1, "b": 2}.get(channel, -1 if own else 0)
    return min(at, 0) if channels < 3 else at


def is_green(mesh: Mesh, color: Picture, decoded: dict[Any, Any], wrap: tuple[Wrap, Wrap]) -> bool:
    """Whether what triangles show of a colour map is mostly green. What is nearly transparent does not
    count, nor does what is grey. decoded, wrap: as of shown_colors."""
    pixels = _decoded(color, decoded)
    if pixels is None or pixels.shape[2] < 3:
        return False
    owners = owners_of(mesh, pixels.shape, wrap)
    seen = pixels.reshape(-1, pixels.shape[2]) if owners is None else pixels[owners >= 0]
    if seen.shape[1] == 4:
        seen = seen[seen[:, 3] > _HALF[1]]
    if not len(seen):
        return False
    red, green, blue = seen[:, :3].mean(axis=0, dtype=np.float64)
    greenest = seen[:, 1] > np.maximum(seen[:, 0], seen[:, 2])
    return bool(green - max(red, blue) > _GREEN and greenest.mean() >= _GREENEST)


def _decoded(color: Picture, decoded: dict[Any, Any]) -> npt.NDArray[np.float32] | None:
    """The pixels (h, w, c) of a picture, read once; None where it cannot be read."""
    key = color.file if color.data is None else id(color.data)
    if key not in decoded:
        decoded[key] = _pixels(color)
    found: npt.NDArray[np.float32] | None = decoded[key]
    return found


def _bend(
    pixels: npt.NDArray[np.float32], texels: Sequence[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]
) -> npt.NDArray[np.float32]:
    """How far the colours of each triangle's texels lie from the line between their neighbours, twice; the
    largest of rows, columns and channels. texels: (rows, columns) of all triangles, by place."""
    last = np.array(pixels.shape[:2]) - 1
    bend = np.zeros(len(texels[0][0]), np.float32)
    for y, x in texels:
        y, x = np.clip(y, 1, max(last[0] - 1, 0)), np.clip(x, 1, max(last[1] - 1, 0))
        for up, aside in ((1, 0), (0, 1)):
            ends = pixels[np.maximum(y - up, 0), np.maximum(x - aside, 0)]
            ends = ends + pixels[np.minimum(y + up, last[0]), np.minimum(x + aside, last[1])]
            bend = np.maximum(bend, np.abs(ends - 2.0 * pixels[y, x])[:, :3].max(axis=1))
    return bend


def _off_gradient(
    colors: npt.NDArray[np.float32], weights: Sequence[npt.NDArray[np.float64]]
) -> npt.NDArray[np.float64]:
    """How far the colours (places, triangles, channels) of each triangle lie from those that change evenly
    across it and fit them best. weights: barycentric, of each place; they are symmetric about the middle."""
    away = [weight - 1.0 / 3.0 for weight in weights]
    scale = 0.5 * sum(float((offset * offset).sum()) for offset in away)
    mean = sum(colors) / len(colors)
    slopes = [
        sum(offset[k] * color for offset, color in zip(away, colors, strict=True)) / scale for k in range(3)
    ]
    off = np.zeros(colors.shape[1:])
    for offset, color in zip(away, colors, strict=True):
        even = mean + sum(offset[k] * slopes[k] for k in range(3))
        off = np.maximum(off, np.abs(color - even))
    return np.asarray(off.max(axis=1))


def _are_shared(mesh: Mesh, corners: npt.NDArray[np.float64], chosen: npt.NDArray[np.bool_]) -> bool:
    """Whether some of the chosen triangles show the same texels, as those of a layout of its own never do.
    corners: (m, 3, 2) texture coordinates."""
    if not chosen.any():
        return False
    places = np.clip(corners[chosen] - np.floor(corners[chosen].min(axis=1, keepdims=True)), 0.0, 1.0)
    points = mesh.positions.astype(np.float64)
    points = (points - points.min(axis=0)) / (float(np.ptp(points, axis=0).max()) or 1.0)
    covered, twice, _ = layout_raster(points, mesh.triangles[chosen], places, resolution=_SIDE, gap=0)
    return twice >= _SHARED * covered > 0


def _shrink(
    mesh: Mesh,
    pixels: npt.NDArray[np.float32],
    places: npt.NDArray[np.float64],
    wrap: tuple[Wrap, Wrap],
) -> int:
    """How often a picture can be halved without a change of its colours at places (n, 2), of its sides, and
    at all texels that triangles cover."""
    owners = owners_of(mesh, pixels.shape, wrap)
    if owners is None:
        return 0

    def seen(level: npt.NDArray[np.float32], places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        rows, columns = level.shape[:2]
        x, y = places[:, 0] * columns - 0.5, places[:, 1] * rows - 0.5
        left, top = np.floor(x), np.floor(y)
        s, t = (x - left)[:, None], (y - top)[:, None]
        beside = [texels_within(left + i, columns, wrap[0]) for i in (0, 1)]
        below = [texels_within(top + j, rows, wrap[1]) for j in (0, 1)]
        corner = [level[j, i] for j in below for i in beside]
        upper, lower = (corner[k] * (1.0 - s) + corner[k + 1] * s for k in (0, 2))
        return np.asarray(upper * (1.0 - t) + lower * t)

    finest, times = pixels, 0
    while min(pixels.shape[:2]) > 1 and not (pixels.shape[0] % 2 or pixels.shape[1] % 2):
        pixels = 0.25 * (pixels[::2, ::2] + pixels[1::2, ::2] + pixels[::2, 1::2] + pixels[1::2, 1::2])
        parts = chain([places], centres(owners))
        if any(np.abs(seen(pixels, part) - seen(finest, part)).max() > _SAME for part in parts):
            break
        times += 1
    return times


def areas_of(mesh: Mesh) -> npt.NDArray[np.float64]:
    return doubled_areas(mesh.positions.astype(np.float64)[mesh.triangles])


def _pixels(picture: Picture) -> npt.NDArray[np.float32] | None:
    """The pixels (h, w, c) of a picture, 0..1 as textures hold them; None where it cannot be read: its bake
    says so."""
    try:
        return _unit(read_picture(picture))
    except ParadizeError:
        return None


def _unit(image: Image) -> npt.NDArray[np.float32]:
    return image.pixels.clip(0.0, 1.0) if image.top is None else image.pixels
