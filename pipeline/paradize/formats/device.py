"""The GPU memory that a baked file takes, read from its header."""

from __future__ import annotations

import struct

from paradize.formats.glb.layout import MAGIC
from paradize.formats.ktx2.layout import IDENTIFIER


def device_bytes(data: bytes) -> int:
    """Bytes that a KTX2 or GLB takes on the GPU; 0 for other files and for damaged ones."""
    try:
        if data[:12] == IDENTIFIER:
            count = struct.unpack_from("<I", data, 40)[0]
            index = struct.unpack_from(f"<{3 * min(count, 32)}Q", data, 80)
            return sum(length or stored for stored, length in zip(index[1::3], index[2::3], strict=True))
        if data[:4] == MAGIC:
            length = struct.unpack_from("<I", data, 12)[0]
            return int(struct.unpack_from("<I", data, 20 + length)[0])
    except struct.error:
        return 0
    return 0
