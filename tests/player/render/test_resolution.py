"""Quality resolution=fast: the picture is drawn smaller and enlarged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paradize.metrics.picture import Picture
from tests.player.passes.test_materials import Render, glow, quad, render, thing
from tests.player.render.test_quality import Draw, draw, error
from tests.player.synthetic import write_scene
from tests.sweeps import sweep

__all__ = ["draw", "render"]  # the fixtures

F64 = NDArray[np.float64]
FAST = ("--quality", "resolution=fast")
CODE = 1 / 255


def enlarged(small: F64, size: int, axis: int) -> tuple[F64, F64]:
    """Catmull-Rom's spline through the texels of one axis, as its matrix gives it, at the pixels' centres.
    The same within the range of the two texels around each."""
    texels = small.shape[axis]
    place = (np.arange(size) + 0.5) * texels / size - 0.5
    first = np.floor(place).astype(int)
    t = place - first
    basis = 0.5 * np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]], np.float64)
    weights = np.stack([t**power for power in range(4)], axis=1) @ basis
    at = np.clip(first[:, None] + np.arange(-1, 3), 0, texels - 1)
    shape = [1] * small.ndim
    shape[axis] = size
    near = [np.take(small, at[:, i], axis) for i in range(4)]
    out: F64 = np.sum([near[i] * weights[:, i].reshape(shape) for i in range(4)], axis=0)
    return out, np.clip(out, np.minimum(near[1], near[2]), np.maximum(near[1], near[2]))


@pytest.mark.parametrize("size", sweep(["200x110", "161x91", "2x1"], test=["200x110", "2x1"]))
def test_the_picture_is_the_smaller_one_enlarged_by_a_bicubic_filter_without_rings(
    draw: Draw, tmp_path: Path, size: str
) -> None:
    """The smaller one is drawn by itself, with dither and in 8 bits: that is a code and a half of slack."""
    width, height = map(int, size.split("x"))
    folder = write_scene(tmp_path / "scene", bare=True)
    seen = draw(folder, *FAST, size=size).astype(np.float64)
    assert seen.shape == (height, width, 3)
    if size == "200x110":  # others give sides of another ratio
        # One sample a pixel, as in a reference of one frame.
        small = draw(folder, "--reference", 1, size="140x77").astype(np.float64)
        _, wide = enlarged(small, width, 1)
        free, wanted = enlarged(wide, height, 0)
        assert (np.abs(free - wanted) > 4 * CODE).mean() > 0.002
        assert np.abs(seen - wanted).max() < 3 * CODE
        assert np.abs(seen - wanted).mean() < 0.5 * CODE


@pytest.mark.parametrize("size", sweep(["200x110", "161x91"], test=["161x91"]))
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
    size = "96x54"
    assert np.array_equal(draw(folder, *FAST, size=size), draw(folder, *FAST, size=size))
    assert np.array_equal(draw(folder, "--quality", "resolution=exact", size=size), draw(folder, size=size))


def test_without_post_the_smaller_picture_fills_the_frame(draw: Draw, tmp_path: Path) -> None:
    folder = write_scene(tmp_path / "scene", bare=True)
    whole = draw(folder, "--disable", "post", size="161x91")
    assert error(whole, draw(folder, "--disable", "post", *FAST, size="161x91")) < 0.1


@pytest.mark.parametrize("size", sweep(["320x180", "480x270"], test=["320x180"]))
def test_the_glow_is_as_wide_in_the_smaller_picture(render: Render, size: str) -> None:
    """Its rows are a divisor of the picture's, which differs: 180 and 126, 135 and 95."""

    def lit(*options: str) -> int:
        shown = ("--size", size, *options)
        seen = render([thing("lamp", {"m": glow(40.0, 40.0, 40.0)})], {"lamp": quad(size=0.4)}, options=shown)
        return int(np.count_nonzero(seen[..., 0] > 0.05))

    whole, fast = lit(), lit(*FAST)
    assert whole > 200
    assert abs(fast - whole) < 0.15 * whole, (whole, fast)
