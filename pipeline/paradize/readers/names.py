"""Names of files that models write: found inside a root folder, also where exporters spell them otherwise."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING
from urllib.parse import unquote

from paradize import files
from paradize.errors import SourceError, unread
from paradize.files import is_there, resolved
from paradize.spelling import entries, folded, in_other_letters

if TYPE_CHECKING:
    from collections.abc import Iterator

END_MARKS = b"\0\x1a"  # bytes behind a text: Ctrl-Z of old systems, zeros that fill a block
_BLANK = r"[\s\N{REPLACEMENT CHARACTER}]"  # a tab of a name is read as the latter
_PICTURES = re.compile(r"tex(ture)?s?|images?|imgs?|maps?|pictures?|materials?")  # folders of them
_FOLDER = re.compile(r"[^.]+")  # any folder; names with a dot are mostly files
# The last word of a picture's name, by which packs of textures and exporters say what it holds.
_SAID = {
    "color": "(base)?colou?r|col|alb(edo)?|diff(use)?",
    "normal": "[a-z]*normals?|normalmap|n|norm?|nrm|nml|nmap|ddn",
    "height": "disp|displacement|heights?|heightmap|bump",
    "other": (
        "rough(ness)?|rgh|metallic|metalness|ao|occlusion|gloss(iness)?|smoothness|spec(ular)?|orm|rma|mrao?"
        "|emissi(on|ve)|luma|opacity|cavity|curvature"
    ),
}
_BEHIND = "map|tex|texture|gl|ogl|opengl|dx|directx|png|jpe?g|tga|tif"  # words that may follow it
_PARTS, _ABOVE = 3, 3  # last parts of a path that are looked for, folders above in which they are
_DEPTH, _FOLDERS = 3, 64  # of folders of pictures in one another, and how many of a depth are looked into
_COMMENT = re.compile(rf"(?<!{_BLANK}){_BLANK}+#(?:{_BLANK}|$)")  # a row of blanks is looked at once


def root_of(path: Path) -> Path:
    """The folder that the files of a model must lie in where nothing else says it: the one above its own,
    since pictures often have a folder beside the model's."""
    own = resolved(path.parent)
    return own if own.parent == Path(own.anchor) else own.parent


def inside(root: Path, folder: Path, name: str) -> Path | None:
    """The path `name` relative to `folder`, with links followed; None where it is absolute, too long or
    outside `root`."""
    if not 0 < len(name) <= 4096 or "\0" in name or PureWindowsPath(name).anchor:
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
    """Whether a file exists that another file names; a folder is none. Raises SourceError where it exists but
    cannot be read or is larger than `limit` bytes. named_by: the naming place, for the message."""
    try:
        return is_there(path, limit)
    except OSError as error:
        if error.errno == errno.EISDIR:
            return False
        raise unread(error, path, f"mend it, or take it out of {named_by}") from None


def why_missing(path: Path | None) -> str:
    """Why `named_file` found none, for a warning."""
    return "is a folder" if path is not None and os.path.isdir(path) else "does not exist"  # noqa: PTH112


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
    it, or where `_guesses` looks, as exporters write paths of the machine that they run on. None where no
    file or several are meant."""
    plain = name.strip().strip("\"'").strip()
    for spelling in dict.fromkeys((name, plain, unquote(plain), without_comment(plain))):
        absolute = _is_absolute(spelling)
        why = "is a path of another machine" if absolute else why_missing(inside(root, folder, spelling))
        for place, guess in _guesses(root, folder, spelling):
            path = inside(root, place, guess)
            if path is None:
                continue
            moved = (place, guess) != (folder, name)
            found = path if moved and _is_file(path) else _in_other_letters(root, path)
            if found is not None:
                spelled = (place, guess) == (folder, spelling)
                there = found.name if spelled else os.path.relpath(found, resolved(folder))
                beside = " beside the file" if absolute and there == found.name else ""
                return found, f"{name[:120]!r} {why}; {there!r}{beside} is read instead"
    return None


def said_of(name: str) -> tuple[str, str]:
    """The last word of a picture's or a folder's name that says what is held, and what: "color", "normal",
    "height" or "other", of which no map is made; "" where the name says nothing."""
    words = re.findall("[a-z]+", re.sub(r"([a-z])([A-Z])|\d+[kK]", r"\1 \2", name).lower())
    while len(words) > 1 and re.fullmatch(_BEHIND, words[-1]):
        words.pop()
    word = words[-1] if words else ""
    return word, next((held for held, said in _SAID.items() if re.fullmatch(said, word)), "")


def _guesses(root: Path, folder: Path, name: str) -> Iterator[tuple[Path, str]]:
    """Folders and what to look for there: the name itself, unless it is absolute; its last parts in the
    folder and in those above it, up to the root; the last one in folders of pictures there, and in the only
    one below these that holds it: of folders of pictures (materials/textures), else any (textures/house)."""
    if not _is_absolute(name):
        yield folder, name
    path = PureWindowsPath(name.removeprefix("file://"))
    parts = [part for part in path.parts if part not in (path.anchor, "..")][-_PARTS:]
    above = [base for base in resolved(folder).parents if base.is_relative_to(resolved(root))]
    bases = [folder, *above[:_ABOVE]]
    for first in range(len(parts)):
        for base in bases:
            yield base, "/".join(parts[first:])
    for base in bases:
        for entry in entries(base):
            if _PICTURES.fullmatch(entry):
                yield base, "/".join((entry, *parts[-1:]))
    for names in (_PICTURES, _FOLDER):
        for base in bases if parts else []:
            level, holding = [base], []
            for depth in range(_DEPTH):
                level = _folders_in(root, level, names if depth else _PICTURES)
                holding += [below for below in level if depth and folded(parts[-1]) in entries(below)]
            if len(holding) == 1:
                yield holding[0], parts[-1]


def _folders_in(root: Path, folders: list[Path], named: re.Pattern[str]) -> list[Path]:
    """The folders of such names in these that lie inside `root`, links followed; at most _FOLDERS."""
    found: dict[Path, None] = {}
    for folder in folders:
        names = [name for key, alike in entries(folder).items() if named.fullmatch(key) for name in alike]
        found |= {path: None for name in names if (path := inside(root, folder, name)) is not None}
    return list(found)[:_FOLDERS]


def _is_absolute(name: str) -> bool:
    path = PureWindowsPath(name.removeprefix("file://"))
    return bool(path.drive or path.root)


def _is_file(path: Path) -> bool:
    try:
        return is_there(path)
    except OSError:
        return False


def _in_other_letters(root: Path, path: Path) -> Path | None:
    """The one file below `root` whose path differs from `path` in letters alone."""
    base = resolved(root)
    found = in_other_letters(base, path.relative_to(base).as_posix())
    real = None if found is None else inside(root, root, found)
    return real if real is not None and _is_file(real) else None
