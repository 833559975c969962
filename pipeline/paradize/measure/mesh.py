"""The tiers of the stages that a mesh goes through: levels of detail, tangent frames, atlas, codes, order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.bakers.mesh.atlas import overlaps, sound_quality
from paradize.bakers.mesh.bake import by_material
from paradize.bakers.mesh.lods import DEFAULT_MAX_ERROR, TIERS, Plan, make_levels
from paradize.bakers.mesh.lods_from_path import sight_plan
from paradize.bakers.quantise import direction_deg_of
from paradize.data import Lod, Mesh
from paradize.errors import BakeError
from paradize.formats.glb.encode import encode_glb
from paradize.measure.timing import Trial, TrialGroup, TrialResult, timed
from paradize.metrics.draw import draw_costs
from paradize.metrics.quantised import quantised_errors
from paradize.metrics.tangent import frame_errors
from paradize.readers.obj import read_obj
from paradize.scene.requirements import BakeJob
from paradize.stages import atlas
from paradize.stages.lod import METHODS, SIMPLIFIERS
from paradize.stages.normals import complete_normals
from paradize.stages.order import draw_order
from paradize.stages.quantise import mesh_lattice, quantise_levels
from paradize.stages.simplifiers import require_simplifier
from paradize.stages.tangents import METHODS as TANGENTS
from paradize.stages.tangents import TIERS as FRAMES
from paradize.stages.tangents import tangent_frames
from paradize.stages.unwrappers import UNWRAPPERS, require_unwrapper
from paradize.stages.validate import validate_mesh
from paradize.stages.weld import weld

Settings = dict[str, Any]
_CODES = {"16 bit, directions 8": 180.0, "16 bit": 0.0, "float32": None}  # degrees that directions may turn


def mesh_groups(order: BakeJob) -> list[TrialGroup]:
    """What there is to be measured of an order of the maker "mesh". Reads the source."""
    path, settings = order.sources["mesh"], order.settings
    artifact = order.wants[0].artifact
    name = order.name.removesuffix(" mesh")
    given = {"path": path, "settings": settings}
    bare = _mended(path, settings)
    found = []
    if _needs_layout(bare, settings):
        metrics = ("atlas_seam_length", "atlas_stretch", "atlas_packing")
        layouts = _asked(name, "atlas", artifact, metrics, tuple(atlas.TIERS), given, atlas_tier)
        found.append(_with_unwrappers(layouts, settings["unwrapper"], given))
    levels = _asked(
        name,
        "levels of detail",
        artifact,
        ("surface_rms", "surface_max"),
        tuple(dict.fromkeys(TIERS.values())),
        given,
        lod_tier,
    )
    found.append(_with_simplifiers(levels, bare, settings["simplifier"], given))
    if bare.uvs is not None or settings["atlas"]:
        tries = tuple(
            Trial(
                tier,
                tangent_tier,
                given | {"tier": tier},
                "one",
                {} if tier == FRAMES.get(settings["tangents"], settings["tangents"]) else None,
            )
            for tier in TANGENTS
        )
        metrics = ("tangent_p99_deg", "tangent_mean_deg", "tangent_max_deg")
        found.append(
            TrialGroup(f"{name} tangent frames", "tangent frames", artifact, metrics, tries, TANGENTS)
        )
    used = "float32"
    if settings["quantise"] is not None:
        used = "16 bit" if direction_deg_of(settings["quantise"]) < 0.5 else "16 bit, directions 8"
    tries = tuple(
        Trial(tier, code_tier, given | {"tier": tier}, tier, {} if tier == used else None) for tier in _CODES
    )
    note = "What is timed is the writing of level 0, with its codes."
    metrics = ("quantise_normal_max_deg", "quantise_max_m", "quantise_tangent_max_deg")
    found.append(TrialGroup(f"{name} vertices", "quantisation", artifact, metrics, tries, note=note))
    order_try = Trial("the one there is", order_tier, given, None, {})
    units = {"acmr": "vertices transformed per triangle"}
    found.append(
        TrialGroup(f"{name} draw order", "draw order", artifact, ("acmr",), (order_try,), units=units)
    )
    return found


def _asked(
    name: str,
    stage: str,
    artifact: str,
    metrics: tuple[str, ...],
    tiers: tuple[str, ...],
    given: Any,
    call: Any,
) -> TrialGroup:
    tries = tuple(Trial(tier, call, given | {"tier": tier}, "one", {"tier": tier}) for tier in tiers)
    units = {"atlas_seam_length": "of the surface's side"} if stage == "atlas" else {}
    return TrialGroup(f"{name} {stage}", stage, artifact, metrics, tries, tiers, units=units)


def _with_simplifiers(group: TrialGroup, mesh: Mesh, used: str, given: Any) -> TrialGroup:
    """The levels of detail, by our tiers and by each other simplifier that can do the mesh."""
    tries = [attempt if used == METHODS[0] else replace(attempt, row=None) for attempt in group.tries]
    notes = ["The time holds the measuring that decides which level is kept."]
    for name in SIMPLIFIERS[1:]:
        try:
            require_simplifier(name, mesh)
        except BakeError as error:
            notes.append(f"{name} cannot do it: {error.what.removeprefix('simplifier: ')}.")
            continue
        more = given | {"tier": "balanced", "simplifier": name}
        tries.append(Trial(name, lod_tier, more, name, {} if used == name else None))
    return replace(group, tries=tuple(tries), note=" ".join(notes))


def _with_unwrappers(group: TrialGroup, used: str, given: Any) -> TrialGroup:
    """The UV layout, by our tiers and by each other unwrapper that is installed."""
    tries = [attempt if used == UNWRAPPERS[0] else replace(attempt, row=None) for attempt in group.tries]
    notes = []
    for name in UNWRAPPERS[1:]:
        try:
            require_unwrapper(name)
        except BakeError as error:
            notes.append(f"{error.what.removeprefix('unwrapper: ')}.")
            continue
        more = given | {"tier": "balanced", "unwrapper": name}
        tries.append(Trial(name, atlas_tier, more, name, {} if used == name else None))
    return replace(group, tries=tuple(tries), note=" ".join(notes))


def _mended(path: Path, settings: Settings) -> Mesh:
    """The source as bake_mesh hands it to its stages."""
    read = read_obj(path)
    joined, _ = weld(read.mesh, settings["weld_m"])
    mesh, found = validate_mesh(joined, path)
    smoothing = read.smoothing[found.kept]
    return by_material(complete_normals(mesh, smoothing, crease_deg=settings["crease_deg"])[0])


def _laid_out(path: Path, settings: Settings) -> Mesh:
    mesh = _mended(path, settings)
    return atlas.make_atlas(mesh, unwrapper=settings["unwrapper"]) if _needs_layout(mesh, settings) else mesh


def _needs_layout(mesh: Mesh, settings: Settings) -> bool:
    """Whether a bake makes a UV layout: where there is none, or, unless maps are painted for it, where it
    lies over itself."""
    if not settings["atlas"]:
        return False
    return mesh.uvs is None or (not settings["painted"] and overlaps(mesh))


def _framed(mesh: Mesh, tangents: str) -> Mesh:
    return mesh if mesh.uvs is None else tangent_frames(mesh, tangents)


def _size(meshes: list[Mesh], tangents: str) -> int:
    return len(encode_glb([Lod(_framed(mesh, tangents), 0.0, 0.0) for mesh in meshes], "measured"))


def atlas_tier(
    path: Path, settings: Settings, tier: str, runs: int | None, unwrapper: str = UNWRAPPERS[0]
) -> TrialResult:
    """seam_length (in square roots of the surface's area), stretch (L2, 1 at best), packing. Raises BakeError
    for a layout that a bake would refuse."""
    mesh = _mended(path, settings)
    seconds, made = timed(lambda: atlas.make_atlas(mesh, tier=tier, unwrapper=unwrapper), runs)
    told = sound_quality(made, path, unwrapper)
    errors = {f"atlas_{key}": float(told[key]) for key in ("seam_length", "stretch", "packing", "charts")}
    return TrialResult(seconds, [errors], _size([made], settings["tangents"]), f"{told['charts']} charts")


def lod_tier(
    path: Path, settings: Settings, tier: str, runs: int | None, simplifier: str = METHODS[0]
) -> TrialResult:
    """The chain of levels; what bake_lods measured of each. Raises BakeError where a library makes none."""
    mesh = _laid_out(path, settings)
    bounds = tuple(settings["lod_errors"])
    limit = settings["max_error"]
    if limit is None:
        limit = max(DEFAULT_MAX_ERROR, *bounds, 0.0)
    plan = Plan(settings["lods"], limit, settings["lod_ratio"], bounds, simplifier=simplifier)
    if settings.get("sight"):
        plan = sight_plan(settings["sight"], settings["instances"])(mesh, plan)
    seconds, (steps, notes) = timed(lambda: make_levels(mesh, plan, tier), runs)
    if len(steps) == 1 and simplifier != METHODS[0]:
        raise BakeError(f"{simplifier} makes no level: {'; '.join(notes)}")
    heads = {"error": "surface", "normal": "lod_normal"}  # as budgets name them
    levels = []
    for step in steps:
        parts = [(*key.partition("_"), value) for key, value in step.errors.items()]
        levels.append({f"{heads.get(head, head)}_{tail}": value for head, _, tail, value in parts})
    triangles = ", ".join(str(len(step.mesh.triangles)) for step in steps)
    size = _size([step.mesh for step in steps], settings["tangents"])
    return TrialResult(seconds, levels, size, f"{triangles} triangles")


def tangent_tier(path: Path, settings: Settings, tier: str, runs: int | None) -> TrialResult:
    """Tangent frames of level 0 against those of a float64 MikkTSpace."""
    mesh = _laid_out(path, settings)
    seconds, made = timed(lambda: tangent_frames(mesh, tier), runs)
    size = len(encode_glb([Lod(made, 0.0, 0.0)], "measured"))
    return TrialResult(seconds, [frame_errors(made)], size, f"{len(made.positions)} vertices")


def code_tier(path: Path, settings: Settings, tier: str, runs: int | None) -> TrialResult:
    """Level 0 written as floats or codes; the file's bytes against the floats."""
    mesh = _framed(_laid_out(path, settings), settings["tangents"])
    degrees = _CODES[tier]

    def write() -> bytes:
        codes = None
        if degrees is not None:
            (codes,) = quantise_levels([mesh], mesh_lattice([mesh]), direction_deg=degrees)
        return encode_glb([Lod(mesh, 0.0, 0.0, codes=codes)], "measured")

    seconds, glb = timed(write, runs)
    return TrialResult(seconds, quantised_errors(glb, [mesh]), len(glb))


def order_tier(path: Path, settings: Settings, runs: int | None) -> TrialResult:
    """The order of triangles and vertices, by what drawing level 0 costs."""
    mesh = _framed(_laid_out(path, settings), settings["tangents"])
    seconds, made = timed(lambda: draw_order(mesh), runs)
    before = draw_costs(mesh)["acmr"]
    return TrialResult(seconds, [draw_costs(made)], None, f"{before:g} before")
