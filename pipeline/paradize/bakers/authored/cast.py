"""Occlusion that is cast from a model instead of authored: read, cast, measure."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from paradize.bakers.authored.pictures import RolePicture
from paradize.errors import BakeError
from paradize.jobs.progress import report_step
from paradize.material import OVERHANG, repeating, uv_width
from paradize.metrics.occlusion import cast_errors
from paradize.readers.model import read_model
from paradize.scene.baker_settings import CastSettings
from paradize.stages.normals import complete_normals
from paradize.stages.occlusion import RAYS, Occlusion, mesh_occlusion
from paradize.stages.validate import validate_mesh

_SHARED = 0.01  # of the texels: more that several triangles show are a warning
_DARK = 0.1  # the same of those that no light reaches


@dataclass(frozen=True)
class CastMap:
    """picture: the occlusion as a picture of floats. errors: of the rays, by the names of budgets."""

    picture: RolePicture
    errors: dict[str, float]
    warnings: list[str]


def cast_occlusion(
    model: Path,
    settings: CastSettings,
    materials: tuple[str, ...],
    tier: str,
    *,
    root: Path | None,
    measure: bool,
) -> CastMap:
    """The occlusion of a model on a square map. materials: whose triangles lie on it; none: all. root: as of
    read_model. Raises SourceError for a model that cannot be read, BakeError for one without a UV layout."""
    read = read_model(model, root)
    mesh, report = validate_mesh(read.mesh, model)
    mesh = complete_normals(mesh, read.smoothing[report.kept], crease_deg=settings.crease_deg)[0]
    uvs = mesh.uvs
    if uvs is None:
        mend = "`paradize mesh --atlas` makes some; cast from the GLB that it writes"
        raise BakeError(
            "has no texture coordinates that a map of its occlusion could follow", file=model, mend=mend
        )
    on = mesh.of_materials(materials) if materials else mesh
    names = {group.material for group in mesh.groups}
    if unknown := sorted({*materials, *settings.see_through} - names):
        what = f"no material {', '.join(map(repr, unknown))}"
        raise BakeError(what, file=model, mend=f"there are {', '.join(map(repr, sorted(names)))}")
    for name in sorted({group.material for group in on.groups}):
        own = on.of_materials([name])
        used = uvs[own.triangles].reshape(-1, 2)
        low, high = used.min(axis=0), used.max(axis=0)
        width = uv_width((float(low[0]), float(low[1]), float(high[0]), float(high[1])))
        if width > 1.0 + OVERHANG:
            mend = "leave it out by naming other materials, or unwrap it into one tile"
            raise BakeError(f"material {name!r}: {repeating(width)}", file=model, mend=mend)
    blocking = mesh.of_materials(names - {*settings.see_through}) if settings.see_through else mesh
    size, reach = settings.occlusion_px, settings.occlusion_reach
    report_step("casting occlusion")
    try:
        made = mesh_occlusion(
            mesh, on.triangles, blocking.triangles, height=size, width=size, reach=reach, rays=RAYS[tier]
        )
    except BakeError as error:
        raise BakeError(error.what, file=model, mend=error.mend) from error
    errors: dict[str, float] = {}
    if measure:
        report_step("measuring occlusion")
        found = cast_errors(made.values, mesh, on.triangles, blocking.triangles, reach=reach)
        errors = {f"occlusion_{name}": value for name, value in found.items()}
    return CastMap(RolePicture(model, made.values, cast=True), errors, _warnings(model, made))


def _warnings(model: Path, made: Occlusion) -> list[str]:
    found = []
    if made.shared > _SHARED:
        found.append(
            f"{model}: {100.0 * made.shared:.3g} % of the texels of its occlusion are shown by several "
            "triangles (its UVs overlap); they hold the mean of their places, which is right where these "
            "look alike"
        )
    if made.dark > _DARK:
        found.append(
            f"{model}: no light reaches {100.0 * made.dark:.3g} % of the texels of its occlusion: they lie "
            "inside other parts, or their normals point into the model"
        )
    return found
