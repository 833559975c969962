"""Materials that are lit at their vertices look as those lit in pixels do, where light hardly varies."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import pi
from typing import Any

import numpy as np
import pytest

from tests.player.passes.test_materials import F64, STEP, WHITE, Render, middle, quad, render, texel, thing
from tests.player.passes.test_point_lights import ONE_SET, lamp
from tests.player.synthetic import instance, material
from tests.sweeps import sample, sweep

__all__ = ["render"]  # the fixture
LEAF = WHITE | {"two_sided": True, "translucency": 0.5}
TEXTURES = {"leaf": texel(200, 150, 90, 255)}
FRONT, SIDE, BEHIND = [0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.6, -0.8]


def both(render: Render, one: dict[str, Any], *stands: dict[str, Any], **light: Any) -> tuple[F64, F64]:
    """The pictures of a small square of a material that is lit in its pixels, and at its vertices."""
    meshes = {"a": replace(quad(size=0.8), normals=np.array([[0.0, 0.6, 0.8]] * 4, np.float32))}
    pixels, vertices = (
        render([thing("a", {"m": one | {"vertex_lit": lit}}, *stands)], meshes, TEXTURES, **light)
        for lit in (False, True)
    )
    return pixels, vertices


@pytest.mark.parametrize(
    ("alpha_mode", "direction", "turn_rad"),
    sweep(
        product(["opaque", "mask"], [FRONT, SIDE, BEHIND], [0.0, pi]),
        test=[("opaque", FRONT, 0.0), ("opaque", BEHIND, 0.0), ("mask", SIDE, pi)],
    ),
)
def test_front_back_and_light_that_passes_through_are_those_of_light_in_the_pixels(
    render: Render, alpha_mode: str, direction: list[float], turn_rad: float
) -> None:
    one = material("leaf", **LEAF, alpha_mode=alpha_mode, vertex_colors=True, color=[0.9, 0.7, 0.8])
    stand = instance([0.0] * 3, turn_rad)
    air = {"color": [0.2, 0.5, 0.9], "density_per_m": 0.05}
    pixels, vertices = both(render, one, stand, sun=(direction, 2.0), ambient=0.2, fog=air)
    assert middle(pixels).min() > 0.05
    assert vertices == pytest.approx(pixels, abs=STEP)


@pytest.mark.parametrize("place", sample([[0.0, 12.0, -16.0], [0.0, 0.0, 20.0]], every=2))
def test_a_far_lamp_before_and_behind_lights_both_sides_as_in_the_pixels(
    render: Render, place: list[float]
) -> None:
    one = material("leaf", **LEAF)
    light = {"lights": [lamp(place, intensity=800.0, range_m=200.0)], "light_sets": ONE_SET}
    for turn_rad in (0.0, pi):
        stand = instance([0.0] * 3, turn_rad)
        pixels, vertices = (
            render(
                [thing("a", {"m": one | {"vertex_lit": lit}}, stand, light_sets=[1])],
                {"a": quad(size=0.8)},
                TEXTURES,
                **light,
            )
            for lit in (False, True)
        )
        assert middle(pixels).max() > 0.1
        assert vertices == pytest.approx(pixels, abs=STEP)


@pytest.mark.parametrize("quality", sweep(["fast", "balanced", "exact"], test=["balanced", "exact"]))
def test_a_lamp_before_the_middle_of_a_large_square_shows_only_in_quality_exact(
    render: Render, quality: str
) -> None:
    light = {"lights": [lamp([0.0, 0.0, 0.5], intensity=0.5)], "light_sets": ONE_SET}
    options = ("--disable", "post", "--quality", f"lod={quality}")
    pixels, vertices = (
        middle(
            render(
                [thing("a", {"m": material(None, **WHITE, vertex_lit=lit)}, light_sets=[1])],
                {"a": quad()},
                options=options,
                **light,
            )
        ).mean()
        for lit in (False, True)
    )
    if quality == "exact":
        assert vertices == pixels
    else:
        assert 0.0 < vertices < 0.3 * pixels  # the lamp reaches the corners


def test_what_reflects_gives_off_light_or_has_another_map_is_lit_in_its_pixels(render: Render) -> None:
    """One of each kind, side by side."""
    changes: list[dict[str, Any]] = [
        {"specular": 0.5, "smoothness": 0.6},
        {"metalness": 1.0, "smoothness": 0.6},
        {"emission": [0.3, 0.2, 0.1]},
        {"normal": "bumps"},
        {"alpha_mode": "blend", "normal": "bumps"},
    ]
    rng = np.random.default_rng(5)
    tilted = rng.normal([0.0, 0.0, 1.0], 0.4, (4, 3)).astype(np.float32)
    mesh = replace(quad(size=1.0), normals=tilted / np.linalg.norm(tilted, axis=1, keepdims=True))
    light = {"sun": (SIDE, 2.0), "ambient": 0.3}
    bumps = {"bumps": texel(60, 20, fmt="RG8_SNORM", kind=np.int8)}
    places = [instance([1.4 * (k - 2), 0.0, 0.0]) for k in range(len(changes))]

    def seen(lit: bool, *kinds: dict[str, Any]) -> F64:
        things = [
            thing(f"t{k}", {"m": material(None, **(WHITE | change), vertex_lit=lit)}, place, mesh="a_mesh")
            for k, (change, place) in enumerate(zip(kinds, places, strict=False))
        ]
        return render(things, {"a": mesh}, bumps, **light)

    assert np.array_equal(seen(False, *changes), seen(True, *changes))
    assert not np.array_equal(seen(False, {}), seen(True, {})), "light at vertices looks different"
