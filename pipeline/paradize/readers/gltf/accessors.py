"""Accessors as arrays."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.readers.gltf.buffers import Buffers
from paradize.readers.gltf.document import Document

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import F64

BYTE, UBYTE, SHORT, USHORT, UINT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
TYPES = {BYTE: "<i1", UBYTE: "<u1", SHORT: "<i2", USHORT: "<u2", UINT: "<u4", FLOAT: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
INDICES = (UBYTE, USHORT, UINT)


class Accessors:
    """The arrays of a document. Each is read once."""

    def __init__(self, document: Document, buffers: Buffers) -> None:
        self.document, self.buffers = document, buffers
        self._codes: dict[int, npt.NDArray[Any]] = {}
        self._floats: dict[int, F64] = {}

    def entry(
        self, index: int, where: str, widths: Collection[int], components: Collection[int]
    ) -> dict[str, Any]:
        """The JSON of an accessor whose type and component type are among these."""
        entry, place = self.document.item("accessors", index, where), f"/accessors/{index}"
        kind = self.document.get(entry, place, "type", str)
        if WIDTHS.get(kind) not in widths:
            raise self.document.fault(f"{kind[:20]!r}, not allowed for {where}", f"{place}/type")
        component = self.document.get(entry, place, "componentType", int)
        if component not in components:
            raise self.document.fault(f"{component}, not allowed for {where}", f"{place}/componentType")
        return entry

    def codes(
        self, index: int, where: str, widths: Collection[int], components: Collection[int] = tuple(TYPES)
    ) -> npt.NDArray[Any]:
        """(n, k) values as they are stored. where: the JSON pointer that names the accessor."""
        entry = self.entry(index, where, widths, components)
        if index not in self._codes:
            self._codes[index] = self._read(entry, f"/accessors/{index}")
        return self._codes[index]

    def floats(
        self, index: int, where: str, widths: Collection[int], components: Collection[int] = tuple(TYPES)
    ) -> F64:
        """(n, k) float64; normalized integers as shares."""
        entry = self.entry(index, where, widths, components)
        if index not in self._floats:
            codes = self.codes(index, where, widths, components)
            place = f"/accessors/{index}"
            self.document.spend(codes.size, place)
            normalized = self.document.get(entry, place, "normalized", bool, False)
            self._floats[index] = shares(codes, normalized)
        return self._floats[index]

    def _read(self, entry: dict[str, Any], place: str) -> npt.NDArray[Any]:
        document = self.document
        kind = np.dtype(TYPES[entry["componentType"]])
        count, width = document.whole(entry, place, "count", 1), WIDTHS[entry["type"]]
        sparse = document.get(entry, place, "sparse", dict, None)
        if document.get(entry, place, "bufferView", int, None) is not None:
            values = self._rows(entry, place, kind, count, width)
        else:
            document.spend(count * width, place)
            values = np.zeros((count, width), kind)
        if sparse is None:
            return values
        document.spend(count * width, place)
        values = np.array(values)
        inner = f"{place}/sparse"
        some = document.whole(sparse, inner, "count", 1)
        if some > count:
            raise document.fault(f"{some} of {count} values", f"{inner}/count")
        rows = document.get(sparse, inner, "indices", dict)
        component = document.get(rows, f"{inner}/indices", "componentType", int)
        if component not in INDICES:
            raise document.fault(f"{component}, expected one of {INDICES}", f"{inner}/indices/componentType")
        numbers = self._rows(rows, f"{inner}/indices", np.dtype(TYPES[component]), some, 1)[:, 0]
        if int(numbers.max()) >= count:
            raise document.fault(f"index {int(numbers.max())} of {count} values", f"{inner}/indices")
        others = document.get(sparse, inner, "values", dict)
        values[numbers] = self._rows(others, f"{inner}/values", kind, some, width)
        return values

    def _rows(
        self, owner: dict[str, Any], place: str, kind: np.dtype[Any], count: int, width: int
    ) -> npt.NDArray[Any]:
        """Rows of a view, without a copy."""
        document = self.document
        index = document.get(owner, place, "bufferView", int)
        data, stride = self.buffers.view(index, f"{place}/bufferView")
        offset = document.whole(owner, place, "byteOffset", 0, 0)
        packed = width * kind.itemsize
        step = packed if stride is None else stride
        if step < packed:
            raise document.fault(f"a stride of {step} bytes for values of {packed}", place)
        end = offset + (count - 1) * step + packed
        if end > len(data):
            raise document.fault(f"{count} values end at byte {end} of a view of {len(data)}", place)
        return np.ndarray((count, width), kind, data, offset, (step, kind.itemsize))


@np.errstate(invalid="ignore")  # a file may hold signalling NaN
def shares(codes: npt.NDArray[Any], normalized: bool) -> F64:
    """Values as float64; normalized integers from 0 or -1 to 1."""
    values = codes.astype(np.float64)
    if normalized and codes.dtype.kind in "iu":
        values /= np.iinfo(codes.dtype).max
        np.maximum(values, -1.0, out=values)
    return values
