"""Reads a scene file and checks what concerns more than one field."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from paradize import player_limits
from paradize.documents import TOML_BYTES, parse_toml, toml_key
from paradize.errors import GroupedError, SceneError, unread
from paradize.files import read_file
from paradize.kinds import SCENE, expecting
from paradize.scene.schema import Faults, read_table
from paradize.scene.settings.instance_table import read_instances
from paradize.scene.settings.lights import check_lights
from paradize.scene.settings.objects import RESERVED, SceneObject
from paradize.scene.settings.scene import Scene
from paradize.scene.settings.sound import check_sounds


def load_scene(path: Path) -> Scene:
    """Reads and checks a scene TOML; its source files must exist.

    Raises SceneError for one fault, GroupedError for several.
    """
    with expecting(SCENE, path):
        tree = _read_toml(path)
    faults = Faults(path)
    scene = read_table(Scene, tree, "", faults)
    if scene is not None:
        scene = replace(scene, objects=tuple(_with_file(item, faults) for item in scene.objects))
        _cross_checks(scene, faults)
    faults.raise_if_any()
    assert scene is not None
    return scene


def _with_file(item: SceneObject, faults: Faults) -> SceneObject:
    """The object with the instances of its file."""
    if item.instances_file is None:
        return item
    try:
        return replace(item, instances=(*item.instances, *read_instances(item.instances_file)))
    except GroupedError as group:
        faults.errors += group.errors
    except SceneError as error:
        faults.errors.append(error)
    return item


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        data = read_file(path, TOML_BYTES)
    except FileNotFoundError:
        raise SceneError("there is no such file", file=path) from None
    except OSError as error:
        raise unread(error, path, kind=SceneError) from None
    mend = "mend that line; `paradize new DIR` makes a scene to start from"
    tree = parse_toml(data, path, SceneError, mend=mend)
    if not tree:
        mend = "`paradize new DIR` makes a scene to start from"
        raise SceneError("holds no settings", file=path, mend=mend)
    return tree


def _check_totals(scene: Scene, faults: Faults) -> None:
    """Adds a fault where objects or clouds together are more than the player takes."""
    instances = [(f"object[{i}].instance", len(item.instances)) for i, item in enumerate(scene.objects)]
    particles = [(f"particles[{i}].count", cloud.count) for i, cloud in enumerate(scene.particles)]
    for what, most, counts in (
        ("instances", player_limits.MOST_INSTANCES, instances),
        ("particles", player_limits.MOST_PARTICLES, particles),
    ):
        total = sum(count for _, count in counts)
        if total > most:
            place, count = max(counts, key=lambda entry: entry[1])
            mend = f"the player takes {most} in a scene; leave {total - most} out, or split the scene"
            faults.add(place, f"has {count}, and all together {total} {what}", mend)


def _check_daytime(scene: Scene, faults: Faults) -> None:
    """Adds the faults of the keys of the light."""
    keys = scene.daytime
    if not keys:
        for name in ("clouds",) if scene.clouds else ():
            faults.add(
                name, "stands without [[daytime]], which lights it", "write two or more keys, or leave it out"
            )
        return
    if len(keys) == 1:
        faults.add("daytime", "has one key", "write two or more, or leave it out")
    for i, key in enumerate(keys):
        if i and key.at_s <= keys[i - 1].at_s:
            mend = f"must be above {keys[i - 1].at_s:g}, the key before"
            faults.add(f"daytime[{i}].at_s", f"is {key.at_s:g}", mend)
        if key.at_s >= scene.flight.duration_s:
            mend = f"must be below the flight's {scene.flight.duration_s:g} s"
            faults.add(f"daytime[{i}].at_s", f"is {key.at_s:g}", mend)
        if key.faces is None and scene.sky is None:
            faults.add(
                f"daytime[{i}].faces",
                "is missing, and there is no [sky]",
                "write [sky], or the faces of the key",
            )
        after = keys[(i + 1) % len(keys)]
        if max(key.sun.intensity, after.sun.intensity) > 0.0 < max(key.moon.intensity, after.moon.intensity):
            what = "this key and the next have sunlight and moonlight, and only one of them casts shadows"
            mend = "set sun.intensity or moon.intensity to 0, or write a key between in which both are 0"
            faults.add(f"daytime[{i}]", what, mend)
    if scene.sky and all(key.faces for key in keys):
        faults.add("sky", "is shown by no key of [[daytime]]", "leave it out, or the faces of a key")


def _check_waves(scene: Scene, faults: Faults) -> None:
    """Adds a fault where waves would break: J. H. Michell, "The Highest Waves in Water", 1893."""
    water = scene.water
    if water and water.wave_height_m > water.wave_length_m / 7.0:
        mend = (
            f"must be at most {water.wave_length_m / 7.0:.3g}, a seventh of wave_length_m: higher ones break"
        )
        faults.add("water.wave_height_m", f"is {water.wave_height_m:g}", mend)


def _cross_checks(scene: Scene, faults: Faults) -> None:
    """Adds the faults that concern more than one field."""
    _check_waves(scene, faults)
    if scene.light_shafts and not scene.shadow:
        what = "stands without [shadow], which it shows in the air"
        faults.add("light_shafts", what, "write [shadow], or leave it out")
    first: dict[str, int] = {}
    for i, item in enumerate(scene.objects):
        name = item.name
        if first.setdefault(name, i) != i:
            faults.add(f"object[{i}].name", f"{name!r} is already object[{first[name]}]", "rename one")
        if name in RESERVED:
            faults.add(f"object[{i}].name", f"{name!r} names the scene's own artifacts", "rename it")
        if (item.lods_by == "error") != bool(item.lod_errors):
            mend = 'write lod_errors with lods_by = "error", and only there'
            faults.add(f"object[{i}].lod_errors", f"has {len(item.lod_errors)} numbers", mend)
        if item.lods_by != "screen_size" and item.lod_size_px is not None:
            mend = 'write lod_size_px with lods_by = "screen_size", and only there'
            faults.add(
                f"object[{i}].lod_size_px", f"is {item.lod_size_px:g} beside lods_by = {item.lods_by!r}", mend
            )
        for material, table in item.materials.items():
            if table.alpha_mode in ("opaque", "blend") and table.alpha_cutoff:
                place = f"object[{i}].material.{toml_key(material)}.alpha_cutoff"
                what = (
                    f"is {table.alpha_cutoff:g} beside alpha_mode = {table.alpha_mode!r}, which has no cutoff"
                )
                faults.add(place, what, 'leave it out, or write alpha_mode = "mask"')
            if table.roughness and table.smoothness_map:
                place = f"object[{i}].material.{toml_key(material)}.smoothness_map"
                faults.add(place, "stands beside roughness, which says the same", "leave one of them out")
        if item.motion is not None and item.motion.laps == 0:
            faults.add(
                f"object[{i}].motion.laps",
                "is 0",
                "must be 1 or more, or -1 or less: whole rounds close the loop",
            )
        if item.motion is not None and item.motion.beat is not None and item.quantise:
            mend = "leave quantise out: wings and legs turn about a hinge in the mesh's own metres"
            faults.add(f"object[{i}].quantise", "is true beside [object.motion.beat]", mend)
        if not any(view == "camera" or getattr(scene, view) for view in item.views):
            mend = f"the scene has no [{item.views[0]}]; name camera, or a view that there is"
            faults.add(f"object[{i}].views", "draws it nowhere", mend)
    for k, (size, largest) in enumerate(zip(scene.head.viewport, scene.head.largest, strict=True)):
        if largest < size:
            mend = f"must not be below viewport[{k}] = {size}"
            faults.add(f"scene.largest_viewport[{k}]", f"is {largest}", mend)
    region = scene.free_camera
    for k in range(3 if region else 0):
        if region and region.low[k] > region.high[k]:
            mend = f"must not be above free_camera.high[{k}] = {region.high[k]:g}"
            faults.add(f"free_camera.low[{k}]", f"is {region.low[k]:g}", mend)
    sparkles: dict[str, int] = {}
    for i, cloud in enumerate(scene.particles):
        if sparkles.setdefault(cloud.name, i) != i:
            what = f"{cloud.name!r} is already particles[{sparkles[cloud.name]}]"
            faults.add(f"particles[{i}].name", what, "rename one")
    _check_totals(scene, faults)
    _check_daytime(scene, faults)
    check_sounds(scene.sounds, scene.music, scene.flight.duration_s, faults)
    flight = scene.flight
    check_lights(scene.lights, scene.objects, flight.duration_s, faults)
    if len(flight.eye) != len(flight.target):
        counts = f"{len(flight.target)} target waypoints for {len(flight.eye)} eye waypoints"
        faults.add("flight.target", counts, "write one target for each eye waypoint")
    for i, waypoint in enumerate(flight.eye):
        after = (i + 1) % len(flight.eye)
        if waypoint.position == flight.eye[after].position:
            faults.add(
                f"flight.eye[{after}].position",
                f"is the same place as flight.eye[{i}]",
                "the camera cannot fly a path of no length; move one or take one out",
            )
    if flight.near_m >= flight.far_m:
        faults.add("flight.near_m", f"is {flight.near_m:g}", f"must be below far_m = {flight.far_m:g}")
    if scene.head.poster_s > flight.duration_s:
        mend = f"the flight lasts {flight.duration_s:g} s"
        faults.add("scene.poster_s", f"is {scene.head.poster_s:g}", mend)
    if scene.terrain and scene.terrain.mix_low_m > scene.terrain.mix_high_m:
        mend = f"must not be above mix_high_m = {scene.terrain.mix_high_m:g}"
        faults.add("terrain.mix_low_m", f"is {scene.terrain.mix_low_m:g}", mend)
