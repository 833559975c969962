"""Reads STL, binary and text: triangles alone.

Source: M. Burns, "Automated Fabrication", 1993, section 6.5. Normals of facets are not read: they follow from
the corners.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh, SourcePositions
from paradize.errors import SourceError
from paradize.files import read_file
from paradize.kernels.mesh import number_rows
from paradize.kernels.obj import origin_of
from paradize.readers.record import DEFAULT_NAME, LARGEST_COORDINATE, UNKNOWN_SMOOTHING, Model

if TYPE_CHECKING:
    from paradize.data import F64

_HEADER, _FACET = 84, 50  # bytes
_VERTEX = re.compile(rb"\bvertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)", re.I)
_HEAD = 4096  # a binary file holds a zero in as many bytes, a text none
_BLANK = b"\xef\xbb\xbf \t\r\n"
_MEND = "export the model again"


@np.errstate(invalid="ignore")  # a file may hold signalling NaN
def read_stl(path: Path) -> Model:
    """Reads an STL. Corners at one place become one vertex. Raises SourceError for a file that is cut, or
    holds no facets, or coordinates that are no numbers."""
    try:
        data = read_file(path)
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror or error}", file=path) from None
    count = int.from_bytes(data[80:_HEADER], "little")
    needed = _HEADER + count * _FACET
    warnings = []
    is_text = b"\0" not in data[:_HEAD]
    if is_text and data[:_HEAD].lstrip(_BLANK)[:5].lower() == b"solid":
        places = _text(data, path)
        if b"endsolid" not in data[-_HEAD:].lower():
            warnings.append(f"{path}: ends without endsolid: it may be cut; export the model again")
    elif is_text:
        begins = data[:16]
        raise SourceError(
            f"is not an STL: a text that begins with {begins!r}, not with 'solid'", file=path, mend=_MEND
        )
    elif len(data) < needed:
        raise SourceError(f"cut: {len(data)} bytes; its {count} facets need {needed}", file=path, mend=_MEND)
    else:
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
        places = np.frombuffer(data, kind, count, _HEADER)["corners"].astype(np.float64).reshape(-1, 3)
    if not len(places):
        raise SourceError("holds no facets", file=path, mend="export the model with its surface")
    sound = (np.abs(places) <= LARGEST_COORDINATE).all(axis=1)
    if not sound.all():
        at = int(sound.argmin())
        shown = " ".join(f"{value:g}" for value in places[at])
        raise SourceError(f"a corner at {shown}", file=path, place=f"facet {at // 3}", mend=_MEND)
    corners = np.arange(len(places), dtype=np.uint32).reshape(-1, 3)
    origin = origin_of(places, corners)
    rounded = (places - origin).astype(np.float32) + np.float32(0)
    ids, first = number_rows(rounded)
    total = len(corners)
    mesh = Mesh(
        np.ascontiguousarray(rounded[first]),
        ids[corners],
        groups=(Group(DEFAULT_NAME, DEFAULT_NAME, 0, total),),
        origin=origin,
    )
    counts = {"faces": total, "triangles": total, "vertices": len(first)}
    counts |= {"positions_in_file": len(places), "positions_unused": 0}
    smoothing = np.full(total, UNKNOWN_SMOOTHING, np.uint32)
    return Model(mesh, SourcePositions(places[first]), {}, warnings, counts, smoothing)


def _text(data: bytes, path: Path) -> F64:
    rows = _VERTEX.findall(data)
    if len(rows) % 3:
        raise SourceError(f"{len(rows)} corners are not whole facets", file=path, mend=_MEND)
    try:
        return np.array([[float(value) for value in row] for row in rows])
    except ValueError:
        raise SourceError("a corner that is not a number", file=path, mend=_MEND) from None
