"""Reads a grid of heights by its name or its first bytes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from paradize.errors import unread
from paradize.files import read_file
from paradize.kinds import GRID_SUFFIXES, is_ascii_grid
from paradize.readers.grids.esri import read_ascii_grid
from paradize.readers.grids.raw import read_raw
from paradize.readers.grids.srtm import read_srtm

if TYPE_CHECKING:
    from pathlib import Path

    from paradize.data import Image

MAX_SIDE = 16385  # of a heightmap
_MOST_BYTES = MAX_SIDE * MAX_SIDE * 24  # of text: a height with its blank takes no more


def read_grid(path: Path) -> Image | None:
    """The heights (h, w, 1) of a grid, row 0 at -Z; None for a file that is none. Raises SourceError for one
    that cannot be read or is damaged."""
    suffix = path.suffix.lower()
    if suffix not in GRID_SUFFIXES and not is_ascii_grid(path):
        return None
    try:
        data = read_file(path, _MOST_BYTES)
    except OSError as error:
        raise unread(error, path) from None
    if suffix not in GRID_SUFFIXES:
        return read_ascii_grid(data, path, MAX_SIDE)
    return read_srtm(data, path, MAX_SIDE) if suffix == ".hgt" else read_raw(data, path, MAX_SIDE)
