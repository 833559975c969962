"""Recognises the kind of a file by its first bytes, so that a reader that refuses a file can say what it is
and which command takes it. Also checks the names of outputs.

The kind is a guess. It is used only after a reader has refused a file.
"""

from __future__ import annotations

import os
import re
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from paradize.documents import SCENE_FILE
from paradize.errors import BakeError, ParadizeError, SceneError, SourceError
from paradize.files import missing_reason, open_file

if TYPE_CHECKING:
    from collections.abc import Iterator

HEAD_BYTES = 1 << 16
MODEL_SUFFIXES = (".obj", ".glb", ".gltf", ".ply", ".stl")
_CHECK = "`paradize check {file}` takes it"
_MAPS = "`paradize maps {file} -o {stem}-maps` takes it"
_TERRAIN = "`paradize terrain {file} -o {stem}.glb --size 111000 111000 --height 1` takes it"
_MESH = "`paradize mesh {file} -o {stem}.glb` or `paradize new {stem}-scene --from {file}` takes it"


@dataclass(frozen=True)
class Kind:
    """name: with its article, "an OBJ model". mend: what to do with such a file; {file}, {name} and {stem}
    are replaced by the file's own."""

    name: str
    mend: str = ""


OBJ = Kind("an OBJ model", _MESH)
GLTF = Kind("a glTF model", _MESH)
PLY = Kind("a PLY model", _MESH)
STL = Kind("an STL model", _MESH)
GLB = Kind("a GLB model", f"{_MESH.replace('-o {stem}.glb', '-o {stem}-baked.glb')}; a baked one: {_CHECK}")
MODEL = Kind("an OBJ, glTF, PLY or STL model")  # as it is wanted; a file is one of these
PICTURE = Kind("a picture", _MAPS)
HEIGHTS = Kind("a heightmap", _TERRAIN)
SCENE = Kind("a scene TOML", "`paradize bake {file}` takes it")
BAKED = Kind("a baked scene", _CHECK)
TEXTURE = Kind("a KTX2 texture", _CHECK)
SOUND = Kind("an Ogg sound", 'a scene takes it: write `file = "{name}"` under `[[sound]]`')
MATERIALS = Kind("an MTL material file", "give the OBJ model that it belongs to")
FOLDER = Kind("a folder", "name a file in it")
EMPTY = Kind("an empty file", "save or export it again")
UNKNOWN = Kind("a binary file of an unknown kind", "name another file")
TEXT = Kind("text")  # of any kind; the reader's own message is more specific

_MAGIC: tuple[tuple[bytes, Kind], ...] = (
    (b"\x89PNG\r\n\x1a\n", Kind("a PNG picture", _MAPS)),
    (b"\xff\xd8\xff", Kind("a JPEG picture", _MAPS)),
    (b"GIF8", Kind("a GIF picture", _MAPS)),
    (b"DDS ", Kind("a DDS picture", _MAPS)),
    (b"\x76\x2f\x31\x01", Kind("an OpenEXR picture", _MAPS)),
    (b"#?RADIANCE", Kind("a Radiance picture", _MAPS)),
    (b"#?RGBE", Kind("a Radiance picture", _MAPS)),
    (b"II*\0", Kind("a TIFF picture", _MAPS)),
    (b"MM\0*", Kind("a TIFF picture", _MAPS)),
    (b"8BPS", Kind("a PSD picture", _MAPS)),
    (b"\xabKTX 20\xbb\r\n\x1a\n", TEXTURE),
    (b"glTF", GLB),
    (b"ply\n", PLY),
    (b"ply\r", PLY),
    (b"OggS", SOUND),
    (b"\xff\xfe", TEXT),  # UTF-16
    (b"\xfe\xff", TEXT),
)
_SUFFIXES = dict.fromkeys((".tga", ".bmp", ".webp", ".pgm", ".ppm", ".pnm", ".pfm", ".jp2"), PICTURE)
_SUFFIXES |= {".hgt": HEIGHTS, ".ply": PLY, ".stl": STL}
_STATEMENT = re.compile(rb"^[ \t]*(?:v|vn|vt|f)[ \t]+[-+.\d]|^[ \t]*mtllib[ \t]", re.M)
_MATERIAL = re.compile(rb"^[ \t]*newmtl[ \t]", re.M)
_TABLE = re.compile(
    rb"^[ \t]*\[\[?[ \t]*[\w-]+(?:[ \t]*\.[ \t]*[\w\"' -]+)*[ \t]*\]\]?[ \t]*(?:#.*)?\r?$", re.M
)
_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


def kind_of(path: Path) -> Kind:
    """Returns the kind of a file or folder. Raises OSError for what is missing, cannot be opened, or is a
    pipe or a device."""
    if path.is_dir():
        return BAKED if os.path.lexists(path / SCENE_FILE) else FOLDER
    with open_file(path) as stream:
        head = stream.read(HEAD_BYTES)
    if not head:
        return EMPTY
    kinds = [kind for magic, kind in _MAGIC if head.startswith(magic)]
    return kinds[0] if kinds else _SUFFIXES.get(path.suffix.lower()) or _kind_of_text(head)


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


def is_ply(path: Path) -> bool:
    """Whether a file is a PLY by its first bytes or its name. False for what cannot be opened."""
    try:
        return kind_of(path) is PLY
    except OSError:
        return False


def _kind_of_text(head: bytes) -> Kind:
    if _STATEMENT.search(head):
        return OBJ
    if _CONTROLS.search(head):
        return UNKNOWN
    if head.lstrip()[:1] == b"{":
        return BAKED if b'"paradize-scene"' in head else GLTF if b'"asset"' in head else TEXT
    if _MATERIAL.search(head):
        return MATERIALS
    return SCENE if _TABLE.search(head) else TEXT


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
    HEIGHTS: "name a picture of one grey channel, or an .hgt tile",
    SCENE: "`paradize new DIR` makes one to start from",
    BAKED: "`paradize bake SCENE.toml -o DIR` makes one",
    SOUND: "save it as Ogg Vorbis, mono or stereo",
}
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
    import difflib

    folder = path.parent
    try:
        names = sorted({*os.listdir(folder)} - {path.name})  # noqa: PTH208 (names only)
    except OSError:
        return f"there is no folder {folder}"
    similar = difflib.get_close_matches(path.name, names[:10_000], n=1)
    return f"did you mean {folder / similar[0]}?" if similar else f"looked for in {folder.absolute()}"


def mend_of(kind: Kind, path: Path) -> str:
    """What to do with a file of this kind, with the file's name quoted for a shell."""
    from shlex import quote

    file, stem = (f"./{text}" if text.startswith("-") else text for text in (str(path), path.stem))
    name = path.name.replace("\\", "\\\\").replace('"', '\\"')  # inside a TOML string
    for placeholder, value in (("{name}", name), ("{stem}", quote(stem)), ("{file}", quote(file))):
        kind = replace(kind, mend=kind.mend.replace(placeholder, value))
    return kind.mend


_FILES = (".glb", ".gltf", ".ktx2", ".png", ".jpg", ".exr", ".obj", ".toml", ".json", ".html", ".ogg")


def require_glb(path: Path) -> None:
    """Raises BakeError for an output name without the suffix .glb, by which programs recognise a GLB."""
    if path.name in ("", ".."):
        raise BakeError("names a folder, not a file", file=path, mend="name a file with -o")
    if path.suffix.lower() != ".glb":
        from shlex import quote

        advice = f"`-o {quote(str(path.with_suffix('.glb')))}`"
        raise BakeError(
            f"ends in {path.suffix or 'nothing'}; the output is a GLB", file=path, mend=f"write {advice}"
        )


def require_folder(path: Path) -> None:
    """Raises BakeError for an output folder whose name looks like a file's and that does not exist."""
    if path.suffix.lower() in _FILES and not path.is_dir():
        from shlex import quote

        advice = f"`-o {quote(str(path.with_suffix('')))}`"
        raise BakeError(
            "looks like the name of a file; the output is a folder", file=path, mend=f"write {advice}"
        )
