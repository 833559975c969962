"""Meanings of alpha in a colour map where the material file says nothing, on a few triangles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.build.materials.shown_colors import shown_colors
from paradize.data import Mesh
from paradize.material import MapSource, Picture
from tests.pipeline.scenes import write_image
from tests.pipeline.shapes import grid

SIDE = 64
RNG = np.random.default_rng(8)
Y, X = np.mgrid[:SIDE, :SIDE] / (SIDE - 1.0)


def alphas() -> dict[str, tuple[np.ndarray, str]]:
    """Alpha 0 to 1 by its meaning, and how the material is drawn."""
    round_ = np.hypot(X - 0.5, Y - 0.5)
    leaf = (round_ < 0.35).astype(float)
    soft = np.clip((0.4 - round_) / 0.05, 0.0, 1.0)
    crate = np.ones((SIDE, SIDE))
    crate[20:24, 30:36] = 0.87  # a rim of an old layer
    frame = np.full((SIDE, SIDE), 0.25)
    frame[:4] = frame[-4:] = frame[:, :4] = frame[:, -4:] = 1.0
    frame[:2, :2] = 0.0
    smoke = 0.8 * np.clip(0.4 - round_, 0.0, 0.4)
    return {
        "a leaf": (leaf, "mask"),
        "a leaf with a soft edge": (soft, "mask"),
        "nearly opaque in a few places": (crate, "opaque"),
        "glass in a frame": (frame, "blend"),
        "glass": (np.full((SIDE, SIDE), 0.4), "blend"),
        "smoke": (smoke, "blend"),
        "heights": (np.clip(0.5 + 0.2 * RNG.normal(size=X.shape), 0.1, 0.9), "varied"),
        "glass that darkens": (0.2 + 0.6 * X, "blend"),
        "two panes": (np.where(X < 0.5, 0.3, 0.7), "blend"),
        "a wire fence": (((SIDE * X) % 9.0 < 1.0).astype(float), "mask"),
        "three texels of dirt": (np.where((X > 0.95) & (Y > 0.97), 0.0, 1.0), "opaque"),
        "one small hole": (np.where((X < 0.2) & (Y < 0.2), 0.0, 1.0), "mask"),
        "nothing": (np.zeros((SIDE, SIDE)), "hidden"),
        "all": (np.ones((SIDE, SIDE)), "opaque"),
    }


@pytest.mark.parametrize("kind", alphas())
def test_alpha_is_judged_by_its_share_of_the_texels_that_show(tmp_path: Path, kind: str) -> None:
    alpha, wanted = alphas()[kind]
    colors = 0.5 + 0.02 * RNG.normal(size=(SIDE, SIDE, 3))
    colors[alpha == 0.0] = 0.5
    file = tmp_path / "a.png"
    write_image(file, np.rint(255 * np.dstack([colors, alpha])).astype(np.uint8))
    wrap = ("repeat", "repeat")
    assert shown_colors(grid(2), Picture(file), {}, wrap)[2] == wanted
    if wanted == "varied":  # where the material file names it as alpha, it is
        source = MapSource(Picture(file), "a")
        assert shown_colors(grid(2), Picture(file), {}, wrap, alpha_map=source)[2] == "blend"


def tiles(count: int) -> Mesh:
    """A grid whose triangles are UV islands, a little apart."""
    mesh = grid(count)
    corners = mesh.triangles.reshape(-1)
    uvs = mesh.uvs[mesh.triangles]
    middle = uvs.mean(axis=1, keepdims=True)
    return Mesh(
        positions=mesh.positions[corners],
        uvs=(middle + 0.98 * (uvs - middle)).reshape(-1, 2).astype(np.float32),
        triangles=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
    )


@pytest.mark.parametrize(
    ("mesh", "plain", "wanted"),
    [
        (tiles(8), False, "painted"),
        (tiles(8), True, "mask"),
        (grid(8), False, "mask"),
        (grid(1), False, "mask"),
    ],
)
def test_detail_below_alpha_that_hides_whole_islands_is_a_painted_surface(
    tmp_path: Path, mesh: Mesh, plain: bool, wanted: str
) -> None:
    """Cars of games keep in alpha where the paint may change: body 1, windows, chassis and seats 0. A shape
    that is cut out of a fine grid hides whole triangles, too, and may have been cut out of a photograph."""
    alpha = np.where((X < 0.5) | (Y < 0.3), 0.0, 1.0)
    colors = 0.5 + 0.02 * RNG.normal(size=(SIDE, SIDE, 3))
    if plain:
        colors[alpha == 0.0] = 0.5
    file = tmp_path / "a.png"
    write_image(file, np.rint(255 * np.dstack([colors, alpha])).astype(np.uint8))
    assert shown_colors(mesh, Picture(file), {}, ("repeat", "repeat"))[2] == wanted
