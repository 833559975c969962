"""Reads Wavefront MTL: names, colours, factors and maps of materials.

Format: Wavefront, "Advanced Visualizer Manual, Appendix B2. Material (.mtl)", 1992; with Pr, Pm, Ke, norm and
their maps of "Physically-based MTL" (Clara.io, 2014). An invalid number, NaN or infinity in a statement that
is used is an error with its line; one out of its range is read as the nearest in it, with a warning.
Statements and options that are not used are one warning a file.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

from paradize.errors import GroupedError, SourceError, unread
from paradize.files import read_file
from paradize.kernels.obj import decode, printable
from paradize.material import MAX_EMISSION, Material
from paradize.readers.mtl.maps import floats, read_map_statement
from paradize.readers.mtl.material import BLENDER_ROLES, PACKED, ROLES, Statements, material_of
from paradize.readers.mtl.texture_transform import BoundsOf
from paradize.readers.names import END_MARKS, require_utf8
from paradize.readers.ranges import beyond, strays, within
from paradize.readers.uv_transform import UvTransforms

MAX_BYTES = 16 << 20
MAX_MAPS = 10_000  # map statements that are followed; each opens a file
_HEAD = 200  # characters in which a program names itself
MAX_MESSAGES = 100  # of warnings and of errors
# The largest value of each statement that is used; the least is 0.
_COLORS = {"kd": 1.0, "ks": 1.0, "ke": MAX_EMISSION, "ka": 1.0}
_NUMBERS = {"ns": inf, "d": 1.0, "tr": 1.0, "pr": 1.0, "pm": 1.0}
_LIGHT = "ambient light is the sky's"
_MIRROR = "surfaces reflect the sky"
_UNUSED = {
    **dict.fromkeys(("ka", "map_ka"), _LIGHT),
    **dict.fromkeys(("refl", "map_refl", "sharpness"), _MIRROR),
    "ni": "light is not bent",
    "tf": "light that passes through is not tinted",
    "illum": "reflections and refractions are not traced",
    **dict.fromkeys(("ps", "map_ps"), "there is no sheen"),
    **dict.fromkeys(("pc", "pcr", "map_pc", "map_pcr"), "there is no clear coat"),
    **dict.fromkeys(("aniso", "anisor", "map_aniso", "map_anisor"), "highlights are round"),
    "decal": "no map is laid over another",
    "map_aat": "textures are always filtered",
}
# Values of unused statements that change nothing.
_NEUTRAL = {"ka": {0.0, 1.0}, "ni": {0.0, 1.0, 1.45, 1.5}, "tf": {1.0}, "illum": {0.0, 1.0, 2.0}}
_NEUTRAL |= {key: {0.0} for key in ("ps", "pc", "pcr", "aniso", "anisor")}


@dataclass(frozen=True)
class Library:
    """The contents of an MTL file. materials: by name, in the file's order. transforms: of texture
    coordinates, by material, where a material moves them."""

    materials: dict[str, Material]
    warnings: list[str]
    transforms: dict[str, UvTransforms]


def read_mtl(
    path: Path,
    root: Path,
    absent: list[Path] | None = None,
    bounds_of: BoundsOf = lambda _: None,
) -> Library:
    """Reads a material file. Pictures must lie inside `root`; otherwise they are a warning and not opened. A
    missing picture is a warning; its path is appended to `absent`. bounds_of: of the texture coordinates that
    a material is used with; None: not known. Raises SourceError for an unreadable file
    or an invalid number with its line, GroupedError for several."""
    try:
        raw = read_file(path, MAX_BYTES).removeprefix(b"\xef\xbb\xbf").rstrip(END_MARKS)
    except OSError as error:
        raise unread(error, path) from None
    require_utf8(raw[:4], path)
    reader = _Reader(path, root, absent)
    found = reader.statements(raw)
    library = Library({}, reader.warnings, {})
    for name, statements in found.items():
        library.materials[name], transform = material_of(name, statements, reader.warn, bounds_of)
        if transform:
            library.transforms[name] = transform
    if reader.unused:
        library.warnings.append(f"{path}: not used: {'; '.join(reader.unused_texts())}")
    return library


class _Reader:
    def __init__(self, path: Path, root: Path, absent: list[Path] | None) -> None:
        self.path, self.root, self.absent = path, root, absent
        self.warnings: list[str] = []
        self.errors: list[SourceError] = []
        self.unused: dict[str, tuple[int, int]] = {}  # keyword as written -> count, first line
        self.maps = 0
        self.color_text = ""  # of the last map_Kd, as written
        self.ambient: tuple[str, int, list[str]] | None = None  # map_Ka: keyword, line, picture

    def statements(self, text: bytes) -> dict[str, Statements]:
        """The statements of each material. Raises what was found wrong. Each line is decoded by itself, as
        names in OBJ are: files of several programs mix encodings."""
        blender = text.startswith(b"# Blender")
        meshlab = b"meshlab" in text[:_HEAD].lower()
        found: dict[str, Statements] = {}
        current: Statements | None = None
        joined = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
        for number, line in enumerate(joined.split(b"\n"), 1):
            word, rest = _split(line)
            if word.lower() == "newmtl":
                rest = printable(rest)
                if not rest:
                    self.warn(number, "a material without a name, which no face can use; name it")
                if rest in found:
                    self.warn(number, f"material {rest[:120]!r} is defined again; the last one counts")
                self.drop_ambient()
                current, self.color_text = Statements(blender=blender, meshlab=meshlab), ""
                found[rest] = current
            elif current is not None and word and not word.startswith("#"):
                self.statement(current, number, word, rest)
            if self.maps > MAX_MAPS:
                what = f"more than {MAX_MAPS} maps: this and all that follows is ignored"
                self.warnings.append(f"{self.path}: line {number}: {what}")
                break
            if len(self.errors) == MAX_MESSAGES:
                break
        self.drop_ambient()
        if self.errors:
            raise self.errors[0] if len(self.errors) == 1 else GroupedError(self.errors)
        return found

    def warn(self, line: int, text: str) -> None:
        if len(self.warnings) < MAX_MESSAGES:
            self.warnings.append(f"{self.path}: line {line}: {text}")
        elif len(self.warnings) == MAX_MESSAGES:
            self.warnings.append(f"{self.path}: more than {MAX_MESSAGES} warnings; the rest is left out")

    def drop(self, word: str, line: int) -> None:
        count, first = self.unused.get(word, (0, line))
        if count or len(self.unused) < MAX_MESSAGES:
            self.unused[word] = (count + 1, first)

    def drop_ambient(self) -> None:
        """Says that a material's map_Ka is not used, unless it is its map_Kd, as exporters write it."""
        if self.ambient and self.ambient[2] != self.color_text.split()[-1:]:
            self.drop(*self.ambient[:2])
        self.ambient = None

    def unused_texts(self) -> list[str]:
        texts = []
        for word, (count, line) in self.unused.items():
            reason = _UNUSED.get(word.lower(), "the option has no effect" if word[0] == "-" else "unknown")
            times = f"{count} times, first in line {line}" if count > 1 else f"line {line}"
            texts.append(f"{word[:40]} ({times}: {reason})")
        return texts

    def statement(self, into: Statements, line: int, word: str, rest: str) -> None:
        """Adds a map, a colour or numbers to a material's statements. Numbers of other keywords are kept too
        (`material_of` uses illum); one that would change the look and is not used is noted."""
        key = word.lower()
        colored = key in _COLORS and (into.blender or key != "ka")
        if key in (BLENDER_ROLES if into.blender else ROLES) or key in PACKED:
            self.map(into, line, word, rest)
        elif colored and rest.split()[:1] in (["spectral"], ["xyz"]):
            self.warn(line, f"{word} as {rest.split()[0]} is not read; ignored")
        elif colored:
            self.numbers(into, line, word, rest, 3, "1 or 3 finite numbers")
        elif key in _NUMBERS:
            self.numbers(into, line, word, rest.removeprefix("-halo").strip(), 1, "a finite number")
        else:
            values = floats(rest, 3 if key in ("ka", "tf") else 1)
            used = into.blender and key == "illum"
            if values is not None:
                into.values[key] = values
                used = used or set(values) <= _NEUTRAL.get(key, set())
            if key == "map_ka":
                self.ambient = (word, line, rest.split()[-1:])
            elif not used:
                self.drop(word, line)

    def numbers(self, into: Statements, line: int, word: str, rest: str, count: int, expected: str) -> None:
        key = word.lower()
        values = floats(rest, count)
        if values is not None:
            high = (_COLORS | _NUMBERS)[key]
            into.values[key], into.lines[key] = within(values, 0.0, high), line
            if strays(values, into.values[key]):
                self.warn(line, f"{word} {beyond(values, 0.0, high, into.values[key])}")
            return
        what = f"{word} {rest[:40]!r}, expected {expected}"
        mend = "mend the file or export it again"
        self.errors.append(SourceError(what, file=self.path, place=f"line {line}", mend=mend))

    def map(self, into: Statements, line: int, word: str, rest: str) -> None:
        self.maps += 1
        if self.maps > MAX_MAPS:
            return
        key = word.lower()
        if key == "map_kd":
            self.color_text = rest
        found = read_map_statement(key, rest, self.path, line, self.root, self.absent)
        if isinstance(found, str):
            self.warn(line, f"{word}: {found}")
            into.values[key] = ()
            return
        if found.note:
            self.warn(line, f"{word}: {found.note}")
        before = into.maps.get(key)
        if before and replace(before, line=line) != found:
            self.warn(line, f"{word}: line {before.line} says otherwise; the last one counts")
        into.maps[key] = found
        for option in found.unused:
            self.drop(option, line)


def _split(line: bytes) -> tuple[str, str]:
    """The keyword and the rest of a line."""
    parts = line.split(None, 1)
    return (decode(parts[0]) if parts else ""), (decode(parts[1].strip()) if len(parts) > 1 else "")
