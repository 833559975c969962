"""Reads the JSON of a GLB, for names, bounds and extras, and some corners of its triangles. Does not import
numpy."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from paradize.documents import json_kind, parse_json
from paradize.errors import FormatError
from paradize.formats.glb.layout import CHUNK, HEADER, JSON, MAGIC

Point = tuple[float, float, float]

_TYPES = {5121: "B", 5123: "H", 5125: "I", 5126: "f"}  # glTF's component types
_COUNTS = {"SCALAR": 1, "VEC3": 3}


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
        raise FormatError(f"is not a GLB: its JSON is {json_kind(tree)}, not an object", file=name)
    return tree, start + length + CHUNK.size


@dataclass(frozen=True)
class _Rows:
    """An accessor. first: byte of the file; stride: bytes; form: of a component, as of struct."""

    first: int
    stride: int
    count: int
    form: str


class Corners:
    """The triangles of a primitive of a GLB that Paradize wrote; metres in the node's space."""

    def __init__(
        self, glb: bytes, indices: _Rows, positions: _Rows, step: Sequence[float], origin: Sequence[float]
    ) -> None:
        self._glb, self._indices, self._positions = glb, indices, positions
        self._step, self._origin = step, origin

    def __len__(self) -> int:
        return self._indices.count // 3

    def of(self, triangle: int) -> list[Point]:
        """The three corners. Raises struct.error for an index outside the file."""
        at = self._indices.first + 3 * triangle * self._indices.stride
        return [self._point(index) for index in struct.unpack_from(f"<3{self._indices.form}", self._glb, at)]

    def _point(self, index: int) -> Point:
        at = self._positions.first + self._positions.stride * index
        raw = struct.unpack_from(f"<3{self._positions.form}", self._glb, at)
        x, y, z = (a + b * c for a, b, c in zip(self._origin, self._step, raw, strict=True))
        return x, y, z


def finest_corners(glb: bytes, name: str) -> Iterator[Corners]:
    """The primitives of the finest level. Raises FormatError if Paradize did not write the file."""
    try:
        tree, start = glb_document(glb, name)
        node = tree["nodes"][0]
        place = node.get("scale", (1.0, 1.0, 1.0)), node.get("translation", (0.0, 0.0, 0.0))

        def rows(index: int) -> _Rows:
            accessor = tree["accessors"][index]
            view = tree["bufferViews"][accessor["bufferView"]]
            form = _TYPES[int(accessor["componentType"])]
            stride = view.get("byteStride", _COUNTS[accessor["type"]] * struct.calcsize(form))
            first = start + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
            return _Rows(first, stride, int(accessor["count"]), form)

        for primitive in tree["meshes"][node["mesh"]]["primitives"]:
            yield Corners(glb, rows(primitive["indices"]), rows(primitive["attributes"]["POSITION"]), *place)
    except (KeyError, IndexError, TypeError, ValueError, struct.error) as error:
        raise FormatError(f"is not a mesh that Paradize wrote: {error}", file=name) from None
