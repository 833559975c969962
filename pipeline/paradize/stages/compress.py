"""Encodes rows of texels into the bytes of a texture's levels, band by band.

`map_table.py` lists the formats of each map. The first is the default if the sides of level 0 divide by
four (WebGL's rule for blocks). The next ones are used if a budget needs them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from paradize.data import Texture
from paradize.kernels import bcn, maps
from paradize.kernels.bc7 import encode_bc7
from paradize.map_table import MAPS

if TYPE_CHECKING:
    from pathlib import Path

    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

_Quality = Literal["fast", "balanced", "exact"]
_BLOCK_BYTES = {"BC1": 8, "BC3": 16, "BC4": 8, "BC5": 16, "BC7": 16}
_TEXEL_BYTES = {"R8": 1, "RG8": 2, "R16": 2, "RG16": 4, "RGBA8": 4}

# Texels of a colour picture up to which blocks save less than 5 KiB. Such a picture is drawn texel by texel
# (swatches, pixel art), and a block makes up to 16 colours of two.
SMALL = 32 * 32
_CHEAP = 128 * 128  # texels up to which blocks save less than 50 KB


def formats_of(
    name: str,
    height: int,
    width: int,
    *,
    tier: str = "balanced",
    alpha: bool = False,
    narrow: bool = False,
) -> tuple[str, ...]:
    """Returns the formats that a map of this size may take, the tier's first. Without block formats if the
    sides do not divide by four, or a colour picture has at most SMALL texels. narrow: only the first channel
    is read."""
    material_map = MAPS[name]
    known = (
        material_map.alpha_formats
        if alpha
        else material_map.narrow_formats
        if narrow
        else material_map.formats
    )
    if tier == "exact" and "BC7_SRGB" in known:
        known = known[known.index("BC7_SRGB") :]
    small = known[-1].endswith("_SRGB") and height * width <= SMALL
    if height % 4 or width % 4 or small:
        known = tuple(fmt for fmt in known if not fmt.startswith("BC"))
    return known


def block_warnings(path: Path, rows: int, columns: int) -> list[str]:
    """A warning where the sides of a picture keep it from the block formats, and that costs much."""
    if (rows % 4 == 0 and columns % 4 == 0) or rows * columns <= _CHEAP:
        return []
    nearest = " x ".join(str(max(4, 4 * round(side / 4))) for side in (columns, rows))
    what = f"{columns} x {rows} texels: block formats need sides that divide by 4, so textures of it are two"
    return [f"{path}: {what} to eight times as large; {nearest} would do"]


def snorm(values: F32, top: int) -> npt.NDArray[Any]:
    """Nearest codes -top..top of values within -1..1; top is 127 or 32767."""
    if top == 127:
        return maps.snorm8(values, threads=1)
    scaled = np.clip(values, np.float32(-1), np.float32(1)).astype(np.float64) * top
    return np.rint(scaled).astype(np.int16)


def unorm(values: F32, top: int) -> npt.NDArray[Any]:
    """Nearest codes 0..top of values within 0..1; top is 255 or 65535."""
    inside = np.clip(values, np.float32(0), np.float32(1))
    if top == 255:
        return (inside * np.float32(255) + np.float32(0.5)).astype(np.uint8)
    return (inside.astype(np.float64) * top + 0.5).astype(np.uint16)


def encode_rows(
    values: npt.NDArray[Any], fmt: str, *, tier: str = "balanced", threads: int = 1, alpha_weight: float = 1.0
) -> bytes:
    """Encodes rows (n, w, c). Colour formats take RGBA codes (n, w, 4) uint8. Signed formats take x and y in
    -1..1; further channels are ignored. Other formats take values in 0..1. Rows of a block format begin at a
    multiple of four, and end at one or at the end of the level. alpha_weight: see kernels/bc7."""
    if fmt == "RGBA8_SRGB":
        return values.tobytes()
    if fmt == "BC1_RGB_SRGB":
        return bcn.encode_bc1(values, quality=cast("_Quality", tier), threads=threads)
    if fmt == "BC3_SRGB":
        return bcn.encode_bc3(values, quality=cast("_Quality", tier), threads=threads)
    if fmt == "BC7_SRGB":
        quality = cast("_Quality", tier)
        return encode_bc7(values, quality=quality, alpha_weight=alpha_weight, threads=threads)
    signed = fmt.endswith("SNORM")
    if signed:
        values = values[:, :, :2]
    if fmt.startswith("BC"):
        return bcn.encode_values(values, signed=signed, quality=cast("_Quality", tier), threads=threads)
    wide = "16" in fmt
    if signed:
        return snorm(np.ascontiguousarray(values), 32767 if wide else 127).tobytes()
    return unorm(values, 65535 if wide else 255).tobytes()


def with_unseen_in_range(codes: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Returns rows of RGBA codes (n, w, 4) whose transparent texels cost the visible ones no precision.

    The colours of a block lie on one line, so a transparent texel far from the visible ones would stretch it.
    Its channels are clamped to the range of theirs. Rows begin at a multiple of four.
    """
    rows, columns = codes.shape[:2]
    seen = codes[:, :, 3] > 0
    if seen.all() or not seen.any():
        return codes
    pad = ((0, -rows % 4), (0, -columns % 4))
    blocks = np.pad(codes[:, :, :3], (*pad, (0, 0)), mode="edge")
    height, width = blocks.shape[:2]
    shape = (height // 4, 4, width // 4, 4, 3)
    visible = np.pad(seen, pad, mode="edge").reshape(*shape[:4], 1)
    colors = blocks.reshape(shape)
    low = np.where(visible, colors, 255).min(axis=(1, 3), keepdims=True)
    high = np.where(visible, colors, 0).max(axis=(1, 3), keepdims=True)
    inside = np.where(visible | (low > high), colors, np.clip(colors, low, high))
    out = codes.copy()
    out[:, :, :3] = inside.reshape(height, width, 3)[:rows, :columns]
    return out


class LevelWriter:
    """Collects the bytes of every level of a texture, band by band, from any thread. Raises ValueError for a
    texture without texels."""

    def __init__(self, fmt: str, height: int, width: int, count: int) -> None:
        if height < 1 or width < 1:
            raise ValueError(f"a texture of {width} x {height} texels")
        self.format, self.height, self.width = fmt, height, width
        self._blocks = fmt.startswith("BC")
        kind = fmt.partition("_")[0]
        self._unit = _BLOCK_BYTES[kind] if self._blocks else _TEXEL_BYTES[kind]
        self.levels = [
            np.zeros((self._rows(max(1, height >> k)), self._row_bytes(k)), np.uint8) for k in range(count)
        ]

    def _rows(self, texels: int) -> int:
        return -(-texels // 4) if self._blocks else texels

    def _row_bytes(self, level: int) -> int:
        return self._rows(max(1, self.width >> level)) * self._unit

    def put(self, level: int, first: int, data: bytes) -> None:
        """The bytes of rows that begin with the level's row `first`, a multiple of four for blocks."""
        rows = np.frombuffer(data, np.uint8).reshape(-1, self._row_bytes(level))
        at = first // 4 if self._blocks else first
        self.levels[level][at : at + len(rows)] = rows

    def texture(self) -> Texture:
        """The texture; the writer is empty afterwards."""
        done = []
        while self.levels:
            done.append(self.levels.pop(0).tobytes())
        return Texture(self.format, self.width, self.height, tuple(done))
