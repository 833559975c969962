"""Reads the JSON of a GLB without its arrays, for names, bounds and extras. Does not import numpy."""

from __future__ import annotations

import struct
from typing import Any

from paradize.documents import parse_json
from paradize.errors import FormatError
from paradize.formats.glb.layout import CHUNK, HEADER, JSON, MAGIC


def glb_document(glb: bytes, name: str) -> tuple[dict[str, Any], int]:
    """Returns the JSON of a GLB and the offset of the binary chunk's data.

    name: for messages. The JSON is parsed but not checked; reader.py does that. Raises FormatError where
    there is no JSON chunk.
    """
    try:
        length, kind = CHUNK.unpack_from(glb, HEADER.size)
    except struct.error as error:
        raise FormatError(f"is not a GLB: {error}", file=name) from None
    if glb[:4] != MAGIC or kind != JSON:
        raise FormatError("is not a GLB: no JSON chunk", file=name)
    start = HEADER.size + CHUNK.size
    tree = parse_json(glb[start : start + length], name)
    if not isinstance(tree, dict):
        raise FormatError("is not a GLB: its JSON is not an object", file=name)
    return tree, start + length + CHUNK.size
