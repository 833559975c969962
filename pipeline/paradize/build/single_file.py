"""`paradize mesh`, `maps` and `terrain`: one input file -> files with names and the object that --json
prints.

Called in a worker process, so that no input takes the command line down with it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from paradize.scene.baker_settings import BakerSettings, MapSettings, MeshSettings, TerrainSettings


@dataclass(frozen=True)
class BakedFiles:
    """files: name -> bytes, to be written by the caller. told: what --json prints, but for `seconds`.
    rows: (artifact, tier, errors, bytes) for the table. errors: what budgets may limit, by product."""

    files: dict[str, bytes]
    told: dict[str, Any]
    rows: list[tuple[str, str, dict[str, float], int]]
    errors: dict[str, dict[str, float]]


def solo(
    kind: str,
    path: Path,
    settings: BakerSettings,
    *,
    tier: str,
    budget: dict[str, float],
    **sources: Path | None,
) -> BakedFiles:
    """One input by the baker of its kind ("mesh", "maps", "terrain"). tier: "auto" is the cheapest whose
    measured errors are inside the budget (metric -> worst value). sources: others than `path`, by the name of
    the baker's argument. Errors beyond the budget are warnings, of "auto" a BakeError (several:
    GroupedError) that says by how much. A budget of what is not measured raises BakeError too, before
    anything is baked where that can be known."""
    from paradize.build.budget_metrics import measured_by, of_single_files
    from paradize.build.tier_choice import inside, limited, misses
    from paradize.build.tuned_settings import by_cost, next_label, split_label
    from paradize.errors import BakeError, GroupedError
    from paradize.scene.baker_settings import TextureSettings
    from paradize.scene.budget import excesses
    from paradize.scene.schema import Limits
    from paradize.scene.tiers import AUTO, FINER_FORMAT, LABELS, ORDER

    makes = of_single_files(measured_by(kind, getattr(settings, "only", ()), asdict(settings)))
    _require_measured(kind, budget, makes, path)
    limits = Limits(hard=budget)
    calls: dict[str, Callable[..., BakedFiles]] = {
        "mesh": solo_mesh,
        "maps": solo_maps,
        "terrain": solo_terrain,
    }
    call = calls[kind]
    growing = isinstance(settings, TextureSettings)
    labels = (tier,) if tier != AUTO else LABELS if growing else ORDER
    measured: dict[str, dict[str, dict[str, float]]] = {}
    tried: dict[str, bool] = {}
    asked: float | None = None  # the setting that may be turned, as it was asked for
    label: str | None = labels[0]
    while label is not None:
        used, tuned = split_label(label)
        grows = {"budget": budget if tier != AUTO or label in FINER_FORMAT else {}} if growing else {}
        try:
            product = call(path, replace(settings, **tuned, **grows), tier=used, **sources)
        except BakeError:
            if not tuned:
                raise
            tried[label] = False  # a bound that positions cannot hold
        else:
            measured[label] = limited(product.errors, limits)
            tried[label] = inside(measured[label], budget)
            kept = [name for name in tried if tried[name]]
            if not kept or by_cost(kept)[0] == label:
                made, one = product, label
        if tier == AUTO and not tuned and 0.0 not in budget.values():
            asked = product.told.get("bound_m")
        label = next_label(kind, labels, asked, tried)
    over = [
        f"{name}: {excess}" for name, errors in made.errors.items() for excess in excesses(limits, errors)
    ]
    if tier == AUTO:
        made.told["tried"] = {"taken": one, "errors": measured}
        if over:
            raise GroupedError(misses(measured, limits, path))
    _require_measured(kind, budget, {metric for errors in made.errors.values() for metric in errors}, path)
    made.told["warnings"] = [*made.told["warnings"], *over]
    return made


def _require_measured(kind: str, budget: Iterable[str], known: Collection[str], path: Path) -> None:
    from paradize.build.budget_metrics import unmeasured
    from paradize.errors import BakeError, GroupedError

    idle, mend = unmeasured(budget, known)
    what = f"nothing that this `paradize {kind}` bakes measures it, so that it cannot be kept"
    if idle:
        raise GroupedError(BakeError(what, file=path, place=f"--budget {one}", mend=mend) for one in idle)


def solo_mesh(path: Path, settings: MeshSettings, *, tier: str) -> BakedFiles:
    """`paradize mesh`: the file is named after the input's stem; the caller renames it."""
    from paradize.bakers.mesh.bake import bake_mesh
    from paradize.bakers.registry import mesh_errors

    made = bake_mesh(path, settings, tier=tier)
    if settings.atlas and not made.report["atlas"]:
        what = "has texture coordinates that its maps may be painted for; no atlas made"
        made.report["warnings"].append(f"{path}: {what}; take them out of the OBJ for a new layout")
    rows = []
    for i, level in enumerate(made.report["lods"]):
        told = {"surface_max": level["error_max"], "surface_rms": level["error_rms"]}
        told["lod_normal_p99_deg"] = level["normal_p99_deg"]
        told |= {key: level[key] for key in ("quantise_max_m", "quantise_normal_max_deg") if key in level}
        rows.append((f"lod{i}, {level['triangles']} triangles", str(level.get("tier", tier)), told, 0))
    rows.append((path.stem, tier, {}, len(made.glb)))
    return BakedFiles(
        {path.stem: made.glb}, dict(made.report), rows, {"mesh": mesh_errors(made.report["lods"])}
    )


def solo_terrain(path: Path, settings: TerrainSettings, *, tier: str) -> BakedFiles:
    """`paradize terrain`: the file is named as solo_mesh does."""
    from paradize.bakers.terrain.mesh import bake_terrain

    made = bake_terrain(path, settings, tier=tier)
    told = {
        "triangles": made.triangles,
        "vertices": made.vertices,
        "bound_m": made.bound_m,
        "max_error_m": made.max_error_m,
        "rms_error_m": made.rms_error_m,
        "tier": made.tier,
        "bytes": len(made.glb),
        "quantised": settings.quantise,
        **made.quantization_errors,
        "warnings": made.warnings,
    }
    errors = {"terrain_max_m": made.max_error_m, "terrain_rms_m": made.rms_error_m}
    rows = [(path.stem, made.tier, errors, len(made.glb))]
    return BakedFiles({path.stem: made.glb}, told, rows, {"terrain": errors | made.quantization_errors})


def solo_maps(path: Path, settings: MapSettings, *, tier: str, uv: Path | None = None) -> BakedFiles:
    """`paradize maps`: a file `<stem>_<map>.<fmt>` for each map. uv: the OBJ whose layout they follow."""
    from paradize.bakers.maps.bake import bake_maps

    made = bake_maps(path, settings, uv=uv, tier=tier)
    files, maps, rows, warnings = {}, {}, [], []
    for name in settings.only:
        product = made[name]
        file = f"{path.stem}_{name}.{settings.fmt}"
        files[file] = product.data
        maps[name] = {
            "file": file,
            "width": product.width,
            "height": product.height,
            "format": product.format,
            "error": product.error,
            "metric": product.metric,
            "errors": product.errors,
            "levels": product.levels,
            "filter": product.filter,
        }
        errors = {} if product.metric is None else {product.metric: product.error}
        rows.append((file, product.tier, errors, len(product.data)))
        warnings += product.warnings
    taken = made[settings.only[0]]
    told = {
        "maps": maps,
        "from": taken.source,
        "guess": taken.guess,
        "warnings": list(dict.fromkeys(warnings)),
    }
    return BakedFiles(files, told, rows, {name: made[name].errors for name in settings.only})
