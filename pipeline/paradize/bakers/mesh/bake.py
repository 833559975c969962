"""Model -> GLB: prepared mesh, levels of detail, tangent frames, draw order, file and report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from paradize.bakers.mesh.lods import LOD_TIERS, MeasuredLevel, Plan, make_levels
from paradize.bakers.mesh.prepare import prepare_mesh
from paradize.bakers.quantise import direction_deg_of, quantised_levels
from paradize.data import Lod, Mesh, rounded_down, rounded_up
from paradize.errors import GroupedError, ParadizeError, SourceError
from paradize.formats.glb.encode import encode_glb
from paradize.formats.glb.materials import left_out
from paradize.formats.glb.reader import verify_glb
from paradize.jobs.progress import report_step
from paradize.metrics.draw import draw_costs
from paradize.metrics.loading import LoadingError
from paradize.metrics.tangent import frame_errors, frame_faults, sample_of, true_tangents
from paradize.scene.baker_settings import MeshSettings
from paradize.stages.lod import simplifier_version
from paradize.stages.order import draw_order
from paradize.stages.reproject import take_attributes, take_sway
from paradize.stages.sway import sway
from paradize.stages.tangents import METHODS, method_of, tangent_frames
from paradize.stages.unwrappers import unwrapper_version
from paradize.tiers import SIMPLIFIERS


@dataclass(frozen=True)
class MeshProduct:
    """glb: the bytes of the file. report: as `mesh --json` prints it. lods: the levels in it, finest
    first."""

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
    """Bakes a model: reads and repairs it, makes normals, tangent frames and levels, and measures each level.

    settings: None for the defaults. changes: fields of the settings to replace. tier: the LOD tier; if there
    is none of that name, `balanced` is used and a note says so. root: folder that material files must lie in.
    plan: changes the plan of the levels once the mesh is known. tangent_tiers: whether the report holds the
    error of each tier of tangent frames. Raises SourceError (GroupedError for several faults) for an input
    that cannot be baked, BakeError if a stage fails.
    """
    path = Path(path)
    settings = replace(settings or MeshSettings(), **changes)
    started = time.monotonic()
    with _file_named(path):
        report_step("reading")
        mesh, found = prepare_mesh(path, settings, tier, root)
        by_settings = Plan.of(settings, found.materials)
        used, frames, notes = _methods_of(settings, tier, mesh)
        wanted = by_settings if plan is None else plan(mesh, by_settings)
        textured = settings.attributes is None or "TEXCOORD_0" in settings.attributes
        levels, fewer = make_levels(mesh, wanted, used, textured=textured)
        report_step("tangent frames")
        tiers = _tangent_tiers(levels[0].mesh) if tangent_tiers else {}
        if settings.attributes is not None and "_SWAY" in settings.attributes:
            _add_sway(levels)
        lods, costs_before = [], []
        while levels:  # saves memory: a level is about as large as its part of the file
            lod, cost = _drawable(mesh, levels.pop(0), frames)
            lods.append(lod)
            costs_before.append(cost)
        del mesh
        if settings.quantise is not None:
            lods = list(quantised_levels(lods, direction_deg=direction_deg_of(settings.quantise)))
        report_step("writing")
        alone = settings.base_colors is None
        described = found.materials if alone else None
        glb = encode_glb(lods, path.stem, base_colors=settings.base_colors, described=described)
        verify_glb(glb, path.with_suffix(".glb"))
        rows = [_level_report(lod, cost, found.loading) for lod, cost in zip(lods, costs_before, strict=True)]
    first = lods[0].mesh
    materials = [group.material for group in first.groups]
    if alone and (without := left_out(found.materials, materials)):
        notes.append(
            f"a mesh alone holds no pictures; left out: {without} (`paradize maps` bakes one, "
            f"`paradize new DIR --from {quote(str(path))}` makes a scene with all)"
        )
    report: dict[str, Any] = {
        "triangles": len(first.triangles),
        "vertices": len(first.positions),
        "tier": used,
        "simplifier": settings.simplifier,
        "simplifier_version": simplifier_version(settings.simplifier),
        "atlas": found.layout is not None,
        "layout": found.layout,
        "unwrapper": None if found.layout is None else settings.unwrapper,
        "unwrapper_version": None if found.layout is None else unwrapper_version(settings.unwrapper),
        "closed": found.validation.closed,
        "components": found.validation.topology.components,
        "tangents": frames if first.tangents is not None else None,
        "tangent_tiers": tiers,
        "bytes": len(glb),
        "quantised": settings.quantise is not None,
        "origin": list(first.origin),
        "loading": found.loading.errors | {"collapsed": found.loading.collapsed},
        "repairs": found.repairs,
        "materials": materials,
        "lods": rows,
        "seconds": round(time.monotonic() - started, 3),
        "warnings": found.warnings + [f"{path}: {note}" for note in (*notes, *fewer)],
    }
    return MeshProduct(glb, report, tuple(lods))


@contextmanager
def _file_named(path: Path) -> Iterator[None]:
    """Errors that name no file name this one."""
    try:
        yield
    except MemoryError as error:
        raise SourceError("too large for this machine's memory", file=path) from error
    except GroupedError:
        raise
    except ParadizeError as error:
        if error.file is None:
            raise type(error)(error.what, file=path, place=error.place, mend=error.mend) from error
        raise


def _methods_of(settings: MeshSettings, tier: str, mesh: Mesh) -> tuple[str, str, list[str]]:
    """Returns the LOD tier and the tangent frames to use, and notes if they differ from the requested
    ones."""
    notes = []
    used = LOD_TIERS.get(tier, "balanced")
    if tier not in LOD_TIERS:
        notes.append(f"levels of detail have no tier {tier!r}; {used!r} used")
    if used == "exact" and settings.simplifier != SIMPLIFIERS[0]:
        used = "balanced"
        notes.append(f"simplifier {settings.simplifier!r} has no tier 'exact'; {used!r} used")
    if settings.tangents == "face" and mesh.uvs is not None:
        notes.append("tangents 'face' are slower and err more than 'vertex', which is used")
    return used, method_of(settings.tangents), notes


def _add_sway(levels: list[MeasuredLevel]) -> None:
    """Gives the first level its sway, and each other that of the nearest place of the first."""
    first = replace(levels[0].mesh, sway=sway(levels[0].mesh))
    levels[0] = replace(levels[0], mesh=first)
    for k in range(1, len(levels)):
        levels[k] = replace(levels[k], mesh=take_sway(first, levels[k].mesh))


def _drawable(source: Mesh, level: MeasuredLevel, tangents: str) -> tuple[Lod, dict[str, float]]:
    """Returns a level with vertex colours, with tangents if it has UVs, and in draw order; and the cost of
    drawing it before."""
    mesh, errors = _colored(source, level.mesh), dict(level.errors)
    if mesh.uvs is not None:
        mesh = tangent_frames(mesh, tangents)
    return Lod(draw_order(mesh), errors.pop("error_max"), errors.pop("error_rms"), errors), draw_costs(mesh)


def _colored(source: Mesh, level: Mesh) -> Mesh:
    """Returns the level with the source's vertex colours at the nearest places. Simplifiers do not keep
    them."""
    if source.colors is None or level.positions is source.positions:
        return level
    taken = take_attributes(source, replace(level, colors=None, tangents=None), ("colors",))
    assert taken.colors is not None
    return replace(taken, colors=np.clip(taken.colors, 0, 1))  # the mean of three may round beyond 1


def _level_report(lod: Lod, cost_before: Mapping[str, float], loading: LoadingError) -> dict[str, Any]:
    before = {"acmr_before": cost_before["acmr"], "atvr_before": cost_before["atvr"]}
    return {
        "triangles": len(lod.mesh.triangles),
        "vertices": len(lod.mesh.positions),
        **_errors_from_text(lod, loading),
        **frame_faults(lod.mesh),
        **frame_errors(lod.mesh),
        "draw": draw_costs(lod.mesh) | before,
    }


def _tangent_tiers(mesh: Mesh) -> dict[str, dict[str, float]]:
    """Returns the errors that each tier of tangent frames would have on the finest level, by tier."""
    if mesh.uvs is None:
        return {}
    part, counted = sample_of(mesh)
    reference = true_tangents(part)
    return {
        tier: frame_errors(tangent_frames(part, tier), valid=counted, reference=reference) for tier in METHODS
    }


def _errors_from_text(lod: Lod, loading: LoadingError) -> dict[str, float]:
    """Returns a level's errors against the text of the source: its distance from level 0 plus the error of
    loading."""
    errors = {"error_max": lod.error_max, "error_rms": lod.error_rms}
    whole = {key: rounded_up(value + loading.largest) for key, value in errors.items()}
    lower = max(0.0, lod.errors["error_max_lower"] - loading.largest)
    return {**whole, **lod.errors, "error_max_lower": rounded_down(lower), **loading.errors}
