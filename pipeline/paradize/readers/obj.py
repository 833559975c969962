"""Reads Wavefront OBJ into a Mesh with our native parser.

Every face of the file is in the result or in a warning. Polygons are triangulated in their own plane. Texture
coordinates are flipped once to the top-left origin (v' = 1 - v). Positions are read as float64. The mesh
holds the nearest float32 of their offset from its origin, which is 0 unless the model lies far from 0
(`obj/origin.hpp`).
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh, SourcePositions
from paradize.errors import SourceError, unread
from paradize.files import open_file, read_file
from paradize.kernels.obj import ParsedObj, parse_obj, parse_obj_file
from paradize.kinds import MODEL, expecting
from paradize.material import Material
from paradize.readers.colors import linear_colors
from paradize.readers.mtl import MAX_BYTES as MTL_BYTES
from paradize.readers.mtl import read_mtl
from paradize.readers.names import (
    END_MARKS,
    inside,
    named_file,
    require_utf8,
    root_of,
    spelled_otherwise,
    why_missing,
    without_comment,
)
from paradize.readers.placed import Bounds
from paradize.readers.record import DEFAULT_NAME, UNKNOWN_SMOOTHING, Model
from paradize.readers.uv_transform import UvTransforms, transformed_uvs

if TYPE_CHECKING:
    import numpy.typing as npt

SHOWN = 3  # notes in the message about a file without faces
MAX_WORDS = 16  # of a mtllib statement: each run of words may be a file name
MAX_LIBRARIES = 256  # different mtllib statements

_NOTES = {
    "lines": "{count} line elements ('l') skipped",
    "points": "{count} point elements ('p') skipped",
    "free_form": "{count} statements of free-form curves and surfaces skipped",
    "short_faces": "{count} faces with fewer than three corners skipped",
    "weights": "{count} vertices with a weight other than 1; weights ignored",
    "long_v": "{count} vertices with an odd count of numbers; x y z used",
    "long_vt": "{count} texture coordinates with more than three numbers; the first two used",
    "long_vn": "{count} normals with more than three numbers; the first three used",
    "smoothing": "{count} smoothing groups that are not whole numbers; read as off",
    "crossing_polygons": "{count} polygons whose outline crosses itself; triangles may overlap",
    "unchecked_polygons": "{count} concave polygons beyond the work limit; triangles may overlap",
    "broken_uvs": "{count} face corners name texture coordinates that are not there; read without them",
    "broken_normals": "{count} face corners name normals that are not there; read without them",
    "nan_uvs": "{count} texture coordinates that are not finite; read as 0 0",
    "nan_normals": "{count} normals that are not finite; computed",
    "nan_colors": "{count} colours that are not finite; read as white",
    "texture_maps": "{count} statements usemap or maplib ignored: name the picture as map_Kd of a material",
    "polypaint": "polypaint (#MRGB) is not one colour for each vertex; ignored",
    "keywords": "{count} more statements with unknown keywords ignored",
}


def read_obj(path: Path, root: Path | None = None, on_library: list[Path] | None = None) -> Model:
    """Reads an OBJ file and its MTL files, which must lie inside `root` (default: root_of). on_library: a
    list to which each MTL file's path is appended before it is read.

    Face corners whose texture coordinate or normal is not there are read without it, with a warning.

    Raises SourceError for a missing or unreadable file, an invalid number, NaN, infinity, a position index
    out of range (with the line), no faces, more than MAX_BYTES, and for MTL or map files that exist but
    cannot be read. Missing MTL and map files are warnings.
    """
    with expecting(MODEL, path):
        parsed = _parse(path)
        if parsed.faults:
            raise _fault(path, parsed)
        warnings = _warnings(path, parsed)
        if len(parsed.triangles) == 0:
            raise _without_faces(path, warnings)
    groups, smoothing = _groups(parsed)
    defined = _Definitions(
        path, root_of(path) if root is None else root, warnings, _bounds_of(parsed, groups)
    )
    groups = defined.read_all(parsed.libraries, groups, on_library)
    warnings = list(dict.fromkeys(warnings + _without_uvs(path, parsed, groups, defined.materials)))
    colors = None
    if len(parsed.colors):
        colors = linear_colors(parsed.colors, ["f4"] * 4, "vertex colours", path, warnings)
    mesh = Mesh(
        positions=parsed.positions,
        triangles=parsed.triangles,
        normals=parsed.normals if len(parsed.normals) else None,
        uvs=parsed.uvs if len(parsed.uvs) else None,
        colors=colors,
        groups=groups,
        origin=parsed.origin,
    )
    source = SourcePositions(parsed.source_positions, parsed.collapsed, parsed.first_collapsed)
    mesh, source = transformed_uvs(mesh, source, defined.transforms)
    counts = {
        "faces": parsed.faces,
        "triangles": len(parsed.triangles),
        "vertices": len(mesh.positions),
        "positions_in_file": parsed.positions_in_file,
        "positions_unused": parsed.positions_unused,
    }
    counts |= {note.code: note.count for note in parsed.notes}
    lost: dict[str, dict[str, int | None]] = {
        name: {"count": 0, "triangle": None, "line": None} for name in ("broken_uvs", "broken_normals")
    }
    for note in parsed.notes:
        if note.code in lost:
            lost[note.code] |= {"count": note.count, "line": note.line}
    return Model(
        *(mesh, source, defined.materials, warnings, counts, smoothing, parsed.triangle_lines),
        *(defined.libraries, defined.absent, lost),
    )


class _Definitions:
    """The materials of a model, read from its MTL files.

    materials, transforms: by name; libraries: the files read, in order; absent: files that are named and not
    there. New warnings are appended to `warnings`.
    """

    def __init__(
        self, path: Path, root: Path, warnings: list[str], bounds_of: Callable[[str], Bounds | None]
    ) -> None:
        self.materials: dict[str, Material] = {}
        self.transforms: dict[str, UvTransforms] = {}
        self.libraries: list[Path] = []
        self.absent: list[Path] = []
        self._path, self._root, self._warnings, self._bounds_of = path, root, warnings, bounds_of

    def read_all(
        self, statements: Sequence[str], groups: Sequence[Group], on_library: list[Path] | None
    ) -> tuple[Group, ...]:
        """Reads the files that the mtllib statements name, and the file of the model's name where materials
        are missing. Returns the groups with materials that are spelled otherwise named as they are defined.
        on_library: as of read_obj."""
        path, warnings = self._path, self._warnings
        statements = list(dict.fromkeys(statements))
        if len(statements) > MAX_LIBRARIES:
            warnings.append(
                f"{path}: {len(statements)} material files, limit {MAX_LIBRARIES}; the rest is left out"
            )
        found: list[Path] = []
        for statement in statements[:MAX_LIBRARIES]:
            found += _libraries(path, self._root, statement, warnings, self.absent)
        for library in dict.fromkeys(found):
            self._read(library, on_library)
        used = dict.fromkeys(group.material for group in groups)
        missing = [name for name in used if name not in self.materials and name != DEFAULT_NAME]
        meant = _without_comments(missing, self.materials)
        missing = [name for name in missing if name not in meant]
        if missing and (own := _of_same_name(path, self._root)) and own not in self.libraries:
            self._read(own, on_library, kept=list(self.materials))
            missing = [name for name in missing if name not in self.materials]
            meant |= _without_comments(missing, self.materials)
            missing = [name for name in missing if name not in meant]
            warnings.append(
                f"{path}: no mtllib line names {own.name!r}; its name is the model's, so it is read"
            )
        if list(used) == [DEFAULT_NAME] and len(self.materials) == 1 and DEFAULT_NAME not in self.materials:
            (only,) = self.materials
            what = f"its faces name no material that is defined; {only[:120]!r}, the only one, is used"
            warnings.append(f"{path}: {what}")
            self.materials[DEFAULT_NAME] = replace(self.materials.pop(only), name=DEFAULT_NAME)
        for name, other in meant.items():
            warnings.append(f"{path}: material {name[:120]!r} is not defined; read as {other[:120]!r}")
        if missing:
            shown = ", ".join(repr(name[:120]) for name in missing[:8]) + (
                ", ..." if len(missing) > 8 else ""
            )
            are = "1 material is" if len(missing) == 1 else f"{len(missing)} materials are"
            mend = "a `mtllib` line names the file that defines them"
            if self.libraries:
                read = ", ".join(repr(library.name[:120]) for library in self.libraries[:8])
                mend = f"no `newmtl` line of {read} names {'it' if len(missing) == 1 else 'them'}"
            mend = f"drawn plain, unless a scene says more; {mend}"
            warnings.append(f"{path}: {are} used but not defined: {shown}; {mend}")
        return tuple(replace(group, material=meant.get(group.material, group.material)) for group in groups)

    def _read(self, library: Path, on_library: list[Path] | None, kept: Collection[str] = ()) -> None:
        """Reads one file. Materials of `kept` stay as they are; other names mean what was read last."""
        self.libraries.append(library)
        if on_library is not None:
            on_library.append(library)
        more = read_mtl(library, self._root, self.absent, self._bounds_of)
        self._warnings += more.warnings
        for name, material in more.materials.items():
            if name not in kept:
                self.materials[name] = material
                self.transforms.pop(name, None)
                self.transforms |= {name: more.transforms[name]} if name in more.transforms else {}


def _bounds_of(parsed: ParsedObj, groups: Sequence[Group]) -> Callable[[str], Bounds | None]:
    """Returns a function of a material's name: the least and the largest texture coordinates of its
    triangles. Names that differ only in the comments behind them are one."""

    def bounds(material: str) -> Bounds | None:
        plain = without_comment(material)
        own = [g for g in groups if g.material == material]
        own = own or [g for g in groups if without_comment(g.material) == plain]
        if not own or not len(parsed.uvs):
            return None
        used = [parsed.uvs[parsed.triangles[g.first : g.first + g.count].reshape(-1)] for g in own]
        low = np.min([uvs.min(axis=0) for uvs in used], axis=0).tolist()
        high = np.max([uvs.max(axis=0) for uvs in used], axis=0).tolist()
        return (*low, *high)

    return bounds


def _without_comments(missing: Collection[str], materials: Collection[str]) -> dict[str, str]:
    """The defined material that each missing one means: that whose name is the same without the comments
    behind both. Names that mean none, or several, are left out."""
    plain: dict[str, list[str]] = {}
    for name in materials:
        plain.setdefault(without_comment(name), []).append(name)
    found = {name: plain.get(without_comment(name), []) for name in missing}
    return {name: those[0] for name, those in found.items() if len(those) == 1}


def _of_same_name(path: Path, root: Path) -> Path | None:
    """The material file beside a model that bears its name."""
    own = inside(root, path.parent, path.stem + ".mtl")
    return own if own is not None and named_file(own, f"{path} (its name)", MTL_BYTES) else None


def _parse(path: Path) -> ParsedObj:
    """parse_obj_file of a path. Raises SourceError where the file cannot be read."""
    try:
        with open_file(path) as file:
            require_utf8(os.pread(file.fileno(), 4, 0), path)
            last = os.pread(file.fileno(), 1, max(os.fstat(file.fileno()).st_size - 1, 0))
            if last.strip(END_MARKS) != last:
                return parse_obj(read_file(path).rstrip(END_MARKS))
            return parse_obj_file(file.fileno())
    except (OSError, ValueError) as error:
        error = error if isinstance(error, OSError) else OSError(errno.EINVAL, str(error))
        large = error.errno == errno.EFBIG
        mend = "split the model into several files" if large else "name an OBJ file that can be read"
        raise unread(error, path, mend) from error


def _without_faces(path: Path, warnings: list[str]) -> SourceError:
    notes = [warning.partition(": ")[2] for warning in warnings]
    notes = [
        *notes[:SHOWN],
        *([f"{len(notes) - SHOWN} more kinds of statements"] if len(notes) > SHOWN else []),
    ]
    what = "no faces" + (f" ({'; '.join(notes)})" if notes else "")
    return SourceError(what, file=path, mend="export the model with its faces")


def _fault(path: Path, parsed: ParsedObj) -> SourceError:
    faults = sorted(parsed.faults, key=lambda fault: fault[1])
    what, line = faults[0]
    if parsed.fault_count > 1:
        lines = list(dict.fromkeys(str(other) for _, other in faults[1:]))
        lines += ["..."] if parsed.fault_count > len(faults) else []
        what += f" (and {parsed.fault_count - 1} more, line{'s' * (len(lines) > 1)} {', '.join(lines)})"
    return SourceError(what, file=path, place=f"line {line}", mend="mend the file or export it again")


def _warnings(path: Path, parsed: ParsedObj) -> list[str]:
    warnings = []
    for note in parsed.notes:
        if note.code.startswith("keyword:"):
            word = note.code.removeprefix("keyword:")
            text = f"{note.count} statements with the unknown keyword {word!r} ignored"
        elif note.code == "faces_without_uv":
            continue  # _without_uvs tells it, once the materials are read
        elif note.code == "faces_without_normal":
            if not len(parsed.normals):
                continue
            text = f"{note.count} of {parsed.faces} faces without normals; computed"
        else:
            text = _NOTES[note.code].format(count=note.count)
        warnings.append(f"{path}: line {note.line}: {text}")
    return warnings


def _without_uvs(
    path: Path, parsed: ParsedObj, groups: Sequence[Group], materials: Mapping[str, Material]
) -> list[str]:
    """A warning of faces without texture coordinates beside others; only of those whose material has a map,
    because nothing reads the coordinates of the rest."""
    note = next((note for note in parsed.notes if note.code == "faces_without_uv"), None)
    if note is None or not len(parsed.uvs):
        return []
    names = {name for name, material in materials.items() if material.maps}
    mapped = np.repeat([group.material in names for group in groups], [group.count for group in groups])
    line, found = note.line, f"{note.count} of {parsed.faces} faces"
    if not mapped.all():
        bare = mapped & (parsed.uvs[parsed.triangles] == 0.0).all(axis=(1, 2))
        if not bare.any():
            return []
        line, found = parsed.triangle_lines[bare.argmax()], f"{bare.sum()} of {len(bare)} triangles"
    return [f"{path}: line {line}: {found} without texture coordinates; they get (0, 0)"]


def _libraries(path: Path, root: Path, statement: str, warnings: list[str], absent: list[Path]) -> list[Path]:
    """The files of one mtllib statement: the whole line as one name, or several names that may contain
    blanks. Raises SourceError as `named_file`."""

    named_by = f"{path} (mtllib)"

    def existing(name: str) -> Path | None:
        library = inside(root, path.parent, name)
        return library if library is not None and named_file(library, named_by, MTL_BYTES) else None

    for spelling in (statement, statement.replace("\\ ", " ")):
        whole = existing(spelling)
        if whole is not None:
            return [whole]
    if other := spelled_otherwise(root, path.parent, statement):
        exact = inside(root, path.parent, statement)
        absent += [] if exact is None else [exact]
        warnings.append(f"{path}: material file {other[1]}")
        return [other[0]]
    words = without_comment(statement).replace("\\ ", " ").split(" ")[:MAX_WORDS]
    if len(words) > 1 and (whole := inside(root, path.parent, " ".join(words))):
        absent.append(whole)
    libraries = []
    missing: list[str] = []  # words of a name, which reaches to its suffix or to a name that is there
    index = 0
    while index < len(words):
        runs = ((existing(" ".join(words[index:stop])), stop) for stop in range(len(words), index, -1))
        part, stop = next((run for run in runs if run[0] is not None), (None, index + 1))
        missing += [] if part else [words[index]]
        name = " ".join(missing).strip()
        after = words[stop] if stop < len(words) else ""
        ends = part or stop == len(words) or name.lower().endswith(".mtl")
        if name and (ends or (after and spelled_otherwise(root, path.parent, after))):
            missing.clear()
            library = inside(root, path.parent, name)
            reason = "lies outside the root folder" if library is None else why_missing(library)
            if library is not None:
                absent.append(library)
            if other := spelled_otherwise(root, path.parent, name):
                libraries.append(other[0])
                warnings.append(f"{path}: material file {other[1]}")
            else:
                mend = "put it beside the model, or correct the mtllib line"
                warnings.append(f"{path}: material file {name[:120]!r} {reason}; ignored: {mend}")
        libraries += [part] if part else []
        index = stop
    return libraries


def _groups(parsed: ParsedObj) -> tuple[tuple[Group, ...], npt.NDArray[np.uint32]]:
    """Runs of triangles with the same name and material, and the smoothing group of each triangle."""
    total = len(parsed.triangles)
    smoothing = np.full(total, UNKNOWN_SMOOTHING, np.uint32)
    groups: list[Group] = []
    for index, run in enumerate(parsed.runs):
        stop = parsed.runs[index + 1].first_triangle if index + 1 < len(parsed.runs) else total
        if run.smoothing is not None:
            smoothing[run.first_triangle : stop] = run.smoothing
        name = run.group or run.object_name or DEFAULT_NAME
        material = run.material or DEFAULT_NAME
        if groups and (groups[-1].name, groups[-1].material) == (name, material):
            previous = groups[-1]
            groups[-1] = Group(name, material, previous.first, stop - previous.first)
        else:
            groups.append(Group(name, material, run.first_triangle, stop - run.first_triangle))
    return tuple(groups), smoothing
