"""Reads the arrays of any GLB, independently of formats/glb/reader.py.

It accepts what other tools write (strides, several buffer views, missing attributes) and does not look at
indices and numbers: the rules do. It refuses only what cannot be read."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.documents import parse_json
from paradize.errors import FormatError

_TYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_SHAPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_OVERLAP = 8
# Numbers of an attribute, by its name without the number behind it (glTF 2.0, "Meshes"); _SWAY is ours.
_WIDTHS = {
    "POSITION": (3,),
    "NORMAL": (3,),
    "TANGENT": (4,),
    "TEXCOORD": (2,),
    "COLOR": (3, 4),
    "_SWAY": (2,),
}
_NUMBER = re.compile(r"_\d+$")
# The exceptions that the lookups below can raise for a JSON chunk of any shape.
_UNREADABLE = (
    FormatError,
    struct.error,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    OverflowError,
    MemoryError,
    RecursionError,
)


@dataclass(frozen=True)
class Primitive:
    """place: JSON pointer. indices: (m,) or None. attributes: glTF name -> (n, k) float32, normalized
    integers decoded. slack: what rounding to integers may add to a vector's length, by name. material: its
    number, None without one; measures: the extras of that material."""

    place: str
    indices: npt.NDArray[np.integer] | None
    attributes: dict[str, npt.NDArray[np.float32]]
    slack: dict[str, float]
    material: int | None
    measures: dict[str, Any]


@dataclass(frozen=True)
class Level:
    """One node with a mesh: its name, extras, primitives, translation and scale."""

    name: str
    extras: dict[str, Any]
    primitives: tuple[Primitive, ...]
    translation: npt.NDArray[np.float64]
    scale: npt.NDArray[np.float64]


def read_levels(data: bytes, file: object) -> list[Level]:
    """Every node that has a mesh, in the order of the file. An accessor used twice is one array. Raises
    FormatError (file, place)."""
    place = "byte 0"
    try:
        magic, version, total = struct.unpack_from("<4sII", data, 0)
        if magic != b"glTF" or version != 2:
            raise ValueError("no GLB of version 2")
        if total != len(data):
            raise ValueError(f"{len(data)} bytes where the header says {total}")
        place = "byte 12"
        length, kind = struct.unpack_from("<I4s", data, 12)
        if kind != b"JSON" or 20 + length > total:
            raise ValueError("no JSON chunk")
        place = "JSON chunk"
        tree = parse_json(data[20 : 20 + length])
        binary = b""
        if 20 + length < total:
            place = f"byte {20 + length}"
            size, kind = struct.unpack_from("<I4s", data, 20 + length)
            if kind != b"BIN\0" or 28 + length + size > total:
                raise ValueError("no BIN chunk")
            binary = data[28 + length : 28 + length + size]
        place = "/nodes"
        arrays = _Arrays(tree, binary)
        levels = []
        for k, node in enumerate(tree.get("nodes", [])):
            if "mesh" not in node:
                continue
            place = f"/meshes/{node['mesh']}"
            mesh = tree["meshes"][node["mesh"]]
            primitives = []
            for i, primitive in enumerate(mesh["primitives"]):
                place = f"/meshes/{node['mesh']}/primitives/{i}"
                indices = None
                if "indices" in primitive:
                    indices = arrays.indices(primitive["indices"])
                    if indices.dtype.kind != "u":
                        raise ValueError(f"indices are {indices.dtype}, not unsigned integers")
                attributes = {name: arrays.floats(at) for name, at in primitive["attributes"].items()}
                for name, values in attributes.items():
                    width, widths = values.shape[1], _WIDTHS.get(_NUMBER.sub("", name))
                    if widths and width not in widths:
                        raise ValueError(f"{name} has {width} numbers, not {' or '.join(map(str, widths))}")
                slack = {name: arrays.slack(at) for name, at in primitive["attributes"].items()}
                number = primitive.get("material")
                extras = {} if number is None else tree["materials"][number].get("extras")
                measures = extras if isinstance(extras, dict) else {}
                primitives.append(Primitive(place, indices, attributes, slack, number, measures))
            place = f"/nodes/{k}"
            stand = (_three(node, "translation", 0.0), _three(node, "scale", 1.0))
            levels.append(
                Level(str(node.get("name", k)), dict(node.get("extras", {})), tuple(primitives), *stand)
            )
    except _UNREADABLE as error:
        text = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise FormatError(text, file=file, place=place) from None
    return levels


def _three(node: dict[str, Any], key: str, otherwise: float) -> npt.NDArray[np.float64]:
    values = np.array(node.get(key, [otherwise] * 3), np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"a {key} of {str(node[key])[:80]}")
    return values


class _Arrays:
    """The accessors of a file, each read once. Together they may hold the bytes of the file _OVERLAP times at
    most, so that a small file cannot cause endless work."""

    def __init__(self, tree: Any, binary: bytes) -> None:
        self._tree, self._binary = tree, binary
        self._values: dict[int, npt.NDArray[Any]] = {}
        self._indices: dict[int, npt.NDArray[Any]] = {}
        self._floats: dict[int, npt.NDArray[np.float32]] = {}
        self._left = _OVERLAP * len(binary) + (1 << 20)

    def of(self, index: int) -> npt.NDArray[Any]:
        """An accessor's values, (count, components)."""
        if index not in self._values:
            values = _accessor(self._tree, self._binary, index)
            self._left -= values.nbytes
            if self._left < 0:
                raise ValueError(f"accessors hold the file's bytes more than {_OVERLAP} times over")
            self._values[index] = values
        return self._values[index]

    def indices(self, index: int) -> npt.NDArray[Any]:
        """An accessor of single numbers, (count,)."""
        if index not in self._indices:
            if self.of(index).shape[1] != 1:
                raise ValueError(f"indices have {self.of(index).shape[1]} numbers, not 1")
            self._indices[index] = self.of(index)[:, 0]
        return self._indices[index]

    def floats(self, index: int) -> npt.NDArray[np.float32]:
        """An accessor as float32, normalized integers decoded."""
        if index not in self._floats:
            values = self.of(index).astype(np.float32)
            if top := self._largest(index):
                values = np.maximum(values / np.float32(top), np.float32(-1.0))
            self._floats[index] = values
        return self._floats[index]

    def slack(self, index: int) -> float:
        """The length of half a step along three axes; 0 if the accessor is not normalized."""
        top = self._largest(index)
        return 0.5 * 3.0**0.5 / top if top else 0.0

    def _largest(self, index: int) -> int:
        """The integer that stands for 1; 0 if the accessor is not normalized."""
        if self._tree["accessors"][index].get("normalized", False) is not True:
            return 0
        kind = self.of(index).dtype
        if kind.kind == "f":
            raise ValueError(f"accessor {index} has normalized floats")
        return int(np.iinfo(kind).max)


def _accessor(tree: Any, binary: bytes, index: int) -> npt.NDArray[Any]:
    """The values of an accessor, (count, components)."""
    if isinstance(index, bool) or not isinstance(index, int) or index < 0:
        raise ValueError(f"accessor {index!r}")
    accessor = tree["accessors"][index]
    kind = np.dtype(_TYPES[accessor["componentType"]]).newbyteorder("<")
    width = _SHAPES[accessor["type"]]
    count = int(accessor["count"])
    if not 0 <= count <= 1 << 31:
        raise ValueError(f"accessor {index} has a count of {count}")
    if "bufferView" not in accessor:
        if count > len(binary):
            raise ValueError(f"accessor {index} has no data")
        return np.zeros((count, width), kind)
    view = tree["bufferViews"][accessor["bufferView"]]
    start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
    item = kind.itemsize * width
    stride = int(view.get("byteStride", item))
    end = start + stride * max(0, count - 1) + (item if count else 0)
    limit = int(view.get("byteOffset", 0)) + int(view["byteLength"])
    if start < 0 or stride < item or end > min(limit, len(binary)):
        raise ValueError(
            f"accessor {index} reaches beyond its buffer ({end} of {min(limit, len(binary))} bytes)"
        )
    if count == 0:
        return np.zeros((0, width), kind)
    shape, strides = (count, width), (stride, kind.itemsize)
    flat = np.frombuffer(binary, np.uint8, count=end - start, offset=start)
    return np.ndarray(shape, kind, flat.data, 0, strides)
