"""The JSON chunk of a GLB, taken out and put back."""

from __future__ import annotations

import json
import struct
from typing import Any


def document(data: bytes) -> dict[str, Any]:
    (length,) = struct.unpack_from("<I", data, 12)
    found: dict[str, Any] = json.loads(data[20 : 20 + length])
    return found


def with_document(data: bytes, changed: dict[str, Any]) -> bytes:
    (length,) = struct.unpack_from("<I", data, 12)
    text = json.dumps(changed).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    total = 20 + len(text) + len(rest)
    return struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text + rest
