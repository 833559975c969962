"""What the writer and the reader of GLB files share: numbers of the standard, and our order of attributes."""

from __future__ import annotations

import struct

MAGIC = b"glTF"
HEADER = struct.Struct("<4sII")
CHUNK = struct.Struct("<I4s")
JSON, BIN = b"JSON", b"BIN\0"
FLOAT, U16, U32 = 5126, 5123, 5125
SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# glTF name, field of Mesh, type, in the order of the file.
ATTRIBUTES = (
    ("POSITION", "positions", "VEC3"),
    ("NORMAL", "normals", "VEC3"),
    ("TANGENT", "tangents", "VEC4"),
    ("TEXCOORD_0", "uvs", "VEC2"),
    ("TEXCOORD_1", "uvs1", "VEC2"),
    ("COLOR_0", "colors", "VEC4"),
)
