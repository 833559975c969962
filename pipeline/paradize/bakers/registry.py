"""The functions that workers run, one for each kind of job. Sources and settings go in, products come out.

Each function calls the baker of its kind and returns its results in one form. It imports the baker only when
called, so that planning a bake stays fast.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from paradize.artifact import Artifact

if TYPE_CHECKING:
    from paradize.scene.baker_settings import MapSettings

Sources = dict[str, Path]
Settings = dict[str, Any]


@dataclass(frozen=True)
class Product:
    """One of a job's products: its bytes or the file in the scratch folder that holds them, and what was
    measured of it under the product's name."""

    artifact: Artifact
    data: bytes | Path


# The errors of quantised vertices, where they are quantised.
QUANTISED = (
    "quantise_max", "quantise_p99", "quantise_rms", "quantise_max_m",
    "quantise_normal_max_deg", "quantise_normal_p99_deg", "quantise_normal_mean_deg",
    "quantise_tangent_max_deg", "quantise_tangent_p99_deg", "quantise_tangent_mean_deg",
    "quantise_uv_max", "quantise_color_max", "quantise_sway_max",
)  # fmt: skip
# The error of rounding the source's positions to float32: the same at every level.
LOADED = ("load_max", "load_max_m", "load_normal_p99_deg")
# The facts in scene.json of each level of a mesh, besides the GLB itself.
LOD_FACTS = (
    "triangles", "error_max", "error_max_lower", "error_rms", "error_p99", *LOADED,
    "normal_mean_deg", "normal_p99_deg", "normal_max_deg", "uv_shift_p99", "uv_shift_max",
    *QUANTISED,
)  # fmt: skip


# The errors of a mesh that budgets may limit, and the fact of which it is the largest of all levels.
LARGEST_OF_LEVELS = {
    "surface_max": "error_max",
    "surface_rms": "error_rms",
    "lod_normal_p99_deg": "normal_p99_deg",
    "lod_normal_mean_deg": "normal_mean_deg",
    "uv_shift_p99": "uv_shift_p99",
    "uv_shift_max": "uv_shift_max",
    **{key: key for key in (*LOADED, *QUANTISED)},
}


def mesh_errors(levels: list[dict[str, Any]], frames: bool = True) -> dict[str, float]:
    """The errors of a mesh that budgets may limit: the largest of its levels, by metric. levels: as bake_mesh
    reports. frames: whether it has tangents."""
    errors = {
        metric: max(level[key] for level in levels)
        for metric, key in LARGEST_OF_LEVELS.items()
        if all(key in level for level in levels)
    }
    tangents = ("tangent_max_deg", "tangent_p99_deg", "tangent_mean_deg") if frames else ()
    return errors | {name: max(level[name] for level in levels) for name in tangents}


def make_mesh(sources: Sources, settings: Settings, tier: str, root: Path | None = None) -> list[Product]:
    """Model -> GLB with tangent frames and LODs."""
    from paradize.bakers.mesh.lods_from_path import bake_seen
    from paradize.scene.baker_settings import MeshSettings

    made = bake_seen(sources["mesh"], MeshSettings(**settings), tier=tier, root=root)
    levels = made.report["lods"]
    attributes = settings["attributes"]
    errors = mesh_errors(levels, attributes is None or "TANGENT" in attributes)
    used = str(made.report.get("tier", tier))
    libraries = "; ".join(
        f"{what} by {made.report[key]} {made.report[f'{key}_version']}"
        for what, key in (("levels", "simplifier"), ("UV layout", "unwrapper"))
        if made.report[f"{key}_version"] is not None
    )
    reason = libraries or None
    rows = [{key: level[key] for key in LOD_FACTS if key in level} for level in levels]
    warnings = list(made.report["warnings"])
    artifact = Artifact(
        "mesh", suffix="glb", tier=used, errors=errors, levels=rows, reason=reason, warnings=warnings
    )
    return [Product(artifact, made.glb)]


def make_terrain(sources: Sources, settings: Settings, tier: str, scratch: Path) -> list[Product]:
    """Heightmap -> GLB tiles, as many as it takes, and what scene.json tells of their patches."""
    from paradize.bakers.terrain.tiles import bake_tiles
    from paradize.scene.baker_settings import TileSettings

    made = bake_tiles(sources["heightmap"], scratch, TileSettings(**settings), tier=tier)
    tree = {"tables": made.tables, "first_s": [tile.first_s for tile in made.tiles]}
    record = Artifact("tree", suffix="json", tier=made.tier, warnings=made.warnings)
    found = [Product(record, json.dumps(tree, allow_nan=False).encode())]
    for k, tile in enumerate(made.tiles):
        name = f"mesh_{k}" if k else "mesh"
        found.append(Product(Artifact(name, suffix="glb", tier=made.tier, errors=tile.errors), tile.file))
    return found


def make_color(sources: Sources, settings: Settings, tier: str, root: Path | None = None) -> list[Product]:
    """Colour map -> KTX2; or a map of emission."""
    from paradize.bakers.color import bake_color
    from paradize.scene.baker_settings import ColorSettings

    made = bake_color(
        sources["image"],
        ColorSettings(**settings),
        alpha=sources.get("alpha"),
        uv=layout_of(sources, root),
        root=root,
        tier=tier,
    )
    return [_texture(settings.get("product", "color"), made)]


def make_maps(sources: Sources, settings: Settings, tier: str, root: Path | None = None) -> list[Product]:
    """Colour or height map -> the asked ones of normal, height, gloss and du/dv, each KTX2."""
    from paradize.bakers.maps.bake import bake_maps

    used, layout = map_settings(sources, settings, root)
    made = bake_maps(sources["image"], used, uv=layout, root=root, tier=tier)
    return [_texture(name, made[name]) for name in used.only]


def make_authored(sources: Sources, settings: Settings, tier: str, root: Path | None = None) -> list[Product]:
    """Authored pictures, by role -> the asked ones of normal, height, gloss and occlusion, each
    KTX2; of a map whose texels are all equal no bytes, but `constant`."""
    from paradize.bakers.authored.bake import bake_authored
    from paradize.scene.baker_settings import AuthoredSettings

    drawn = {role: path for role, path in sources.items() if role.partition(",")[0] != "layout"}
    made = bake_authored(
        drawn, AuthoredSettings(**settings), uv=layout_of(sources, root), root=root, tier=tier
    )
    return [_texture(name, baked_map) for name, baked_map in made.items()]


def map_settings(
    sources: Sources, settings: Settings, root: Path | None = None
) -> tuple[MapSettings, Path | None]:
    """The settings of a job of maps, and the model whose layout they follow; None: all of the map shines."""
    from paradize.scene.baker_settings import MapSettings

    used, layout = MapSettings(**settings), layout_of(sources, root)
    return used if layout else replace(used, gloss_groups=()), layout


def layout_of(sources: Sources, root: Path | None = None) -> Path | None:
    """The model whose UV layout an object's maps follow; None where it has none of its own."""
    path = sources.get("layout")
    if path is None:
        return None
    from paradize.errors import ParadizeError
    from paradize.readers.model import read_model

    try:
        return path if read_model(path, root).mesh.uvs is not None else None
    except ParadizeError:
        return path  # the baker reads it again, after the picture, and raises


def make_cubemap(sources: Sources, settings: Settings, tier: str) -> list[Product]:
    """Six faces, +X -X +Y -Y +Z -Z, or a panorama -> KTX2 cube map."""
    from paradize.bakers.cubemap import bake_cubemap
    from paradize.scene.baker_settings import CubemapSettings

    made = bake_cubemap(list(sources.values()), CubemapSettings(**settings))
    return [_texture("sky", made)]


def make_sound(sources: Sources, settings: Settings, tier: str) -> list[Product]:
    """Ogg Vorbis -> the same, checked."""
    from paradize.bakers.sound import bake_sound
    from paradize.scene.baker_settings import SoundSettings

    made = bake_sound(sources["file"], SoundSettings(**settings))
    artifact = Artifact("sound", suffix=made.suffix, tier="exact", warnings=made.warnings)
    return [Product(artifact, made.data)]


def make_flight(sources: Sources, settings: Settings, tier: str) -> list[Product]:
    """The camera path's measured errors; no artifact of its own."""
    from paradize.metrics.flight import flight_error

    errors = flight_error(settings["flight"], settings["eye"], settings["target"], settings["speed"])
    return [Product(Artifact("flight", tier=tier, errors=errors), b"")]


def _texture(name: str, made: Any) -> Product:
    artifact = Artifact(
        name,
        suffix="ktx2",
        tier=made.tier,
        errors=dict(made.errors),
        levels=made.levels,
        format=made.format,
        reason=made.reason,
        filter=made.filter,
        warnings=list(made.warnings),
        constant=None if made.constant is None else list(made.constant),
    )
    return Product(artifact, made.data)


Baker = Callable[
    ..., list[Product]
]  # of sources, settings and tier; those of WITH_SCRATCH also a scratch folder, those of MODEL_READERS `root`
WITH_SCRATCH = ("terrain",)
MODEL_READERS = ("mesh", "color", "maps", "authored")  # root: as of read_model
BUDGET_FORMATS = ("color", "maps", "authored")  # the bakers whose texture format a budget decides
TEXTURES = (*BUDGET_FORMATS, "cubemap")
# baker -> (the module whose code, with all that it imports, decides the result; the function)
BAKERS: dict[str, tuple[str, Baker]] = {
    "mesh": ("paradize.bakers.mesh.lods_from_path", make_mesh),
    "terrain": ("paradize.bakers.terrain.tiles", make_terrain),
    "color": ("paradize.bakers.color", make_color),
    "maps": ("paradize.bakers.maps.bake", make_maps),
    "authored": ("paradize.bakers.authored.bake", make_authored),
    "cubemap": ("paradize.bakers.cubemap", make_cubemap),
    "sound": ("paradize.bakers.sound", make_sound),
    "flight": ("paradize.metrics.flight", make_flight),
}
