"""The colour of the exported ground, against the player's shader translated number by number."""

from __future__ import annotations

import math

import numpy as np
import pytest

from paradize.export.ground_shade import contrasted, tone_of, toned, value_noise, wetted

WORD = 1 << 32


def hashed(column: int, row: int) -> float:
    """hash21 of shaders/lib/hash.glsl, in whole numbers."""
    x, y = ((v % WORD * 1664525 + 1013904223) % WORD for v in (column, row))
    for _ in range(2):
        x = (x + y * 1664525) % WORD
        y = (y + x * 1664525) % WORD
        x, y = x ^ x >> 16, y ^ y >> 16
    return (x >> 8) / (1 << 24)


def noise(x: float, y: float) -> float:
    """value_noise of the same file."""
    column, row = math.floor(x), math.floor(y)
    across, down = (f * f * f * (f * (f * 6 - 15) + 10) for f in (x - column, y - row))
    low, high = (
        hashed(column, row + k) * (1 - across) + hashed(column + 1, row + k) * across for k in (0, 1)
    )
    return low * (1 - down) + high * down


def test_the_tone_of_the_ground_is_the_shader_s_at_every_place() -> None:
    x, y = np.array([-7.3, -1.0, 0.0, 0.5, 3.25, 1e5]), np.array([-2.75, 0.1, 41.9])
    assert np.allclose(value_noise(x, y), [[noise(a, b) for a in x] for b in y], atol=1e-6)
    tone = tone_of((30.0, 12.0), (4, 6))  # of texels' centres, x along the rows
    places = [[(-12.5 + 5.0 * i, -4.5 + 3.0 * j) for i in range(6)] for j in range(4)]
    expected = [
        [noise(a * 0.11, b * 0.11) + 0.5 * noise(a * 0.37 + 19, b * 0.37 + 19) for a, b in row]
        for row in places
    ]
    assert np.allclose(tone, expected, atol=1e-5)
    light = np.full((4, 6, 3), 0.5, np.float32)
    assert np.allclose(toned(light, tone)[..., 1], 0.5 * (0.93 + 0.09 * np.array(expected)), atol=1e-6)


def test_sand_is_dark_where_waves_reach_it_and_neither_high_above_nor_deep_below() -> None:
    heights = np.array([[5.0, 1.05, 0.5]], np.float32)
    terrain = {"wet_high_m": 0.5, "wet_darkness": 0.4}
    light = np.full((1, 3, 3), 0.5, np.float32)
    found = wetted(light, np.full((1, 3), 0.75, np.float32), heights, terrain, 1.0)
    assert np.array_equal(found[0, [0, 2]], light[0, [0, 2]])
    assert found[0, 1] == pytest.approx(0.5 * (1.0 - 0.4 * np.array([0.92, 1.0, 1.08])), rel=1e-6)
    light, heights = light[:, :1], np.array([[1.3375]], np.float32)  # in the middle of the slope
    wet, dry = (wetted(light, np.full((1, 1), t, np.float32), heights, terrain, 1.0) for t in (0.35, 1.15))
    assert wet[0, 0, 1] < 0.37 and dry[0, 0, 1] > 0.43, "the tone moves it by 5 cm"
    half = wetted(light, np.full((1, 1), 0.75, np.float32), np.array([[0.925]], np.float32), terrain, 1.0)
    assert half[0, 0, 1] == pytest.approx(0.5 * (1.0 - 0.4 / 2)), "it ends 15 cm below the water"


def test_grains_have_more_contrast_and_the_same_mean_and_plain_sand_stays() -> None:
    light = np.array([[[0.2] * 3, [0.4] * 3]], np.float32)
    found = contrasted(light)[0, :, 0]
    assert found == pytest.approx([0.2 * (1 - 0.45 / 3), 0.4 * (1 + 0.45 / 3)], rel=1e-6)
    green = np.array([[[0.0, 0.4, 0.0], [0.4, 0.0, 0.0]]], np.float32)  # luminances 0.7152 : 0.2126
    assert contrasted(green)[0, 0, 1] == pytest.approx(0.4 * (1 + 0.45 * (0.7152 / 0.4639 - 1)), rel=1e-4)
    bright = np.array([[[9.0] * 3] + [[0.1] * 3] * 9], np.float32)
    ends = contrasted(bright)[0, :2, 0]
    assert ends == pytest.approx([9.0 * (1 + 0.45 * 0.6), 0.1 * (1 - 0.45 * 0.5)], rel=1e-5), (
        "grains have limits"
    )
    plain = np.full((2, 2, 3), 0.3, np.float32)
    assert np.allclose(contrasted(plain), plain)
