"""The metrics of metrics.levels once more, in numpy float64 and by the shortest way, for small maps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from paradize.data import HeightMap, Texture
from paradize.metrics.filters import taps as metric_taps
from paradize.metrics.texels import decode_texels, rebuilt
from tests.pipeline.heights import angles_between, up

BLOCK_BYTES = {"BC1_RGB_SRGB": 8, "BC3_SRGB": 16, "BC4_UNORM": 8, "BC5_UNORM": 16, "BC5_SNORM": 16}
TEXEL_BYTES = {
    "R8_UNORM": 1,
    "RG8_UNORM": 2,
    "RG8_SNORM": 2,
    "RGBA8_SRGB": 4,
    "R16_UNORM": 2,
    "RG16_UNORM": 4,
    "RG16_SNORM": 4,
    "R32F": 4,
}


def sizes(rows: int, columns: int) -> list[tuple[int, int]]:
    """Of every level, level 0 first."""
    return [(max(1, rows >> k), max(1, columns >> k)) for k in range(max(rows, columns).bit_length())]


def equal_ends(name: str, data: np.ndarray, every: int) -> None:
    """Gives, in place, both ends of every so many-th block one code: there decoders choose how many codes
    lie between."""
    blocks = data.reshape(-1, BLOCK_BYTES[name])[::every]
    colors = {"BC1_RGB_SRGB": 0, "BC3_SRGB": 8}.get(name)
    if colors is not None:
        blocks[:, colors + 2 : colors + 4] = blocks[:, colors : colors + 2]
    for values in {"BC3_SRGB": (0,), "BC4_UNORM": (0,), "BC1_RGB_SRGB": ()}.get(name, (0, 8)):
        blocks[:, values + 1] = blocks[:, values]


def random_texture(name: str, rows: int, columns: int, seed: int = 1) -> Texture:
    """Any bytes: every block and code that there can be, every third block with equal ends."""
    rng = np.random.default_rng(seed)
    levels = []
    for down, across in sizes(rows, columns):
        if name in BLOCK_BYTES:
            count = -(-down // 4) * -(-across // 4) * BLOCK_BYTES[name]
        else:
            count = down * across * TEXEL_BYTES[name]
        data = rng.integers(0, 256, count, dtype=np.uint8)
        if name in BLOCK_BYTES:
            equal_ends(name, data, every=3)
        levels.append(data.tobytes())
    return Texture(name, columns, rows, tuple(levels))


def area_matrix(size: int, to: int) -> np.ndarray:
    """(to, size): the share that each of `size` texels has in each of `to` equal parts of the whole."""
    edges = np.linspace(0.0, size, to + 1)
    texels = np.arange(size)
    overlap = np.minimum(edges[1:, None], texels + 1) - np.maximum(edges[:-1, None], texels)
    return np.maximum(overlap, 0.0) * to / size


def mean(values: np.ndarray, level: int) -> np.ndarray:
    """The area mean (h, w, c) of values (h, w, c) at a level."""
    values = values.astype(np.float64)
    for axis in (0, 1):
        size = values.shape[axis]
        to = max(1, size >> level)
        if size % to == 0:  # whole texels in each part
            values = values.reshape(*values.shape[:axis], to, size // to, *values.shape[axis + 1 :])
            values = values.mean(axis=axis + 1)
        else:
            values = np.moveaxis(np.tensordot(area_matrix(size, to), values, (1, axis)), 0, axis)
    return values


def extended(heights: np.ndarray, reach: int, axis: int, repeats: bool) -> np.ndarray:
    """Heights with `reach` more at both ends of an axis: repeated, or reflected oddly about the last."""
    n = heights.shape[axis]
    places = np.arange(-reach, n + reach)
    if repeats:
        return np.take(heights, places % n, axis)
    edge = np.clip(places, 0, n - 1)
    mirrored = np.take(heights, np.clip(2 * edge - places, 0, n - 1), axis)
    inside = np.expand_dims(places == edge, 1 - axis)
    return np.where(inside, mirrored, 2 * np.take(heights, edge, axis) - mirrored)


def slopes(
    heights: np.ndarray, taps: tuple[Sequence[float], Sequence[float]], wrap: tuple[bool, bool]
) -> tuple[np.ndarray, np.ndarray]:
    """Slopes (h, w) along x and down y of heights by (derivative, smooth): what a filter's taps mean."""
    derivative, smooth = taps
    reach = max(len(derivative), len(smooth) - 1)
    field = extended(extended(heights.astype(np.float64), reach, 0, wrap[1]), reach, 1, wrap[0])

    def along_x(field: np.ndarray) -> np.ndarray:
        down, across = (size - 2 * reach for size in field.shape)
        wide = range(1 - len(smooth), len(smooth))
        mixed = np.sum([field[reach + j : reach + j + down] * smooth[abs(j)] for j in wide], axis=0)
        parts = [
            weight * (mixed[:, reach + k : reach + k + across] - mixed[:, reach - k : reach - k + across])
            for k, weight in enumerate(derivative, start=1)
        ]
        return np.sum(parts, axis=0)

    return along_x(field), along_x(field.T).T


def normals(
    heights: np.ndarray,
    taps: tuple[Sequence[float], Sequence[float]],
    *,
    scale: tuple[float, float] = (1.0, 1.0),
    wrap: tuple[bool, bool] = (False, False),
    green_down: bool = False,
) -> np.ndarray:
    """Unit normals (h, w, 3) of heights by a filter's taps."""
    dx, dy = slopes(heights, taps, wrap)
    return up(dx * scale[0], dy * (-scale[1] if green_down else scale[1]))


EIGHTH = ((4 / 5, -1 / 5, 4 / 105, -1 / 280), (1.0,))


def reach_of_half_steps(ground: HeightMap) -> tuple[np.ndarray, np.ndarray]:
    """How far the eighth-order slopes along x and down y can be off while every height stays within half of
    the gap to the next code; tap by tap, so that beyond an edge the parts of a reflection add up."""
    assert ground.height_levels is not None
    gaps = np.diff(ground.height_levels.astype(np.float64))
    at = np.searchsorted(ground.height_levels, ground.heights)
    halves = np.maximum(np.append(gaps, 0.0)[at], np.append(0.0, gaps)[at]) / 2

    def along_x(halves: np.ndarray, repeats: bool) -> np.ndarray:
        n = halves.shape[1]
        total = np.zeros_like(halves)
        for x in range(n):
            for k, weight in enumerate(EIGHTH[0], start=1):
                for place in (x - k, x + k):
                    edge = min(max(place, 0), n - 1)
                    if repeats or place == edge:
                        room = halves[:, place % n]
                    else:
                        room = 2 * halves[:, edge] + halves[:, min(max(2 * edge - place, 0), n - 1)]
                    total[:, x] += abs(weight) * room
        return total

    return along_x(halves, ground.wrap[0]), along_x(halves.T, ground.wrap[1]).T


def cones(ground: HeightMap) -> np.ndarray:
    """Degrees (h, w) from the true normal to the farthest of the four at the corners of that reach."""
    dx, dy = slopes(ground.heights, EIGHTH, ground.wrap)
    open_x, open_y = reach_of_half_steps(ground)
    x, y = ground.slope_scale
    middle = up(dx * x, dy * y)
    corners = [up((dx + a * open_x) * x, (dy + b * open_y) * y) for a in (-1, 1) for b in (-1, 1)]
    return np.max([angles_between(middle, corner) for corner in corners], axis=0)


def held(ground: HeightMap) -> np.ndarray:
    """Normals of the ground's filter whose slopes are held to that reach."""
    own, exact = (slopes(ground.heights, t, ground.wrap) for t in (metric_taps(ground.filter_name), EIGHTH))
    within = [
        np.clip(slope, middle - room, middle + room)
        for slope, middle, room in zip(own, exact, reach_of_half_steps(ground), strict=True)
    ]
    return up(within[0] * ground.slope_scale[0], within[1] * ground.slope_scale[1])


def normalised(means: np.ndarray) -> np.ndarray:
    length = np.sqrt((means * means).sum(axis=2, keepdims=True))
    return np.where(length > 1e-7, means / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])


def p99(errors: np.ndarray) -> float:
    flat = np.sort(errors.ravel())
    return float(flat[min(flat.size - 1, -(-flat.size * 99 // 100) - 1)])


def angles(
    texture: Texture,
    truths: list[np.ndarray],
    masks: list[np.ndarray] | None = None,
    room: list[np.ndarray] | None = None,
) -> list[dict]:
    """The result of normal_levels for unit vectors (h, w, 3) per level. room: degrees that are no error."""
    out = []
    for level, truth in enumerate(truths):
        found = angles_between(rebuilt(decode_texels(texture, level)[:, :, :2]), truth)
        if room is not None:
            found = np.maximum(0.0, found - room[level])
        found = found.ravel() if masks is None else found[masks[level]]
        if found.size == 0:
            found = np.zeros(1)
        out.append({"mean_deg": found.mean(), "p99_deg": p99(found), "max_deg": found.max()})
    return out


def psnr(squares: np.ndarray) -> float:
    return float(min(120.0, -10 * np.log10(max(1e-12, squares.mean()))))


def differences(found: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    apart = np.abs(found.astype(np.float64) - truth)
    return {"psnr_db": psnr(apart * apart), "p99": p99(apart), "max": float(apart.max())}


def decode_srgb(v: np.ndarray) -> np.ndarray:
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def encode_srgb(v: np.ndarray) -> np.ndarray:
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** (1 / 2.4) - 0.055)


def colors(texture: Texture, pixels: np.ndarray, encoded: bool, cutoff: float | None) -> list[dict[str, Any]]:
    """The result of color_levels."""
    top = {np.dtype(np.uint8): 255.0, np.dtype(np.uint16): 65535.0}.get(pixels.dtype, 1.0)
    exact = np.clip(pixels / np.float64(top), 0.0, 1.0)
    light = decode_srgb(exact[:, :, :3]) if encoded else exact[:, :, :3]
    alpha = exact[:, :, 3:] if exact.shape[2] == 4 else np.ones((*exact.shape[:2], 1))
    out = []
    for level in range(len(texture.levels)):
        opaque = mean(alpha, level)
        weighted = mean(light * alpha, level) / np.maximum(opaque, 1e-300)
        truth = encode_srgb(np.where(opaque > 0, weighted, mean(light, level)))
        decoded = decode_texels(texture, level)
        if level:  # what is wholly transparent may have any colour
            truth = np.where(opaque > 0, truth, decoded[:, :, :3])
        found: dict[str, Any] = differences(decoded[:, :, :3], truth)
        if exact.shape[2] == 4:
            if cutoff is not None and level > 0:
                share = (alpha.astype(np.float32) >= np.float32(cutoff)).mean()
                wanted = int(share * opaque.size + 0.5)
                least = np.sort(opaque.ravel())[::-1][wanted - 1] if wanted else 0.0
                if least > 0:
                    opaque = np.minimum(1.0, opaque * np.clip(cutoff / least, 1 / 16, 16))
            apart = decoded[:, :, 3:].astype(np.float64) - opaque
            found["alpha_psnr_db"] = psnr(apart * apart)
        out.append(found)
    return out
