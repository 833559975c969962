"""Reads PLY, text and binary: polygons or strips of triangles with normals, texture coordinates, colours and
the picture that MeshLab and photogrammetry name in a comment (TextureFile).

Polygons are cut into triangles as those of an OBJ are. Texture coordinates are flipped once to the top-left
origin. Colours are sRGB, as the programs that write them (Blender, MeshLab) have them.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh, SourcePositions
from paradize.errors import SourceError, unread
from paradize.files import read_file
from paradize.kernels.mesh import number_rows
from paradize.kernels.obj import cut_polygons, origin_of
from paradize.material import MapSource, Material, Picture
from paradize.readers.colors import linear_colors
from paradize.readers.names import inside, named_file, root_of, spelled_otherwise, why_missing
from paradize.readers.ply_elements import Lists, Ply, read_elements
from paradize.readers.record import DEFAULT_NAME, LARGEST_COORDINATE, UNKNOWN_SMOOTHING, Model

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import F64

_UVS = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_COLORS = (
    ("red", "green", "blue", "alpha"),
    ("diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"),
    ("r", "g", "b", "a"),
)
_FACES = ("vertex_indices", "vertex_index")
_READ = {"x", "y", "z", "nx", "ny", "nz", *(name for names in (*_UVS, *_COLORS) for name in names)}
# Properties of Gaussian splats: of trained ones, of compressed ones.
_SPLATS = ({"scale_0", "rot_0"}, {"packed_position", "packed_scale"})
_PICTURE = "TextureFile"  # a comment names it
_MEND = "export the model again"


@np.errstate(invalid="ignore")  # a file may hold signalling NaN
def read_ply(path: Path, root: Path | None = None) -> Model:
    """Reads a PLY and finds its picture, which must lie inside `root` (default: root_of). Beside a picture
    its vertices have no colours: programs show the one or the other.

    Raises SourceError for a file that is cut, without faces, or with an index or a number that cannot be
    meant, and for a picture that cannot be read. A missing one is a warning.
    """
    try:
        data = read_file(path)
    except OSError as error:
        raise unread(error, path) from None
    ply = read_elements(data, path, {*_READ, *_FACES, "texcoord"})
    columns = ply.columns.get("vertex", {})
    if not {"x", "y", "z"} <= columns.keys():
        raise _no_mesh(ply, path, "has no vertices with x, y and z")
    places = np.stack([columns[name] for name in ("x", "y", "z")], axis=1).astype(np.float64)
    warnings: list[str] = []
    faces, own = _faces(ply, path, len(places), warnings)
    corners = faces.values.astype(np.uint32)
    _require_finite(places, corners, path)
    cut, crossing = cut_polygons(places, corners, faces.counts.astype(np.uint32))
    if crossing:
        warnings.append(f"{path}: {crossing} polygons whose outline crosses itself; triangles may overlap")
    triangles = corners[cut]
    origin = origin_of(places, triangles)
    arrays = {"positions": (places - origin).astype(np.float32), **_attributes(ply, path, warnings)}
    if own:  # a vertex for each corner
        arrays = {name: rows[corners] for name, rows in arrays.items()} | own
        places, triangles = places[corners], cut
    absent: list[Path] = []
    picture = _picture(ply, path, root_of(path) if root is None else root, warnings, absent)
    materials = _materials(picture, arrays, path, warnings)
    _warn(ply, path, warnings)
    arrays = {name: rows + np.float32(0) for name, rows in arrays.items()}  # -0 becomes 0
    used, place = np.unique(triangles, return_inverse=True)
    ids, first = number_rows(np.concatenate([rows[used] for rows in arrays.values()], axis=1))
    kept, total = used[first], len(triangles)
    mesh = Mesh(
        triangles=np.ascontiguousarray(ids[place.reshape(-1, 3)]),
        groups=(Group(DEFAULT_NAME, DEFAULT_NAME, 0, total),),
        origin=origin,
        **{name: np.ascontiguousarray(rows[kept]) for name, rows in arrays.items()},  # type: ignore[arg-type]
    )
    in_file = len(columns["x"])
    counts = {"faces": len(faces.counts), "triangles": total, "vertices": len(kept)}
    counts |= {"positions_in_file": in_file, "positions_unused": in_file - len(np.unique(corners))}
    smoothing = np.full(total, UNKNOWN_SMOOTHING, np.uint32)
    source = SourcePositions(places[kept])
    return Model(mesh, source, materials, warnings, counts, smoothing, absent=absent)


def _no_mesh(ply: Ply, path: Path, what: str) -> SourceError:
    """The error `what`, or that the file is a Gaussian splat."""
    if any(names <= ply.columns.get("vertex", {}).keys() for names in _SPLATS):
        what = "is a Gaussian splat, and Paradize reads only meshes"
    return SourceError(what, file=path, mend="export the model with its faces, as polygons")


def _require_finite(places: F64, corners: npt.NDArray[np.uint32], path: Path) -> None:
    """Raises SourceError where a place of a corner is not a number, or beyond float32. Vertices that no face
    uses, which are left out, are put at 0 there."""
    bad = np.logical_not((np.abs(places) <= LARGEST_COORDINATE).all(axis=1))
    if (wrong := corners[bad[corners]]).size:
        at = int(wrong.min())
        shown = " ".join(f"{value:g}" for value in places[at])
        raise SourceError(f"x y z are {shown}", file=path, place=f"vertex {at}", mend=_MEND)
    places[bad] = 0.0


def _faces(
    ply: Ply, path: Path, vertices: int, warnings: list[str]
) -> tuple[Lists, dict[str, npt.NDArray[np.float32]]]:
    """The polygons; what their corners have of their own: texture coordinates, and the colours of faces where
    vertices have none."""
    own = ply.lists.get("face", {})
    faces = next((own[name] for name in _FACES if name in own), None)
    strips = next((rows for name, rows in ply.lists.get("tristrips", {}).items() if name in _FACES), None)
    if strips is not None and faces is None:
        faces = _triangles(strips)
    if faces is None or not (faces.counts >= 3).any():
        raise _no_mesh(ply, path, "holds no faces")
    whole = np.repeat(faces.counts >= 3, faces.counts)
    corners = faces.values[whole]
    bad = ~((corners >= 0) & (corners < vertices) & (corners == np.floor(corners)))
    if bad.any():
        at = int(bad.argmax())
        face = int(np.searchsorted(np.cumsum(faces.counts[faces.counts >= 3]), at, side="right"))
        what = f"names vertex {corners[at]:g} of {vertices}"
        raise SourceError(what, file=path, place=f"face {face}", mend=_MEND)
    short = int((faces.counts < 3).sum())
    if short:
        warnings.append(f"{path}: {short} faces with fewer than three corners skipped")
    found = {}
    if own.keys() & set(_FACES) and _color_names(ply, "face"):
        if _color_names(ply, "vertex"):
            warnings.append(f"{path}: the colours of its faces are left out: its vertices have theirs")
        else:
            found["colors"] = np.repeat(_colors(ply, "face", path, warnings), faces.counts, axis=0)[whole]
    texcoord = own.get("texcoord")
    if texcoord is not None and (texcoord.counts == 2 * faces.counts).all():
        uvs = texcoord.values.reshape(-1, 2)[whole].astype(np.float64)
        if (np.abs(uvs) <= LARGEST_COORDINATE).all():
            found["uvs"] = _flipped(uvs)
        else:
            warnings.append(f"{path}: texcoord holds what is no number, or beyond float32; left out")
    elif texcoord is not None and texcoord.counts.any():
        warnings.append(f"{path}: texcoord does not fit all faces; left out")
    return Lists(faces.counts[faces.counts >= 3], corners), found


def _triangles(strips: Lists) -> Lists:
    """The triangles of strips, each turned as the first of its strip. -1 ends a strip, as the end of its list
    does. A triangle with a corner twice joins two strips: it has no area and is left out."""
    corners = np.insert(strips.values.astype(np.float64), np.cumsum(strips.counts), -1.0)
    at = np.arange(len(corners))
    begin = np.maximum.accumulate(np.where(corners == -1.0, at + 1, 0))
    third = at[at >= begin + 2]
    odd = (third - begin[third]) % 2
    rows = np.stack([corners[third - 2 + odd], corners[third - 1 - odd], corners[third]], axis=1)
    first, second, last = rows.T
    rows = rows[(first != second) & (second != last) & (last != first)]
    return Lists(np.full(len(rows), 3), rows.reshape(-1))


def _flipped(uvs: F64) -> npt.NDArray[np.float32]:
    return np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1).astype(np.float32)


def _attributes(ply: Ply, path: Path, warnings: list[str]) -> dict[str, npt.NDArray[np.float32]]:
    """Normals, texture coordinates and colours of the vertices, as a Mesh has them."""
    columns = ply.columns["vertex"]
    found: dict[str, npt.NDArray[np.float32]] = {}
    if {"nx", "ny", "nz"} <= columns.keys():
        normals = np.stack([columns[name] for name in ("nx", "ny", "nz")], axis=1).astype(np.float64)
        normals[~np.isfinite(normals).all(axis=1)] = 0.0
        length = np.sqrt(np.square(normals / (top := max(float(np.abs(normals).max()), 1e-300))).sum(axis=1))
        normals = normals / top / np.where(length > 0.0, length, 1.0)[:, None]
        found["normals"] = normals.astype(np.float32)
    for pair in _UVS:
        if set(pair) <= columns.keys() and "uvs" not in found:
            uvs = np.stack([columns[name] for name in pair], axis=1).astype(np.float64)
            bad = np.logical_not((np.abs(uvs) <= LARGEST_COORDINATE).all(axis=1))
            if bad.any():
                what = "texture coordinates that are no numbers, or beyond float32; read as 0 0"
                warnings.append(f"{path}: {what} ({int(bad.sum())})")
            found["uvs"] = _flipped(np.where(bad[:, None], 0.0, uvs))
    if _color_names(ply, "vertex"):
        found["colors"] = _colors(ply, "vertex", path, warnings)
    return found


def _color_names(ply: Ply, element: str) -> list[str]:
    columns = ply.columns.get(element, {})
    names = next((names for names in _COLORS if set(names[:3]) <= columns.keys()), ())
    return [name for name in names if name in columns]


def _colors(ply: Ply, element: str, path: Path, warnings: list[str]) -> npt.NDArray[np.float32]:
    """The colours of vertices or faces (n, 4), linear."""
    columns, held = ply.columns[element], _color_names(ply, element)
    rows = np.stack([columns[name] for name in held], axis=1).astype(np.float64)
    bad = np.logical_not((np.abs(rows) <= LARGEST_COORDINATE).all(axis=1))
    if bad.any():
        what = "colours that are no numbers, or beyond float32; read as white"
        warnings.append(f"{path}: {int(bad.sum())} {what}")
    kinds = [ply.kinds[element][name] for name in held]
    what = "vertex colours" if element == "vertex" else "face colours"
    colors = linear_colors(np.where(bad[:, None], 0.0, rows), kinds, what, path, warnings)
    colors[bad] = 1.0
    return colors


def _materials(
    picture: Path | None, arrays: dict[str, npt.NDArray[np.float32]], path: Path, warnings: list[str]
) -> dict[str, Material]:
    """The material that has the picture; the colours of the vertices are taken out of `arrays` then."""
    if picture is None:
        return {}
    if "uvs" not in arrays:
        what = f"has no texture coordinates for its picture {picture.name!r}, which is left out"
        warnings.append(f"{path}: {what}")
        return {}
    if arrays.pop("colors", None) is not None:
        warnings.append(f"{path}: its colours are left out beside its picture")
    maps = {"color": MapSource(Picture(picture, name=picture.name))}
    return {DEFAULT_NAME: Material(DEFAULT_NAME, maps=maps)}


def _picture(ply: Ply, path: Path, root: Path, warnings: list[str], absent: list[Path]) -> Path | None:
    """The picture that its comment names; None without one, with several, or where it is not there."""
    marked = [comment for comment in ply.comments if comment.startswith(_PICTURE)]
    names = [comment.removeprefix(_PICTURE).strip() for comment in marked]
    if len(names) > 1:
        warnings.append(f"{path}: {len(names)} pictures ({_PICTURE}) are not read, one is; export it as OBJ")
    if len(names) != 1:
        return None
    found = inside(root, path.parent, names[0])
    if found is not None and named_file(found, f"{_PICTURE} of {path}"):
        return found
    absent += [found] if found is not None else []
    other = spelled_otherwise(root, path.parent, names[0])
    if other is None:
        what = f"{why_missing(found)}; ignored: put it there, or correct the name"
        if found is None:
            what = f"lies outside {root}; ignored: copy it beside the model"
        warnings.append(f"{path}: {_PICTURE}: {names[0][:120]!r} {what}")
        return None
    warnings.append(f"{path}: {_PICTURE}: {other[1]}")
    return other[0]


def _warn(ply: Ply, path: Path, warnings: list[str]) -> None:
    """Adds warnings of what is not read."""
    for number, line in list(ply.skipped.items())[:1]:
        more = f" (and {len(ply.skipped) - 1} more)" if len(ply.skipped) > 1 else ""
        what = f"{line[:80]!r} is not a statement of PLY; skipped{more}"
        warnings.append(f"{path}: line {number}: {what}")
    if ply.longer:
        what = f"{ply.longer} lines with more numbers than the header names; the rest left out"
        warnings.append(f"{path}: {what}")
    others = sorted(ply.kinds["vertex"].keys() - _READ)
    if others:
        warnings.append(f"{path}: properties of vertices are not read: {', '.join(others)[:200]}")
