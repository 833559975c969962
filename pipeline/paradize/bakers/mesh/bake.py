"""OBJ -> GLB: reader, stages, format and metrics joined into one product with its report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.bakers.mesh.atlas import with_atlas
from paradize.bakers.mesh.lods import DEFAULT_MAX_ERROR, TIERS, Plan, make_levels
from paradize.bakers.quantise import direction_deg_of, quantised_levels
from paradize.data import Group, Lod, Mesh, six_down, six_up
from paradize.errors import BakeError, GroupedError, ParadizeError, SourceError
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.reader import verify_glb
from paradize.metrics.draw import draw_costs
from paradize.metrics.loading import Loaded, loaded, loading_messages
from paradize.metrics.tangent import frame_errors, frame_faults, part_of, true_tangents
from paradize.readers.mtl import base_colors_of
from paradize.readers.obj import read_obj
from paradize.scene.baker_settings import MeshSettings
from paradize.stages.lod import SIMPLIFIERS
from paradize.stages.normals import complete_normals
from paradize.stages.order import draw_order
from paradize.stages.reproject import take_attributes
from paradize.stages.simplifiers import simplifier_version
from paradize.stages.tangents import METHODS, tangent_frames
from paradize.stages.tangents import TIERS as FRAMES
from paradize.stages.unwrappers import unwrapper_version
from paradize.stages.validate import messages, repairs, validate_mesh
from paradize.stages.weld import weld, welded_messages

MAX_LODS = 8
# Half of the largest float32: the distance of two vertices along an axis, and a simplified vertex a little
# outside of the others, still are floats.
_LARGEST = 1.7e38


@dataclass(frozen=True)
class MeshProduct:
    """glb: the file. report: as `mesh --json` prints it. lods: what the file holds, the finest first."""

    glb: bytes
    report: dict[str, Any]
    lods: tuple[Lod, ...]


def bake_mesh(
    path: Path,
    settings: MeshSettings | None = None,
    *,
    tier: str = "balanced",
    root: Path | None = None,
    plan: Callable[[Mesh, Plan], Plan] | None = None,
    tangent_tiers: bool = True,
    **changes: Any,
) -> MeshProduct:
    """Reads an OBJ, mends it, gives it normals, tangent frames and levels of detail, and measures each level.

    settings: None: as they are by themselves; changes: fields of them that are others. tier: the LOD tier;
    the nearest one there is is used and named in the report. root: folder that material files must lie in.
    plan: what makes another plan of this one, knowing the mesh. tangent_tiers: report what each tier of
    tangent frames would be off. Raises SourceError (of several faults GroupedError) for an input that cannot
    be baked, BakeError where a stage fails.
    """
    path = Path(path)
    used = replace(settings or MeshSettings(), **changes)
    _require_ranges(path, used)
    try:
        return _bake(path, used, tier, root, plan, tangent_tiers)
    except MemoryError as error:
        raise SourceError("too large for this machine's memory", file=path) from error
    except GroupedError:
        raise
    except ParadizeError as error:
        if error.file is None:
            raise type(error)(error.what, file=path, place=error.place, mend=error.mend) from error
        raise


def _require_ranges(path: Path, settings: MeshSettings) -> None:
    """Raises BakeError for a setting that is out of range."""
    errors, crease_deg = list(settings.lod_errors), settings.crease_deg
    if not 1 <= settings.lods <= MAX_LODS:
        raise BakeError(f"{settings.lods} levels of detail, expected 1 to {MAX_LODS}", file=path)
    if settings.max_error is not None and not 0 <= settings.max_error <= 1:
        raise BakeError(f"max error {settings.max_error:g} of the diagonal, expected 0 to 1", file=path)
    if not 0.05 <= settings.lod_ratio <= 0.95:
        raise BakeError(f"a ratio of {settings.lod_ratio:g}, expected 0.05 to 0.95", file=path)
    if errors != sorted(errors) or not all(0 <= bound <= 1 for bound in errors):
        raise BakeError(f"errors {errors}, expected rising numbers from 0 to 1", file=path)
    if settings.simplifier not in SIMPLIFIERS:
        mend = f"use one of {', '.join(SIMPLIFIERS)}"
        raise BakeError(f"no simplifier {settings.simplifier!r}", file=path, mend=mend)
    if not 0 <= crease_deg <= 180:
        raise BakeError(f"a crease angle of {crease_deg:g} degrees, expected 0 to 180", file=path)


def _plan_of(settings: MeshSettings) -> Plan:
    errors, limit = tuple(settings.lod_errors), settings.max_error
    return Plan(
        count=settings.lods,
        limit=max(DEFAULT_MAX_ERROR, *errors, 0.0) if limit is None else limit,
        ratio=settings.lod_ratio,
        errors=errors,
        simplifier=settings.simplifier,
    )


def _bake(
    path: Path,
    settings: MeshSettings,
    tier: str,
    root: Path | None,
    plan: Callable[[Mesh, Plan], Plan] | None,
    tangent_tiers: bool,
) -> MeshProduct:
    started = time.monotonic()
    asked = _plan_of(settings)
    read = read_obj(path, root)
    loading = loaded(read.mesh, read.text)
    if loading.coordinate_m > _LARGEST:
        raise SourceError(
            f"a coordinate of {loading.coordinate_m:g} metres, limit {_LARGEST:g}",
            file=path,
            mend="scale the model down",
        )
    warnings, lines = list(read.warnings), read.lines
    warnings += [f"{path}: {text}" for text in loading_messages(loading, lines)]
    joined, welding = weld(read.mesh, settings.weld_m)
    try:
        mesh, found = validate_mesh(joined, path)
    except SourceError as error:
        if not welding.joined:
            raise
        what = f"{error.what} once places within {settings.weld_m:g} metres are joined"
        raise SourceError(what, file=path, mend="join with a smaller tolerance") from error
    found = replace(found, unused_vertices=found.unused_vertices + read.counts["positions_unused"])
    smoothing, materials = read.smoothing[found.kept], read.materials
    del read, joined  # a large mesh in memory three times over is three times too often
    warnings += [f"{path}: {text}" for text in (*welded_messages(welding), *messages(found, lines))]
    if mesh.colors is not None and (mesh.colors.min() < 0 or mesh.colors.max() > 1):
        mesh = replace(mesh, colors=np.clip(mesh.colors, 0, 1))
        warnings.append(f"{path}: vertex colours beyond 0 to 1, held to it")
    mesh = by_material(complete_normals(mesh, smoothing, crease_deg=settings.crease_deg)[0])
    layout = None
    if settings.atlas and not (settings.painted and mesh.uvs is not None):
        mesh, layout, notes = with_atlas(mesh, path, tier, settings.unwrapper)
        warnings += notes
    if mesh.uvs is None:
        warnings.append(f"{path}: no texture coordinates, so no tangent frames; mesh --atlas makes some")
    used = TIERS.get(tier, "balanced")
    if tier not in TIERS:
        warnings.append(f"{path}: levels of detail have no tier {tier!r}; {used!r} used")
    if used == "exact" and asked.simplifier != SIMPLIFIERS[0]:
        used = "balanced"
        warnings.append(f"{path}: simplifier {asked.simplifier!r} has no tier 'exact'; {used!r} used")
    frames = FRAMES.get(settings.tangents, settings.tangents)
    if settings.tangents == "face" and mesh.uvs is not None:
        warnings.append(f"{path}: tangents 'face' are slower and err more than 'vertex', which is used")
    steps, notes = make_levels(mesh, asked if plan is None else plan(mesh, asked), used)
    warnings += [f"{path}: {note}" for note in notes]
    tiers = _tangent_tiers(steps[0].mesh) if tangent_tiers else {}
    framed = []
    while steps:  # what is done with is let go: a level is about as large as its part of the file
        step = steps.pop(0)
        framed.append((_framed(mesh, step.mesh, frames), step.errors))
    del step, mesh
    unordered = [draw_costs(level) for level, _ in framed]
    for at, (level, errors) in enumerate(framed):
        framed[at] = draw_order(level), errors
    del level
    done = tuple(_lod(level, errors) for level, errors in framed)
    if settings.quantise is not None:
        done = quantised_levels(done, direction_deg=direction_deg_of(settings.quantise))
    own = base_colors_of(materials) if settings.base_colors is None else settings.base_colors
    glb = encode_glb(done, path.stem, base_colors=own)
    verify_glb(glb, path.with_suffix(".glb"))
    report: dict[str, Any] = {
        "triangles": len(framed[0][0].triangles),
        "vertices": len(framed[0][0].positions),
        "tier": used,
        "simplifier": asked.simplifier,
        "simplifier_version": simplifier_version(asked.simplifier),
        "atlas": layout is not None,
        "layout": layout,
        "unwrapper": None if layout is None else settings.unwrapper,
        "unwrapper_version": None if layout is None else unwrapper_version(settings.unwrapper),
        "closed": found.closed,
        "components": found.topology.components,
        "tangents": frames if framed[0][0].tangents is not None else None,
        "tangent_tiers": tiers,
        "bytes": len(glb),
        "quantised": settings.quantise is not None,
        "origin": list(framed[0][0].origin),
        "loading": loading.errors | {"collapsed": loading.collapsed},
        "repairs": repairs(found, lines) | {"welded": welding.joined, "welded_most_m": welding.largest_m},
        "materials": [group.material for group in framed[0][0].groups],
        "lods": [
            {
                "triangles": len(level.triangles),
                "vertices": len(level.positions),
                **errors,
                **_told(lod, loading),
            }
            | frame_faults(level)
            | frame_errors(level)
            | {"draw": draw_costs(level) | {"acmr_before": before["acmr"], "atvr_before": before["atvr"]}}
            for (level, errors), before, lod in zip(framed, unordered, done, strict=True)
        ],
        "seconds": round(time.monotonic() - started, 3),
        "warnings": warnings,
    }
    return MeshProduct(glb, report, done)


def _tangent_tiers(mesh: Mesh) -> dict[str, dict[str, float]]:
    """What each tier of tangent frames would cost on the finest level: frame_errors by tier."""
    if mesh.uvs is None:
        return {}
    part, counted = part_of(mesh)
    truth = true_tangents(part)
    return {tier: frame_errors(tangent_frames(part, tier), counted=counted, truth=truth) for tier in METHODS}


def _framed(source: Mesh, level: Mesh, tangents: str) -> Mesh:
    """A level as it is written: with the vertex colours of the source, and tangents where it has an image."""
    if level is not source:
        colored = _colored(source, replace(level, tangents=None))
        level = colored if source.colors is not None else level
    return level if level.uvs is None else tangent_frames(level, tangents)


def _lod(level: Mesh, errors: Mapping[str, float]) -> Lod:
    more = {key: value for key, value in errors.items() if key not in ("error_max", "error_rms")}
    return Lod(level, errors["error_max"], errors["error_rms"], more)


def _told(lod: Lod, loading: Loaded) -> dict[str, float]:
    """A level's errors against the source's text: its distance from level 0, and what loading cost that."""
    errors = {"error_max": lod.error_max, "error_rms": lod.error_rms}
    whole = {key: six_up(value + loading.largest) for key, value in errors.items()}
    lower = max(0.0, lod.errors["error_max_lower"] - loading.largest)
    return {**whole, **lod.errors, "error_max_lower": six_down(lower), **loading.errors}


def _colored(source: Mesh, level: Mesh) -> Mesh:
    """The level with the source's vertex colours, those of the nearest place: no simplifier carries them."""
    if source.colors is None or level is source or level.positions is source.positions:
        return level
    taken = take_attributes(source, replace(level, colors=None), ("colors",))
    assert taken.colors is not None
    return replace(taken, colors=np.clip(taken.colors, 0, 1))  # the mean of three may round beyond 1


def by_material(mesh: Mesh) -> Mesh:
    """Triangles in one run per material, materials in the order of their first use: one draw each."""
    runs: dict[str, list[Group]] = {}
    for group in mesh.groups:
        runs.setdefault(group.material, []).append(group)
    order = np.concatenate(
        [np.arange(group.first, group.first + group.count) for groups in runs.values() for group in groups]
    )
    merged, first = [], 0
    for material, groups in runs.items():
        count = sum(group.count for group in groups)
        names = dict.fromkeys(group.name for group in groups)
        merged.append(Group(next(iter(names)) if len(names) == 1 else material, material, first, count))
        first += count
    return replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[order]), groups=tuple(merged))
