"""Names of files that models write: found inside a root folder, also where exporters spell them otherwise."""

from __future__ import annotations

import os
import re
from functools import lru_cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from urllib.parse import unquote

from paradize import files
from paradize.errors import SourceError
from paradize.files import is_there, resolved

_BLANK = r"[\s\N{REPLACEMENT CHARACTER}]"  # a tab of a name is read as the latter
_COMMENT = re.compile(rf"{_BLANK}+#(?:{_BLANK}|$)")


def root_of(path: Path) -> Path:
    """The folder that the files of a model must lie in where nothing else says it: the one above its own,
    since pictures often have a folder beside the model's."""
    own = resolved(path.parent)
    return own if own.parent == Path(own.anchor) else own.parent


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


def without_comment(name: str) -> str:
    """A name without a comment behind it: ` # ` and what follows. 3ds Max names materials `Material #25`."""
    return _COMMENT.split(name, maxsplit=1)[0]


def named_file(path: Path, named_by: str, limit: int = files.MAX_BYTES) -> bool:
    """Whether a file exists that another file names. Raises SourceError where it exists but cannot be read or
    is larger than `limit` bytes. named_by: the naming place, for the message."""
    try:
        return is_there(path, limit)
    except OSError as error:
        what = f"cannot be read: {error.strerror or error}"
        raise SourceError(what, file=path, mend=f"mend it, or take it out of {named_by}") from None


def require_utf8_name(path: Path) -> None:
    """Raises SourceError for a file whose name no text can hold."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise SourceError("the file's name is not UTF-8", file=path, mend="rename it") from None


def require_utf8(head: bytes, path: Path) -> None:
    """Raises SourceError for a text whose first four bytes say UTF-16 or UTF-32."""
    wide = head.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff"))
    if wide or head.startswith((b"\xff\xfe", b"\xfe\xff")):
        what = f"the text is UTF-{32 if wide else 16}"
        raise SourceError(what, file=path, mend="save it as UTF-8")


def spelled_otherwise(root: Path, folder: Path, name: str) -> tuple[Path, str] | None:
    """The file inside `root` that is meant by a name that leads to none, and a note for a warning: without
    quotes or a comment, with %20 as a blank, with other letters, small or capital, as Windows and macOS find
    it, or beside the file where exporters write a path of the machine they run on. None where no file or
    several are meant."""
    plain = name.strip().strip("\"'").strip()
    for spelling in dict.fromkeys((name, plain, unquote(plain), without_comment(plain))):
        elsewhere = _name_of_absolute(spelling)
        path = inside(root, folder, spelling if elsewhere is None else elsewhere)
        if path is None:
            continue
        found = path if (elsewhere or spelling != name) and _is_file(path) else _in_other_case(root, path)
        if found is not None:
            why = "does not exist" if elsewhere is None else "is a path of another machine"
            beside = "" if elsewhere is None else " beside the file"
            return found, f"{name[:120]!r} {why}; {found.name!r}{beside} is read instead"
    return None


def _name_of_absolute(name: str) -> str | None:
    """The last part of an absolute path or of a `file:` URI; None for another name."""
    path = PureWindowsPath(name.removeprefix("file://"))
    return path.name if path.drive or path.root else None


def _is_file(path: Path) -> bool:
    try:
        return is_there(path)
    except OSError:
        return False


def _in_other_case(root: Path, path: Path) -> Path | None:
    """The one file below `root` whose path differs from `path` in capital letters alone."""
    found = resolved(root)
    for part in path.relative_to(found).parts:
        try:
            alike = _entries(found, found.stat().st_mtime_ns).get(part.casefold(), [])
        except OSError:
            return None
        if part not in alike and len(alike) != 1:
            return None
        found /= part if part in alike else alike[0]
    real = inside(root, root, str(found.relative_to(resolved(root))))
    return real if real is not None and _is_file(real) else None


@lru_cache(maxsize=16)
def _entries(folder: Path, _mtime_ns: int) -> dict[str, list[str]]:
    """The names in a folder, by the same in small letters."""
    out: dict[str, list[str]] = {}
    for name in sorted(os.listdir(folder)):  # noqa: PTH208 (names only)
        out.setdefault(name.casefold(), []).append(name)
    return out
