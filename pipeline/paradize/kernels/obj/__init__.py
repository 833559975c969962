"""Checked face of the native OBJ parser (`obj/parse.hpp`)."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import paradize.kernels.obj._obj as _obj

ABSENT = 0xFFFFFFFF


@dataclass(frozen=True)
class Note:
    """Something left out or filled in: a stable code, how often, and the line of the first."""

    code: str
    count: int
    line: int


@dataclass(frozen=True)
class Run:
    """Triangles from `first_triangle` on that share names (None: not given) and smoothing group (0: off)."""

    first_triangle: int
    object_name: str | None
    group: str | None
    material: str | None
    smoothing: int | None


@dataclass(frozen=True)
class ParsedObj:
    """positions (n, 3; counted from origin), normals (n, 3), uvs (n, 2, top-left origin), colors (n, 4):
    float32, empty where the file has none (zeros in single rows that lack them); texts (n, 3) float64: the
    positions in the file, of several that became one vertex the farthest from it; triangles (m, 3) uint32;
    triangle_lines (m,) uint32, from 1. collapsed: triangles with an area in the file of which two corners
    became one vertex, and the first. With faults, (message, line) each, everything else is empty."""

    origin: tuple[float, float, float]
    positions: npt.NDArray[np.float32]
    texts: npt.NDArray[np.float64]
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


def decode_name(raw: bytes) -> str:
    """Bytes of a name -> text: UTF-8, else Latin-1, without control characters."""
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)


def parse_obj(text: bytes, *, elements: int = 200_000_000, ear_tests: int = 400_000_000) -> ParsedObj:
    """Reads OBJ text. elements: most vertices, uvs, normals or face corners, each; ear_tests: the work that
    may go into cutting concave polygons, for the whole file."""
    return _parsed(_obj.parse(text, elements, ear_tests))


def parse_obj_file(
    descriptor: int, *, elements: int = 200_000_000, ear_tests: int = 400_000_000
) -> ParsedObj:
    """The same for an open regular file, read from its place to its end in small blocks. Raises OSError, also
    where the file changes its size meanwhile."""
    try:
        return _parsed(_obj.parse_file(descriptor, elements, ear_tests))
    except OSError as error:
        if error.errno == errno.ESTALE:
            raise OSError(errno.EIO, "changed while it was read") from None
        raise


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
        texts=raw["texts"],
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
