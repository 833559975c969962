"""GLB tiles of a terrain: a node a patch, written as they fill and read back strictly (see FORMAT.md).

Source: The Khronos Group, "glTF 2.0 Specification", 2021.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from paradize.data import Mesh
from paradize.errors import BakeError
from paradize.formats.glb_layout import ATTRIBUTES, BIN, CHUNK, FLOAT, HEADER, JSON, MAGIC, SHAPES, U16

TILE_BYTES = 64_000_000  # a tile's limit
_ARRAY, _ELEMENTS = 34962, 34963
_MAX_VERTICES = 65535  # index 65535 is kept free: it restarts primitives
_TABLES = 1600  # bytes of JSON for a patch, at most
_HEAD = 1000


@dataclass(frozen=True)
class TilePatch:
    """index: the patch's row in scene.json. error_m: measured. finest: whether nothing finer replaces it."""

    index: int
    mesh: Mesh
    error_m: float
    finest: bool


# (index, error_m, finest, byte offsets of the views, vertices, indices, low, high)
_Held = tuple[int, float, bool, list[int], int, int, list[float], list[float]]


def encode_tiles(patches: Iterable[TilePatch]) -> Iterator[tuple[bytes, list[int]]]:
    """Packs patches in their order into tiles of at most TILE_BYTES; gives each tile's bytes and the indices
    of its patches as soon as it is full. Raises BakeError on a mesh that lacks an attribute, has numbers that
    are not finite, or too many vertices."""
    binary = bytearray()
    held: list[_Held] = []
    for patch in patches:
        size = _binary_bytes(patch.mesh)
        if held and len(binary) + size + _TABLES * (len(held) + 1) + _HEAD > TILE_BYTES:
            yield _tile(binary, held), [entry[0] for entry in held]
            binary, held = bytearray(), []
        held.append((patch.index, patch.error_m, patch.finest, *_append(binary, patch)))
    if held:
        yield _tile(binary, held), [entry[0] for entry in held]


_COLUMNS = tuple(entry for entry in ATTRIBUTES if entry[0] != "COLOR_0")


def _binary_bytes(mesh: Mesh) -> int:
    return len(mesh.positions) * 56 + mesh.triangles.size * 2 + 16 * (len(_COLUMNS) + 1)


def _append(binary: bytearray, patch: TilePatch) -> tuple[list[int], int, int, list[float], list[float]]:
    mesh, name = patch.mesh, f"patch{patch.index}"
    count = len(mesh.positions)
    if not 0 < count < _MAX_VERTICES or not len(mesh.triangles) or int(mesh.triangles.max()) >= count:
        raise BakeError(f"{len(mesh.triangles)} triangles of {count} vertices do not fit", place=name)
    offsets = []
    for _, attribute, shape in _COLUMNS:
        values = getattr(mesh, attribute)
        if values is None or values.shape != (count, SHAPES[shape]) or not np.isfinite(values).all():
            raise BakeError(f"{attribute} is missing or not finite", place=name)
        offsets.append(_view(binary, np.ascontiguousarray(values, "<f4").tobytes()))
    offsets.append(_view(binary, np.ascontiguousarray(mesh.triangles, "<u2").tobytes()))
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    return offsets, count, mesh.triangles.size, [float(x) for x in low], [float(x) for x in high]


def _view(binary: bytearray, data: bytes) -> int:
    binary += b"\0" * (-len(binary) % 16)
    at = len(binary)
    binary += data
    return at


def _tile(binary: bytearray, held: list[_Held]) -> bytes:
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    views: list[dict[str, Any]] = []
    for index, error_m, _, offsets, count, indices, low, high in held:
        attributes = {}
        for (key, _, shape), at in zip(_COLUMNS, offsets[:-1], strict=True):
            bounds = {"min": low, "max": high} if key == "POSITION" else {}
            attributes[key] = len(accessors)
            accessors.append(_accessor(len(views), FLOAT, count, shape) | bounds)
            views.append(_buffer_view(at, count * SHAPES[shape] * 4, _ARRAY))
        primitive = {"attributes": attributes, "indices": len(accessors), "material": 0}
        accessors.append(_accessor(len(views), U16, indices, "SCALAR"))
        views.append(_buffer_view(offsets[-1], indices * 2, _ELEMENTS))
        name = f"patch{index}"
        nodes.append({"name": name, "mesh": len(meshes), "extras": {"error_m": error_m}})
        meshes.append({"name": name, "primitives": [primitive]})
    scene: dict[str, Any] = {"name": "terrain"}
    finest = [at for at, entry in enumerate(held) if entry[2]]
    if finest:
        scene["nodes"] = finest
    document = {
        "asset": {"version": "2.0", "generator": "paradize"},
        "scene": 0,
        "scenes": [scene],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{"name": "terrain"}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-(len(text) + HEADER.size + 2 * CHUNK.size) % 16)
    binary += b"\0" * (-len(binary) % 4)
    total = HEADER.size + 2 * CHUNK.size + len(text) + len(binary)
    return b"".join(
        (
            HEADER.pack(MAGIC, 2, total),
            CHUNK.pack(len(text), JSON),
            text,
            CHUNK.pack(len(binary), BIN),
            binary,
        )
    )


def _accessor(view: int, component: int, count: int, shape: str) -> dict[str, Any]:
    return {"bufferView": view, "componentType": component, "count": count, "type": shape}


def _buffer_view(at: int, length: int, target: int) -> dict[str, Any]:
    return {"buffer": 0, "byteOffset": at, "byteLength": length, "target": target}
