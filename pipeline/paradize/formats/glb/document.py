"""The JSON of a GLB, without its arrays: light, for who needs names, bounds and extras alone. No numpy."""

from __future__ import annotations

import struct
from typing import Any

from paradize.documents import parse_json
from paradize.errors import FormatError
from paradize.formats.glb.layout import CHUNK, HEADER, JSON, MAGIC


def glb_document(glb: bytes, name: str) -> tuple[dict[str, Any], int]:
    """The JSON chunk of a GLB, and the byte at which its binary chunk's data begin.

    name: stands in messages. The document is parsed, not checked: reader.py does that. Raises FormatError
    where there is no JSON chunk.
    """
    try:
        length, kind = CHUNK.unpack_from(glb, HEADER.size)
    except struct.error as error:
        raise FormatError(f"is no GLB: {error}", file=name) from None
    if glb[:4] != MAGIC or kind != JSON:
        raise FormatError("is no GLB: no JSON chunk", file=name)
    start = HEADER.size + CHUNK.size
    tree = parse_json(glb[start : start + length], name)
    if not isinstance(tree, dict):
        raise FormatError("is no GLB: its JSON is no object", file=name)
    return tree, start + length + CHUNK.size
