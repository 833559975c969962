"""One mesh out of the primitives of a model, in world space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from paradize.data import Group, Mesh, SourcePositions
from paradize.kernels.mesh import number_rows
from paradize.kernels.obj import origin_of
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.materials import PlacedMaterial
from paradize.readers.gltf.nodes import Matrix, cofactors, determinant
from paradize.readers.gltf.primitives import Primitive
from paradize.readers.gltf.texture_transform import TextureTransform
from paradize.readers.record import LARGEST_COORDINATE, UNKNOWN_SMOOTHING
from paradize.vectors import cross, lengths, squared_lengths

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import F64


@dataclass(frozen=True)
class Part:
    """A primitive as it stands in the world. positions: (n, 3). triangles: (m, 3). The attributes: (n, k), or
    None. name: of the group. material: its name. mapped: whether it has maps."""

    name: str
    material: str
    mapped: bool
    positions: F64
    triangles: npt.NDArray[np.int64]
    normals: F64 | None
    tangents: F64 | None
    uvs: F64 | None
    uvs1: F64 | None
    colors: F64 | None


def place_part(
    document: Document,
    read: Primitive,
    matrix: Matrix | F64,
    material: PlacedMaterial,
    name: str,
    place: str,
) -> Part:
    """A primitive moved into the world. matrix: its transform, or (n, 12) one for each vertex. name: of its
    node."""
    document.spend(read.triangles.size + 3 * len(read.values["POSITION"]), place, "copies")
    m = np.broadcast_to(np.asarray(matrix), (len(read.values["POSITION"]), 12))
    with np.errstate(over="ignore", invalid="ignore"):
        positions = _moved(m, read.values["POSITION"], 4) + m[:, 3::4]
    if not (np.abs(positions) <= LARGEST_COORDINATE).all():
        at = int((~(np.abs(positions) <= LARGEST_COORDINATE)).any(axis=1).argmax())
        shown = " ".join(f"{value:g}" for value in positions[at])
        raise document.fault(f"vertex {at} lies at {shown}, beyond float32", place)
    columns = matrix if isinstance(matrix, tuple) else tuple(matrix.T)
    normal_matrix = np.stack(cofactors(columns), axis=-1).reshape(-1, 9)
    mirrored = np.broadcast_to(determinant(columns) < 0.0, len(positions))
    triangles = read.triangles
    if mirrored.any():
        most = np.count_nonzero(mirrored[triangles], axis=1) >= 2  # of the corners
        triangles = np.where(most[:, None], triangles[:, ::-1], triangles)
    turned = np.where(mirrored, -1.0, 1.0)[:, None]
    normals = read.values.get("NORMAL")
    if normals is not None:
        normals = _units(_moved(normal_matrix, _finite(document, normals, "normals", place), 3) * turned)
    tangents = read.values.get("TANGENT")
    placement = material.placement
    uvs = _coordinates(document, read, placement or TextureTransform(), place, needed=placement is not None)
    uvs1 = None
    if material.second is not None:
        uvs1 = _coordinates(document, read, material.second, place, needed=True)
    moved = placement is not None and placement != TextureTransform()
    if material.second is not None and "normal" in material.material.second:
        moved = material.second.matrix != TextureTransform().matrix
    if moved:
        tangents = None  # they are those of the untransformed coordinates
    if tangents is not None and normals is not None and uvs is not None:
        tangents = _finite(document, tangents, "tangents", place)
        along = _units(_moved(m, tangents[:, :3], 4))
        tangents = np.concatenate([along, np.where(tangents[:, 3:] < 0, -1.0, 1.0) * turned], axis=1)
    else:
        tangents = None
    colors = read.values.get("COLOR_0")
    if colors is not None:
        colors = _finite(document, colors, "colours", place, instead=1.0)
        if colors.shape[1] == 3:
            colors = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
    return Part(
        name=name,
        material=material.material.name,
        mapped=placement is not None,
        positions=positions,
        triangles=triangles,
        normals=normals,
        tangents=tangents,
        uvs=uvs,
        uvs1=uvs1,
        colors=colors,
    )


def _coordinates(
    document: Document, read: Primitive, placement: TextureTransform, place: str, *, needed: bool
) -> F64 | None:
    """Texture coordinates (n, 2) of a placement; None where the primitive lacks them, with a warning where
    maps need them."""
    uvs = read.values.get(f"TEXCOORD_{placement.coordinates}")
    if uvs is None:
        if needed:
            document.warn(f"its maps need TEXCOORD_{placement.coordinates}, which is missing", place)
        return None
    uvs = _finite(document, uvs, "texture coordinates", place)
    if placement.matrix == TextureTransform().matrix:
        return uvs
    a, b, x, c, d, y = placement.matrix
    u, v = uvs[:, 0], uvs[:, 1]
    with np.errstate(over="ignore", invalid="ignore"):
        moved = np.stack([a * u + b * v + x, c * u + d * v + y], axis=1)
    return _finite(document, moved, "texture coordinates that KHR_texture_transform moves", place)


def joined(document: Document, parts: Sequence[Part]) -> tuple[Mesh, SourcePositions, npt.NDArray[np.uint32]]:
    """The mesh, the positions of the file, and the smoothing group of each triangle: 0 where a primitive has
    no normals, so that it is flat."""
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    places = np.concatenate([part.positions for part in parts])
    corners = np.concatenate(
        [part.triangles + start for part, start in zip(parts, starts, strict=False)]
    ).astype(np.uint32)
    origin = origin_of(places, corners)
    arrays = {"positions": (places - origin).astype(np.float32)}
    total = len(corners)
    columns = (("normals", 3, 0.0), ("uvs", 2, 0.0), ("uvs1", 2, 0.0), ("colors", 4, 1.0))
    for name, width, otherwise in columns:
        rows = _column(parts, name, width, otherwise)
        if rows is not None:
            arrays[name] = rows
    if all(part.tangents is not None for part in parts):
        arrays["tangents"] = np.concatenate([part.tangents for part in parts]).astype(np.float32)
    without = sum(len(part.triangles) for part in parts if part.mapped and part.uvs is None)
    if without and "uvs" in arrays:
        document.warn(f"{without} of {total} triangles without texture coordinates; they get (0, 0)")
    without = sum(len(part.triangles) for part in parts if part.normals is None)
    if without and "normals" in arrays:
        document.warn(f"{without} of {total} triangles without normals; computed")
    arrays = {name: rows + np.float32(0) for name, rows in arrays.items()}  # -0 becomes 0
    ids, first = number_rows(np.concatenate(list(arrays.values()), axis=1))
    mesh = Mesh(
        triangles=ids[corners],
        groups=_groups(parts),
        origin=origin,
        **{name: np.ascontiguousarray(rows[first]) for name, rows in arrays.items()},  # type: ignore[arg-type]
    )
    counts = [len(part.triangles) for part in parts]
    smooth = [0 if part.normals is None else UNKNOWN_SMOOTHING for part in parts]
    smoothing = np.repeat(np.array(smooth, np.uint32), counts)
    return mesh, _source(mesh, places, corners, ids, first), smoothing


def _column(parts: Sequence[Part], name: str, width: int, otherwise: float) -> npt.NDArray[np.float32] | None:
    """An attribute of all parts; None where none has it."""
    if all(getattr(part, name) is None for part in parts):
        return None
    rows = [
        np.full((len(part.positions), width), otherwise) if (own := getattr(part, name)) is None else own
        for part in parts
    ]
    return np.concatenate(rows).astype(np.float32)


def _groups(parts: Sequence[Part]) -> tuple[Group, ...]:
    groups: list[Group] = []
    first = 0
    for part in parts:
        count = len(part.triangles)
        if groups and (groups[-1].name, groups[-1].material) == (part.name, part.material):
            groups[-1] = Group(part.name, part.material, groups[-1].first, groups[-1].count + count)
        elif count:
            groups.append(Group(part.name, part.material, first, count))
        first += count
    return tuple(groups)


def _source(
    mesh: Mesh,
    places: F64,
    corners: npt.NDArray[np.uint32],
    ids: npt.NDArray[np.uint32],
    first: npt.NDArray[np.uint32],
) -> SourcePositions:
    """The farthest of the positions that became each vertex, and the triangles that lost corners."""
    off = places - mesh.absolute_positions[ids]
    order = np.lexsort((-squared_lengths(off), ids))
    farthest = order[np.searchsorted(ids[order], np.arange(len(first)))]
    a, b, c = (ids[corners[:, k]] for k in range(3))
    shared = np.flatnonzero((a == b) | (b == c) | (a == c))
    ends = places[corners[shared]]
    u, v = ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]
    lost = shared[(cross(u, v) != 0).any(axis=1)]
    return SourcePositions(places[farthest], len(lost), int(lost[0]) if len(lost) else 0)


def _moved(matrix: F64, rows: F64, width: int) -> F64:
    """Rows (n, 3) through the 3 x 3 parts of matrices with `width` numbers a row."""
    x, y, z = rows[:, 0], rows[:, 1], rows[:, 2]
    out = [matrix[:, k] * x + matrix[:, k + 1] * y + matrix[:, k + 2] * z for k in range(0, 3 * width, width)]
    return np.stack(out, axis=1)


def _units(rows: F64) -> F64:
    """Rows of length 1; those without a direction are 0."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    sound = (largest > 0.0) & np.isfinite(largest)
    scaled = np.where(sound[:, None], rows, 0.0) / np.where(sound, largest, 1.0)[:, None]
    return np.asarray(scaled / np.where(sound, lengths(scaled), 1.0)[:, None])


def _finite(document: Document, rows: F64, what: str, place: str, instead: float = 0.0) -> F64:
    """The rows, with `instead` for those that are not finite or beyond float32."""
    bad = np.logical_not((np.abs(rows) <= LARGEST_COORDINATE).all(axis=1))
    if not bad.any():
        return rows
    document.warn(f"{int(bad.sum())} {what} are not finite; read as {instead:g}", place)
    return np.where(bad[:, None], instead, rows)
