"""Finds UDIM tiles: pictures of one map that lie side by side in UVs, numbered 1001 + u + 10 v. They are
refused by name, because a material here has one picture of each map."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from paradize.material import MapSource

_TOKEN = re.compile(r"<udim>|<uvtile>", re.IGNORECASE)
_NUMBER = re.compile(r"(?<![0-9])1[0-9]{3}(?![0-9])")
_SHOWN = 8
MEND = (
    "join the tiles into one picture and scale the UVs to it, or give the triangles of each tile a material "
    "of their own with its picture"
)


def udim_fault(
    maps: Mapping[str, MapSource], tiles: Iterable[tuple[int, int]], missing: Iterable[Path]
) -> str | None:
    """Says which map of a material is made of UDIM tiles; None where none is. tiles: those of its UVs,
    (u, v), v downwards. missing: files that the model names and that do not exist."""
    for path in missing:
        if _TOKEN.search(path.name):
            return f"the picture {path.name!r} stands for UDIM tiles, which are not read"
    numbers = _numbers(tiles)
    for role, source in maps.items():
        name = source.picture.name or source.picture.file.name
        if _TOKEN.search(name):
            return f"the {role} map {name!r} stands for UDIM tiles, which are not read"
        others = [one for one in numbers if _exists_beside(source, one)]
        if len(numbers) > 1 and others:
            shown = ", ".join(numbers[:_SHOWN])
            what = f"the {role} map {name!r} is one of several UDIM tiles, which are not read"
            return f"{what}; UVs lie in {shown}"
    return None


def named_as_tile(maps: Mapping[str, MapSource], tiles: Iterable[tuple[int, int]]) -> str | None:
    """Warns of a map that is named as one of the tiles that UVs lie in, where no other is beside it."""
    numbers = _numbers(tiles)
    for role, source in maps.items():
        found = _NUMBER.search(source.picture.name or source.picture.file.name)
        if len(numbers) > 1 and found and found[0] in numbers:
            shown = ", ".join(numbers[:_SHOWN])
            return (
                f"the {role} map is named as UDIM tile {found[0]}, UVs lie in {shown}, and no picture of "
                "another tile is beside it: it is repeated"
            )
    return None


def _numbers(tiles: Iterable[tuple[int, int]]) -> list[str]:
    return [str(1001 + u - 10 * v) for u, v in sorted(tiles)]


def _exists_beside(source: MapSource, number: str) -> bool:
    file = source.picture.file
    other = _NUMBER.sub(number, file.name, count=1)
    return other != file.name and (file.parent / other).exists()
