"""Lists the artifacts that a scene requires, and for each the render passes that read it.

An artifact that no pass reads is not listed, so it is not baked: without water there is no du/dv map, without
parallax no height map, without highlights no gloss map. Does not import numpy.
"""

from __future__ import annotations

from dataclasses import asdict

from paradize.scene.baker_settings import CubemapSettings, SoundSettings
from paradize.scene.daytime import KeySky, key_skies
from paradize.scene.finest_views import camera_views, scene_views
from paradize.scene.ground_jobs import add_color, add_terrain, add_water
from paradize.scene.jobs import Output, Requirements
from paradize.scene.map_jobs import add_map_set
from paradize.scene.map_sets import SceneMaps
from paradize.scene.object_jobs import add_object, screen_size
from paradize.scene.pass_inputs import listed, views_of, views_of_objects
from paradize.scene.settings import Scene, sound_files


def require(scene: Scene, maps: SceneMaps) -> Requirements:
    """Returns the jobs of a scene. maps: from build/materials/map_sets.py."""
    required = Requirements()
    _add_skies(required, scene)
    views = views_of(scene)
    if scene.terrain:
        waves = scene.water is not None and scene.water.wave_height_m > 0.0
        add_terrain(required, scene.terrain, views[1:], scene_views(scene), waves=waves)
    if scene.water:
        add_water(required, scene.water)
    quantise_limits = {
        metric: limit for metric, limit in scene.budget.hard.items() if metric.startswith("quantise_")
    }
    drawn_in = views_of_objects(scene)
    left = list(maps.sets)
    for item in scene.objects:
        path = camera_views(scene) if item.lods_by == "flight" else None
        size = (
            screen_size(scene.head, item, maps.objects[item.name]) if item.lods_by == "screen_size" else None
        )
        add_object(
            required,
            item,
            maps=maps,
            views=drawn_in[item.name],
            flight_views=path,
            size=size,
            quantise_limits=quantise_limits,
        )
        for map_set in [map_set for map_set in left if item.name in map_set.materials]:
            left.remove(map_set)  # a shared set comes with its first object
            add_map_set(required, map_set, maps, drawn_in)
    for file, needed in sound_files(scene.sounds, scene.music).items():
        output = Output(needed.artifact, "sound", "sound", needed.reason)
        settings = asdict(SoundSettings(needed.placed))
        required.add(needed.artifact, "sound", {"file": file}, [output], **settings)
    for job in required.jobs:
        for role in [role for role in ("mesh", "layout") if role in job.sources]:
            files = maps.beside.get(job.sources[role], ())
            job.sources.update({f"{role}, file {k + 2}": path for k, path in enumerate(files)})
    return required


def _add_skies(required: Requirements, scene: Scene) -> None:
    """Adds the jobs of the sky's cube maps and of the clouds."""
    surfaces = tuple(name for name in ("terrain", "objects", "water") if getattr(scene, name))
    readers = ("environment", "sky") if scene.daytime else ("sky", *surfaces)
    for sky in key_skies(scene):
        roles = ["panorama"] if len(sky.faces) == 1 else [f"face{i}" for i in range(6)]
        faces = dict(zip(roles, sky.faces, strict=True))
        output = Output(sky.name, "cubemap", "sky", _reason(sky, scene), readers)
        required.add(sky.name, "cubemap", faces, [output], **asdict(CubemapSettings()))
    if scene.clouds:
        source = {"image": scene.clouds.picture}
        add_color(required, "clouds", source, "repeat", "the clouds around the horizon", readers)


def _reason(sky: KeySky, scene: Scene) -> str:
    seen = listed("the sky", *(["the water's mirror"] if scene.water else []))
    times = [f"from {begin:g} s to {end or scene.flight.duration_s:g} s" for begin, end in sky.spans_s]
    return f"{seen} {listed(*times)}" if times else seen
