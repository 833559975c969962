"""Recognises the kind of a file by its first bytes, so that a reader that refuses a file can say what it is
and which command takes it. Also checks the names of outputs.

The kind is a guess. It is used only after a reader has refused a file.
"""

from __future__ import annotations

import os
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from paradize.documents import SCENE_FILE, parse_json, parse_toml
from paradize.errors import BakeError, FormatError, ParadizeError, SceneError, SourceError
from paradize.files import missing_reason, open_file
from paradize.kind_table import (
    ASCII_GRID,
    BAKED,
    CONTROLS,
    EMPTY,
    FILE_SUFFIXES,
    FOLDER,
    GLB,
    GLTF,
    GLTF_LIST,
    GRID_SUFFIXES,
    HEAD_BYTES,
    HEIGHTS,
    MAGIC,
    MATERIAL,
    MATERIALS,
    MODEL,
    MODEL_SUFFIXES,
    OBJ,
    PACKED,
    PICTURE,
    PLY,
    RIFF,
    RIFF_MAGIC,
    SCENE,
    SOUND,
    SOUNDS,
    STATEMENT,
    STL,
    SUFFIXES,
    TABLE,
    TEXT,
    TEXTS,
    TEXTURE,
    UNKNOWN,
    Kind,
)
from paradize.spelling import similar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = [
    "BAKED",
    "EMPTY",
    "FOLDER",
    "GLB",
    "GLTF",
    "GRID_SUFFIXES",
    "HEAD_BYTES",
    "HEIGHTS",
    "MATERIALS",
    "MODEL",
    "MODEL_SUFFIXES",
    "OBJ",
    "PICTURE",
    "PLY",
    "SCENE",
    "SOUND",
    "STL",
    "TEXT",
    "TEXTURE",
    "UNKNOWN",
    "Kind",
    "expecting",
    "is_ascii_grid",
    "is_gltf",
    "is_surely_other",
    "kind_of",
    "mend_of",
    "refusal",
    "require",
    "require_folder",
    "require_glb",
]


def kind_of(path: Path) -> Kind:
    """Returns the kind of a file or folder. Raises OSError for what is missing, cannot be opened, or is a
    pipe or a device."""
    if path.is_dir():
        return BAKED if os.path.lexists(path / SCENE_FILE) else FOLDER
    with open_file(path) as stream:
        head = stream.read(HEAD_BYTES)
    if not head:
        return EMPTY
    named = SUFFIXES.get(path.suffix.lower())
    sure = _sure_kind(path, head)
    if sure is not None:
        packed = any(sure is kind for _, kind in PACKED)
        return named if packed and named not in (None, PLY, STL) else sure
    if ASCII_GRID.match(head):
        return HEIGHTS
    # Text of another kind under such a name.
    if named in (PLY, STL, *SOUNDS.values()) and not CONTROLS.search(head):
        text = _kind_of_text(head)
        return named if text in (TEXT, SCENE) else text
    kind = named or _kind_of_text(head)
    whole = len(head) < HEAD_BYTES and path.suffix.lower() != ".toml"
    ini = kind is SCENE and whole and not _is_parsed(parse_toml, head, path)
    return TEXT if ini else kind


def _sure_kind(path: Path, head: bytes) -> Kind | None:
    """The kind that the first bytes tell surely. The header of a binary STL, 80 bytes, may hold any words: so
    one is known by its name and its number of facets."""
    facets = int.from_bytes(head[80:84], "little")
    if path.suffix.lower() == ".stl" and 0 < 50 * facets <= path.stat().st_size - 82:
        return STL
    riff = RIFF.get(head[8:12]) if head[:4] in RIFF_MAGIC else None
    return riff or next((kind for magic, kind in (*MAGIC, *PACKED) if head.startswith(magic)), None)


def is_surely_other(wanted: Kind, path: Path) -> bool:
    """Whether the first bytes of a file tell that it is of another kind than wanted. False for what cannot be
    opened."""
    try:
        with open_file(path) as stream:
            kind = _sure_kind(path, stream.read(84))
    except OSError:
        return False
    return kind is not None and not _accepted(kind, wanted)


def is_ascii_grid(path: Path) -> bool:
    """Whether a file begins as an ESRI ASCII grid does. False for what cannot be opened."""
    try:
        with open_file(path) as stream:
            return ASCII_GRID.match(stream.read(512)) is not None
    except OSError:
        return False


def is_gltf(path: Path) -> bool:
    """Whether the reader of glTF is to try a file: its first bytes are those of a GLB or of JSON, or its name
    is that of a glTF file that nothing else claims. False for what cannot be opened."""
    try:
        kind = kind_of(path)
        with open_file(path) as stream:
            head = stream.read(64).removeprefix(b"\xef\xbb\xbf").lstrip()
    except OSError:
        return False
    if kind in (GLB, GLTF) or head.startswith(b"{"):
        return kind is not BAKED
    return kind in _UNSPECIFIC and path.suffix.lower() in (".glb", ".gltf")


def _kind_of_text(head: bytes) -> Kind:
    if STATEMENT.search(head):
        return OBJ
    other = b'"paradize-scene"' in head or (b'"geometricError"' in head and not GLTF_LIST.search(head))
    if head.lstrip()[:1] == b"{" and b'"asset"' in head and not other:
        return GLTF
    if CONTROLS.search(head):
        return UNKNOWN
    named = [kind for pattern, kind in TEXTS if pattern.search(head)]
    if head.lstrip()[:1] == b"{":
        return BAKED if b'"paradize-scene"' in head else named[0] if named else TEXT
    if MATERIAL.search(head):
        return MATERIALS
    if head.lstrip()[:1] == b"[" and _is_parsed(parse_json, head):  # [1] is a table of TOML, too
        return TEXT
    return named[0] if named else SCENE if TABLE.search(head) else TEXT


def _is_parsed(parse: Callable[..., object], *arguments: object) -> bool:
    try:
        parse(*arguments)
    except FormatError:
        return False
    return True


def _accepted(actual: Kind, wanted: Kind) -> bool:
    """Whether a reader of `wanted` may try a file of kind `actual`."""
    picture = actual is PICTURE or actual.name.endswith(" picture")
    if wanted in (PICTURE, HEIGHTS):
        return picture or actual in (HEIGHTS, UNKNOWN, EMPTY)
    if wanted is MODEL:
        return actual in (OBJ, GLTF, GLB, PLY, STL, TEXT)
    return actual is wanted or (actual is TEXT and wanted is SCENE)


_HINTS = {  # for files whose own kind suggests nothing
    MODEL: "name an OBJ, GLB, glTF, PLY or STL file",
    PICTURE: "name a PNG, TIFF or OpenEXR file",
    HEIGHTS: "name a picture of one grey channel, an .hgt tile, an ESRI ASCII grid (.asc) or raw heights "
    "(.raw, .r16, .r32)",
    SCENE: "`paradize new DIR` makes one to start from",
    BAKED: "`paradize bake SCENE.toml -o DIR` makes one",
    SOUND: "save it as Ogg Vorbis, mono or stereo",
}
_NEW_SCENE = "scene.toml"  # as `paradize new` names it
_UNSPECIFIC = (TEXT, UNKNOWN, EMPTY, FOLDER)


def refusal(wanted: Kind, path: Path) -> tuple[str, str] | None:
    """Returns what is wrong with a file that is missing or of another kind than wanted, and what to do; else
    None."""
    try:
        actual = kind_of(path)
    except FileNotFoundError:
        link = missing_reason(path)
        return (
            (link, "mend it, or name another file") if link else ("there is no such file", _suggestion(path))
        )
    except OSError:
        return None
    if _accepted(actual, wanted):
        return None
    if actual is FOLDER and wanted is BAKED:
        return f"holds no {SCENE_FILE}", _HINTS[BAKED]
    if actual is FOLDER and wanted is SCENE and os.path.isfile(path / _NEW_SCENE):  # noqa: PTH113 (raises nothing)
        return f"is {actual.name}, not {wanted.name}", f"did you mean {path / _NEW_SCENE}?"
    return f"is {actual.name}, not {wanted.name}", _HINTS[wanted] if actual in _UNSPECIFIC else mend_of(
        actual, path
    )


def require(wanted: Kind, path: Path) -> None:
    """Raises SourceError (SceneError for a scene) with the fault that `refusal` returns."""
    fault = refusal(wanted, path)
    if fault:
        raise (SceneError if wanted is SCENE else SourceError)(fault[0], file=path, mend=fault[1])


@contextmanager
def expecting(wanted: Kind, path: Path) -> Iterator[None]:
    """Wraps a reader. If the reader refuses a file that is missing or of another kind, raises `require`'s
    message instead."""
    try:
        yield
    except ParadizeError:
        require(wanted, path)
        raise


def _suggestion(path: Path) -> str:
    """A file of a similar name, or the folder that was searched."""
    folder = path.parent
    if not folder.is_dir():
        return f"there is no folder {folder}"
    other = similar(folder, path.name)
    return f"did you mean {folder / other}?" if other else f"looked for in {folder.absolute()}"


def mend_of(kind: Kind, path: Path) -> str:
    """Advice for a file of this kind, with the file's name quoted for a shell."""
    from shlex import quote

    file, stem = (f"./{text}" if text.startswith("-") else text for text in (str(path), path.stem))
    name = path.name.replace("\\", "\\\\").replace('"', '\\"')  # inside a TOML string
    for placeholder, value in (("{name}", name), ("{stem}", quote(stem)), ("{file}", quote(file))):
        kind = replace(kind, mend=kind.mend.replace(placeholder, value))
    return kind.mend


def require_glb(path: Path) -> None:
    """Raises BakeError for an output name without the suffix .glb, by which programs recognise a GLB."""
    if path.name in ("", ".."):
        raise BakeError("names a folder, not a file", file=path, mend="name a file with -o")
    if path.suffix.lower() != ".glb":
        from shlex import quote

        known = path.stem if path.suffix.lower() in FILE_SUFFIXES else path.name.rstrip(".")
        better = str(path.with_name(f"{known or path.name}.glb"))
        advice = f"`-o {quote(f'./{better}' if better.startswith('-') else better)}`"
        raise BakeError(
            f"ends in {path.suffix or 'nothing'}; the output is a GLB", file=path, mend=f"write {advice}"
        )


def require_folder(path: Path, option: str = "-o") -> None:
    """Raises BakeError for an output folder whose name looks like a file's and that does not exist. option:
    stands before the folder on the command line."""
    if path.suffix.lower() in FILE_SUFFIXES and not os.path.isdir(path):  # noqa: PTH112 (raises nothing)
        from shlex import quote

        advice = f"`{option} {quote(str(path.with_suffix('')))}`"
        raise BakeError(
            "looks like the name of a file; the output is a folder", file=path, mend=f"write {advice}"
        )
