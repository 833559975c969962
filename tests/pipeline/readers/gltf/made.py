"""Builds small glTF models, sound ones and broken ones."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
TWO = np.array([0, 1, 2, 0, 2, 3], np.uint16)
# A PNG of one red texel.
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"
)


class Made:
    """A document and its one buffer."""

    def __init__(self) -> None:
        self.tree: dict[str, Any] = {"asset": {"version": "2.0"}}
        self.data = bytearray()

    def add(self, table: str, **entry: Any) -> int:
        """Appends to a table; returns the number."""
        self.tree.setdefault(table, []).append(entry)
        return len(self.tree[table]) - 1

    def view(self, data: bytes, **entry: Any) -> int:
        self.data += bytes(-len(self.data) % 4)
        start = len(self.data)
        self.data += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **entry)

    def array(self, values: Any, **entry: Any) -> int:
        """An accessor of (n,) or (n, k) values."""
        values = np.ascontiguousarray(values)
        rows = values.reshape(len(values), -1)
        fields = {
            "bufferView": self.view(values.tobytes()),
            "componentType": CODES[values.dtype.str[1:]],
            "count": len(rows),
            "type": SHAPES[rows.shape[1]],
        }
        return self.add("accessors", **(fields | entry))

    def mesh(self, *primitives: dict[str, Any], **entry: Any) -> int:
        return self.add("meshes", primitives=list(primitives), **entry)

    def show(self, *nodes: int) -> None:
        self.tree["scenes"] = [{"nodes": list(nodes)}]

    def glb(self, path: Path) -> Path:
        if self.data:
            self.tree["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.tree).encode()
        text += b" " * (-len(text) % 4)
        data = bytes(self.data) + bytes(-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data if data else b""
        path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
        return path

    def gltf(self, path: Path, uri: str | None = None) -> Path:
        """The same as text, with a file beside, or with its bytes inside where `uri` is None."""
        inner = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        self.tree["buffers"] = [{"byteLength": len(self.data), "uri": uri or inner}]
        path.write_text(json.dumps(self.tree))
        return path


def square(**attributes: Any) -> tuple[Made, dict[str, Any]]:
    """A document with a square, and its primitive. attributes: arrays by name."""
    made = Made()
    numbers = {"POSITION": made.array(SQUARE)}
    numbers |= {name: made.array(values) for name, values in attributes.items()}
    return made, {"attributes": numbers, "indices": made.array(TWO)}


def shown(primitive: dict[str, Any], made: Made, **node: Any) -> Made:
    """The document with a node that shows the primitive."""
    made.show(made.add("nodes", mesh=made.mesh(primitive), **node))
    return made
