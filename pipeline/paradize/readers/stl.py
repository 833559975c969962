"""Reads STL, binary and text: triangles; of a text also polygons, cut as those of an OBJ are; of a binary
file the colours of facets.

Source: M. Burns, "Automated Fabrication", 1993, section 6.5. Normals of facets are not read: they follow from
the corners.
"""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh, SourcePositions
from paradize.errors import SourceError, unread
from paradize.files import read_file
from paradize.kernels.mesh import number_rows
from paradize.kernels.obj import cut_polygons, origin_of
from paradize.readers.colors import linear_colors
from paradize.readers.names import END_MARKS
from paradize.readers.record import DEFAULT_NAME, LARGEST_COORDINATE, UNKNOWN_SMOOTHING, Model

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import F64

_HEADER, _FACET, _ATTRIBUTE = 84, 50, 2  # bytes; the last of a facet may hold its colour
_COLOR = re.compile(rb"COLOR=(...)", re.S)  # in a header of Magics: red, green, blue of the whole
_FLAG, _MOST = 1 << 15, 31.0  # of the bits of a colour: the highest, and the number that stands for 1
# A corner, the end of a loop, or the begin of one or the line of a solid's name, which may hold all words.
_PIECE = re.compile(
    rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)|\b(end\s*loop)\b"
    rb"|\b(outer\s+loop|(?:end)?solid\b(?:(?!facet\s+normal)[^\r\n])*)",
    re.I,
)
_HEAD = 4096  # a binary file holds a zero in as many bytes, a text none
_BLANK = b"\xef\xbb\xbf \t\r\n"
_MEND = "export the model again"


@np.errstate(invalid="ignore")  # a file may hold signalling NaN
def read_stl(path: Path) -> Model:
    """Reads an STL. Corners at one place become one vertex. Raises SourceError for a file that is cut, or
    holds no facets, a loop of fewer than three corners, or coordinates that are no numbers."""
    try:
        data = read_file(path)
    except OSError as error:
        raise unread(error, path) from None
    count = int.from_bytes(data[80:_HEADER], "little")
    needed = _HEADER + count * _FACET
    warnings: list[str] = []
    colors = None
    is_solid = data[:_HEAD].lstrip(_BLANK)[:5].lower() == b"solid"
    is_text = b"\0" not in (data[:_HEAD].rstrip(END_MARKS) if is_solid else data[:_HEAD])
    if is_text and is_solid:
        data = data.rstrip(END_MARKS)
        places, counts = _text(data, path)
        if b"endsolid" not in data[-_HEAD:].lower():
            warnings.append(f"{path}: ends without endsolid: it may be cut; export the model again")
    elif is_text:
        begins = data[:16]
        raise SourceError(
            f"is not an STL: a text that begins with {begins!r}, not with 'solid'", file=path, mend=_MEND
        )
    elif len(data) + _ATTRIBUTE < needed:  # the last facet's may be missing: 3ds Max leaves out a byte
        raise SourceError(f"cut: {len(data)} bytes; its {count} facets need {needed}", file=path, mend=_MEND)
    else:
        kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")])
        facets = np.frombuffer(data.ljust(needed, b"\0"), kind, count, _HEADER)
        places = facets["corners"].astype(np.float64).reshape(-1, 3)
        counts = np.full(count, 3, np.uint32)
        colors = _colors(facets["attribute"], data[:80], path, warnings)
        if more := max(len(data) - needed, 0) // _FACET:
            what = f"holds bytes of {more} facets behind the {count} that its header says; these are left out"
            warnings.append(f"{path}: {what}: export the model again")
    if not len(places):
        raise SourceError("holds no facets", file=path, mend="export the model with its surface")
    sound = (np.abs(places) <= LARGEST_COORDINATE).all(axis=1)
    if not sound.all():
        at = int(sound.argmin())
        shown = " ".join(f"{value:g}" for value in places[at])
        facet = int(np.searchsorted(np.cumsum(counts), at, side="right"))
        raise SourceError(f"a corner at {shown}", file=path, place=f"facet {facet}", mend=_MEND)
    corners = _triangles(places, counts, path, warnings)
    origin = origin_of(places, corners)
    rounded = (places - origin).astype(np.float32) + np.float32(0)
    rows = rounded if colors is None else np.concatenate([rounded, colors.repeat(3, axis=0)], axis=1)
    ids, first = number_rows(rows)
    total = len(corners)
    mesh = Mesh(
        np.ascontiguousarray(rounded[first]),
        ids[corners],
        colors=None if colors is None else np.ascontiguousarray(rows[first, 3:]),
        groups=(Group(DEFAULT_NAME, DEFAULT_NAME, 0, total),),
        origin=origin,
    )
    found = {"faces": len(counts), "triangles": total, "vertices": len(first)}
    found |= {"positions_in_file": len(places), "positions_unused": 0}
    smoothing = np.full(total, UNKNOWN_SMOOTHING, np.uint32)
    return Model(mesh, SourcePositions(places[first]), {}, warnings, found, smoothing)


def _colors(
    bits: npt.NDArray[np.uint16], header: bytes, path: Path, warnings: list[str]
) -> npt.NDArray[np.float32] | None:
    """The colours of facets (n, 4), linear; None where they have none. bits: (n,), the last bytes of each.

    Three numbers of five bits and a flag. Magics, known by its header, puts red lowest, and sets the flag
    where a facet has the colour that the header names. Others (VisCAM, SolidView) put blue lowest, and set
    the flag where a facet has a colour; the rest are white. Facets have none where all hold 0, whatever the
    header names, or where all hold one number that fills these bytes without a header of Magics.
    """
    whole = _COLOR.search(header)
    if not bits.any() or (whole is None and ((bits == bits[0]).all() or not (bits & _FLAG).any())):
        return None
    shares = (bits[:, None] >> np.array([0, 5, 10], np.uint16) & 31) / _MOST
    flagged = (bits & _FLAG != 0)[:, None]
    if whole:
        rgb = np.where(flagged, np.frombuffer(whole[1], np.uint8) / 255.0, shares)
    else:
        rgb = np.where(flagged, shares[:, ::-1], 1.0)
    return linear_colors(rgb, ["f8"] * 3, "facet colours", path, warnings)


def _triangles(
    places: F64, counts: npt.NDArray[np.uint32], path: Path, warnings: list[str]
) -> npt.NDArray[np.uint32]:
    """The corners (m, 3) of the triangles of facets. counts: (f,), corners of each."""
    corners = np.arange(len(places), dtype=np.uint32)
    polygons = int((counts > 3).sum())
    if not polygons:
        return corners.reshape(-1, 3)
    warnings.append(f"{path}: {polygons} facets with more than three corners; cut into triangles")
    cut, crossing = cut_polygons(places, corners, counts)
    if crossing:
        warnings.append(f"{path}: {crossing} polygons whose outline crosses itself; triangles may overlap")
    return cut


def _text(data: bytes, path: Path) -> tuple[F64, npt.NDArray[np.uint32]]:
    """The corners (n, 3) of all loops, and how many each loop has. Raises SourceError, with the line, for a
    corner that is not three numbers and for a loop that is no facet."""
    rows = _PIECE.findall(data)

    def fault(what: str, row: int) -> SourceError:
        at = next(islice(_PIECE.finditer(data), row, None)).start()
        line = 1 + (data.count(b"\n", 0, at) or data.count(b"\r", 0, at))
        return SourceError(what, file=path, place=f"line {line}", mend=_MEND)

    places = []
    for k, (x, y, z, _, _) in enumerate(rows):
        if not x:
            continue
        sound = b"_" not in x + y + z  # a form that only Python accepts
        try:
            places.append((float(x), float(y), float(z)))
        except ValueError:
            sound = False
        if not sound:
            shown = b" ".join((x, y, z)).decode("latin-1")[:80]
            raise fault(f"a corner at {shown!r}, expected three numbers", k)
    ends = np.array([k for k, row in enumerate(rows) if not row[0]] + [len(rows)])
    counts = np.diff(ends, prepend=-1) - 1
    closed = np.array([bool(rows[k][3]) for k in ends[:-1]] + [False])
    bad = np.where(closed, counts < 3, counts > 0)
    if bad.any():
        at = int(bad.argmax())
        what = f"a loop of {counts[at]} corners, expected 3 or more"
        if not closed[at]:
            what = f"{counts[at]} corners without an endloop behind them"
        raise fault(what, int(ends[at]) - (not closed[at]))
    return np.array(places).reshape(-1, 3), counts[closed].astype(np.uint32)
