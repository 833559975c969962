"""A KTX2 texture without its finest levels."""

from __future__ import annotations

import struct
from dataclasses import replace

from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import NONE
from paradize.formats.ktx2.reader import decode_ktx2

_SCHEME_AT = 44  # of supercompression, in the header


def can_cut(width: int, height: int, fmt: str, finer: int) -> bool:
    """Whether a texture of this size can do without its `finer` finest levels: each must have been halved
    without a remainder, and blocks need sides that divide by four (WebGL's rule)."""
    unit = (4 if fmt.startswith("BC") else 1) << finer
    return width % unit == 0 and height % unit == 0


def cut_ktx2(data: bytes, finer: int, *, zstd_level: int | None, file: object = None) -> bytes:
    """The texture without its `finer` finest levels: the others hold the bytes they held. zstd_level: of
    textures that are supercompressed. Raises FormatError for bytes that we did not write."""
    texture = decode_ktx2(data, file)
    packed = struct.unpack_from("<I", data, _SCHEME_AT)[0] != NONE
    rest = replace(
        texture,
        width=max(1, texture.width >> finer),
        height=max(1, texture.height >> finer),
        levels=texture.levels[finer:],
    )
    return encode_ktx2(rest, zstd_level=zstd_level if packed else None)
