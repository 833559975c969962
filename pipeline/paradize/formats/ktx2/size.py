"""Reads the size of a KTX2 from its first bytes, without numpy."""

from __future__ import annotations

import struct

from paradize.errors import FormatError
from paradize.formats.ktx2.layout import IDENTIFIER

_HEAD = struct.Struct("<8I")  # format, type size, width, height, depth, layers, faces, levels
SIZE_BYTES = len(IDENTIFIER) + _HEAD.size  # bytes that ktx2_size needs


def ktx2_size(head: bytes) -> tuple[int, int, int]:
    """Width, height and number of levels. head: the file, or its first SIZE_BYTES. Raises FormatError for
    another format."""
    if not head.startswith(IDENTIFIER) or len(head) < SIZE_BYTES:
        raise FormatError("is not a KTX2")
    _, _, width, height, _, _, _, levels = _HEAD.unpack_from(head, len(IDENTIFIER))
    return width, height, levels
