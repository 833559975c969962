"""GLB tiles of a terrain: one node per patch. Tiles are written as they fill and read strictly (see
FORMAT.md).

Source: The Khronos Group, "glTF 2.0 Specification", 2021.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from paradize.data import Mesh, QuantisationGrid, QuantisedValues
from paradize.errors import BakeError
from paradize.formats.glb.layout import (
    ATTRIBUTES,
    FLOAT,
    QUANTISED_TYPES,
    QUANTIZATION,
    SHAPES,
    SHARES,
    U16,
)
from paradize.formats.glb.quantised import decoded
from paradize.formats.glb.reader import Reader, grid_of
from paradize.formats.glb.writer import MAX_U16_VERTICES, Writer, join_chunks, node_transform

TILE_BYTES = 64_000_000  # limit of a tile
_TABLES = 1800  # upper bound of the bytes of JSON per patch
_HEAD = 1000
_ONE_LAYOUT = "all patches of a terrain must have one quantisation grid and the same types, or none"
_COLUMNS = tuple(entry for entry in ATTRIBUTES if entry[0] not in SHARES)


@dataclass(frozen=True)
class TilePatch:
    """index: the patch's row in scene.json. error_m: its measured error. finest: whether no finer patch
    replaces it. quantised: its vertices on the terrain's grid; None: float32."""

    index: int
    mesh: Mesh
    error_m: float
    finest: bool
    quantised: QuantisedValues | None = None


# Shared by all patches of a terrain: the grid and the types of the attributes; None: float32.
_Layout = tuple[QuantisationGrid, tuple[str, ...]] | None


def _layout(patch: TilePatch) -> _Layout:
    quantised = patch.quantised
    if quantised is None:
        return None
    columns = (getattr(quantised, attribute) for _, attribute, _ in _COLUMNS)
    return quantised.grid, tuple("" if values is None else str(values.dtype) for values in columns)


def encode_tiles(patches: Iterable[TilePatch], limit: int = TILE_BYTES) -> Iterator[tuple[bytes, list[int]]]:
    """Packs patches in their order into tiles of at most `limit` bytes, or of one patch. Yields each full
    tile's bytes and the indices of its patches. Raises BakeError for a mesh that lacks an attribute, has
    values that are not finite, or has too many vertices."""
    tile = _Tile()
    for patch in patches:
        _check_patch(patch)
        size = 56 * len(patch.mesh.positions) + 2 * patch.mesh.triangles.size + 16 * (len(_COLUMNS) + 1)
        if tile.indices and tile.size + size + _TABLES > limit:
            yield tile.encoded(), tile.indices
            tile = _Tile()
        tile.add(patch)
    if tile.indices:
        yield tile.encoded(), tile.indices


def _check_patch(patch: TilePatch) -> None:
    mesh, name = patch.mesh, f"patch{patch.index}"
    count = len(mesh.positions)
    if not 0 < count < MAX_U16_VERTICES or not len(mesh.triangles) or int(mesh.triangles.max()) >= count:
        raise BakeError(f"{len(mesh.triangles)} triangles of {count} vertices do not fit", place=name)
    for _, attribute, shape in _COLUMNS:
        values = getattr(mesh, attribute)
        if values is None and attribute == "tangents":
            continue
        if values is None or values.shape != (count, SHAPES[shape]) or not np.isfinite(values).all():
            raise BakeError(f"{attribute} is missing or not finite", place=name)
    if mesh.colors is not None or mesh.sway is not None:
        raise BakeError("a terrain has no vertex colours and does not sway", place=name)


@dataclass
class _Tile:
    """A tile under construction."""

    writer: Writer = field(default_factory=Writer)
    indices: list[int] = field(default_factory=list)
    nodes: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    finest: list[int] = field(default_factory=list)
    layouts: set[_Layout] = field(default_factory=set)

    @property
    def size(self) -> int:
        """An upper bound of its present size in bytes."""
        return len(self.writer.binary) + _TABLES * len(self.indices) + _HEAD

    def add(self, patch: TilePatch) -> None:
        if patch.finest:
            self.finest.append(len(self.nodes))
        attributes = self.writer.vertices(patch.mesh, patch.quantised)
        view, component, _ = self.writer.indices(patch.mesh)
        corners = self.writer.accessor(view, component, patch.mesh.triangles.size, "SCALAR")
        name = f"patch{patch.index}"
        self.layouts.add(_layout(patch))
        if len(self.layouts) > 1:
            raise BakeError(_ONE_LAYOUT, place=name)
        place = node_transform(patch.mesh.origin, patch.quantised.grid if patch.quantised else None)
        extras = {"error_m": patch.error_m}
        self.nodes.append({"name": name, "mesh": len(self.meshes), **place, "extras": extras})
        primitive = {"attributes": attributes, "indices": corners, "material": 0}
        self.meshes.append({"name": name, "primitives": [primitive]})
        self.indices.append(patch.index)

    def encoded(self) -> bytes:
        scene: dict[str, Any] = {"name": "terrain"}
        if self.finest:
            scene["nodes"] = self.finest
        binary = self.writer.binary
        binary += b"\0" * (-len(binary) % 4)
        used = [QUANTIZATION] if self.layouts - {None} else []
        extensions = {"extensionsRequired": used, "extensionsUsed": used} if used else {}
        document = {
            "asset": {"version": "2.0", "generator": "paradize"},
            **extensions,
            "scene": 0,
            "scenes": [scene],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": [{"name": "terrain"}],
            "accessors": self.writer.accessors,
            "bufferViews": self.writer.views,
            "buffers": [{"byteLength": len(binary)}],
        }
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        return join_chunks(text, binary)


def decode_tile(data: bytes, file: object = None) -> list[TilePatch]:
    """Reads the patches of a tile in the order of its nodes. Raises FormatError, with a byte offset or JSON
    pointer, for everything that encode_tiles does not write."""
    reader = Reader(data, file)
    if len(data) > TILE_BYTES:
        raise reader.fault(f"{len(data)} bytes, a tile has at most {TILE_BYTES}", "byte 0")
    nodes = reader.get(reader.document, "", "nodes", list)
    scenes = reader.get(reader.document, "", "scenes", list)
    finest = scenes[0].get("nodes", []) if len(scenes) == 1 and isinstance(scenes[0], dict) else None
    if not isinstance(finest, list) or any(type(index) is not int for index in finest):
        raise reader.fault("one scene with a list of nodes expected", "/scenes")
    if (
        not nodes
        or sorted(set(finest)) != finest
        or (finest and not 0 <= finest[0] <= finest[-1] < len(nodes))
    ):
        raise reader.fault("rising indices of nodes expected", "/scenes/0/nodes")
    finest_set = set(finest)
    patches = [_read_patch(reader, index, index in finest_set) for index in range(len(nodes))]
    if len({_layout(patch) for patch in patches}) > 1:
        raise reader.fault(_ONE_LAYOUT, "/nodes")
    if len({patch.mesh.tangents is None for patch in patches}) > 1:
        raise reader.fault("all patches have tangents, or none", "/meshes")
    required = [] if patches[0].quantised is None else [QUANTIZATION]
    if reader.get(reader.document, "", "extensionsRequired", list, []) != required:
        raise reader.fault(f"{required} expected", "/extensionsRequired")
    for index in range(1, len(patches)):
        if patches[index].index != patches[index - 1].index + 1:
            raise reader.fault("patch numbers must rise without gaps", f"/nodes/{index}/name")
    return patches


def _read_patch(reader: Reader, index: int, finest: bool) -> TilePatch:
    pointer = f"/nodes/{index}"
    node = reader.item("nodes", index, pointer)
    name = reader.get(node, pointer, "name", str)
    number = name.removeprefix("patch")
    if name == number or not (number.isascii() and number.isdigit()) or len(number) > 9:
        raise reader.fault(f"{name[:40]!r}, expected 'patch' and a number", f"{pointer}/name")
    if node.keys() - {"translation", "scale"} != {"name", "mesh", "extras"}:
        raise reader.fault(f"{sorted(node)!r:.80}, expected name, mesh and extras", pointer)
    error_m = reader.get(node, pointer, "extras", dict).get("error_m")
    if isinstance(error_m, bool) or not isinstance(error_m, int | float) or not 0 <= error_m < float("inf"):
        raise reader.fault(f"{str(error_m)[:40]}, expected a number from 0", f"{pointer}/extras/error_m")
    mesh_pointer = f"/meshes/{reader.get(node, pointer, 'mesh', int)}"
    entry = reader.item("meshes", node["mesh"], f"{pointer}/mesh")
    primitives = reader.get(entry, mesh_pointer, "primitives", list)
    if len(primitives) != 1:
        raise reader.fault(f"{len(primitives)} primitives, expected one", f"{mesh_pointer}/primitives")
    mesh_pointer += "/primitives/0"
    keys = reader.get(primitives[0], mesh_pointer, "attributes", dict)
    known = {key for key, _, _ in _COLUMNS}
    if not known - {"TANGENT"} <= keys.keys() <= known:
        raise reader.fault(f"attributes {sorted(keys)!r:.80}", f"{mesh_pointer}/attributes")
    arrays: dict[str, Any] = {}
    for key, attribute, shape in _COLUMNS:
        if key not in keys:
            continue
        components, normalized = QUANTISED_TYPES[key]
        values = reader.accessor(
            keys[key], f"{mesh_pointer}/attributes/{key}", shape, (FLOAT, *components), normalized
        )
        if not np.isfinite(values).all():
            raise reader.fault(f"{key} is not finite", f"{mesh_pointer}/attributes/{key}")
        arrays[attribute] = np.ascontiguousarray(values, values.dtype.newbyteorder("="))
    count = len(arrays["positions"])
    indices = reader.accessor(primitives[0].get("indices"), f"{mesh_pointer}/indices", "SCALAR", (U16,))
    if any(len(values) != count for values in arrays.values()) or not count < MAX_U16_VERTICES:
        raise reader.fault(
            f"{count} vertices, and another number of an attribute, or too many",
            f"{mesh_pointer}/attributes",
        )
    if len(indices) % 3 or int(indices.max()) >= count:
        raise reader.fault(
            f"{len(indices)} indices below {count} expected, three each", f"{mesh_pointer}/indices"
        )
    grid = grid_of(reader, node, pointer, arrays["positions"].dtype != np.float32)
    quantised = None if grid is None else QuantisedValues(grid, **arrays)
    if quantised is not None:
        arrays = decoded(quantised)
    elif any(values.dtype != np.float32 for values in arrays.values()):
        raise reader.fault("quantised attributes beside float positions", f"{mesh_pointer}/attributes")
    mesh = Mesh(**arrays, triangles=indices.astype(np.uint32).reshape(-1, 3))
    return TilePatch(int(number), mesh, float(error_m), finest, quantised)
