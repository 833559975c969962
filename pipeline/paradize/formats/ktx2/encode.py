"""Writes KTX2 textures: encode_ktx2 writes them, decode_ktx2 reads back what it writes.

Source: The Khronos Group, "KTX File Format Specification, Version 2.0", 2020. FORMAT.md describes the bytes.
Supercompression: Zstandard (RFC 8878), one frame per level with its content size.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from paradize.errors import FormatError
from paradize.formats.ktx2.layout import (
    FORMATS,
    HEADER,
    HEADER_END,
    IDENTIFIER,
    LEVEL,
    MAX_SIZE,
    NONE,
    ZSTD,
    descriptor,
    full_level_count,
    level_bytes,
    level_start,
)
from paradize.formats.ktx2.reader import decode_ktx2

if TYPE_CHECKING:
    from collections.abc import Mapping

    from paradize.data import Texture

__all__ = [
    "FORMATS",
    "IDENTIFIER",
    "MAX_SIZE",
    "decode_ktx2",
    "encode_ktx2",
    "full_level_count",
    "level_bytes",
]

MAX_ZSTD_LEVEL = 22


def _key_values(metadata: Mapping[str, str]) -> bytes:
    """The key/value data, sorted by key as the specification requires. Each value ends with a zero byte."""
    out = bytearray()
    for key in sorted(metadata, key=lambda k: k.encode()):
        entry = key.encode() + b"\0" + metadata[key].encode() + b"\0"
        out += struct.pack("<I", len(entry)) + entry + bytes(-len(entry) % 4)
    return bytes(out)


def _compressed(texture: Texture, zstd_level: int) -> tuple[bytes, ...]:
    """Each level as a Zstandard frame. One thread and a fixed level, so the bytes are reproducible."""
    import zstandard

    packer = zstandard.ZstdCompressor(
        level=zstd_level, write_content_size=True, write_checksum=False, threads=0
    )
    return tuple(packer.compress(data) for data in texture.levels)


def encode_ktx2(
    texture: Texture, metadata: Mapping[str, str] | None = None, *, zstd_level: int | None = None
) -> bytes:
    """Returns the KTX2 file of a texture. The smallest level is first, so that a prefix of the file can be
    drawn.

    metadata: added to (or replaces) KTXorientation "rd" and KTXwriter "paradize"; no zero bytes. zstd_level:
    1 to 22, supercompression with Zstandard; None: none. Raises FormatError for an unknown format, levels of
    the wrong size, and a zstd_level out of range.
    """
    fmt = FORMATS.get(texture.format)
    if fmt is None:
        raise FormatError(f"unknown texture format {texture.format!r}", mend=f"one of {', '.join(FORMATS)}")
    width, height, faces, count = texture.width, texture.height, texture.faces, len(texture.levels)
    if not (1 <= width <= MAX_SIZE and 1 <= height <= MAX_SIZE):
        raise FormatError(f"texture of {width} x {height} texels; 1 to {MAX_SIZE} per side are written")
    if faces not in (1, 6) or (faces == 6 and width != height):
        raise FormatError(f"{faces} faces of {width} x {height}; one, or six square ones, are written")
    if not 1 <= count <= full_level_count(width, height):
        raise FormatError(
            f"{count} levels, but {width} x {height} texels have {full_level_count(width, height)}"
        )
    for level, data in enumerate(texture.levels):
        expected = level_bytes(texture.format, width, height, level, faces)
        if len(data) != expected:
            raise FormatError(f"level {level} holds {len(data)} bytes; {texture.format} needs {expected}")

    if zstd_level is not None and not 1 <= zstd_level <= MAX_ZSTD_LEVEL:
        raise FormatError(f"Zstandard level {zstd_level}; 1 to {MAX_ZSTD_LEVEL} are taken")

    scheme = NONE if zstd_level is None else ZSTD
    stored = texture.levels if zstd_level is None else _compressed(texture, zstd_level)
    descriptor_bytes = descriptor(fmt, scheme)
    key_values = _key_values({"KTXorientation": "rd", "KTXwriter": "paradize", **(metadata or {})})
    descriptor_at = HEADER_END + LEVEL.size * count
    key_values_at = descriptor_at + len(descriptor_bytes)
    offsets = [0] * count
    end = key_values_at + len(key_values)
    for level in reversed(range(count)):
        offsets[level] = level_start(end, fmt, scheme)
        end = offsets[level] + len(stored[level])

    head = bytearray(key_values_at + len(key_values))
    head[: len(IDENTIFIER)] = IDENTIFIER
    HEADER.pack_into(
        head, len(IDENTIFIER),
        fmt.vk, fmt.type_size, width, height, 0, 0, faces, count, scheme,
        descriptor_at, len(descriptor_bytes), key_values_at, len(key_values), 0, 0,
    )  # fmt: skip
    for level, data in enumerate(stored):
        entry = (offsets[level], len(data), len(texture.levels[level]))
        LEVEL.pack_into(head, HEADER_END + LEVEL.size * level, *entry)
    head[descriptor_at:key_values_at] = descriptor_bytes
    head[key_values_at:] = key_values
    parts: list[bytes | bytearray] = [head]  # joined once, because the levels may be large
    position = len(head)
    for level in reversed(range(count)):
        parts += [bytes(offsets[level] - position), stored[level]]
        position = offsets[level] + len(stored[level])
    return b"".join(parts)
