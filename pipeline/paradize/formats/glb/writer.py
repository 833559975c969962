"""The binary chunk of a GLB while it grows: views, accessors, and a mesh's vertices as floats or as codes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import ORIGIN, Mesh, QuantizationGrid, QuantizedValues, Vec3
from paradize.formats.glb.layout import (
    ATTRIBUTES,
    BIN,
    CHUNK,
    CODED,
    DTYPES,
    FLOAT,
    HEADER,
    JSON,
    MAGIC,
    U16,
    U32,
)

ARRAY, ELEMENTS = 34962, 34963
MAX_U16_VERTICES = 65535  # index 65535 is kept free: it restarts primitives
_COMPONENTS = {np.dtype(name): component for component, name in DTYPES.items()}


@dataclass
class Writer:
    """The binary chunk and the tables that describe it, growing together."""

    binary: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def view(self, values: npt.NDArray[Any], target: int, **more: object) -> int:
        """Appends an array's bytes at a multiple of 16, without a copy between; the view's index."""
        self.binary += b"\0" * (-len(self.binary) % 16)
        where = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": values.nbytes}
        self.views.append(where | more | {"target": target})
        self.binary += values.reshape(-1).view(np.uint8).data
        return len(self.views) - 1

    def accessor(self, view: int, component: int, count: int, shape: str, **more: object) -> int:
        """Appends an accessor; its index."""
        entry = {"bufferView": view, "componentType": component, "count": count, "type": shape, **more}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def vertices(self, mesh: Mesh, codes: QuantizedValues | None = None) -> dict[str, int]:
        """Appends the attributes that the mesh has, each in a view of its own, as float32 or as its codes;
        glTF name -> accessor. Rows of codes are padded with zeros to multiples of 4 bytes."""
        made: dict[str, int] = {}
        for key, attribute, shape in ATTRIBUTES:
            values = getattr(mesh if codes is None else codes, attribute)
            if values is None:
                continue
            component = FLOAT if values.dtype == np.float32 else _COMPONENTS[values.dtype]
            more: dict[str, object] = {}
            if component != FLOAT and CODED[key][1]:
                more["normalized"] = True
            if key == "POSITION":
                number = float if component == FLOAT else int
                more["min"] = [number(x) for x in values.min(axis=0)]
                more["max"] = [number(x) for x in values.max(axis=0)]
            rows = np.ascontiguousarray(values, DTYPES[component])
            width = rows.itemsize * rows.shape[1]
            stride = -(-width // 4) * 4
            if stride == width:
                view = self.view(rows, ARRAY)
            else:
                view = self.view(_padded(rows, stride), ARRAY, byteStride=stride)
            made[key] = self.accessor(view, component, len(values), shape, **more)
        return made

    def indices(self, mesh: Mesh) -> tuple[int, int, int]:
        """Appends the triangles' indices: (view, component type, bytes of an index)."""
        component = U16 if len(mesh.positions) <= MAX_U16_VERTICES else U32
        values = np.ascontiguousarray(mesh.triangles, DTYPES[component])
        return self.view(values, ELEMENTS), component, values.itemsize


def placement(origin: Vec3, lattice: QuantizationGrid | None) -> dict[str, list[float]]:
    """What a node needs so that a mesh's positions, or its codes, become places in metres."""
    if lattice is None:
        return {} if origin == ORIGIN else {"translation": list(origin)}
    there = [a + b for a, b in zip(origin, lattice.origin, strict=True)]
    return {"translation": there, "scale": list(lattice.step)}


def joined(text: bytes, binary: bytearray) -> bytes:
    """The file of both chunks. Spaces after the JSON bring the binary chunk's data to a multiple of 16 in the
    file, so that it is mapped aligned; `binary` is padded and then emptied: two of it are one too many."""
    text += b" " * (-(len(text) + HEADER.size + 2 * CHUNK.size) % 16)
    binary += b"\0" * (-len(binary) % 4)
    total = HEADER.size + 2 * CHUNK.size + len(text) + len(binary)
    head = HEADER.pack(MAGIC, 2, total) + CHUNK.pack(len(text), JSON) + text
    found = b"".join((head, CHUNK.pack(len(binary), BIN), binary))
    binary.clear()
    return found


def _padded(rows: npt.NDArray[Any], stride: int) -> npt.NDArray[np.uint8]:
    raw = rows.view(np.uint8).reshape(len(rows), -1)
    wide = np.zeros((len(rows), stride), np.uint8)
    wide[:, : raw.shape[1]] = raw
    return wide
