"""Objects in the water get circles for ripples: round sections, each once, where it is wet."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from paradize.build.ripple_circles import _circles, _is_wet, merged

UP = np.array([0.0, 1.0, 0.0])


def prism(x: float, z: float, across: float, along: float, sides: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """A pole from 1 m below the water to 1 m above it, without caps."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    rim = np.stack([x + across * np.cos(turn), np.zeros(sides), z + along * np.sin(turn)], axis=1)
    points = np.concatenate([rim - UP, rim + UP])
    i, j = np.arange(sides), (np.arange(sides) + 1) % sides
    return points, np.concatenate(
        [np.stack([i, j, i + sides], axis=1), np.stack([j, j + sides, i + sides], axis=1)]
    )


def test_each_pole_of_a_mesh_becomes_a_circle_of_its_place_and_radius() -> None:
    first, second = prism(3.0, -2.0, 0.2, 0.2), prism(8.0, 5.0, 0.5, 0.5)
    points = np.concatenate([first[0], second[0]])
    triangles = np.concatenate([first[1], second[1] + len(first[0])])
    assert sorted(_circles(points, triangles)) == [(3.0, -2.0, 0.2), (8.0, 5.0, 0.5)]


def test_hulls_twigs_and_what_does_not_cross_the_surface_have_none() -> None:
    assert _circles(*prism(0.0, 0.0, 0.4, 2.0)) == []
    assert _circles(*prism(0.0, 0.0, 0.02, 0.02)) == []
    points, triangles = prism(0.0, 0.0, 0.2, 0.2)
    assert _circles(points + 3.0 * UP, triangles) == []


def test_a_circle_beside_a_larger_one_is_part_of_it() -> None:
    assert merged([(0.4, 0.0, 0.1), (0.0, 0.0, 0.5), (3.0, 0.0, 0.1)]) == [(0.0, 0.0, 0.5), (3.0, 0.0, 0.1)]


def test_poles_in_the_sand_have_none() -> None:
    floor = {"columns": 2, "cell_m": [5.0, 10.0], "highest_m": [1.0, -2.0]}
    assert not _is_wet((-2.0, 0.0, 0.1), floor, [10.0, 10.0], 0.0)
    assert _is_wet((2.0, 0.0, 0.1), floor, [10.0, 10.0], 0.0)
    assert _is_wet((50.0, 0.0, 0.1), floor, [10.0, 10.0], 0.0)


def test_the_poles_of_the_islands_jetty_have_them(island: Path) -> None:
    ripples = json.loads((island / "scene.json").read_text())["water"]["ripples"]
    thin = [x for x, radius in zip(ripples["x_m"], ripples["radius_m"], strict=True) if radius < 0.2]
    assert len(thin) >= 12
    assert all(36.5 < x < 39.5 for x in thin)
