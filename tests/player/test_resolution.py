"""Quality resolution=fast: the picture is drawn smaller and enlarged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paradize.metrics.picture import Picture
from tests.player.synthetic import write_scene
from tests.player.test_quality import Draw, draw, error

__all__ = ["draw"]  # the fixture

F64 = NDArray[np.float64]
FAST = ("--quality", "resolution=fast")
CODE = 1 / 255


def enlarged(small: F64, size: int, axis: int) -> F64:
    """Catmull-Rom's spline through the texels of one axis, as its matrix gives it, at the pixels' centres."""
    texels = small.shape[axis]
    place = (np.arange(size) + 0.5) * texels / size - 0.5
    first = np.floor(place).astype(int)
    t = place - first
    basis = 0.5 * np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]], np.float64)
    weights = np.stack([t**power for power in range(4)], axis=1) @ basis
    at = np.clip(first[:, None] + np.arange(-1, 3), 0, texels - 1)
    shape = [1] * small.ndim
    shape[axis] = size
    parts = [np.take(small, at[:, i], axis) * weights[:, i].reshape(shape) for i in range(4)]
    out: F64 = np.sum(parts, axis=0)
    return out


def nearest_four(small: F64, width: int, height: int) -> F64:
    """The four texels around each pixel: (4, height, width, 3)."""
    corners = []
    for size, texels in ((height, small.shape[0]), (width, small.shape[1])):
        first = np.floor((np.arange(size) + 0.5) * texels / size - 0.5).astype(int)
        corners.append([np.clip(first + i, 0, texels - 1) for i in (0, 1)])
    return np.stack([small[np.ix_(y, x)] for y in corners[0] for x in corners[1]])


@pytest.mark.parametrize("size", [(200, 110), (161, 91), (2, 1)])
def test_the_picture_is_the_smaller_one_enlarged_by_a_bicubic_filter_without_rings(
    draw: Draw, tmp_path: Path, size: tuple[int, int]
) -> None:
    """The smaller one is drawn by itself, with dither and in 8 bits: that is a code and a half of slack."""
    width, height = size
    folder = write_scene(tmp_path / "scene", bare=True)
    seen = draw(folder, *FAST, size=f"{width}x{height}").astype(np.float64)
    assert seen.shape == (height, width, 3)
    if size == (200, 110):  # others give sides of another ratio
        # One sample a pixel, as in a reference of one frame.
        small = draw(folder, "--reference", 1, size="140x77").astype(np.float64)
        wanted = enlarged(enlarged(small, height, 0), width, 1)
        four = nearest_four(small, width, height)
        rings = (wanted < four.min(axis=0) - 4 * CODE) | (wanted > four.max(axis=0) + 4 * CODE)
        assert rings.mean() > 0.002
        wanted = np.clip(wanted, four.min(axis=0), four.max(axis=0))
        assert np.abs(seen - wanted).max() < 3 * CODE
        assert np.abs(seen - wanted).mean() < 0.5 * CODE


@pytest.mark.parametrize("size", ["200x110", "161x91"])
def test_it_looks_like_the_whole_picture_and_is_not_shifted_against_it(
    draw: Draw, tmp_path: Path, size: str
) -> None:
    folder = write_scene(tmp_path / "scene", bare=True)
    whole, fast = draw(folder, size=size), draw(folder, *FAST, size=size)

    def inner(picture: Picture) -> Picture:
        return np.ascontiguousarray(picture[2:-2, 2:-2], dtype=np.float32)

    here = error(inner(whole), inner(fast))
    assert 0.0 < here < 0.05
    for step in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        shifted = 0.5 * (fast + np.roll(fast, step, (0, 1)))  # by half a pixel
        assert error(inner(whole), inner(shifted)) > 1.02 * here, step


def test_it_is_the_same_each_time_and_exact_is_balanced(draw: Draw, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene")
    assert np.array_equal(draw(folder, *FAST), draw(folder, *FAST))
    assert np.array_equal(draw(folder, "--quality", "resolution=exact"), draw(folder))


def test_without_post_the_smaller_picture_fills_the_frame(draw: Draw, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene", bare=True)
    whole = draw(folder, "--disable", "post", size="161x91")
    assert error(whole, draw(folder, "--disable", "post", *FAST, size="161x91")) < 0.1
