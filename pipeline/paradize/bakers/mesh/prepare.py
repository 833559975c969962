"""Reads a model and makes it ready for levels of detail: welded, validated, with normals and UVs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.bakers.mesh.atlas import with_atlas
from paradize.data import ATTRIBUTES, Group, Mesh
from paradize.errors import SourceError
from paradize.kernels.mesh import number_rows
from paradize.metrics.loading import LoadingError, loaded, loading_warnings
from paradize.metrics.tangent import frame_errors
from paradize.readers.model import read_model
from paradize.scene.baker_settings import MeshSettings
from paradize.stages.normals import complete_normals
from paradize.stages.reproject import with_groups
from paradize.stages.validate import Report, messages, repairs, validate_mesh
from paradize.stages.weld import Welding, weld, welded_messages

if TYPE_CHECKING:
    from paradize.material import Material

# Tangents of a file this near to MikkTSpace's are those, written with 8 bits or more.
TANGENT_DEG, TANGENTS_TURNED = 1.5, 1e-3
# Half of the largest float32. So the distance of two vertices along an axis still is a float32, and so is a
# simplified vertex slightly outside the others.
_LARGEST = 1.7e38


@dataclass(frozen=True)
class Preparation:
    """The findings of prepare_mesh.

    loading: the error of rounding the file's text to float32. layout: the measurements of a UV layout, if one
    was made. repairs: as `mesh --json` prints them. materials: by name.
    """

    loading: LoadingError
    validation: Report
    repairs: dict[str, Any]
    layout: dict[str, Any] | None
    materials: Mapping[str, Material]
    warnings: list[str]


def prepare_mesh(
    path: Path, settings: MeshSettings, tier: str, root: Path | None = None
) -> tuple[Mesh, Preparation]:
    """Reads a model: a validated mesh with normals, its triangles sorted by material, and what was found.
    root: the folder that the files it names must lie in.

    Raises SourceError (of several faults GroupedError) for a file that cannot be baked, BakeError where a
    layout cannot be made.
    """
    read = read_model(path, root)
    loading = loaded(read.mesh, read.source)
    if loading.coordinate_m > _LARGEST:
        raise SourceError(
            f"a coordinate of {loading.coordinate_m:g} metres, limit {_LARGEST:g}",
            file=path,
            mend="scale the model down",
        )
    joined, welding = weld(read.mesh, settings.weld_m)
    used = {group.material for group in read.mesh.groups}
    mapped = {name for name in used if name in read.materials and read.materials[name].maps}
    from_scene = not mapped and "TEXCOORD_0" in (
        settings.attributes or ()
    )  # maps that the model does not name
    mesh, validation = _validated(joined, path, welding, None if from_scene else mapped)
    unused = validation.unused_vertices + read.counts["positions_unused"]
    validation = replace(validation, unused_vertices=unused)
    warnings = list(read.warnings)
    found = (
        *loading_warnings(loading, read.lines),
        *welded_messages(welding),
        *messages(validation, read.lines),
    )
    warnings += [f"{path}: {text}" for text in found]
    if mesh.colors is not None and (mesh.colors.min() < 0 or mesh.colors.max() > 1):
        span = f"{mesh.colors.min():g} to {mesh.colors.max():g}"
        warnings.append(f"{path}: vertex colours of {span}, outside 0 to 1, clamped")
        mesh = replace(mesh, colors=np.clip(mesh.colors, 0, 1))
    smoothing, materials = read.smoothing[validation.kept], read.materials
    welded = {"welded": welding.joined, "welded_most_m": welding.largest_m}
    repaired: dict[str, Any] = {**read.repairs, **repairs(validation, read.lines), **welded}
    del read, joined  # saves memory while the layout is made
    mesh = _by_material(complete_normals(mesh, smoothing, crease_deg=settings.crease_deg)[0])
    framed = settings.second_frames
    if framed is None:
        framed = [name for name, material in materials.items() if "normal" in material.second]
    mesh = replace(mesh, second_frames=frozenset(framed))
    mesh, strange = _without_tangents(mesh)
    warnings += [f"{path}: {text}" for text in strange]
    layout = None
    if settings.atlas and not (settings.painted and mesh.uvs is not None):
        mesh, layout, notes = with_atlas(mesh, path, tier, settings.unwrapper)
        warnings += notes
    if mesh.uvs is None and (settings.attributes is None or "TANGENT" in settings.attributes):
        warnings.append(
            f"{path}: no texture coordinates, so no tangent frames; `paradize mesh --atlas` makes some"
        )
    return mesh, Preparation(loading, validation, repaired, layout, materials, warnings)


def _without_tangents(mesh: Mesh) -> tuple[Mesh, list[str]]:
    """The mesh without the tangents of its file: every level is given those of MikkTSpace, for which normal
    maps are painted. Tangents that differ from these by more than rounding are reported. Vertices that only
    their tangents told apart become one."""
    if mesh.tangents is None:
        return mesh, []
    error = frame_errors(mesh)
    bare = replace(mesh, tangents=None)
    arrays = {name: rows for name in ("positions", *ATTRIBUTES) if (rows := getattr(bare, name)) is not None}
    ids, first = number_rows(np.concatenate(list(arrays.values()), axis=1))
    kept: dict[str, Any] = {name: np.ascontiguousarray(rows[first]) for name, rows in arrays.items()}
    bare = replace(bare, **kept, triangles=ids[mesh.triangles])
    if error["tangent_p99_deg"] <= TANGENT_DEG and error["tangent_turned"] <= TANGENTS_TURNED:
        return bare, []
    differences = []
    if error["tangent_p99_deg"] > TANGENT_DEG:
        differences.append(
            f"are up to {error['tangent_p99_deg']:.3g} degrees (99 %) from those of MikkTSpace"
        )
    if error["tangent_turned"] > TANGENTS_TURNED:
        differences.append(
            f"are mirrored against those of MikkTSpace in {error['tangent_turned']:.1%} of corners"
        )
    return bare, [f"its tangents {' and '.join(differences)}; computed anew"]


def _validated(
    mesh: Mesh, path: Path, welding: Welding, mapped: Collection[str] | None
) -> tuple[Mesh, Report]:
    """validate_mesh; where places were joined, its error says so."""
    try:
        return validate_mesh(mesh, path, mapped)
    except SourceError as error:
        if not welding.joined:
            raise
        what = f"{error.what} once places within {welding.tolerance_m:g} metres are joined"
        raise SourceError(what, file=path, mend="join with a smaller tolerance") from error


def _by_material(mesh: Mesh) -> Mesh:
    """Returns the mesh with its triangles sorted by material, in the order of first use: each material is one
    draw."""
    names: dict[str, list[str]] = {}
    for group in mesh.groups:
        names.setdefault(group.material, []).append(group.name)
    merged = tuple(
        Group(own[0] if len(set(own)) == 1 else material, material, 0, 0) for material, own in names.items()
    )
    place = {material: k for k, material in enumerate(names)}
    numbers = np.array([place[group.material] for group in mesh.groups], np.uint32)
    return with_groups(mesh, np.repeat(numbers, [group.count for group in mesh.groups]), merged)
