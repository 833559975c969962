"""Constants of GLB that its writer and reader share, and the order of our attributes."""

from __future__ import annotations

import struct

MAGIC = b"glTF"
HEADER = struct.Struct("<4sII")
CHUNK = struct.Struct("<I4s")
JSON, BIN = b"JSON", b"BIN\0"
BYTE, UBYTE, SHORT, U16, U32, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
DTYPES = {BYTE: "<i1", UBYTE: "<u1", SHORT: "<i2", U16: "<u2", U32: "<u4", FLOAT: "<f4"}
SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
# glTF name, field of Mesh, type; in the order of the file.
ATTRIBUTES = (
    ("POSITION", "positions", "VEC3"),
    ("NORMAL", "normals", "VEC3"),
    ("TANGENT", "tangents", "VEC4"),
    ("TEXCOORD_0", "uvs", "VEC2"),
    ("TEXCOORD_1", "uvs1", "VEC2"),
    ("COLOR_0", "colors", "VEC4"),
    ("_SWAY", "sway", "VEC2"),
)
# Of objects only: a terrain has none of them. All lie in 0 to 1.
SHARES = ("COLOR_0", "_SWAY")
QUANTIZATION = "KHR_mesh_quantization"
UNLIT, SPECULAR = "KHR_materials_unlit", "KHR_materials_specular"
STRENGTH = "KHR_materials_emissive_strength"
MATERIAL_EXTENSIONS = (UNLIT, SPECULAR, STRENGTH)
# Allowed component types of quantised attributes, and whether they are normalized.
QUANTISED_TYPES = {
    "POSITION": ((U16,), False),
    "NORMAL": ((BYTE, SHORT), True),
    "TANGENT": ((BYTE, SHORT), True),
    "TEXCOORD_0": ((U16,), True),
    "TEXCOORD_1": ((U16,), True),
    "COLOR_0": ((UBYTE, U16), True),
    "_SWAY": ((UBYTE,), True),
}
