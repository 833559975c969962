"""Python interface of the native OBJ parser (`obj/parse.hpp`)."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import paradize.kernels.obj._obj as _obj
from paradize.kernels.arrays import finite_rows, to_indices, triangle_rows

ABSENT = 0xFFFFFFFF


@dataclass(frozen=True)
class Note:
    """Something that was skipped or filled in: a stable code, the number of cases, and the line of the
    first."""

    code: str
    count: int
    line: int


@dataclass(frozen=True)
class Run:
    """Triangles from `first_triangle` on with the same names (None: not given) and smoothing group (0:
    off)."""

    first_triangle: int
    object_name: str | None
    group: str | None
    material: str | None
    smoothing: int | None


@dataclass(frozen=True)
class ParsedObj:
    """positions (n, 3; relative to origin), normals (n, 3), uvs (n, 2, top-left origin), colors (n, 4):
    float32, empty where the file has none; rows without a value have zeros, colours 1.
    source_positions: (n, 3) float64, positions in the file; if several became one vertex, the farthest from
    it. triangles: (m, 3) uint32. triangle_lines: (m,) uint32, from 1. collapsed, first_collapsed: triangles
    with an area in the file of which two corners became one vertex, and the first. faults: (message, line)
    each; with faults the arrays and runs are empty."""

    origin: tuple[float, float, float]
    positions: npt.NDArray[np.float32]
    source_positions: npt.NDArray[np.float64]
    normals: npt.NDArray[np.float32]
    uvs: npt.NDArray[np.float32]
    colors: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.uint32]
    triangle_lines: npt.NDArray[np.uint32]
    runs: list[Run]
    libraries: list[str]
    notes: list[Note]
    faults: list[tuple[str, int]]
    fault_count: int
    faces: int
    positions_in_file: int
    positions_unused: int
    collapsed: int
    first_collapsed: int


def decode(raw: bytes) -> str:
    """Decodes a text: UTF-8, else Latin-1."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def decode_name(raw: bytes) -> str:
    """Decodes a name; control characters are replaced."""
    return printable(decode(raw))


def printable(name: str) -> str:
    """A name with control characters replaced."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in name)


def parse_obj(text: bytes) -> ParsedObj:
    """Parses OBJ text, within the limits of `obj/parse.hpp`."""
    return _parsed(_obj.parse(text))


def parse_obj_file(descriptor: int) -> ParsedObj:
    """Parses an open regular file from its current position to its end, in small blocks. Raises OSError, also
    where the size of the file changes meanwhile."""
    try:
        return _parsed(_obj.parse_file(descriptor))
    except OSError as error:
        if error.errno == errno.ESTALE:
            raise OSError(errno.EIO, "changed while it was read") from None
        raise


def origin_of(
    positions: npt.NDArray[np.float64], triangles: npt.NDArray[np.uint32]
) -> tuple[float, float, float]:
    """The place from which float32 positions of a mesh are counted; 0 unless it lies far from 0
    (`obj/origin.hpp`). positions: (n, 3) finite, metres. triangles: (m, 3)."""
    positions = finite_rows(positions, 3, np.float64)
    return _obj.origin_of(positions, triangle_rows(triangles, len(positions)))  # type: ignore[no-any-return]


def cut_polygons(
    positions: npt.NDArray[np.float64],
    corners: npt.NDArray[np.uint32],
    counts: npt.NDArray[np.uint32],
) -> tuple[npt.NDArray[np.uint32], int]:
    """Cuts polygons into triangles, as those of an OBJ are. Returns their places in `corners` (m, 3), and how
    many outlines may cross themselves. positions: (n, 3), finite where a corner is. corners: (c,), positions
    of all polygons, one after the other. counts: (f,), corners of each polygon, at least 3."""
    positions = np.ascontiguousarray(positions, np.float64)
    corners, counts = (to_indices(array) for array in (corners, counts))
    if positions.shape[1:] != (3,) or int(counts.sum(dtype=np.int64)) != len(corners):
        raise ValueError(f"positions {positions.shape}, {len(corners)} corners of {len(counts)} polygons")
    if len(corners) and (int(corners.max()) >= len(positions) or int(counts.min()) < 3):
        raise ValueError(f"index {int(corners.max())} of {len(positions)}, {int(counts.min())} corners")
    if not np.isfinite(positions[corners]).all():
        raise ValueError("a corner is not finite")
    return _obj.cut_polygons(positions, corners, counts)  # type: ignore[no-any-return]


def _parsed(raw: dict[str, Any]) -> ParsedObj:
    names = [decode_name(name) for name in raw["names"]]

    def named(index: int) -> str | None:
        return None if index == ABSENT else names[index]

    runs = [
        Run(first, named(obj), named(group), named(material), None if smoothing == ABSENT else smoothing)
        for first, obj, group, material, smoothing in raw["runs"]
    ]
    return ParsedObj(
        origin=raw["origin"],
        positions=raw["positions"],
        source_positions=raw["texts"],
        normals=raw["normals"],
        uvs=raw["uvs"],
        colors=raw["colors"],
        triangles=raw["triangles"],
        triangle_lines=raw["triangle_lines"],
        runs=runs,
        libraries=[names[index] for index in raw["libraries"]],
        notes=[Note(decode_name(code), count, line) for code, count, line in raw["notes"]],
        faults=[(decode_name(what), line) for what, line in raw["faults"]],
        fault_count=raw["fault_count"],
        faces=raw["faces"],
        positions_in_file=raw["positions_in_file"],
        positions_unused=raw["positions_unused"],
        collapsed=raw["collapsed"],
        first_collapsed=raw["first_collapsed"],
    )
