"""Decodes baked textures as the hardware does. The block decoders share nothing with the encoders.

Source: Khronos, "Data Format Specification 1.3", chapters S3TC and RGTC: exact fractions, no intermediate
rounding.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from paradize.metrics.texels_bc7 import decode_bc7

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Texture

    F32 = npt.NDArray[np.float32]
    F64 = npt.NDArray[np.float64]
    U8 = npt.NDArray[np.uint8]

_PLAIN = {
    "R8_UNORM": (np.uint8, 1, 255.0),
    "RG8_UNORM": (np.uint8, 2, 255.0),
    "RG8_SNORM": (np.int8, 2, 127.0),
    "RGBA8_UNORM": (np.uint8, 4, 255.0),
    "RGBA8_SRGB": (np.uint8, 4, 255.0),
    "R16_UNORM": (np.uint16, 1, 65535.0),
    "RG16_UNORM": (np.uint16, 2, 65535.0),
    "RG16_SNORM": (np.int16, 2, 32767.0),
    "RGBA16F": (np.float16, 4, 1.0),
    "R32F": (np.float32, 1, 1.0),
}
_BLOCKS = {
    "BC1_RGB_UNORM": 8,
    "BC1_RGB_SRGB": 8,
    "BC3_UNORM": 16,
    "BC3_SRGB": 16,
    "BC4_UNORM": 8,
    "BC5_UNORM": 16,
    "BC5_SNORM": 16,
    "BC7_UNORM": 16,
    "BC7_SRGB": 16,
}
_BLOCKS_AT_ONCE = 1 << 12


def _select(palettes: F32, index: npt.NDArray[np.integer], size: int) -> F32:
    """Entries of palettes. palettes: `size` entries per block, concatenated. index: (n, 16)."""
    positions = index.astype(np.intp)
    positions += size * np.arange(len(positions), dtype=np.intp)[:, None]
    return palettes.take(positions, axis=0)


def _decode_colors(blocks: U8, four: bool) -> F32:
    """BC1 colour blocks (n, 8) -> (n, 16, 3) in 0..1. four: always four colours, as in BC3."""
    words = blocks[:, :4].view("<u2")
    endpoints = np.empty((len(blocks), 2, 3), np.float32)
    for channel, (shift, bits) in enumerate(((11, 5), (5, 6), (0, 5))):
        top = (1 << bits) - 1
        endpoints[:, :, channel] = ((words >> shift) & top).astype(np.float32) / np.float32(top)
    a, b = endpoints[:, 0], endpoints[:, 1]
    third = np.float32(1) / np.float32(3)
    palette = np.stack([a, b, (a + a + b) * third, (a + b + b) * third], axis=1)
    if not four:
        three_colors = words[:, 0] <= words[:, 1]
        palette[three_colors, 2] = (a[three_colors] + b[three_colors]) * np.float32(0.5)
        palette[three_colors, 3] = 0
    packed = blocks[:, 4:8].view("<u4")
    index = (packed >> (2 * np.arange(16, dtype=np.uint32))) & 3
    return _select(palette.reshape(-1, 3), index, 4)


def _decode_values(blocks: U8, signed: bool) -> F32:
    """BC4 blocks (n, 8) -> (n, 16) in 0..1, signed: -1..1."""
    codes = (blocks[:, :2].view(np.int8) if signed else blocks[:, :2]).astype(np.float32)
    endpoints = np.maximum(codes, np.float32(-127)) / np.float32(127) if signed else codes / np.float32(255)
    a, b = endpoints[:, 0], endpoints[:, 1]
    eight = np.stack([a, b, *(((7 - k) * a + k * b) / np.float32(7) for k in range(1, 7))], axis=1)
    lowest = np.full_like(a, -1 if signed else 0)
    rounded = np.stack(
        [a, b, *(((5 - k) * a + k * b) / np.float32(5) for k in range(1, 5)), lowest, np.ones_like(a)], axis=1
    )
    palette = np.where((codes[:, 0] > codes[:, 1])[:, None], eight, rounded)
    padded = np.zeros((len(blocks), 8), np.uint8)
    padded[:, :6] = blocks[:, 2:8]
    index = (padded.view("<u8") >> (3 * np.arange(16, dtype=np.uint64))) & np.uint64(7)
    return _select(palette.reshape(-1), index, 8)


def bc7_codes(texture: Texture, level: int, face: int = 0) -> U8:
    """The texels (h, w, 4) uint8 of one level of one face of a BC7 texture."""
    width, height = max(1, texture.width >> level), max(1, texture.height >> level)
    across, down = (width + 3) // 4, (height + 3) // 4
    blocks = np.frombuffer(texture.levels[level], np.uint8).reshape(texture.faces, down, across, 16)[face]
    out = np.empty((height, width, 4), np.uint8)
    step = max(1, _BLOCKS_AT_ONCE // across)
    for first in range(0, down, step):
        band = decode_bc7(blocks[first : first + step].reshape(-1, 16))
        grid = band.reshape(-1, across, 4, 4, 4).transpose(0, 2, 1, 3, 4).reshape(-1, 4 * across, 4)
        rows = out[4 * first : 4 * (first + step)]
        rows[:] = grid[: len(rows), :width]
    return out


def decode_texels(texture: Texture, level: int = 0, face: int = 0) -> F32:
    """The texels (h, w, c) float32 of one level of one face. sRGB stays encoded, 0..1; SNORM is -1..1. Raises
    ValueError where the texture is empty or has no such level."""
    if texture.width < 1 or texture.height < 1:
        raise ValueError(f"a texture of {texture.width} x {texture.height} texels")
    if not 0 <= level < len(texture.levels):
        raise ValueError(
            f"level {level} does not exist; the texture has levels 0 to {len(texture.levels) - 1}"
        )
    width, height = max(1, texture.width >> level), max(1, texture.height >> level)
    data = texture.levels[level]
    size = len(data) // texture.faces
    data = data[face * size : (face + 1) * size]
    if texture.format in _PLAIN:
        kind, channels, top = _PLAIN[texture.format]
        plain = np.frombuffer(data, kind).reshape(height, width, channels).astype(np.float32) / np.float32(
            top
        )
        return np.maximum(plain, np.float32(-1)) if texture.format.endswith("SNORM") else plain
    block_bytes = _BLOCKS[texture.format]
    across, down = (width + 3) // 4, (height + 3) // 4
    blocks = np.frombuffer(data, np.uint8).reshape(across * down, block_bytes)
    signed = texture.format.endswith("SNORM")
    if texture.format.startswith("BC7"):
        codes = bc7_codes(texture, level, face).astype(np.float32)
        return np.divide(codes, np.float32(255), out=codes)
    channels = {"BC1": 3, "BC3": 4}.get(texture.format[:3], block_bytes // 8)
    out = np.empty((height, width, channels), np.float32)
    step = max(1, _BLOCKS_AT_ONCE // across)  # rows of blocks decoded together, to stay in the cache
    for first in range(0, down, step):
        band = blocks[first * across : (first + step) * across]
        texels = np.empty((len(band), 16, channels), np.float32)
        if texture.format.startswith("BC1"):
            texels[:] = _decode_colors(np.ascontiguousarray(band), False)
        elif texture.format.startswith("BC3"):
            texels[:, :, :3] = _decode_colors(np.ascontiguousarray(band[:, 8:]), True)
            texels[:, :, 3] = _decode_values(np.ascontiguousarray(band[:, :8]), False)
        else:
            for k in range(channels):
                half = np.ascontiguousarray(band[:, 8 * k : 8 * k + 8])
                texels[:, :, k] = _decode_values(half, signed)
        grid = texels.reshape(-1, across, 4, 4, channels).transpose(0, 2, 1, 3, 4)
        rows = out[4 * first : 4 * (first + step)]
        rows[:] = grid.reshape(-1, 4 * across, channels)[: len(rows), :width]
    return out


def rebuilt(xy: npt.NDArray[np.floating]) -> F64:
    """The unit vector (..., 3) that a shader reconstructs from x and y: z = sqrt(max(0, 1 - x^2 - y^2)),
    normalized."""
    x, y = xy[..., 0].astype(np.float64), xy[..., 1].astype(np.float64)
    z = np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))
    length = np.sqrt(x * x + y * y + z * z)
    out = np.empty((*x.shape, 3))
    for axis, values in enumerate((x, y, z)):
        np.divide(values, length, out=out[..., axis])
    return out
