"""The jobs of objects' meshes. Does not import numpy."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from paradize.scene.baker_settings import (
    MeshSettings,
)
from paradize.scene.jobs import Output, Requirements
from paradize.scene.map_sets import ObjectMaps, SceneMaps
from paradize.scene.motion import stands
from paradize.scene.pass_inputs import drawing_passes, map_inputs, mesh_inputs
from paradize.scene.settings import Head, SceneObject

_LOD_SIZE_PX = 256.0  # without lod_size_px


def add_object(
    required: Requirements,
    item: SceneObject,
    maps: SceneMaps,
    views: tuple[str, ...],
    flight_views: dict[str, Any] | None,
    size: dict[str, Any] | None,
    quantise_limits: dict[str, float],
) -> None:
    """Adds the job of an object's mesh. views: those that draw it. flight_views: from camera_views; None: its
    levels of detail do not follow the flight. size: from screen_size; None: they are not by how they look."""
    name = item.name
    sets = list(maps.of_object(name))
    read: dict[bool, list[str]] = {False: [], True: []}  # by MapSet.second
    for map_set, names in sets:
        read[map_set.second] += map_inputs(map_set, {name: names}, maps, {name: views})
    inputs = mesh_inputs(item, maps.objects[name], views, read[False], read[True])
    required.add(
        f"{name} mesh",
        "mesh",
        {"mesh": item.mesh},
        [Output(f"{name}_mesh", "mesh", "mesh", inputs["POSITION"], drawing_passes(views))],
        [name],
        **asdict(
            MeshSettings.of(
                item,
                attributes=list(inputs),
                quantise=quantise_limits if item.quantise else None,
                flight_views=flight_views,
                screen_size=size,
                instances=stands(item) if flight_views else [],
                atlas=bool(sets),  # a map needs a UV layout
                painted=True,  # overlapping UVs are the author's choice: the maps are painted for them
                base_colors=_base_colors(maps.objects[name]),
                second_frames=[
                    material
                    for material, map_set in maps.objects[name].second.items()
                    if "normal" in map_set.pictures
                ],
            )
        ),
    )


def screen_size(head: Head, item: SceneObject, known: ObjectMaps) -> dict[str, Any]:
    """Returns the screen size of MeshSettings."""
    limits = {"normal_deg": head.lod_error_deg, "silhouette": head.lod_silhouette, "flip": head.lod_flip}
    return {"size_px": _LOD_SIZE_PX if item.lod_size_px is None else item.lod_size_px, **limits} | {
        "two_sided": sorted(name for name, drawn in known.drawn.items() if drawn.two_sided)
    }


def _base_colors(known: ObjectMaps) -> dict[str, list[float]]:
    """Returns the colours that the GLB holds, by material; materials with a colour map are white by
    default."""
    return {
        name: list(drawn.color)
        for name, drawn in known.drawn.items()
        if drawn.color != (1.0, 1.0, 1.0) or not (name in known.sets and "color" in known.sets[name].pictures)
    }
