"""Names that lead to no file, and the files that are probably meant."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path


def in_other_letters(folder: Path, name: str) -> str | None:
    """The name of what is below a folder under `name`, parts apart by /: itself, else the only one that has
    the same letters, small or capital, accents composed or not, as Windows and macOS find it."""
    found: list[str] = []
    for part in name.split("/"):
        entry = _entry(folder.joinpath(*found), part)
        if entry is None:
            return None
        found.append(entry)
    return "/".join(found)


def similar(folder: Path, name: str) -> str | None:
    """The name below a folder that is probably meant by one that leads to nothing there: in other letters, \\
    for /, or the nearest spelling of its last part, suffix apart. None without one."""
    above, _, last = name.replace("\\", "/").rpartition("/")
    place = in_other_letters(folder, above) if above else "."
    if place is None:
        return None
    other = _entry(folder / place, last) or _nearest(folder / place, last)
    return other if other is None or not above else f"{place}/{other}"


def entries(folder: Path) -> dict[str, list[str]]:
    """The names in a folder, by their letters alone (`folded`); none of a folder that cannot be listed."""
    try:
        return _entries(folder, folder.stat().st_mtime_ns)
    except OSError:
        return {}


def folded(name: str) -> str:
    """A name that is the same whether its letters are small or capital, its accents composed or not."""
    from unicodedata import normalize

    return normalize("NFC", name.casefold())


def _entry(folder: Path, part: str) -> str | None:
    alike = entries(folder).get(folded(part), [])
    if part in alike:
        return part
    return alike[0] if len(alike) == 1 else None


def _nearest(folder: Path, last: str) -> str | None:
    from difflib import get_close_matches

    names = [name for alike in entries(folder).values() for name in alike][:10_000]
    stems: dict[str, list[str]] = {}
    for name in names:
        stems.setdefault(os.path.splitext(folded(name))[0], []).append(name)  # noqa: PTH122 (names only)
    near = get_close_matches(os.path.splitext(folded(last))[0], stems, n=1)  # noqa: PTH122
    return get_close_matches(last, stems[near[0]], n=1, cutoff=0.0)[0] if near else None


@lru_cache(maxsize=16)
def _entries(folder: Path, _mtime_ns: int) -> dict[str, list[str]]:
    out: dict[str, list[str]] = {}
    for name in sorted(os.listdir(folder)):  # noqa: PTH208 (names only)
        out.setdefault(folded(name), []).append(name)
    return out
