"""The error of every mip level of a baked map against float64 references.

Level 0's truth is computed from the source in float64; the truth of level k is the area mean of level 0's
over the area of each of its texels (not a mean of means, which differs for odd sizes). Nothing here is shared
with the stages that made the texture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.metrics.angle import angles_deg, rebuilt, reference_normals
from paradize.metrics.psnr import psnr_db
from paradize.metrics.texels import decode_texels

if TYPE_CHECKING:

    import numpy.typing as npt

    from paradize.data import Texture

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    I32 = npt.NDArray[np.int32]


def _six(value: float) -> float:
    return float(f"{value:.6g}")


def _along(values: F64, size: int) -> F64:
    """Area means along axis 0, down to `size`."""
    n = values.shape[0]
    edge = np.arange(size + 1) * n
    first = edge[:-1] // size
    out = np.zeros((size, *values.shape[1:]))
    for step in range(-(-n // size) + 1):
        texel = first + step
        low, high = np.maximum(edge[:-1], texel * size), np.minimum(edge[1:], (texel + 1) * size)
        weight = np.maximum(high - low, 0) / n
        out += values[np.minimum(texel, n - 1)] * weight.reshape(-1, *([1] * (values.ndim - 1)))
    return out


def _mean(values: F64, level: int) -> F64:
    rows, columns = (max(1, size >> level) for size in values.shape[:2])
    return _along(_along(values, rows).swapaxes(0, 1), columns).swapaxes(0, 1)


def _rank(errors: F64) -> tuple[float, float]:
    flat = np.sort(errors.ravel())
    return _six(float(flat[min(flat.size - 1, (flat.size * 99 + 99) // 100 - 1)])), _six(float(flat[-1]))


def _angles(texture: Texture, level: int, truth: F64, inside: npt.NDArray[np.bool_]) -> dict[str, float]:
    angles = angles_deg(rebuilt(decode_texels(texture, level)[:, :, :2]), truth)[inside]
    if angles.size == 0:
        return {"mean_deg": 0.0, "p99_deg": 0.0, "max_deg": 0.0}
    p99, largest = _rank(angles)
    return {"mean_deg": _six(float(angles.sum()) / angles.size), "p99_deg": p99, "max_deg": largest}


def _normalised(means: F64) -> F64:
    length = np.sqrt((means * means).sum(axis=2, keepdims=True))
    return np.where(length > 1e-7, means / np.where(length > 1e-7, length, 1.0), [0.0, 0.0, 1.0])


def _truth(heights: F32, settings: dict[str, Any]) -> F64:
    return reference_normals(heights, 0, heights.shape[0], **settings)


def _inside(islands: I32 | None, shape: tuple[int, int], reach: int = 4) -> F64:
    if islands is None:
        return np.ones(shape)
    wide = np.pad(islands, reach, constant_values=-2)
    out = islands >= 0
    for j in range(2 * reach + 1):
        for i in range(2 * reach + 1):
            out = out & (wide[j : j + shape[0], i : i + shape[1]] == islands)
    return out.astype(np.float64)


def normal_levels(
    texture: Texture, heights: F32, *, slope_scale: tuple[float, float], wrap: tuple[bool, bool],
    filter_name: str, green_down: bool = False, islands: I32 | None = None,
) -> list[dict[str, float]]:  # fmt: skip
    """mean_deg, p99_deg, max_deg of every level of a normal map of heights (h, w), level 0 first."""
    settings = {
        "slope_scale": slope_scale, "wrap": wrap, "filter_name": filter_name, "green_down": green_down
    }  # fmt: skip
    truth, inside = _truth(heights, settings), _inside(islands, heights.shape)
    return [
        _angles(texture, k, _normalised(_mean(truth, k)), _mean(inside, k) > 1 - 1e-9)
        for k in range(len(texture.levels))
    ]


def dudv_levels(
    texture: Texture, heights: F32, *, slope_scale: tuple[float, float], wrap: tuple[bool, bool],
    filter_name: str, green_down: bool = False, islands: I32 | None = None,
) -> list[dict[str, float]]:  # fmt: skip
    """The same of a du/dv map: x and y of the normals less their mean."""
    settings = {
        "slope_scale": slope_scale, "wrap": wrap, "filter_name": filter_name, "green_down": green_down
    }  # fmt: skip
    inside = _inside(islands, heights.shape)
    xy = _truth(heights, settings)[:, :, :2]
    xy = xy - xy.mean(axis=(0, 1))
    return [
        _angles(texture, k, rebuilt(_mean(xy, k)), _mean(inside, k) > 1 - 1e-9)
        for k in range(len(texture.levels))
    ]


def _values(decoded: npt.NDArray[np.floating], truth: F64) -> dict[str, float]:
    p99, largest = _rank(np.abs(decoded - truth))
    return {"psnr_db": _six(psnr_db(decoded, truth)), "p99": p99, "max": largest}


def value_levels(texture: Texture, level0: F32) -> list[dict[str, float]]:
    """psnr_db, p99, max (absolute differences) of every level of linear data (h, w, c), 0..1."""
    truth = level0.astype(np.float64)
    return [_values(decode_texels(texture, k), _mean(truth, k)) for k in range(len(texture.levels))]


def gloss_levels(
    texture: Texture, gloss: F32, heights: F32, *, slope_scale: tuple[float, float], wrap: tuple[bool, bool],
    filter_name: str, green_down: bool = False, islands: I32 | None = None,
) -> list[dict[str, float]]:  # fmt: skip
    """psnr_db, p99, max of every level of gloss (h, w, 2): R averaged, G widened by what the normals lose."""
    del islands
    settings = {
        "slope_scale": slope_scale, "wrap": wrap, "filter_name": filter_name, "green_down": green_down
    }  # fmt: skip
    exact = gloss.astype(np.float64)
    rough = 1.0 - exact[:, :, 1]
    joined = np.dstack([exact[:, :, 0], rough * rough * rough * rough, _truth(heights, settings)])
    out = []
    for k in range(len(texture.levels)):
        mean = _mean(joined, k)
        total = np.ones(mean.shape[:2])
        square = (mean[:, :, 2:] * mean[:, :, 2:]).sum(axis=2)
        some = square > 1e-12
        r = np.sqrt(square[some])
        lost = np.maximum(0.0, 2.0 * (1.0 - square[some]) / (r * (3.0 - square[some])))
        total[some] = np.minimum(1.0, mean[:, :, 1][some] + lost)
        smooth = 1.0 - np.sqrt(np.sqrt(total)) if k else exact[:, :, 1]
        out.append(_values(decode_texels(texture, k), np.dstack([mean[:, :, 0], smooth])))
    return out


def _decoded(v: F64) -> F64:
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def _encoded(v: F64) -> F64:
    return np.where(v <= 0.0031308, v * 12.92, 1.055 * v ** (1 / 2.4) - 0.055)


def color_levels(
    texture: Texture, pixels: npt.NDArray[Any], *, encoded: bool, alpha_cutoff: float | None
) -> list[dict[str, float]]:
    """psnr_db, p99, max of every level's colour, in sRGB-encoded values, and alpha_psnr_db where the texture
    has alpha. pixels (h, w, 3 | 4) u8, u16 or f32; encoded: they are sRGB-encoded, else linear light."""
    top = {"u": {1: 255.0, 2: 65535.0}}.get(pixels.dtype.kind, {}).get(pixels.dtype.itemsize, 1.0)
    exact = np.clip(pixels.astype(np.float64) / top, 0.0, 1.0)
    light = _decoded(exact[:, :, :3]) if encoded else exact[:, :, :3]
    alpha = exact[:, :, 3:] if exact.shape[2] == 4 else np.ones((*exact.shape[:2], 1))
    share = np.count_nonzero(alpha >= np.float32(alpha_cutoff)) / alpha.size if alpha_cutoff else 0.0
    out = []
    for k in range(len(texture.levels)):
        opaque = _mean(alpha, k)
        safe = np.where(opaque > 0, opaque, 1.0)
        mean = np.where(opaque > 0, _mean(light * alpha, k) / safe, _mean(light, k))
        decoded = decode_texels(texture, k)
        truth = _encoded(mean) if k or not encoded else exact[:, :, :3]
        found = _values(decoded[:, :, :3], truth)
        if exact.shape[2] == 4:
            wanted = int(share * opaque.size + 0.5) if alpha_cutoff else 0
            least = np.sort(opaque.ravel())[::-1][wanted - 1] if wanted else 0.0
            factor = min(16.0, max(1 / 16, alpha_cutoff / least)) if k and alpha_cutoff and least > 0 else 1.0
            found["alpha_psnr_db"] = _six(psnr_db(decoded[:, :, 3:], np.minimum(1.0, opaque * factor)))
        out.append(found)
    return out
