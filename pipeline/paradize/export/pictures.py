"""Our maps as the textures of a standard glTF material: decoded, put into glTF's channels, written as PNG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Texture
from paradize.formats.png import encode_png
from paradize.metrics.texels import decode_texels
from paradize.preview.pictures import rebuilt, to_bytes
from paradize.preview.shade import to_srgb

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]

_TOE, _CONTRAST, _SHOULDER = 0.22, 1.33, 0.532  # of shaders/lib/tonemap.glsl


def color_png(texture: Texture) -> bytes:
    """sRGB, with alpha if the format has it."""
    return encode_png(to_bytes(decode_texels(texture)))


def normal_png(texture: Texture) -> bytes:
    """glTF's tangent-space normals, green up."""
    return encode_png(to_bytes(rebuilt(decode_texels(texture)[:, :, :2]) * 0.5 + 0.5))


def gloss_png(gloss: Texture | None, occlusion: Texture | None = None, *, smoothness: float = 1.0) -> bytes:
    """G: glTF's roughness, 1 - smoothness (alpha is its square in both); B: metalness, channel G of
    `occlusion`; A: specular intensity; R is not used. Without gloss G and A are 1, without metalness B is.
    smoothness: the material's, a factor on the map's. The larger of both maps gives the size; of the smaller
    the nearest texel counts."""
    shine = None if gloss is None else decode_texels(gloss)
    metal = None if occlusion is None else decode_texels(occlusion)
    rows, columns = (
        max(shown.shape[axis] for shown in (shine, metal) if shown is not None) for axis in (0, 1)
    )
    shown = np.ones((rows, columns, 4), np.float32)
    if shine is not None:
        nearest = _nearest(shine, rows, columns)
        shown[:, :, 1] = 1.0 - np.float32(smoothness) * nearest[:, :, 1]
        shown[:, :, 3] = nearest[:, :, 0]
    if metal is not None and metal.shape[2] > 1:
        shown[:, :, 2] = _nearest(metal, rows, columns)[:, :, 1]
    return encode_png(to_bytes(shown))


def _nearest(values: F32, rows: int, columns: int) -> F32:
    y, x = (np.arange(to) * size // to for to, size in zip((rows, columns), values.shape, strict=False))
    found: F32 = values[y[:, None], x[None, :]]
    return found


def occlusion_png(texture: Texture) -> bytes:
    """R: how much of the light from all around arrives."""
    return encode_png(np.repeat(to_bytes(decode_texels(texture)[:, :, :1]), 3, axis=2))


def sky_pngs(cube: Texture, exposure: float) -> list[bytes]:
    """The six faces as the player shows them: with exposure and tone mapping, sRGB."""
    edge = cube.width
    faces = np.frombuffer(cube.levels[0], np.float16).reshape(6, edge, edge, 4)
    return [encode_png(to_srgb(_tone(face[:, :, :3].astype(np.float32) * exposure))) for face in faces]


def ground_light(sand: F32, effect: F32 | None, share: F32, repeat: tuple[float, float]) -> F32:
    """The terrain's colour from above (h, w, 3), linear. share (h, w): of the sand; the rest is the effect
    map. sand, effect: level 0, linear; repeat: of the sand along x and z."""
    height, width = share.shape
    rows, columns = ((np.arange(n, dtype=np.float64) + 0.5) / n for n in share.shape)
    light = _box(sand, (height / repeat[1], width / repeat[0]))
    out = _sampled(light, rows * repeat[1] % 1.0, columns * repeat[0] % 1.0, wrap=True)
    if effect is not None:
        below = _sampled(effect, rows, columns, wrap=False)
        out = below * (1.0 - share[..., None]) + out * share[..., None]
    return out


def _sampled(values: F32, v: F64, u: F64, *, wrap: bool) -> F32:
    """Interpolates between texels' centres, at all (v, u), each 0..1; beyond the border are the texels of the
    other side, or the nearest."""
    for axis, at in enumerate((v, u)):
        size = values.shape[axis]
        place = at * size - 0.5
        low = np.floor(place).astype(np.int64)
        weight = (place - low).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (-1, 1))
        ends = [(low + k) % size if wrap else np.clip(low + k, 0, size - 1) for k in (0, 1)]
        values = values.take(ends[0], axis) * (1.0 - weight) + values.take(ends[1], axis) * weight
    return values


def _box(values: F32, texels: tuple[float, float]) -> F32:
    """Halves the values along each axis while there are twice as many texels as will be shown."""
    for axis, shown in enumerate(texels):
        while values.shape[axis] >= 2.0 * shown and values.shape[axis] % 2 == 0:
            values = 0.5 * (values.take(range(0, values.shape[axis], 2), axis)) + 0.5 * values.take(
                range(1, values.shape[axis], 2), axis
            )
    return values


def _tone(light: F32) -> F32:
    """The player's tone curve: H. Uchimura, "HDR Theory and Practice", CEDEC 2017."""
    x = np.clip(light, 0.0, 1e4)
    toe = _TOE * (np.maximum(x, 1e-6) / _TOE) ** _CONTRAST
    shoulder = 1.0 - (1.0 - _SHOULDER) * np.exp(-(x - _SHOULDER) / (1.0 - _SHOULDER))
    near = np.clip(x / _TOE, 0.0, 1.0)
    low = 1.0 - near * near * (3.0 - 2.0 * near)
    high = (x >= _SHOULDER).astype(np.float32)
    out: F32 = np.clip(toe * low + x * (1.0 - low - high) + shoulder * high, 0.0, 1.0)
    return out
