"""Maps of a UV layout, on layouts as hostile as they come: no slope crosses an island's border, and nothing
outside an island is ever seen. `paradize maps --uv` does the same."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from paradize.scene.baker_settings import MapSettings
from tests.pipeline.layouts import SIZE, cards, rect
from tests.pipeline.scenes import write_image
from tests.sweeps import sweep

Corners = list[tuple[float, float]]

# Islands in texels of a 64 x 64 map; corners inside a texel cover all of it.
LAYOUTS: dict[str, list[Corners]] = {
    "one texel apart": [rect(x, y, x + 6, y + 6) for y in range(1, 57, 7) for x in range(1, 57, 7)],
    "thin slivers": [
        [(2.5, 3.2), (61.5, 3.4), (61.5, 3.6)],
        [(2.5, 8.1), (61.5, 12.3), (61.5, 12.35)],
        [(5.2, 20.5), (5.4, 60.5), (5.6, 60.5)],
        [(20.5, 20.5), (58.5, 58.5), (58.5, 58.4)],
    ],
    "overlapping": [rect(4, 4, 30, 30), rect(10, 10, 40, 40), rect(12, 12, 20, 20)],
    "outside 0..1": [rect(-20, 70, -4, 90), rect(200, -60, 220, -40)],
    "mirrored": [rect(4, 4, 28, 28), rect(60, 4, 36, 28), rect(4, 60, 28, 36), rect(60, 60, 36, 36)],
    "across the wrap edge": [rect(-8, 20, 8, 40), rect(20, -8, 40, 8)],
    "one triangle each": [[(x, y), (x + 2, y + 3), (x + 3, y)] for y in (4, 20, 50) for x in (5, 11, 40)],
    "touching": [rect(4, 4, 20, 60), rect(20, 4, 40, 60)],
    "a point and a line": [[(5, 5), (5, 5), (5, 5)], [(8, 8), (20, 20), (30, 30)], rect(40, 40, 50, 50)],
}


def covered(corners: Corners) -> np.ndarray:
    """(64, 64) bool: texels whose square a convex island's inside meets, wrapped: no edge of a triangle has
    the whole square on its outer side. An island may be a line or a point."""
    points = np.array(corners)
    mask = np.zeros((SIZE, SIZE), np.bool_)
    square = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
    for i in range(2, len(points)):
        triangle = points[[0, i - 1, i]]
        (ax, ay), (bx, by) = triangle[1] - triangle[0], triangle[2] - triangle[0]
        if ax * by == ay * bx:  # a line or a point shows the texels that bilinear samples read there
            for share in np.linspace(0.0, 1.0, 500):
                for a, b in ((0, 1), (1, 2), (2, 0)):
                    x, y = triangle[a] * (1.0 - share) + triangle[b] * share - 0.5
                    mask[np.ix_([int(y) % SIZE, int(y + 1) % SIZE], [int(x) % SIZE, int(x + 1) % SIZE])] = (
                        True
                    )
            continue
        low, high = np.floor(triangle.min(axis=0)).astype(int), np.ceil(triangle.max(axis=0)).astype(int)
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        squares = np.stack([x, y], axis=-1)[:, :, None] + square
        meets = np.ones(x.shape, np.bool_)
        for a, b, c in (triangle, triangle[[1, 2, 0]], triangle[[2, 0, 1]]):
            normal = np.array([a[1] - b[1], b[0] - a[0]])
            meets &= ((squares - a) @ normal * np.sign((c - a) @ normal)).max(axis=2) > 1e-9
        mask[y[meets] % SIZE, x[meets] % SIZE] = True
    return mask


def painted(islands: list[Corners], levels: list[int]) -> np.ndarray:
    """(64, 64, 3) uint8: each island in a grey of its own; overlapping and touching ones alike; between
    them a checker of black and white."""
    picture = np.zeros((SIZE, SIZE, 3), np.uint8)
    picture[(np.indices((SIZE, SIZE)).sum(axis=0) % 2) == 0] = 255
    for corners, level in zip(islands, levels, strict=True):
        picture[covered(corners)] = level
    return picture


def baked(folder: Path, islands: list[Corners], picture: np.ndarray, wrap: str) -> np.ndarray:
    """(64, 64, 3) uint8: the normal map."""
    (folder / "a.obj").write_text(cards(islands))
    write_image(folder / "a.png", picture)
    settings = MapSettings(only=["normal"], fmt="png", strength=50.0, wrap=wrap)
    (folder / "a_normal.png").write_bytes(
        bake_maps(folder / "a.png", settings, uv=folder / "a.obj")["normal"].data
    )
    return np.asarray(oiio.ImageBuf(str(folder / "a_normal.png")).get_pixels(oiio.UINT8))


@pytest.mark.parametrize(
    ("name", "wrap"),
    sweep(
        itertools.product(LAYOUTS, ("clamp", "repeat")),
        test=[(name, ("clamp", "repeat")[k % 2]) for k, name in enumerate(LAYOUTS)],
    ),
)
def test_flat_islands_stay_flat_whatever_lies_between_them(tmp_path: Path, name: str, wrap: str) -> None:
    islands = LAYOUTS[name]
    alike = name in ("overlapping", "touching")
    levels = [120] * len(islands) if alike else [40 + 37 * k % 200 for k in range(len(islands))]
    codes = baked(tmp_path, islands, painted(islands, levels), wrap)
    assert np.array_equal(np.unique(codes.reshape(-1, 3), axis=0), [[128, 128, 255]])


def test_a_ramp_keeps_its_slope_up_to_the_border(paradize_here: Callable[..., Any], tmp_path: Path) -> None:
    # Two islands one texel apart rise to the right; a ridge would stand where one ends and the other begins.
    islands = [rect(4, 4, 31, 60), rect(32, 4, 59, 60)]
    picture = np.zeros((SIZE, SIZE, 1), np.float32)
    for left in (4, 32):
        picture[4:60, left : left + 27, 0] = np.linspace(0.2, 0.8, 27, dtype=np.float32)
    (tmp_path / "a.obj").write_text(cards(islands))
    write_image(tmp_path / "a.exr", picture)
    done = paradize_here(
        "maps", tmp_path / "a.exr", "-o", tmp_path, "--uv", tmp_path / "a.obj", "--only", "normal", "--from",
        "height", "--format", "png", "--strength", 20,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    codes = oiio.ImageBuf(str(tmp_path / "a_normal.png")).get_pixels(oiio.UINT8).astype(int)
    inside = codes[4:60, 4:59]
    assert np.abs(inside - inside[20, 10]).max() <= 1
    assert inside[20, 10, 0] < 120


def test_a_layout_of_nothing_leaves_the_picture_as_it_is(tmp_path: Path) -> None:
    nothing = [[(5.0, 5.0), (5.0, 5.0), (5.0, 5.0)]]
    codes = baked(tmp_path, nothing, np.full((SIZE, SIZE, 3), 90, np.uint8), "clamp")
    assert (codes == [128, 128, 255]).all()


@pytest.mark.parametrize("under", [(255, 255, 255), (0, 0, 0), (255, 0, 255)])
def test_no_fringe_shows_what_was_painted_under_transparent_texels(
    tmp_path: Path, under: tuple[int, int, int]
) -> None:
    leaf = (40, 150, 50)
    size = 62  # not divided by 4: exact texels, no blocks
    y, x = np.mgrid[0:size, 0:size]
    shape = np.hypot((x - 30.5) / 20, (y - 30.5) / 9) < 1
    shape |= np.abs(x - 30.5) < 1
    picture = np.zeros((size, size, 4), np.uint8)
    picture[...] = (*under, 0)
    picture[shape] = (*leaf, 255)
    write_image(tmp_path / "leaf.png", picture)
    texture = decode_ktx2(bake_color(tmp_path / "leaf.png").data)
    for level in range(len(texture.levels)):
        colors = decode_texels(texture, level)[:, :, :3]
        assert np.abs(colors * 255 - np.array(leaf)).max() <= 1, level


def test_gutters_of_a_cut_out_are_filled_under_its_transparent_texels_too(tmp_path: Path) -> None:
    size = 62
    picture = np.zeros((size, size, 4), np.uint8)
    picture[10:50, 10:26] = (40, 150, 50, 255)
    picture[10:50, 36:50] = (150, 60, 30, 255)
    picture[10:20, 10:26, 3] = 0  # cut out of the first island, and black
    picture[10:20, 10:26, :3] = 0
    write_image(tmp_path / "a.png", picture)
    (tmp_path / "a.obj").write_text(cards([rect(10, 10, 26, 50), rect(36, 10, 50, 50)], size))
    texture = decode_ktx2(bake_color(tmp_path / "a.png", uv=tmp_path / "a.obj").data)
    texels = decode_texels(texture) * 255
    assert np.abs(texels[:, :30, :3] - [40, 150, 50]).max() <= 1
    assert np.abs(texels[:, 32:, :3] - [150, 60, 30]).max() <= 1
    assert (texels[10:20, 10:26, 3] == 0).all()
    assert (texels[:10, 12:24, 3] == 0).all()  # a gutter is as transparent as what it continues
