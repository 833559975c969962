"""What kind of file a path leads to, by its first bytes, and which command takes it: so that a reader that
cannot make sense of a file says what it is and where it belongs. And which names output may have.

A look and no proof: only asked once a reader has refused a file.
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
from paradize.files import absence, open_file

if TYPE_CHECKING:
    from collections.abc import Iterator

HEAD_BYTES = 1 << 16
_CHECK = "`paradize check {file}` takes it"
_MAPS = "`paradize maps {file} -o {stem}-maps` takes it"
_TERRAIN = "`paradize terrain {file} -o {stem}.glb --size 111000 111000 --height 1` takes it"
_MESH = "`paradize mesh {file} -o {stem}.glb` or `paradize new {stem}-scene --from {file}` takes it"


@dataclass(frozen=True)
class Kind:
    """name: as a sentence has it, "an OBJ model". mend: what to do with such a file; {file}, {name} and
    {stem} stand for its own."""

    name: str
    mend: str = ""


MODEL = Kind("an OBJ model", _MESH)
PICTURE = Kind("a picture", _MAPS)
HEIGHTS = Kind("a heightmap", _TERRAIN)
SCENE = Kind("a scene TOML", "`paradize bake {file}` takes it")
BAKED = Kind("a baked scene", _CHECK)
MESH = Kind("a GLB mesh", _CHECK)
TEXTURE = Kind("a KTX2 texture", _CHECK)
SOUND = Kind("an Ogg sound", 'a scene takes it: write `file = "{name}"` under `[sound]`')
MATERIALS = Kind("an MTL material file", "give the OBJ model that it belongs to")
GLTF = Kind("a glTF file", "export the model as OBJ")
FOLDER = Kind("a folder", "name a file in it")
EMPTY = Kind("an empty file", "save or export it again")
UNKNOWN = Kind("a binary file of no kind that Paradize knows", "name another file")
TEXT = Kind("text")  # of any kind: a reader's own message says more

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
    (b"glTF", MESH),
    (b"OggS", SOUND),
    (b"\xff\xfe", TEXT),  # UTF-16
    (b"\xfe\xff", TEXT),
)
_SUFFIXES = dict.fromkeys((".tga", ".bmp", ".webp", ".pgm", ".ppm", ".pnm", ".pfm", ".jp2"), PICTURE)
_SUFFIXES |= {".hgt": HEIGHTS}
_STATEMENT = re.compile(rb"^[ \t]*(?:v|vn|vt|f)[ \t]+[-+.\d]|^[ \t]*mtllib[ \t]", re.M)
_MATERIAL = re.compile(rb"^[ \t]*newmtl[ \t]", re.M)
_TABLE = re.compile(
    rb"^[ \t]*\[\[?[ \t]*[\w-]+(?:[ \t]*\.[ \t]*[\w\"' -]+)*[ \t]*\]\]?[ \t]*(?:#.*)?\r?$", re.M
)
_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


def kind_of(path: Path) -> Kind:
    """Raises OSError for what is missing, cannot be opened, or is a pipe or a device."""
    if path.is_dir():
        return BAKED if os.path.lexists(path / SCENE_FILE) else FOLDER
    with open_file(path) as stream:
        head = stream.read(HEAD_BYTES)
    if not head:
        return EMPTY
    kinds = [kind for magic, kind in _MAGIC if head.startswith(magic)]
    return kinds[0] if kinds else _SUFFIXES.get(path.suffix.lower()) or _of_text(head)


def _of_text(head: bytes) -> Kind:
    if _STATEMENT.search(head):
        return MODEL
    if _CONTROLS.search(head):
        return UNKNOWN
    if head.lstrip()[:1] == b"{":
        return BAKED if b'"paradize-scene"' in head else GLTF if b'"asset"' in head else TEXT
    if _MATERIAL.search(head):
        return MATERIALS
    return SCENE if _TABLE.search(head) else TEXT


def _is(found: Kind, wanted: Kind) -> bool:
    """Whether a file of the kind found may be one of the kind wanted, so that its reader knows best."""
    picture = found is PICTURE or found.name.endswith(" picture")
    if wanted in (PICTURE, HEIGHTS):
        return picture or found in (HEIGHTS, UNKNOWN, EMPTY)
    return found is wanted or (found is TEXT and wanted in (MODEL, SCENE))


_HINTS = {  # where the file itself says nothing of what it is for
    MODEL: "name an OBJ file",
    PICTURE: "name a PNG, TIFF or OpenEXR file",
    HEIGHTS: "name a picture of one grey channel, or an .hgt tile",
    SCENE: "`paradize new DIR` makes one to start from",
    BAKED: "`paradize bake SCENE.toml -o DIR` makes one",
    SOUND: "save it as Ogg Vorbis, mono or stereo",
}
_SILENT = (TEXT, UNKNOWN, EMPTY, FOLDER)


def refusal(wanted: Kind, path: Path) -> tuple[str, str] | None:
    """What is wrong, and its mend, where a file is missing or of another kind than wanted; else None."""
    try:
        found = kind_of(path)
    except FileNotFoundError:
        link = absence(path)
        return (link, "mend it, or name another file") if link else ("there is no such file", _near(path))
    except OSError:
        return None
    if _is(found, wanted):
        return None
    if found is FOLDER and wanted is BAKED:
        return f"holds no {SCENE_FILE}", _HINTS[BAKED]
    return f"is {found.name}, not {wanted.name}", _HINTS[wanted] if found in _SILENT else mend_of(found, path)


def require(wanted: Kind, path: Path) -> None:
    """Raises SourceError (of a scene SceneError) where `refusal` finds something."""
    found = refusal(wanted, path)
    if found:
        raise (SceneError if wanted is SCENE else SourceError)(found[0], file=path, mend=found[1])


@contextmanager
def expecting(wanted: Kind, path: Path) -> Iterator[None]:
    """Lets a reader read; where it refuses a file that is missing or of another kind, says that instead."""
    try:
        yield
    except ParadizeError:
        require(wanted, path)
        raise


def _near(path: Path) -> str:
    """The file that may have been meant, or where it was looked for."""
    import difflib

    folder = path.parent
    try:
        names = sorted({*os.listdir(folder)} - {path.name})  # noqa: PTH208 (names, no paths)
    except OSError:
        return f"there is no folder {folder}"
    near = difflib.get_close_matches(path.name, names[:10_000], n=1)
    return f"did you mean {folder / near[0]}?" if near else f"looked for in {folder.absolute()}"


def mend_of(kind: Kind, path: Path) -> str:
    """What to do with a file of a kind, its name filled in as a shell takes it."""
    from shlex import quote

    file, stem = (f"./{text}" if text.startswith("-") else text for text in (str(path), path.stem))
    name = path.name.replace("\\", "\\\\").replace('"', '\\"')  # inside a TOML string
    for hole, value in (("{name}", name), ("{stem}", quote(stem)), ("{file}", quote(file))):
        kind = replace(kind, mend=kind.mend.replace(hole, value))
    return kind.mend


_FILES = (".glb", ".gltf", ".ktx2", ".png", ".jpg", ".exr", ".obj", ".toml", ".json", ".html", ".ogg")


def require_glb(path: Path) -> None:
    """Raises BakeError for the name of a file that is no GLB's: programs know one by it."""
    if path.name in ("", ".."):
        raise BakeError("names a folder, not a file", file=path, mend="name a file with -o")
    if path.suffix.lower() != ".glb":
        from shlex import quote

        named = f"`-o {quote(str(path.with_suffix('.glb')))}`"
        raise BakeError(
            f"ends in {path.suffix or 'nothing'}; what is written is a GLB", file=path, mend=f"write {named}"
        )


def require_folder(path: Path) -> None:
    """Raises BakeError for a name of a folder that looks like that of a file, where no such folder is yet."""
    if path.suffix.lower() in _FILES and not path.is_dir():
        from shlex import quote

        named = f"`-o {quote(str(path.with_suffix('')))}`"
        raise BakeError(
            "is the name of a file; what is written is a folder", file=path, mend=f"write {named}"
        )
