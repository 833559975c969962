"""The limits that the pipeline knows of the player are the player's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from paradize import player_limits as limits

# The limit in the pipeline, and the name of the constant and its file under player/assets.
SAME = [
    (limits.SCALES[0], "min_scale", "scene/objects.cpp"),
    (limits.SCALES[1], "max_scale", "scene/objects.cpp"),
    (limits.FLIGHT_S[0], "min_flight_s", "scene/fields.hpp"),
    (limits.FOV_RAD[0], "min_fov_rad", "scene/objects.cpp"),
    (limits.NEAR_M[0], "min_near_m", "scene/objects.cpp"),
    (limits.FAR_M[0], "min_far_m", "scene/objects.cpp"),
    (limits.FLIGHT_S[1], "max_flight_s", "scene/fields.hpp"),
    (limits.FOV_RAD[1], "max_fov_rad", "scene/objects.cpp"),
    (limits.NEAR_M[1], "max_length_m", "limits.hpp"),
    (limits.FAR_M[1] / 10.0, "max_length_m", "limits.hpp"),
    (limits.MOST_INSTANCES, "max_instances", "scene/objects.cpp"),
    (limits.MOST_PARTICLES, "max_particles", "scene/objects.cpp"),
    (limits.MOST_LIGHTS, "max_lights", "scene/lights.cpp"),
    (limits.MOST_LIGHT_SETS, "max_sets", "scene/lights.cpp"),
    (limits.MOST_LIGHTS_OF_A_SET, "max_lights_of_a_set", "scene/file.hpp"),
    (limits.MOST_RIPPLES, "most_ripples", "scene/ripples.cpp"),
    (limits.MOST_FLOOR_CELLS, "max_floor_cells", "scene/terrain.cpp"),
    (limits.FARTHEST_UV, "max_uv", "payload.cpp"),
]


@pytest.mark.parametrize(("limit", "name", "file"), SAME)
def test_a_limit_is_that_of_the_player(root: Path, limit: Any, name: str, file: str) -> None:
    found = re.findall(rf"\b{name} = ([0-9.e-]+)F?[,;]", (root / "player/assets" / file).read_text())
    assert [float(value) for value in found] == [limit]
