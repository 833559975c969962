"""Finds UDIM tiles: pictures of one map that lie side by side in UVs, numbered 1001 + u + 10 v. They are
refused by name, because a material here has one picture of each map."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from paradize.material import MapSource

_TOKEN = re.compile(r"<udim>|<uvtile>", re.IGNORECASE)
_NUMBER = re.compile(r"(?<![0-9])1[0-9]{3}(?![0-9])")
_COLUMNS = 10  # tiles of a row; the number of an eleventh would be that of the next row's first
_SHOWN = 8
MEND = (
    "join the tiles into one picture and scale the UVs to it, or give the triangles of each tile a material "
    "of their own with its picture"
)


def udim_fault(
    maps: Mapping[str, MapSource], tiles: Iterable[tuple[int, int]], missing: Iterable[Path]
) -> str | None:
    """Says which map of a material is made of UDIM tiles; None where none is for certain: its name has no
    placeholder of tiles, or not each tile of its UVs has a picture. tiles: those of its UVs, (u, v), v
    downwards. missing: files that the model names and that do not exist."""
    for path in missing:
        if _TOKEN.search(path.name):
            return f"the picture {path.name!r} is a set of UDIM tiles, which are not read"
    numbers = _numbers(tiles)
    for role, source in maps.items():
        name = _name(source)
        if _TOKEN.search(name):
            return f"the {role} map {name!r} is a set of UDIM tiles, which are not read"
        if any(not _missing(source, number, numbers) for number in _own(name, numbers)):
            what = f"the {role} map {name!r} is one of several UDIM tiles, which are not read"
            return f"{what}; UVs lie in {_shown(numbers)}"
    return None


def named_as_tile(maps: Mapping[str, MapSource], tiles: Iterable[tuple[int, int]]) -> str | None:
    """Warns of a map that is named as one of the tiles that UVs lie in, where pictures of others are
    missing."""
    numbers = _numbers(tiles)
    for role, source in maps.items():
        for own in _own(_name(source), numbers):
            if missing := _missing(source, own, numbers):
                return (
                    f"the {role} map is named as UDIM tile {own[0]}, UVs lie in {_shown(numbers)}, and no "
                    f"picture of {_shown(missing)} is beside it: it is repeated"
                )
    return None


def _numbers(tiles: Iterable[tuple[int, int]]) -> list[str]:
    """The numbers of the tiles, if they are several and all have one."""
    places = [(u, -v) for u, v in sorted(tiles)]
    numbered = all(0 <= u < _COLUMNS and v >= 0 and 1001 + u + 10 * v <= 1999 for u, v in places)
    return [str(1001 + u + 10 * v) for u, v in places] if numbered and len(places) > 1 else []


def _own(name: str, numbers: list[str]) -> list[re.Match[str]]:
    """Where a picture's name has the number of one of the tiles."""
    return [found for found in _NUMBER.finditer(name) if found[0] in numbers]


def _missing(source: MapSource, own: re.Match[str], numbers: list[str]) -> list[str]:
    """The numbers of which no picture is beside a map's, whose name has its number at `own`."""
    folder, before, after = source.picture.file.parent, own.string[: own.start()], own.string[own.end() :]
    return [
        number
        for number in numbers
        if number != own[0] and not (folder / f"{before}{number}{after}").exists()
    ]


def _name(source: MapSource) -> str:
    return source.picture.name or source.picture.file.name


def _shown(numbers: list[str]) -> str:
    rest = [f"{len(numbers) - _SHOWN} more"] if len(numbers) > _SHOWN else []
    return ", ".join([*numbers[:_SHOWN], *rest])
