"""The jobs of the terrain and the water. Does not import numpy."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from paradize.scene.baker_settings import ColorSettings, MapSettings, TileSettings
from paradize.scene.jobs import Output, Requirements
from paradize.scene.pass_inputs import seen_in
from paradize.scene.settings import Terrain, Water

FLOOR_CELLS = 48  # of the terrain along a side, for the waves: so many that they end near the shore


def add_terrain(
    required: Requirements,
    terrain: Terrain,
    views: tuple[str, ...],
    flight_views: dict[str, Any],
    *,
    waves: bool,
) -> None:
    """Adds the jobs of the terrain. views: those beside the camera's. flight_views: from scene_views. waves:
    whether waves lift the water, which need its depth."""
    readers = ("terrain",)
    relief = terrain.effect_height or terrain.effect_color
    bumps = terrain.sand_strength > 0.0 or (relief is not None and terrain.effect_strength > 0.0)
    reason = seen_in("the terrain", ("camera", *views))
    required.add(
        "terrain",
        "terrain",
        {"heightmap": terrain.heightmap},
        [
            Output("terrain_mesh", "mesh", "mesh", reason, ("terrain", *views), many=True),
            Output("terrain_tree", "", "tree", "which parts of the terrain stand for which"),
        ],
        **asdict(
            TileSettings.of(
                terrain,
                tangents=bumps,
                flight_views=flight_views,
                floor_cells=FLOOR_CELLS if waves else 0,
            )
        ),
    )
    add_color(
        required, "sand", {"image": terrain.sand_color}, "repeat", "the terrain's sand pattern", readers
    )
    if terrain.sand_strength > 0.0:
        required.add(
            "sand maps",
            "maps",
            {"image": terrain.sand_height or terrain.sand_color},
            [Output("sand_normal", "texture", "normal", "the sand's grain in the light", readers)],
            **asdict(
                MapSettings.of(
                    terrain.sand_relief,
                    only=["normal"],
                    source="height" if terrain.sand_height else "color",
                    strength=terrain.sand_strength,
                    wrap="repeat",
                )
            ),
        )
    if terrain.effect_color:
        add_color(
            required, "effect", {"image": terrain.effect_color}, "clamp", "the terrain's effect map", readers
        )
    if relief and terrain.effect_strength > 0.0:
        required.add(
            "effect maps",
            "maps",
            {"image": relief},
            [Output("effect_normal", "texture", "normal", "the effect map's relief in the light", readers)],
            **asdict(
                MapSettings.of(
                    terrain.effect_relief,
                    only=["normal"],
                    source="height" if terrain.effect_height else "color",
                    strength=terrain.effect_strength,
                    size_m=list(terrain.size_m),
                )
            ),
        )


def add_water(required: Requirements, water: Water) -> None:
    """Adds the jobs of the water."""
    required.add(
        "water maps",
        "maps",
        {"image": water.waves},
        [
            Output("water_normal", "texture", "normal", "the light on the waves", ("water",)),
            Output(
                "water_dudv", "texture", "dudv", "the waves that shake reflection and refraction", ("water",)
            ),
        ],
        **asdict(
            MapSettings.of(
                water.wave_relief,
                only=["normal", "dudv"],
                source="height",
                strength=water.wave_strength,
                wrap="repeat",
            )
        ),
    )


def add_color(
    required: Requirements,
    name: str,
    sources: dict[str, Path],
    wrap: str,
    reason: str,
    passes: tuple[str, ...],
) -> None:
    """Adds the job of a colour map."""
    output = Output(f"{name}_color", "texture", "color", reason, passes)
    required.add(f"{name} colour", "color", sources, [output], **asdict(ColorSettings(wrap=wrap)))
