"""Reads Wavefront MTL: names, colours and maps of materials.

Format: Wavefront, "Advanced Visualizer Manual, Appendix B2. Material (.mtl)", 1992. A map is searched
relative to the MTL file and must lie inside the root folder; otherwise it is a warning and no file is opened.
An invalid number, NaN or infinity is an error with its line.
"""

from __future__ import annotations

import math
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from paradize import files
from paradize.errors import GroupedError, SourceError
from paradize.files import is_there, read_file, resolved
from paradize.material import MapSource, Material, Picture

MAX_BYTES = 16 << 20
MAX_MAPS = 10_000  # map statements that are followed; each opens a file
MAX_MESSAGES = 100  # of warnings and of errors
_MAX_WORDS = 64  # words before a map's name; all options together take half as many
# Largest number of arguments of each option of a map statement.
_OPTIONS = {
    "-blendu": 1,
    "-blendv": 1,
    "-bm": 1,
    "-boost": 1,
    "-cc": 1,
    "-clamp": 1,
    "-imfchan": 1,
    "-colorspace": 1,
}
_OPTIONS |= {"-mm": 2, "-o": 3, "-s": 3, "-t": 3, "-texres": 1, "-type": 1}
# The role of each map statement's picture.
_ROLES = {"map_kd": "color", "map_d": "alpha", "map_ks": "specular", "map_ns": "smoothness"}
_ROLES |= {"map_bump": "height", "bump": "height", "map_kn": "normal", "norm": "normal"}


def inside(root: Path, folder: Path, name: str) -> Path | None:
    """The path `name` relative to `folder`, with links followed; None where it is absolute or outside
    `root`."""
    if not name or "\0" in name or PureWindowsPath(name).drive or PureWindowsPath(name).root:
        return None
    name = name.replace("\\", "/")
    if PurePosixPath(name).is_absolute():
        return None
    try:
        path = resolved(folder / name)
        return path if path.is_relative_to(resolved(root)) else None
    except (OSError, RuntimeError, ValueError):
        return None


def named_file(path: Path, named_by: str, limit: int = files.MAX_BYTES) -> bool:
    """Whether a file exists that another file names. Raises SourceError where it exists but cannot be read or
    is larger than `limit` bytes. named_by: the naming place, for the message."""
    try:
        return is_there(path, limit)
    except OSError as error:
        what = f"cannot be read: {error.strerror or error}"
        raise SourceError(what, file=path, mend=f"mend it, or take it out of {named_by}") from None


def read_mtl(
    path: Path, root: Path, absent: list[Path] | None = None
) -> tuple[dict[str, Material], list[str]]:
    """Returns materials by name in the file's order, and warnings. A missing map is a warning; its path is
    appended to `absent`. Raises SourceError for an unreadable file or an invalid number with its line,
    GroupedError for several."""
    try:
        raw = read_file(path, MAX_BYTES)
    except OSError as error:
        raise SourceError(f"cannot be read: {error.strerror or error}", file=path) from None
    fields: dict[str, dict[str, Any]] = {}
    warnings: list[str] = []
    errors: list[SourceError] = []
    current: dict[str, Any] | None = None
    maps = 0

    def warn(text: str) -> None:
        if len(warnings) < MAX_MESSAGES:
            warnings.append(text)
        elif len(warnings) == MAX_MESSAGES:
            warnings.append(f"{path}: more than {MAX_MESSAGES} warnings; the rest is left out")

    try:
        text = raw.removeprefix(b"\xef\xbb\xbf").decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    joined = text.replace("\r\n", "\n").replace("\r", "\n").replace("\\\n", " ")
    for number, line in enumerate(joined.split("\n"), 1):
        word, _, rest = line.strip().partition(" ") if "\t" not in line else _split_tab(line)
        word, rest = word.lower(), rest.strip()
        where = f"{path}: line {number}"
        if word == "newmtl":
            if rest in fields:
                warn(f"{where}: material {rest[:120]!r} is defined again; the last one counts")
            current = fields[rest] = {"maps": {}}
        elif current is None or not word or word.startswith("#"):
            continue
        elif word in ("kd", "ks"):
            color = _floats(rest, 3)
            if rest.split()[:1] in (["spectral"], ["xyz"]):
                warn(f"{where}: {word} as {rest.split()[0]} is not read; ignored")
            elif color is None:
                errors.append(_bad(path, number, word, rest, "1 or 3 finite numbers"))
            elif word == "kd":
                current["color"] = color
        elif word in ("ns", "d", "tr"):
            value = _floats(rest.removeprefix("-halo").strip(), 1)
            if value is None:
                errors.append(_bad(path, number, word, rest, "a finite number"))
            elif word != "ns":
                current["opacity"] = min(max(value[0] if word == "d" else 1.0 - value[0], 0.0), 1.0)
        elif word in _ROLES:
            maps += 1
            if maps > MAX_MAPS:
                warnings.append(f"{where}: more than {MAX_MAPS} maps: this and all that follows is ignored")
                break
            map_file = _map_path(rest, path, number, root, absent)
            if isinstance(map_file, Path):
                current["maps"][_ROLES[word]] = MapSource(Picture(map_file, name=map_file.name))
            else:
                warn(f"{where}: {word}: {map_file}")
        if len(errors) == MAX_MESSAGES:
            break
    if errors:
        raise errors[0] if len(errors) == 1 else GroupedError(errors)
    return {name: Material(name, **values) for name, values in fields.items()}, warnings


def _bad(path: Path, line: int, word: str, rest: str, expected: str) -> SourceError:
    return SourceError(f"{word} {rest[:40]!r}, expected {expected}", file=path, place=f"line {line}")


def _split_tab(line: str) -> tuple[str, str, str]:
    parts = line.split(None, 1)
    return (parts[0] if parts else "", " ", parts[1] if len(parts) > 1 else "")


def _floats(text: str, count: int) -> tuple[float, ...] | None:
    """`count` finite numbers, or None. For a colour one number stands for all three."""
    words = text.split()[:count]
    if not all(word.isascii() and "_" not in word for word in words):  # forms that only Python accepts
        return None
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    if count == 3 and len(values) == 1:
        values *= 3
    if len(values) != count or not all(math.isfinite(value) for value in values):
        return None
    return tuple(values)


def _map_path(text: str, file: Path, line: int, root: Path, absent: list[Path] | None = None) -> Path | str:
    """The file of a map statement, options skipped, or a text that says why there is none. Raises SourceError
    as `named_file`."""
    words = text.split(None, _MAX_WORDS)
    index = 0
    while index < len(words) and words[index].lower() in _OPTIONS:
        largest_count = _OPTIONS[words[index].lower()]
        index += 1
        for count in range(largest_count):
            if len(words) - index < 2 or (largest_count > 1 and count and _floats(words[index], 1) is None):
                break
            index += 1
    # A name may contain several blanks in a row: without options the text is taken unchanged.
    name = " ".join(words[index:]) if index else text.strip()
    if not name:
        return "no file named"
    path = inside(root, file.parent, name)
    if path is None:
        return f"{name[:120]!r} lies outside {root}; ignored"
    if not named_file(path, f"line {line} of {file}"):
        if absent is not None:
            absent.append(path)
        return f"{name[:120]!r} does not exist; ignored"
    return path
