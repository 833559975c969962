"""The binary chunk of a GLB under construction: buffer views, accessors, and vertices as float32 or
quantised."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import ORIGIN, Mesh, QuantisationGrid, QuantisedValues, Vec3
from paradize.formats.glb.layout import (
    ATTRIBUTES,
    BIN,
    CHUNK,
    DTYPES,
    FLOAT,
    HEADER,
    JSON,
    MAGIC,
    QUANTISED_TYPES,
    U16,
    U32,
)

ARRAY, ELEMENTS = 34962, 34963
MAX_U16_VERTICES = 65535  # index 65535 restarts primitives
_COMPONENTS = {np.dtype(name): component for component, name in DTYPES.items()}


@dataclass
class Writer:
    """The binary chunk and the tables that describe it."""

    binary: bytearray = field(default_factory=bytearray)
    views: list[dict[str, Any]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def view(self, values: npt.NDArray[Any], target: int, **more: object) -> int:
        """Appends an array at a multiple of 16 bytes. Returns the index of its view."""
        self.binary += b"\0" * (-len(self.binary) % 16)
        where = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": values.nbytes}
        self.views.append(where | more | {"target": target})
        self.binary += values.reshape(-1).view(np.uint8).data
        return len(self.views) - 1

    def accessor(self, view: int, component: int, count: int, shape: str, **more: object) -> int:
        """Appends an accessor. Returns its index."""
        entry = {"bufferView": view, "componentType": component, "count": count, "type": shape, **more}
        self.accessors.append(entry)
        return len(self.accessors) - 1

    def vertices(self, mesh: Mesh, quantised: QuantisedValues | None = None) -> dict[str, int]:
        """Appends the attributes of a mesh, each in its own view, as float32 or quantised. Returns accessors
        by glTF name. Rows of integers are padded with zeros to multiples of 4 bytes."""
        accessors: dict[str, int] = {}
        for key, attribute, shape in ATTRIBUTES:
            values = getattr(mesh if quantised is None else quantised, attribute)
            if values is None:
                continue
            component = FLOAT if values.dtype == np.float32 else _COMPONENTS[values.dtype]
            more: dict[str, object] = {}
            if component != FLOAT and QUANTISED_TYPES[key][1]:
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
                view = self.view(_pad(rows, stride), ARRAY, byteStride=stride)
            accessors[key] = self.accessor(view, component, len(values), shape, **more)
        return accessors

    def indices(self, mesh: Mesh) -> tuple[int, int, int]:
        """Appends the indices of the triangles. Returns the view, the component type and the bytes of an
        index."""
        component = U16 if len(mesh.positions) <= MAX_U16_VERTICES else U32
        values = np.ascontiguousarray(mesh.triangles, DTYPES[component])
        return self.view(values, ELEMENTS), component, values.itemsize


def node_transform(origin: Vec3, grid: QuantisationGrid | None) -> dict[str, list[float]]:
    """The translation and scale of a node that turn a mesh's positions, float or quantised, into metres."""
    if grid is None:
        return {} if origin == ORIGIN else {"translation": list(origin)}
    translation = [a + b for a, b in zip(origin, grid.origin, strict=True)]
    return {"translation": translation, "scale": list(grid.step)}


def join_chunks(text: bytes, binary: bytearray) -> bytes:
    """Returns the GLB of both chunks. Spaces after the JSON align the binary chunk to 16 bytes in the file,
    so that it can be mapped. `binary` is padded and then emptied, to keep only one copy in memory."""
    text += b" " * (-(len(text) + HEADER.size + 2 * CHUNK.size) % 16)
    binary += b"\0" * (-len(binary) % 4)
    total = HEADER.size + 2 * CHUNK.size + len(text) + len(binary)
    head = HEADER.pack(MAGIC, 2, total) + CHUNK.pack(len(text), JSON) + text
    glb = b"".join((head, CHUNK.pack(len(binary), BIN), binary))
    binary.clear()
    return glb


def _pad(rows: npt.NDArray[Any], stride: int) -> npt.NDArray[np.uint8]:
    raw = rows.view(np.uint8).reshape(len(rows), -1)
    padded = np.zeros((len(rows), stride), np.uint8)
    padded[:, : raw.shape[1]] = raw
    return padded
