"""Reads ESRI ASCII grids (`.asc`): a header of names and numbers, then the heights as text, from the north.

Format: ESRI, "ArcGIS: Esri ASCII raster format", and GDAL, "AAIGrid driver", which also writes dx and dy for
cells that are no squares.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Image
from paradize.errors import SourceError

if TYPE_CHECKING:
    from pathlib import Path

_LINE = re.compile(rb"[ \t\r\n]*([A-Za-z_]+)[ \t]+([^ \t\r\n]+)[ \t]*(?=[\r\n]|\Z)")
_MOST_LINES = 32  # of the header
_MEND = "export it again as an ESRI ASCII grid, or as a GeoTIFF"


def read_ascii_grid(data: bytes, path: Path, max_side: int) -> Image:
    """Heights (h, w, 1) float32, metres. Raises SourceError for a header without a size of 2 to max_side each
    way, for another count of heights, and for what is not a number, with its row and column."""
    header, start = _header(data.removeprefix(b"\xef\xbb\xbf"))
    body = data.removeprefix(b"\xef\xbb\xbf")[start:]
    columns, rows = (_size(header, name, path, max_side) for name in ("ncols", "nrows"))
    said = header.get("nodata_value", header.get("nodata"))
    nodata = None if said is None else _number(said)
    if said is not None and nodata is None:
        what = f"NODATA_value {said[:40].decode('latin-1')!r}, expected a number"
        raise SourceError(what, file=path, place="header", mend=_MEND)
    count = columns * rows
    if len(body) < 2 * count - 1:  # before a large array is made
        raise _wrong_count(f"{len(body)} bytes of heights", columns, rows, path)
    values = _heights(body, columns, path)
    if len(values) != count:
        raise _wrong_count(f"{len(values)} heights", columns, rows, path)
    with np.errstate(over="ignore"):  # beyond float32: refused as infinite where it is not a hole
        heights = values.astype(np.float32).reshape(rows, columns, 1)
    return Image(heights, "data", 32, nodata=nodata)


def _header(data: bytes) -> tuple[dict[str, bytes], int]:
    """The values by name in small letters, and where the heights begin."""
    found: dict[str, bytes] = {}
    position = 0
    for _ in range(_MOST_LINES):
        line = _LINE.match(data, position)
        # A row of heights may begin with a number that is none.
        if line is None or _number(line[1]) is not None:
            break
        found[line[1].decode().lower()] = line[2]
        position = line.end()
    return found, position


def _size(header: dict[str, bytes], name: str, path: Path, max_side: int) -> int:
    text = header.get(name, b"")
    if not (text.isdigit() and len(text) <= 9 and 2 <= int(text) <= max_side):
        what = f"{name} {text[:40].decode('latin-1')!r}" if text else f"{name} is missing"
        raise SourceError(f"{what}; expected 2 to {max_side}", file=path, place="header", mend=_MEND)
    return int(text)


def _number(text: bytes) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _heights(body: bytes, columns: int, path: Path) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """All numbers of a text. Raises SourceError for the first word that is none."""
    try:
        return np.fromstring(body, np.float64, sep=" ")
    except ValueError:
        pass
    words = enumerate(body.split())
    index, word = next(((k, w) for k, w in words if _number(w) is None or b"_" in w), (0, body[:1]))
    comma = b"," in word
    what = f"{word[:40].decode('latin-1')!r} is not a number"
    mend = "numbers need decimal points" if comma else _MEND
    place = f"row {index // columns + 1}, column {index % columns + 1}"
    raise SourceError(what, file=path, place=place, mend=mend)


def _wrong_count(what: str, columns: int, rows: int, path: Path) -> SourceError:
    return SourceError(
        f"{what}; its header says {columns} x {rows}", file=path, mend=f"{_MEND}: it may be cut"
    )
