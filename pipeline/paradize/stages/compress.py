"""Float mip chains -> Texture: block-compressed where level 0 divides by four, plain bytes elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Texture
from paradize.kernels import bcn, maps

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]


# tier -> searches around a block's endpoints (kernels/bcn_encode.hpp): each gains a little less.
PASSES = {"fast": 0, "balanced": 1, "exact": 4}


def _divides(level: npt.NDArray[np.generic]) -> bool:
    height, width = level.shape[:2]
    return bool(height % 4 == 0 and width % 4 == 0)


def _texture(name: str, level: F32, levels: list[bytes]) -> Texture:
    return Texture(name, level.shape[1], level.shape[0], tuple(levels))


def _blocks(levels: Sequence[F32], tier: str, *, signed: bool) -> list[bytes]:
    return [bcn.encode_values(level, signed=signed, passes=PASSES[tier]) for level in levels]


def unorm8(values: F32) -> npt.NDArray[np.uint8]:
    """Nearest codes 0..255 of values 0..1."""
    return (np.clip(values, np.float32(0), np.float32(1)) * np.float32(255) + np.float32(0.5)).astype(
        np.uint8
    )


def encode_color(
    levels: Sequence[F32], level0: npt.NDArray[np.uint8] | None = None, *, tier: str = "balanced"
) -> Texture:
    """Linear colour (h, w, 3 or 4) -> BC1_RGB_SRGB, BC3_SRGB with alpha, RGBA8_SRGB where they cannot be.

    level0: (h, w, 3 or 4) uint8 sRGB codes for level 0, where the source had them (no round trip).
    """
    alpha = levels[0].shape[2] == 4
    block = _divides(levels[0])
    encode = bcn.encode_bc3 if alpha else bcn.encode_bc1
    out = []
    for index, level in enumerate(levels):
        codes = level0 if index == 0 and level0 is not None else maps.linear_to_srgb8(level)
        if not alpha:
            codes = np.concatenate([codes, np.full_like(codes[:, :, :1], 255)], axis=2)
        if block:
            out.append(encode(codes, passes=PASSES[tier]))
        else:
            out.append(codes.tobytes())
    name = ("BC3_SRGB" if alpha else "BC1_RGB_SRGB") if block else "RGBA8_SRGB"
    return _texture(name, levels[0], out)


def encode_height(levels: Sequence[F32], *, tier: str = "balanced") -> Texture:
    """Heights (h, w, 1) 0..1 -> BC4_UNORM or R8_UNORM."""
    if _divides(levels[0]):
        return _texture("BC4_UNORM", levels[0], _blocks(levels, tier, signed=False))
    return _texture("R8_UNORM", levels[0], [unorm8(level).tobytes() for level in levels])


def encode_gloss(levels: Sequence[F32], *, tier: str = "balanced") -> Texture:
    """Gloss (h, w, 2) 0..1 -> BC5_UNORM or RG8_UNORM."""
    if _divides(levels[0]):
        return _texture("BC5_UNORM", levels[0], _blocks(levels, tier, signed=False))
    return _texture("RG8_UNORM", levels[0], [unorm8(level).tobytes() for level in levels])


def encode_normal(levels: Sequence[F32], *, tier: str = "balanced") -> Texture:
    """Unit normals (h, w, 3) -> BC5_SNORM or RG8_SNORM of x and y."""
    flat = [np.ascontiguousarray(level[:, :, :2]) for level in levels]
    if _divides(levels[0]):
        return _texture("BC5_SNORM", levels[0], _blocks(flat, tier, signed=True))
    return _texture("RG8_SNORM", levels[0], [maps.snorm8(level).tobytes() for level in flat])


def encode_dudv(levels: Sequence[F32]) -> Texture:
    """Du/dv (h, w, 2) -> RG8_SNORM whose codes sum to exactly zero in every level."""
    return _texture("RG8_SNORM", levels[0], [maps.balanced_snorm8(level).tobytes() for level in levels])
