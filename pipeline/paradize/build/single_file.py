"""`paradize mesh`, `maps` and `terrain`: one input file -> files with names and the object that --json
prints.

Called in a worker process, so that no input takes the command line down with it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from paradize.bakers.product import MapProduct
    from paradize.scene.baker_settings import (
        BakerSettings,
        MapSettings,
        MeshSettings,
        OcclusionSettings,
        TerrainSettings,
    )


@dataclass(frozen=True)
class BakedFiles:
    """files: name -> bytes, to be written by the caller. report: what --json prints, without `seconds`.
    rows: (artifact, tier, errors, bytes) for the table. errors: what budgets may limit, by product."""

    files: dict[str, bytes] = field(repr=False)
    report: dict[str, Any]
    rows: list[tuple[str, str, dict[str, float], int]]
    errors: dict[str, dict[str, float]]


def bake_single(
    kind: str,
    path: Path,
    settings: BakerSettings,
    *,
    tier: str,
    budget: dict[str, float],
    **sources: Path | None,
) -> BakedFiles:
    """Bakes one input by the baker of its kind ("mesh", "maps", "occlusion", "terrain"). tier: "auto" takes
    the cheapest whose measured errors are inside the budget (metric -> worst value). sources: others than
    `path`, by the name of the baker's argument. Settings of another kind raise TypeError, an unknown tier
    BakeError.

    Errors beyond the budget are warnings; of "auto" they are a BakeError (several: GroupedError) that says by
    how much. A budget of what is not measured raises BakeError too, before anything is baked if that is
    known.
    """
    from paradize.build.budget_metrics import measured_by, of_single_files
    from paradize.errors import BakeError
    from paradize.scene.baker_settings import (
        MapSettings,
        MeshSettings,
        OcclusionSettings,
        TerrainSettings,
        TextureSettings,
    )
    from paradize.scene.budget import excesses
    from paradize.scene.schema import Limits
    from paradize.tiers import AUTO, TIER_OPTIONS

    kinds: dict[str, tuple[Callable[..., BakedFiles], type[BakerSettings]]] = {
        "mesh": (mesh_files, MeshSettings),
        "maps": (map_files, MapSettings),
        "occlusion": (occlusion_files, OcclusionSettings),
        "terrain": (terrain_files, TerrainSettings),
    }
    baker, wanted = kinds[kind]
    if not isinstance(settings, wanted):
        raise TypeError(f"settings is a {type(settings).__name__}, expected {wanted.__name__}")
    if tier not in TIER_OPTIONS:
        mend = f"name one of {', '.join(TIER_OPTIONS)}"
        raise BakeError(f"tier {tier!r} is not known", file=path, mend=mend)
    measurable = of_single_files(measured_by(kind, getattr(settings, "only", ()), asdict(settings)))
    _require_measured(kind, budget, measurable, path)

    def bake(used: BakerSettings, tier: str, formats_by: dict[str, float]) -> BakedFiles:
        if isinstance(used, TextureSettings):
            used = replace(used, budget=formats_by)
        return baker(path, used, tier=tier, **sources)

    if tier == AUTO:
        made = _cheapest_inside(bake, kind, path, settings, budget)
    else:
        made = bake(settings, tier, budget)
    measured = {metric for errors in made.errors.values() for metric in errors}
    _require_measured(kind, budget, measured, path)
    limits = Limits(hard=budget)
    made.report["warnings"] = made.report["warnings"] + [
        f"{name}: {excess}" for name, errors in made.errors.items() for excess in excesses(limits, errors)
    ]
    return made


def _cheapest_inside(
    bake: Callable[[BakerSettings, str, dict[str, float]], BakedFiles],
    kind: str,
    path: Path,
    settings: BakerSettings,
    budget: dict[str, float],
) -> BakedFiles:
    """Bakes in the cheapest tier inside the budget. bake: bakes by settings in a tier; the budget that it is
    given decides the formats of textures. The report lists the errors of each tried tier. Raises GroupedError
    if no tier is inside."""
    from paradize.build.tiers.tier_choice import inside, limited, misses
    from paradize.build.tiers.tuned_settings import by_cost, next_label, split_label
    from paradize.errors import BakeError, GroupedError
    from paradize.scene.baker_settings import TextureSettings
    from paradize.scene.schema import Limits
    from paradize.tiers import FINER_FORMAT, LABELS, TIERS

    limits = Limits(hard=budget)
    labels = LABELS if isinstance(settings, TextureSettings) else TIERS
    measured: dict[str, dict[str, dict[str, float]]] = {}
    tried: dict[str, bool] = {}  # by label: whether it is inside the budget
    given: float | None = None  # value of the setting that may be tuned
    label: str | None = labels[0]
    while label is not None:
        tier, tuned = split_label(label)
        formats_by = budget if label in FINER_FORMAT else {}
        try:
            product = bake(replace(settings, **tuned), tier, formats_by)
        except BakeError:
            if not tuned:
                raise
            tried[label] = False  # a bound that positions cannot hold
        else:
            measured[label] = limited(product.errors, limits)
            tried[label] = inside(measured[label], budget)
            kept = [name for name in tried if tried[name]]
            if not kept or by_cost(kept)[0] == label:
                made, taken = product, label
        if not tuned and 0.0 not in budget.values():
            given = product.report.get("bound_m")
        label = next_label(kind, labels, given, tried)
    if not any(tried.values()):
        raise GroupedError(misses(measured, limits, path))
    made.report["tried"] = {"taken": taken, "errors": measured}
    return made


def _require_measured(kind: str, budget: Iterable[str], known: Collection[str], path: Path) -> None:
    from paradize.build.budget_metrics import unmeasured
    from paradize.errors import BakeError, GroupedError

    idle, mend = unmeasured(budget, known)
    what = f"nothing that this `paradize {kind}` bakes measures it, so that it cannot be kept"
    if idle:
        raise GroupedError(
            BakeError(what, file=path, place=f"--budget {metric}", mend=mend) for metric in idle
        )


def mesh_files(path: Path, settings: MeshSettings, *, tier: str) -> BakedFiles:
    """`paradize mesh`: the file is named after the input's stem; the caller renames it."""
    from paradize.bakers.mesh.bake import bake_mesh
    from paradize.bakers.registry import mesh_errors

    made = bake_mesh(path, settings, tier=tier)
    if settings.atlas and not made.report["atlas"]:
        what = "has texture coordinates that its maps may be painted for; no atlas made"
        made.report["warnings"].append(f"{path}: {what}; take them out of the model for a new layout")
    rows = []
    used = str(made.report["tier"])
    for i, level in enumerate(made.report["lods"]):
        errors = {"surface_max": level["error_max"], "surface_rms": level["error_rms"]}
        errors["lod_normal_p99_deg"] = level["normal_p99_deg"]
        errors |= {key: level[key] for key in ("quantise_max_m", "quantise_normal_max_deg") if key in level}
        rows.append((f"lod{i}, {level['triangles']} triangles", used, errors, 0))
    rows.append((path.stem, used, {}, len(made.glb)))
    return BakedFiles(
        {path.stem: made.glb}, dict(made.report), rows, {"mesh": mesh_errors(made.report["lods"])}
    )


def terrain_files(path: Path, settings: TerrainSettings, *, tier: str) -> BakedFiles:
    """`paradize terrain`: the file is named after the input's stem; the caller renames it."""
    from paradize.bakers.terrain.mesh import bake_terrain

    made = bake_terrain(path, settings, tier=tier)
    report = {
        "triangles": made.triangles,
        "vertices": made.vertices,
        "bound_m": made.bound_m,
        "max_error_m": made.max_error_m,
        "rms_error_m": made.rms_error_m,
        "tier": made.tier,
        "bytes": len(made.glb),
        "quantised": settings.quantise,
        **made.quantisation_errors,
        "warnings": made.warnings,
    }
    errors = {"terrain_max_m": made.max_error_m, "terrain_rms_m": made.rms_error_m}
    rows = [(path.stem, made.tier, errors, len(made.glb))]
    return BakedFiles({path.stem: made.glb}, report, rows, {"terrain": errors | made.quantisation_errors})


def map_files(path: Path, settings: MapSettings, *, tier: str, uv: Path | None = None) -> BakedFiles:
    """`paradize maps`: a file `<stem>_<map>.<fmt>` for each map. uv: the model whose layout they follow."""
    from paradize.bakers.maps.bake import bake_maps

    made = bake_maps(path, settings, uv=uv, tier=tier)
    files, maps, rows, warnings = {}, {}, [], []
    for name in settings.only:
        product = made[name]
        file = f"{path.stem}_{name}.{settings.fmt}"
        files[file] = product.data
        maps[name] = _map_row(file, product)
        errors = {} if product.metric is None else {product.metric: product.error}
        rows.append((file, product.tier, errors, len(product.data)))
        warnings += product.warnings
    taken = made[settings.only[0]]
    report = {
        "maps": maps,
        "from": taken.source,
        "guess": taken.guess,
        "warnings": list(dict.fromkeys(warnings)),
    }
    return BakedFiles(files, report, rows, {name: made[name].errors for name in settings.only})


def _map_row(file: str, product: MapProduct) -> dict[str, Any]:
    """The entry of a map in the output of --json."""
    return {
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


def occlusion_files(path: Path, settings: OcclusionSettings, *, tier: str) -> BakedFiles:
    """`paradize maps --only occlusion`: the file `<stem>_occlusion.<fmt>`, cast from the model's mesh. Raises
    BakeError for a model on which no place is darker than another, for which a map would be of no use."""
    from paradize.bakers.authored.bake import bake_authored
    from paradize.errors import BakeError
    from paradize.kinds import MODEL, require
    from paradize.scene.baker_settings import AuthoredSettings

    require(MODEL, path)
    used = AuthoredSettings.of(settings, only=["occlusion"], occlusion_cast=True)
    picture = settings.fmt == "png"
    product = bake_authored({}, used, uv=path, tier=tier, fmt="R8_UNORM" if picture else None)["occlusion"]
    if product.constant:
        what = f"has the same occlusion everywhere, {product.constant[0]:g}: a map would show nothing"
        raise BakeError(what, file=path, mend="leave its occlusion out")
    if picture:
        product = _as_png(product)
    file = f"{path.stem}_occlusion.{settings.fmt}"
    report = {"maps": {"occlusion": _map_row(file, product)}, "from": "mesh", "warnings": product.warnings}
    shown = {name: product.errors[name] for name in ("occlusion_cast_p99",) if name in product.errors}
    if product.metric:
        shown[product.metric] = product.error
    rows = [(file, product.tier, shown, len(product.data))]
    return BakedFiles({file: product.data}, report, rows, {"occlusion": product.errors})


def _as_png(product: MapProduct) -> MapProduct:
    """A map of one channel of 8 bits: its level 0 as a PNG."""
    import numpy as np

    from paradize.formats.ktx2.reader import decode_ktx2
    from paradize.formats.png import encode_png

    texture = decode_ktx2(product.data, "occlusion")
    codes = np.frombuffer(texture.levels[0], np.uint8).reshape(texture.height, texture.width, 1)
    return replace(product, data=encode_png(codes), format="PNG8", levels=product.levels[:1])
