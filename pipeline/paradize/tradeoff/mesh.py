"""The stages of a mesh: UV atlas, levels of detail, tangent frames, vertex quantisation, draw order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize.bakers.mesh.atlas import overlaps, sound_quality
from paradize.bakers.mesh.lods import LOD_TIERS, Plan, make_levels
from paradize.bakers.mesh.lods_from_path import plan_by_flight
from paradize.bakers.mesh.prepare import prepare_mesh
from paradize.bakers.quantise import direction_deg_of
from paradize.data import Lod, Mesh
from paradize.errors import BakeError
from paradize.formats.glb.encode import encode_glb
from paradize.metrics.draw import draw_costs
from paradize.metrics.quantised import quantised_errors
from paradize.metrics.tangent import frame_errors
from paradize.scene.baker_settings import MeshSettings
from paradize.scene.jobs import BakeJob
from paradize.stages.atlas import make_atlas
from paradize.stages.lod import require_simplifier
from paradize.stages.order import draw_order
from paradize.stages.quantise import mesh_grid, quantise_levels
from paradize.stages.tangents import METHODS as TANGENTS
from paradize.stages.tangents import method_of, tangent_frames
from paradize.stages.unwrappers import require_unwrapper
from paradize.tiers import SIMPLIFIERS, TIERS, UNWRAPPERS
from paradize.tradeoff.timing import Trial, TrialGroup, TrialResult, timed

Settings = dict[str, Any]
_BESIDE = ("lod_normal_p99_deg", "uv_shift_p99")  # what levels do to light and texture
# Vertex formats -> how many degrees quantisation may turn normals and tangents; None: floats.
_VERTICES = {"16 bit, directions 8": 180.0, "16 bit": 0.0, "float32": None}


def mesh_groups(job: BakeJob, *, alone: bool = False) -> list[TrialGroup]:
    """The groups of a job of the baker "mesh". alone: a model without a scene; where its UVs overlap, the
    layout of `paradize mesh --atlas` is measured too. Reads the source."""
    path, settings = job.sources["mesh"], job.settings
    artifact = job.outputs[0].artifact
    name = job.name.removesuffix(" mesh")
    arguments = {"path": path, "settings": settings}
    bare = _mended_mesh(path, settings)
    found = []
    if _needs_layout(bare, settings | ({"painted": False} if alone else {})):
        metrics = ("atlas_seam_length", "atlas_stretch", "atlas_packing")
        note = "" if bare.uvs is None else "The model's own overlaps; levels and tangent frames keep it."
        layouts = _tier_group(
            name,
            "atlas",
            artifact=artifact,
            metrics=metrics,
            tiers=TIERS,
            arguments=arguments,
            call=atlas_tier,
            note=note,
        )
        found.append(
            _with_libraries(layouts, "unwrapper", UNWRAPPERS, settings["unwrapper"], require_unwrapper)
        )
    levels = _tier_group(
        name,
        "levels of detail",
        artifact=artifact,
        metrics=("surface_rms", "surface_max"),
        tiers=tuple(dict.fromkeys(LOD_TIERS.values())),
        arguments=arguments,
        call=lod_tier,
        note="The time includes the measuring that decides which levels are kept.",
    )

    levels = replace(levels, beside=_BESIDE)

    def require(name: str) -> None:
        require_simplifier(name, bare)

    found.append(_with_libraries(levels, "simplifier", SIMPLIFIERS, settings["simplifier"], require))
    if bare.uvs is not None or settings["atlas"]:
        trials = tuple(
            Trial(
                tier,
                tangent_tier,
                arguments | {"tier": tier},
                "paradize",
                {} if tier == method_of(settings["tangents"]) else None,
            )
            for tier in TANGENTS
        )
        metrics = ("tangent_p99_deg", "tangent_mean_deg", "tangent_max_deg")
        found.append(
            TrialGroup(f"{name} tangent frames", "tangent frames", artifact, metrics, trials, TANGENTS)
        )
    used = "float32"
    if settings["quantise"] is not None:
        used = "16 bit" if direction_deg_of(settings["quantise"]) < 0.5 else "16 bit, directions 8"
    trials = tuple(
        Trial(tier, vertex_tier, arguments | {"tier": tier}, tier, {} if tier == used else None)
        for tier in _VERTICES
    )
    note = "The time is that of quantising and writing level 0."
    metrics = ("quantise_normal_max_deg", "quantise_max_m", "quantise_tangent_max_deg")
    found.append(TrialGroup(f"{name} vertices", "quantisation", artifact, metrics, trials, note=note))
    order_trial = Trial("only tier", order_tier, arguments, None, {})
    units = {"acmr": "vertices transformed per triangle"}
    found.append(
        TrialGroup(f"{name} draw order", "draw order", artifact, ("acmr",), (order_trial,), units=units)
    )
    return found


def _tier_group(
    name: str,
    stage: str,
    artifact: str,
    metrics: tuple[str, ...],
    tiers: tuple[str, ...],
    arguments: Any,
    call: Any,
    note: str,
) -> TrialGroup:
    """A group with a trial for each tier."""
    own = "paradize"  # the name of the series
    trials = tuple(Trial(tier, call, arguments | {"tier": tier}, own, {"tier": tier}) for tier in tiers)
    units = {"atlas_seam_length": "of the surface's side"} if stage == "atlas" else {}
    return TrialGroup(
        name=f"{name} {stage}",
        stage=stage,
        artifact=artifact,
        metrics=metrics,
        trials=trials,
        declared=tiers,
        note=note,
        units=units,
    )


def _with_libraries(
    group: TrialGroup, setting: str, names: tuple[str, ...], used: str, require: Callable[[str], None]
) -> TrialGroup:
    """Adds a trial for each library of another name than ours. setting: what names the library, used: its
    value in the scene. require: raises BakeError for a library that cannot do it, which becomes a note."""
    ours, *others = names
    call, arguments = group.trials[0].call, group.trials[0].arguments
    trials = [trial if used == ours else replace(trial, row=None) for trial in group.trials]
    notes = [group.note] if group.note else []
    for name in others:
        try:
            require(name)
        except BakeError as error:
            notes.append(f"{name} cannot do it: {error.what.removeprefix(f'{setting}: ')}.")
            continue
        more = arguments | {"tier": "balanced", setting: name}
        trials.append(Trial(name, call, more, name, {} if used == name else None))
    return replace(group, trials=tuple(trials), note=" ".join(notes))


def _mended_mesh(path: Path, settings: Settings) -> Mesh:
    """The source as bake_mesh passes it to its stages, without the layout that a bake may make."""
    return prepare_mesh(path, replace(MeshSettings(**settings), atlas=False), "balanced")[0]


def _laid_out(path: Path, settings: Settings) -> Mesh:
    """The mended mesh, with a UV layout if a bake makes one."""
    mesh = _mended_mesh(path, settings)
    return make_atlas(mesh, unwrapper=settings["unwrapper"]) if _needs_layout(mesh, settings) else mesh


def _needs_layout(mesh: Mesh, settings: Settings) -> bool:
    """Whether a bake makes a UV layout: if there is none, or if it overlaps and no maps are painted for
    it."""
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
    """Makes the atlas: seam_length (in square roots of the surface's area), stretch (L2, 1 at best), packing.
    Raises BakeError for a layout that a bake would refuse."""
    mesh = _mended_mesh(path, settings)
    seconds, made = timed(lambda: make_atlas(mesh, tier=tier, unwrapper=unwrapper), runs)
    quality = sound_quality(made, path, unwrapper)
    errors = {f"atlas_{key}": float(quality[key]) for key in ("seam_length", "stretch", "packing", "charts")}
    return TrialResult(seconds, [errors], _size([made], settings["tangents"]), f"{quality['charts']} charts")


def lod_tier(
    path: Path,
    settings: Settings,
    tier: str,
    runs: int | None,
    simplifier: str = SIMPLIFIERS[0],
    most_levels: int | None = None,
) -> TrialResult:
    """Makes the levels of detail, with the errors that the baker measures of each. most_levels: the source
    counted; None: as many as a bake makes. Raises BakeError if a library makes no level."""
    mesh = _laid_out(path, settings)
    plan = replace(Plan.of(MeshSettings(**settings)), simplifier=simplifier)
    if settings.get("flight_views"):
        plan = plan_by_flight(settings["flight_views"], settings["instances"])(mesh, plan)
    if most_levels is not None:
        plan = replace(plan, count=most_levels)
    seconds, (made, notes) = timed(lambda: make_levels(mesh, plan, tier), runs)
    if len(made) == 1 and simplifier != SIMPLIFIERS[0]:
        raise BakeError(f"{simplifier} makes no level: {'; '.join(notes)}")
    heads = {"error": "surface", "normal": "lod_normal"}  # as budgets name them
    errors = []
    for level in made:
        parts = [(*key.partition("_"), value) for key, value in level.errors.items()]
        errors.append({f"{heads.get(head, head)}_{tail}": value for head, _, tail, value in parts})
    triangles = tuple(len(level.mesh.triangles) for level in made)
    size = _size([level.mesh for level in made], settings["tangents"])
    note = f"{', '.join(map(str, triangles))} triangles{_moved(errors)}"
    return TrialResult(seconds, errors, size, note, triangles)


def _moved(levels: list[dict[str, float]]) -> str:
    """How far the levels turn normals and move the texture, for 99 % of the surface of the worst level."""
    words = ""
    texts = ("normals turn by {:.3g} degrees", "the texture slides by {:.2g} of the diagonal")
    for metric, text in zip(_BESIDE, texts, strict=True):
        worst = max((level.get(metric, 0.0) for level in levels), default=0.0)
        words += f"; {text.format(worst)}" if worst > 0.0 else ""
    return f"{words} (99 %)" if words else ""


def tangent_tier(path: Path, settings: Settings, tier: str, runs: int | None) -> TrialResult:
    """Tangent frames of level 0 against those of a float64 MikkTSpace."""
    mesh = _laid_out(path, settings)
    seconds, made = timed(lambda: tangent_frames(mesh, tier), runs)
    size = len(encode_glb([Lod(made, 0.0, 0.0)], "measured"))
    return TrialResult(seconds, [frame_errors(made)], size, f"{len(made.positions)} vertices")


def vertex_tier(path: Path, settings: Settings, tier: str, runs: int | None) -> TrialResult:
    """Writes level 0 as floats or quantised; the file's values against the floats."""
    mesh = _framed(_laid_out(path, settings), settings["tangents"])
    degrees = _VERTICES[tier]

    def write() -> bytes:
        quantised = None
        if degrees is not None:
            (quantised,) = quantise_levels([mesh], mesh_grid([mesh]), direction_deg=degrees)
        return encode_glb([Lod(mesh, 0.0, 0.0, quantised=quantised)], "measured")

    seconds, glb = timed(write, runs)
    return TrialResult(seconds, quantised_errors(glb, [mesh]), len(glb))


def order_tier(path: Path, settings: Settings, runs: int | None) -> TrialResult:
    """Orders triangles and vertices; acmr is the number of vertices transformed per triangle of level 0."""
    mesh = _framed(_laid_out(path, settings), settings["tangents"])
    seconds, made = timed(lambda: draw_order(mesh), runs)
    before = draw_costs(mesh)["acmr"]
    return TrialResult(seconds, [draw_costs(made)], None, f"{before:g} before")
