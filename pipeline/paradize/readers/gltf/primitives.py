"""The triangles of a primitive and the attributes of their vertices, in the space of their node."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.errors import SourceError
from paradize.readers.gltf.accessors import BYTE, FLOAT, INDICES, SHORT, UBYTE, USHORT, Accessors, shares
from paradize.readers.gltf.compression import draco_mesh
from paradize.readers.gltf.document import Document

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import F64

DRACO = "KHR_draco_mesh_compression"
_SMALL = (BYTE, UBYTE, SHORT, USHORT, FLOAT)
# Attribute: the widths that are allowed, the component types (with KHR_mesh_quantization).
_ALLOWED: dict[str, tuple[tuple[int, ...], tuple[int, ...]]] = {
    "POSITION": ((3,), _SMALL),
    "NORMAL": ((3,), (BYTE, SHORT, FLOAT)),
    "TANGENT": ((4,), (BYTE, SHORT, FLOAT)),
    "TEXCOORD": ((2,), _SMALL),
    "COLOR": ((3, 4), (UBYTE, USHORT, FLOAT)),
    "JOINTS": ((4,), (UBYTE, USHORT)),
    "WEIGHTS": ((4,), (UBYTE, USHORT, FLOAT)),
}
_POINTS, _TRIANGLES, _STRIP, _FAN = 0, 4, 5, 6


@dataclass(frozen=True)
class Primitive:
    """triangles: (m, 3), counter-clockwise. values: by attribute, (n, k) float64; POSITION always there.
    material: its number, None without one. targets: morph targets, likewise, displacements."""

    triangles: npt.NDArray[np.int64]
    values: dict[str, F64]
    material: int | None
    targets: list[dict[str, F64]] = field(default_factory=list)


def read_primitive(
    document: Document, accessors: Accessors, entry: dict[str, Any], place: str, targets: int
) -> Primitive | None:
    """Reads a primitive; None for points, lines and no vertices. targets: how many morph targets are read."""
    mode = document.get(entry, place, "mode", int, _TRIANGLES)
    if mode not in range(7):
        raise document.fault(f"{mode}, expected 0 to 6", f"{place}/mode")
    if mode < _TRIANGLES:
        document.warn(f"{'points' if mode == _POINTS else 'lines'} are not read; left out", place)
        return None
    attributes = document.get(entry, place, "attributes", dict)
    where = f"{place}/attributes"
    numbers = {
        name: document.get(attributes, where, name, int)
        for name in attributes
        if name in ("POSITION", "NORMAL", "TANGENT", "COLOR_0")
        or name.startswith(("TEXCOORD_", "JOINTS_", "WEIGHTS_"))
    }
    if "POSITION" not in numbers:
        document.warn("a primitive without positions; left out", place)
        return None
    if "TANGENT" in numbers:
        try:
            accessors.entry(numbers["TANGENT"], f"{where}/TANGENT", *_ALLOWED["TANGENT"])
        except SourceError as error:  # they are only compared with those that are made
            document.warn(f"{error.what}; its tangents are not read", error.place or place)
            del numbers["TANGENT"]
    used = {f"{where}/POSITION": numbers["POSITION"]}
    used[f"{place}/indices"] = document.get(entry, place, "indices", int, None)
    named = [document.item("accessors", number, at) for at, number in used.items() if number is not None]
    if any(accessor.get("count") == 0 for accessor in named):
        document.warn("a primitive without vertices; left out", place)
        return None
    material = document.get(entry, place, "material", int, None)
    packed = document.extension(entry, place, DRACO)
    if packed is not None:
        read = _draco(document, accessors, entry, packed, numbers, place)
    else:
        values = {
            name: accessors.floats(number, f"{where}/{name}", *_ALLOWED[name.partition("_")[0]])
            for name, number in numbers.items()
        }
        count = len(values["POSITION"])
        corners = _corners(document, accessors, entry, count, place)
        read = Primitive(_triangles(document, corners, mode, place), values, material)
    count = len(read.values["POSITION"])
    for name, rows in read.values.items():
        if len(rows) != count:
            raise document.fault(f"{len(rows)} values for {count} positions", f"{where}/{name}")
    if read.triangles.size and int(read.triangles.max()) >= count:
        what = f"index {int(read.triangles.max())} of {count} vertices"
        raise document.fault(what, f"{place}/indices")
    read = replace(read, material=material)
    return _compact(replace(read, targets=_targets(document, accessors, entry, place, count, targets)))


def _corners(
    document: Document, accessors: Accessors, entry: dict[str, Any], count: int, place: str
) -> npt.NDArray[np.int64]:
    number = document.get(entry, place, "indices", int, None)
    if number is None:
        return np.arange(count, dtype=np.int64)
    codes = accessors.codes(number, f"{place}/indices", (1,), INDICES)
    document.spend(codes.size, f"{place}/indices")
    return codes[:, 0].astype(np.int64)


def _triangles(
    document: Document, corners: npt.NDArray[np.int64], mode: int, place: str
) -> npt.NDArray[np.int64]:
    """Corners (m, 3) of a list, a strip or a fan."""
    if mode == _TRIANGLES:
        if left := len(corners) % 3:
            document.warn(f"{len(corners)} indices are not whole triangles; the last {left} left out", place)
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    count = max(len(corners) - 2, 0)
    k = np.arange(count)
    if mode == _FAN:
        return np.stack([corners[k + 1], corners[k + 2], np.broadcast_to(corners[:1], count)], axis=1)
    odd = k % 2
    return np.stack([corners[k], corners[k + 1 + odd], corners[k + 2 - odd]], axis=1)


def _draco(
    document: Document,
    accessors: Accessors,
    entry: dict[str, Any],
    packed: dict[str, Any],
    numbers: dict[str, int],
    place: str,
) -> Primitive:
    """A primitive that Draco packed: its accessors say only types and counts."""
    inner = f"{place}/extensions/{DRACO}"
    data, _ = accessors.buffers.view(document.get(packed, inner, "bufferView", int), f"{inner}/bufferView")
    listed = document.get(packed, inner, "attributes", dict)
    ids = {name: document.get(listed, f"{inner}/attributes", name, int) for name in listed}
    ids = {name: number for name, number in ids.items() if name in numbers}
    if "POSITION" not in ids:
        raise document.fault("lacks POSITION", f"{inner}/attributes")
    indices = accessors.entry(document.get(entry, place, "indices", int), f"{place}/indices", (1,), INDICES)
    count = document.whole(indices, f"/accessors/{entry['indices']}", "count", 1)
    triangles, found = draco_mesh(document, data, ids, count, inner)
    values = {}
    for name, number in numbers.items():
        where = f"{place}/attributes/{name}"
        if name not in found:
            values[name] = accessors.floats(number, where, *_ALLOWED[name.partition("_")[0]])
            continue
        accessor = accessors.entry(number, where, *_ALLOWED[name.partition("_")[0]])
        document.spend(found[name].size, where)
        normalized = document.get(accessor, f"/accessors/{number}", "normalized", bool, False)
        kinds = {BYTE: np.int8, UBYTE: np.uint8, SHORT: np.int16, USHORT: np.uint16}
        kind = kinds.get(accessor["componentType"])
        values[name] = shares(found[name] if kind is None else found[name].astype(kind), normalized)
    return Primitive(triangles.astype(np.int64), values, None)


def _targets(
    document: Document, accessors: Accessors, entry: dict[str, Any], place: str, count: int, wanted: int
) -> list[dict[str, F64]]:
    """The first `wanted` morph targets."""
    out = []
    for k, target in enumerate(document.get(entry, place, "targets", list, [])[:wanted]):
        where = f"{place}/targets/{k}"
        rows = {}
        for name in ("POSITION", "NORMAL"):
            number = document.get(target, where, name, int, None)
            if number is not None:
                rows[name] = accessors.floats(number, f"{where}/{name}", *_ALLOWED[name])
                if len(rows[name]) != count:
                    raise document.fault(f"{len(rows[name])} values for {count} positions", where)
        out.append(rows)
    return out


def _compact(read: Primitive) -> Primitive:
    """Only the vertices that triangles use: primitives may share one long list."""
    used, corners = np.unique(read.triangles, return_inverse=True)
    if len(used) == len(read.values["POSITION"]):
        return read
    values = {name: rows[used] for name, rows in read.values.items()}
    targets = [{name: rows[used] for name, rows in target.items()} for target in read.targets]
    return Primitive(corners.reshape(-1, 3), values, read.material, targets)
