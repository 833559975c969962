"""Measures each object's published files in workers: the limits of its maps' gutters, the errors of its
levels' normals under the normal map, and at which size each level looks like the finest. Results are kept in
the store.

gutter_limits.py, lod_normal_error.py and lods_seen.py measure. They are imported in the worker only.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paradize.build.artifacts import read_artifact
from paradize.build.entries import GUTTERS, LOD_NORMAL_ERRORS, LODS_SEEN, PALETTES, fits
from paradize.build.options import BuildOptions
from paradize.build.work import run_build_jobs
from paradize.errors import ParadizeError
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.pool import Job
from paradize.map_table import maps_of
from paradize.scene.map_sets import SceneMaps
from paradize.scene.settings import Scene, SceneObject
from paradize.scene.sightings import ObjectSighting
from paradize.store.local import Store, key_of

_SHAPES = {
    "gutters": GUTTERS,
    "lod_normal_error": LOD_NORMAL_ERRORS,
    "palettes": PALETTES,
    "lods_seen": LODS_SEEN,
}
WHOLE = ""  # in place of a map set: measured of the whole object


@dataclass(frozen=True)
class _Measurement:
    """A measurement of a map set on an object (WHOLE: of all together): its kind, its key in the store, and
    the job that makes it."""

    item: str
    map_set: str
    kind: str
    key: str
    job: Job


def gutter_limits_job(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """Calls gutter_limits.measure_gutters, in a worker."""
    from paradize.build.measurements.gutter_limits import measure_gutters

    textures = {key: read_artifact(path) for key, path in maps.items()}
    return measure_gutters(glb=read_artifact(glb), textures=textures, **settings)


def lod_normal_error_job(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """Calls lod_normal_error.measure_lod_normal_error, in a worker."""
    from paradize.build.measurements.lod_normal_error import measure_lod_normal_error

    texture = read_artifact(maps["normal"])
    return {"levels": measure_lod_normal_error(glb=read_artifact(glb), texture=texture, **settings)}


def palette_job(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """Calls flat_colors.measure_palette, in a worker."""
    from paradize.build.materials.flat_colors import measure_palette

    mesh = read_artifact(glb)
    return {
        key: measure_palette(glb=mesh, texture=read_artifact(path), **settings) for key, path in maps.items()
    }


def lods_seen_job(glb: Path, maps: dict[str, Path], settings: dict[str, Any]) -> dict[str, Any]:
    """Calls lods_seen.measure_lods_seen, in a worker."""
    from paradize.build.measurements.lods_seen import measure_lods_seen

    textures = {key: read_artifact(path) for key, path in maps.items()}
    return {"levels": measure_lods_seen(read_artifact(glb), textures, **settings)}


def measure_objects(
    store: Store,
    scene: Scene,
    maps: SceneMaps,
    sightings: Mapping[str, ObjectSighting],
    errors_m: Mapping[str, Sequence[float]],
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    options: BuildOptions,
) -> tuple[dict[str, dict[tuple[str, str], dict[str, Any]]], list[ParadizeError]]:
    """Measures each object's published files; results are kept in the store.

    sightings: how the flight sees each object, by name. errors_m: of the levels of each mesh, metres. data,
    sha256: by artifact.

    Returns, by "gutters", "lod_normal_error", "palettes" and "lods_seen" and then by (object, map set), what
    measure_gutters returns of sets with maps; {"levels": what measure_lod_normal_error returns} of those with
    a normal map; what measure_palette returns of each map of palettes; of (object, WHOLE) with several levels
    {"levels": what measure_lods_seen returns}; and the errors of what failed.
    """
    measurements: list[_Measurement] = []
    found: dict[str, dict[tuple[str, str], dict[str, Any]]] = {kind: {} for kind in _SHAPES}
    for item in scene.objects:
        for map_set, materials in maps.of_object(item.name):
            textures = {
                key: f"{map_set.name}_{key}" for key in maps_of("object") if f"{map_set.name}_{key}" in data
            }
            drawn = {name: maps.objects[item.name].drawn[name] for name in materials}
            parallax = {name: (by.parallax_scale, by.parallax_bias) for name, by in drawn.items()}
            kinds: dict[str, tuple[dict[str, Any], dict[str, str]]] = {}
            if textures and map_set.layout is None:  # maps that tile have no borders to look at
                free = {"limits": dict.fromkeys(sorted(parallax)), "maps": dict.fromkeys(textures)}
                found["gutters"][item.name, map_set.name] = free
            elif textures:
                settings = {"parallax": parallax, "bleed": map_set.bleed}
                kinds["gutters"] = settings | {"pixel_m": sightings[item.name].pixel_m}, textures
            if "normal" in textures and not map_set.second:
                settings = {"wrap": map_set.wrap, "materials": materials}
                kinds["lod_normal_error"] = settings, {"normal": textures["normal"]}
            if map_set.palette and textures:
                settings = {"wrap": map_set.wrap, "materials": materials}
                kinds["palettes"] = settings, textures
            measurements += [
                _measurement(
                    kind,
                    item,
                    map_set=map_set.name,
                    settings=settings,
                    data=data,
                    sha256=sha256,
                    textures=names,
                )
                for kind, (settings, names) in kinds.items()
            ]
        if len(errors_m[f"{item.name}_mesh"]) > 1:
            settings, names = _as_seen(scene, item, maps, data)
            settings["errors_m"] = list(errors_m[f"{item.name}_mesh"])
            measurements.append(
                _measurement(
                    "lods_seen",
                    item,
                    map_set=WHOLE,
                    settings=settings,
                    data=data,
                    sha256=sha256,
                    textures=names,
                )
            )
    missing = []
    if not options.force:
        store.expect(measurement.key for measurement in measurements)
    for measured in measurements:
        stored = None if options.force else store.get_product(measured.key)
        if fits(stored, _SHAPES[measured.kind]):
            found[measured.kind][measured.item, measured.map_set] = stored
        else:
            missing.append(measured)
    errors = []
    outcomes = run_build_jobs(options, [measurement.job for measurement in missing])
    for measured, outcome in zip(missing, outcomes, strict=True):
        if outcome.error:
            errors.append(outcome.error)
            continue
        found[measured.kind][measured.item, measured.map_set] = outcome.value
        store.put_product(measured.key, outcome.value)
    return found, errors


def _as_seen(
    scene: Scene, item: SceneObject, maps: SceneMaps, data: Mapping[str, Path]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Returns the settings of measure_lods_seen, and the artifacts of its textures."""
    materials: dict[str, dict[str, Any]] = {}
    names: dict[str, str] = {}
    for map_set, of_set in maps.of_object(item.name):
        if map_set.second:  # of normals that lie elsewhere only the surface's are compared
            continue
        kinds = ("normal", "color", "emission")
        known = {key: f"{map_set.name}_{key}" for key in kinds if f"{map_set.name}_{key}" in data}
        for material in of_set:
            drawn = maps.objects[item.name].drawn[material]
            names |= {name: name for name in known.values()}
            materials[material] = {
                "normal": known.get("normal"),
                "alpha": known.get("color") if drawn.alpha_mode != "opaque" else None,
                "color": known.get("color"),
                "color_factor": list(drawn.color),
                "emission": known.get("emission"),
                "emission_factor": list(drawn.emission),
                "cutoff": None if drawn.alpha_mode == "blend" else drawn.alpha_cutoff,
                "wrap": map_set.wrap or ("clamp", "clamp"),
                "two_sided": drawn.two_sided,
            }
    for material, drawn in maps.objects[item.name].drawn.items():
        bare: dict[str, Any] = {
            "normal": None,
            "alpha": None,
            "cutoff": 0.0,
            "wrap": None,
            "two_sided": drawn.two_sided,
        }
        bare |= {"color": None, "color_factor": list(drawn.color)}
        bare |= {"emission": None, "emission_factor": list(drawn.emission)}
        materials.setdefault(material, bare)
    limits = {"normal_deg": scene.head.lod_error_deg, "silhouette": scene.head.lod_silhouette}
    settings = {"materials": materials, "error_px": scene.head.lod_error_px, "limits": limits}
    return settings | {"flip": scene.head.lod_flip}, names


_FUNCTIONS: dict[str, tuple[str, Callable[..., dict[str, Any]]]] = {
    "gutters": ("paradize.build.measurements.gutter_limits", gutter_limits_job),
    "lod_normal_error": ("paradize.build.measurements.lod_normal_error", lod_normal_error_job),
    "palettes": ("paradize.build.materials.flat_colors", palette_job),
    "lods_seen": ("paradize.build.measurements.lods_seen", lods_seen_job),
}


def _measurement(
    kind: str,
    item: SceneObject,
    map_set: str,
    settings: dict[str, Any],
    data: Mapping[str, Path],
    sha256: Mapping[str, str],
    textures: Mapping[str, str],
) -> _Measurement:
    module, function = _FUNCTIONS[kind]
    mesh = f"{item.name}_mesh"
    settings = {"name": map_set or mesh} | settings
    hashes = {key: sha256[name] for key, name in textures.items()} | {"mesh": sha256[mesh]}
    key = key_of(kind, code_digest(module), hashes, settings)
    maps = {key: data[name] for key, name in textures.items()}
    of = item.name if map_set in (WHOLE, item.name) else f"{item.name} {map_set}"
    job = Job(
        f"{of} {kind.replace('_', ' ')}",
        function,
        {"glb": data[mesh], "maps": maps, "settings": settings},
        file=item.mesh,
        code=code_of(module),
        files=dict.fromkeys([data[mesh], *maps.values()], True),
    )
    return _Measurement(item.name, map_set, kind, key, job)
