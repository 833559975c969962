"""Makes the chain of levels of detail: each level is simplified, measured, and kept or left out with a
reason.

A plan sets how levels are chosen: by a share of the triangles, by the error of each, by how they look at a
size on the screen (lods_by_screen_size.py), or by what the camera's path can see. Only measured errors count,
not the simplifier's own estimate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isqrt

from paradize.bakers.mesh.lods_by_screen_size import Judge, ScreenSize
from paradize.bakers.mesh.refine import refine_level
from paradize.data import Mesh
from paradize.errors import SourceError
from paradize.jobs.progress import report_step
from paradize.material import Material
from paradize.metrics.mapped_normal import normal_error, uv_shift
from paradize.metrics.surface import Original, is_loose
from paradize.scene.baker_settings import MeshSettings
from paradize.stages.lod import LEAST_TRIANGLES, require_simplifier, simplify
from paradize.stages.validate import validate_mesh
from paradize.tiers import SEAM_SIMPLIFIERS, SIMPLIFIERS

# By the tiers of a bake. Nineteen twentieths of a chain's time go into measuring it, so that no simplifier
# makes it much quicker, and none that was tried is behind ours on nearly every model: `fast` is `balanced`.
LOD_TIERS = {"fast": "balanced", "balanced": "balanced", "exact": "exact"}
# Without an asked bound a level may be this far from the source, of the diagonal; worse ones are not worth
# a draw.
DEFAULT_MAX_ERROR = 0.1
# A level must save this share of the triangles of the one before.
_WORTH = 0.1
# A level by ratio whose normals, on the mean, are further off than this is not made: its boxes became
# tetrahedra, its poles blades.
_TURNED_DEG = 15.0
# Errors nearer to each other than this share of the diagonal are one: positions are float32.
_ROUNDING = 1e-7
_BISECTIONS = 4
_SAMPLES = 50_000
# Where the 99th percentile of the UV shift exceeds the first, a share of the diagonal, the level is made
# again with these factors on the weight of UVs, at little cost to the shape. Above the second a note reports
# it. A shift below twice the surface error is accepted.
_UV_SHIFT_TRIED, _UV_SHIFT_REPORTED = 0.01, 0.02
_UV_WEIGHTS = (4.0, 16.0)
# The errors of the source itself. Distances are shares of the diagonal.
NO_ERROR = {"error_max": 0.0, "error_max_lower": 0.0, "error_rms": 0.0, "error_p99": 0.0}
_NO_NORMAL_ERROR = {"normal_mean_deg": 0.0, "normal_p99_deg": 0.0, "normal_max_deg": 0.0}
_NO_UV_SHIFT = {"uv_shift_p99": 0.0, "uv_shift_max": 0.0}


@dataclass(frozen=True)
class Plan:
    """How levels are chosen. Errors are shares of the source's diagonal.

    count: most levels, the first included. limit: largest error of any level. ratio: level k aims at
    ratio ** k of the triangles of level 0. errors: bounds of the levels after the first, instead of ratio;
    each level is the coarsest mesh inside its bound. screen_size: each level is the coarsest that looks like
    the source at its size, instead of ratio. finest: allowed error of the first level; 0: it is the source.
    farthest: allowed error at the farthest view; no level follows one with that error. simplifier: one of
    SIMPLIFIERS.
    """

    count: int = MeshSettings.lods
    limit: float = DEFAULT_MAX_ERROR
    ratio: float = MeshSettings.lod_ratio
    errors: tuple[float, ...] = ()
    screen_size: ScreenSize | None = None
    finest: float = 0.0
    farthest: float | None = None
    simplifier: str = MeshSettings.simplifier

    @staticmethod
    def of(settings: MeshSettings, materials: Mapping[str, Material] | None = None) -> Plan:
        """The plan that the settings of a mesh ask for. materials: of the model, by name; those that are
        two-sided count as such where screen_size does not name others."""
        errors, limit = tuple(settings.lod_errors), settings.max_error
        if limit is None:
            limit = max(DEFAULT_MAX_ERROR, *errors, 0.0)
        size = None
        if settings.screen_size is not None:
            two_sided = tuple(name for name, material in (materials or {}).items() if material.two_sided)
            size = ScreenSize(**{"two_sided": two_sided, **settings.screen_size})
        return Plan(settings.lods, limit, settings.lod_ratio, errors, size, simplifier=settings.simplifier)


@dataclass(frozen=True)
class MeasuredLevel:
    """A level of detail; its errors by name, as `mesh --json` prints them; seams_kept as in stages.lod.
    number: of the level that the plan asked for."""

    mesh: Mesh
    errors: dict[str, float]
    seams_kept: bool = True
    number: int = 0


def make_levels(
    mesh: Mesh, plan: Plan, tier: str, *, textured: bool = True
) -> tuple[list[MeasuredLevel], list[str]]:
    """Returns levels, finest first, and notes with the reason where there are fewer than requested.

    mesh: validated, with normals. tier: `balanced`; with our simplifier also `exact`. textured: whether its
    UVs are written; without them no note says how far a texture slid. No level has more
    triangles or a smaller error than the one before. Raises BakeError if the plan's simplifier cannot handle
    the mesh.
    """
    require_simplifier(plan.simplifier, mesh)
    reference = Original(mesh)
    levels, notes = _chain(reference, plan)
    if tier == "exact" and plan.simplifier == SIMPLIFIERS[0]:
        levels, left_out = _refined(reference, levels, plan.screen_size)
        notes += left_out
    notes += _bound_notes(levels)
    if textured:
        notes += _uv_shift_notes(levels, plan.simplifier)
    return levels, list(dict.fromkeys(notes))


def _refined(
    reference: Original, levels: list[MeasuredLevel], screen_size: ScreenSize | None
) -> tuple[list[MeasuredLevel], list[str]]:
    """Returns the levels, each nearer to the source where possible; levels that a coarser one then beats
    are left out, with notes. One that no longer looks like the source at its screen size stays as it was."""
    found: list[MeasuredLevel] = []
    notes: list[str] = []
    before = reference.mesh
    for at, level in enumerate(levels):
        if level.mesh is reference.mesh:
            found.append(level)
            continue
        report_step(f"refining level {at} of {len(levels) - 1}")
        mesh, errors = refine_level(reference, before, level.mesh, level.errors, level.seams_kept, _SAMPLES)
        before = level.mesh
        if screen_size is None or screen_size.judge(reference.mesh, level.number, found[-1].mesh).accepts(
            mesh
        ):
            level = replace(level, mesh=mesh, errors=errors)
        notes += _append_better(found, level)
    return found, notes


def _append_better(levels: list[MeasuredLevel], found: MeasuredLevel) -> list[str]:
    """Appends a level, removes those that it beats with fewer triangles, and returns notes."""
    notes = []
    while len(levels) > 1 and found.errors["error_max"] < levels[-1].errors["error_max"] - _ROUNDING:
        worse = len(levels.pop().mesh.triangles)
        notes.append(
            f"a level of {worse} triangles left out: {len(found.mesh.triangles)} are nearer to the source"
        )
    levels.append(found)
    return notes


def _chain(reference: Original, plan: Plan) -> tuple[list[MeasuredLevel], list[str]]:
    """The levels of balanced, and notes."""
    mesh = reference.mesh
    levels, notes = [_fully_measured(reference, MeasuredLevel(mesh, NO_ERROR))], []
    if plan.finest > 0:
        found, note = _coarsest(reference, mesh, plan.finest, plan.simplifier)
        if found is None:
            notes.append(f"lod0 is the source: {note}")
        else:
            levels = [_fully_measured(reference, found)]
            share = f"{len(found.mesh.triangles)} of {len(mesh.triangles)} triangles"
            notes.append(f"lod0 has {share}: nothing finer is seen")
    first = len(levels[0].mesh.triangles)
    count = min(plan.count, 1 + len(plan.errors)) if plan.errors else plan.count
    left_out = len(plan.errors) + 1 - count if plan.errors else 0
    if left_out:
        notes.append(
            f"{left_out} of {len(plan.errors)} bounds have no level: at most {plan.count} are asked for, the "
            "source counted"
        )
    for at in range(1, count):
        report_step(f"level {at} of {count - 1}")
        last = levels[-1]
        before = len(last.mesh.triangles)
        seen = max(last.errors["error_max"], last.errors["uv_shift_p99"])
        if plan.farthest is not None and seen >= plan.farthest:
            notes.append(f"no level after lod{len(levels) - 1}: the flight never is farther away")
            break
        if plan.errors:
            bound = min(plan.errors[at - 1], plan.limit)
            found, note = _coarsest(reference, last.mesh, bound, plan.simplifier)
        elif plan.screen_size is not None:
            judge = plan.screen_size.judge(mesh, at, last.mesh)
            found, note = _coarsest(reference, last.mesh, plan.limit, plan.simplifier, judge)
        else:
            target = max(LEAST_TRIANGLES, int(first * plan.ratio**at))
            if target >= before:
                notes.append(f"no level after lod{len(levels) - 1}: few enough triangles: {before}")
                break
            found, note = _nearest(reference, last.mesh, target, plan.limit, plan.simplifier)
        if found is None:
            none = f"no level after lod{len(levels) - 1}: "
            if notes and notes[-1].startswith(
                none
            ):  # a wider bound or a smaller size says it for those before
                notes.pop()
            notes.append(none + note)
            if plan.errors or plan.screen_size:
                continue
            break
        found = replace(_fully_measured(reference, found), number=at)
        turned = found.errors["normal_mean_deg"]
        if not (plan.errors or plan.screen_size) and turned > _TURNED_DEG:
            shape = f"{len(found.mesh.triangles)} triangles turn normals by {turned:.0f} degrees on the mean"
            mend = 'for more, set lods_by = "screen_size" or "error" in a scene, '
            mend += "or give `paradize mesh` --screen-size or --errors"
            notes.append(f"no level after lod{len(levels) - 1}; {mend}: {shape}, limit {_TURNED_DEG:.0f}")
            break
        notes += _append_better(levels, found)
    return levels, notes


def _fully_measured(reference: Original, level: MeasuredLevel) -> MeasuredLevel:
    """Returns the level with the errors of its normals and its texture measured too."""
    if level.mesh is reference.mesh:
        return replace(level, errors=NO_ERROR | _NO_NORMAL_ERROR | _NO_UV_SHIFT)
    normals = normal_error(reference, level.mesh, _SAMPLES, surface_error=level.errors["error_max"])
    slid = {key: level.errors[key] for key in _NO_UV_SHIFT if key in level.errors}
    slid = slid or uv_shift(reference, level.mesh, _SAMPLES)
    return replace(level, errors=level.errors | normals | slid)


def _bound_notes(levels: list[MeasuredLevel]) -> list[str]:
    return [
        f"lod{at}: the largest distance to the source lies between {level.errors['error_max_lower']:.3g} and "
        f"{level.errors['error_max']:.3g} of the diagonal, and the larger is reported: a closer search would "
        "take too long, mostly because of long thin triangles"
        for at, level in enumerate(levels)
        if is_loose(level.errors)
    ]


def _uv_shift_notes(levels: list[MeasuredLevel], simplifier: str) -> list[str]:
    notes = []
    mend = (
        "ask for fewer levels"
        if simplifier in SEAM_SIMPLIFIERS
        else f"take the simplifier {SIMPLIFIERS[0]!r}"
    )
    for at, level in enumerate(levels):
        p99, most = level.errors["uv_shift_p99"], level.errors["uv_shift_max"]
        slid = f"by {most:.2g} of the diagonal at most (99 % of the samples by no more than {p99:.2g})"
        if not level.seams_kept:
            notes.append(
                f"lod{at}: seams were not kept, so the texture is stretched beside them; it slid {slid}; "
                f"{mend} to keep them"
            )
        elif p99 > max(_UV_SHIFT_REPORTED, 2 * level.errors["error_max"]):
            notes.append(
                f"lod{at}: the texture slid {slid}; ask for fewer levels or a larger ratio to keep it in "
                "place"
            )
    return notes


def _simplified(
    reference: Original,
    before: Mesh,
    target: int,
    limit: float,
    simplifier: str,
    judge: Judge | None = None,
) -> tuple[MeasuredLevel | None, str, Mesh | None]:
    """Returns a measured level of about `target` triangles, or None if nothing would be left or the judge
    does not accept it; why it has more; and the mesh that was not accepted. If its texture slid, it is made
    again with more weight on UVs, and the least slid one inside `limit` is taken."""
    made = simplify(before, target, method=simplifier, original=reference.mesh)
    try:
        mesh, _ = validate_mesh(made.mesh)
    except SourceError:
        return None, "nothing would be left", None
    if judge is not None and not judge.accepts(mesh):  # before it is measured, which takes longer
        return None, made.note, mesh
    level = MeasuredLevel(mesh, reference.distance(mesh, _SAMPLES), made.seams_kept)
    level = _with_less_uv_shift(reference, level, before, target, limit, simplifier)
    if judge is not None and level.mesh is not mesh and not judge.accepts(level.mesh):
        return None, made.note, level.mesh
    return level, made.note, None


def _with_less_uv_shift(
    reference: Original, level: MeasuredLevel, before: Mesh, target: int, limit: float, simplifier: str
) -> MeasuredLevel:
    """Returns the level; if its texture slid too far, one of as few triangles inside `limit` that slid
    less."""
    if reference.mesh.uvs is None or simplifier not in SEAM_SIMPLIFIERS or level.errors["error_max"] > limit:
        return level
    best = replace(level, errors=level.errors | uv_shift(reference, level.mesh, _SAMPLES))
    for weight in _UV_WEIGHTS:
        if best.errors["uv_shift_p99"] <= max(_UV_SHIFT_TRIED, 2 * best.errors["error_max"]):
            break
        made = simplify(before, target, method=simplifier, original=reference.mesh, uv_weight=weight)
        try:
            mesh, _ = validate_mesh(made.mesh)
        except SourceError:
            continue
        errors = reference.distance(mesh, _SAMPLES)
        if errors["error_max"] > limit or len(mesh.triangles) > 1.02 * len(level.mesh.triangles):
            continue
        errors |= uv_shift(reference, mesh, _SAMPLES)
        if made.seams_kept >= level.seams_kept and errors["uv_shift_p99"] < best.errors["uv_shift_p99"]:
            best = MeasuredLevel(mesh, errors, made.seams_kept)
    return best


def _nearest(
    reference: Original, before: Mesh, target: int, limit: float, simplifier: str
) -> tuple[MeasuredLevel | None, str]:
    """Returns the level nearest to `target` triangles with a measured error inside `limit`, or None; and
    why it is not nearer."""
    most = int(len(before.triangles) * (1 - _WORTH))
    least, best, note = target, None, ""
    for _ in range(_BISECTIONS):
        level, reason, _ = _simplified(reference, before, target, limit, simplifier)
        if level is None:
            return best, note or reason
        count = len(level.mesh.triangles)
        if count > most:
            note = note or reason or f"{len(before.triangles)} triangles are the least"
            break
        if level.errors["error_max"] <= limit:
            best, most = level, count
            if target == least:
                break
        else:
            note = (
                f"{count} triangles are {level.errors['error_max']:.3g} of the diagonal off, limit {limit:g}"
            )
            least = target
        if best is not None and target <= least + 1:
            break
        target = (least + most) // 2
    return best, note


def _coarsest(
    reference: Original, before: Mesh, bound: float, simplifier: str, judge: Judge | None = None
) -> tuple[MeasuredLevel | None, str]:
    """Returns the mesh of the fewest triangles with a measured error inside `bound` that the judge accepts,
    by bisection of the count on a logarithmic scale; None if no level saves enough triangles, and why."""
    whole = len(before.triangles)
    low, high = LEAST_TRIANGLES, int(whole * (1 - _WORTH))
    best: MeasuredLevel | None = None
    note = f"{whole} triangles are the least"
    refused: Mesh | None = None  # the last fault, where the judge found it
    for _ in range(2 * _BISECTIONS):
        if low > high:
            break
        target = max(low, min(high, isqrt(low * high)))
        level, reason, unlike = _simplified(reference, before, target, bound, simplifier, judge)
        if level is None:
            refused = unlike or refused
            low = target + 1
            continue
        count, off = len(level.mesh.triangles), level.errors["error_max"]
        if off > bound:
            note, refused = f"{count} triangles are {off:.3g} of the diagonal off, limit {bound:g}", None
            low = target + 1
            continue
        if count > int(whole * (1 - _WORTH)):
            note, refused = reason or note, None if reason else refused
            low = target + 1
            continue
        if best is None or count < len(best.mesh.triangles):
            best = level
        if count > target * 1.1:  # seams and borders hold the rest: fewer cannot be had
            break
        high = min(target, count) - 1
        if low * 1.02 > high:
            break
    if best is None and judge is not None and refused is not None:
        note = f"{len(refused.triangles)} triangles {judge.fault(refused)}"
    return best, note
