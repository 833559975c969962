"""Removes the finest levels of a KTX2 texture."""

from __future__ import annotations

import struct
from dataclasses import replace

from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import NONE
from paradize.formats.ktx2.reader import decode_ktx2

_SCHEME_OFFSET = 44  # of the supercompression scheme


def can_cut(width: int, height: int, fmt: str, finer: int) -> bool:
    """Whether a texture of this size can lose its `finer` finest levels. Each must divide by two, and with
    block compression the remaining sides by four (WebGL's rule)."""
    unit = (4 if fmt.startswith("BC") else 1) << finer
    return width % unit == 0 and height % unit == 0


def cut_ktx2(data: bytes, finer: int, *, zstd_level: int | None, file: object = None) -> bytes:
    """Returns the texture without its `finer` finest levels; the bytes of the others are unchanged.
    zstd_level: for supercompressed textures. Raises FormatError for a texture that we did not write."""
    texture = decode_ktx2(data, file)
    compressed = struct.unpack_from("<I", data, _SCHEME_OFFSET)[0] != NONE
    coarser = replace(
        texture,
        width=max(1, texture.width >> finer),
        height=max(1, texture.height >> finer),
        levels=texture.levels[finer:],
    )
    return encode_ktx2(coarser, zstd_level=zstd_level if compressed else None)
