"""Edges are smooth: of bright things behind dark ones, and of holes that are as small as pixels."""

from __future__ import annotations

from dataclasses import replace
from math import tan

import numpy as np
import pytest

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from tests.player.passes.test_materials import (
    AWAY_M,
    BLACK,
    F64,
    FOV_RAD,
    HEIGHT,
    Render,
    at_depth,
    glow,
    quad,
    render,
    thing,
)

__all__ = ["render"]  # the fixture

SAMPLES = 4
SHARE = 3 / 8  # of the pattern that is covered
EDGE = 256  # texels of the pattern


def linear(encoded: F64) -> F64:
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def test_an_edge_before_bright_light_keeps_its_share_of_coverage_through_the_tone_map(render: Render) -> None:
    """Blue of three times white does not glow. By plain means one sample of four gives 0.7 of it."""
    before = quad(size=3.0)
    turned = before.positions @ np.array([[0.98, 0.2, 0], [-0.2, 0.98, 0], [0, 0, 1]], np.float32)
    things = [
        thing("sky", {"m": glow(0.0, 0.0, 3.0)}),
        thing("leaf", {"m": glow(0.0, 0.0, 0.0)}),
    ]
    meshes = {"sky": at_depth(quad(size=40.0), -4.0), "leaf": replace(before, positions=turned)}
    blue = linear(render(things, meshes, options=()))[..., 2]
    steps = blue * SAMPLES
    assert np.abs(steps - np.round(steps)).max() < 0.06
    counts = [np.count_nonzero(np.round(steps) == i) for i in range(SAMPLES + 1)]
    assert min(counts) > 15, counts


def fine_leaflets() -> bytes:
    """Stripes of three texels in eight, with mips that keep the share of texels above a cutoff of a half."""
    alpha = np.zeros((EDGE, EDGE))
    alpha[:, np.arange(EDGE) % 8 < 3] = 1.0
    levels = []
    while True:
        kept = np.sort(alpha, axis=None)[::-1][max(round(SHARE * alpha.size) - 1, 0)]
        texels = np.full((*alpha.shape, 4), 255, np.uint8)
        texels[..., 3] = np.clip(alpha * min(0.5001 / max(kept, 1e-3), 16.0) * 255 + 0.5, 0, 255)
        levels.append(texels.tobytes())
        if len(alpha) == 1:
            return encode_ktx2(Texture("RGBA8_SRGB", EDGE, EDGE, tuple(levels)))
        alpha = alpha.reshape(len(alpha) // 2, 2, -1, 2).mean(axis=(1, 3))


@pytest.mark.parametrize("quality, least, most", [("balanced", 0.0, 0.15), ("lod=fast", 0.2, 1.0)])
def test_leaflets_as_fine_as_pixels_cover_their_share(
    render: Render, quality: str, least: float, most: float
) -> None:
    """Half a pixel each, turned against the grid of pixels. By one lookup for each pixel they merge."""
    size = 2 * AWAY_M * tan(FOV_RAD / 2) * EDGE / 8 / HEIGHT * 1.3  # a period of 1.3 pixels
    square = quad(size=size)
    turned = square.positions @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]], np.float32)
    one = glow(1.0, 1.0, 1.0, alpha_mode="mask", alpha_cutoff=0.5)
    one["maps"]["color"] = "leaf"
    seen = render(
        [thing("a", {"m": one | {"specular": BLACK["specular"]}})],
        {"a": replace(square, positions=turned)},
        {"leaf": fine_leaflets()},
        options=("--disable", "post", "--quality", quality),
    )[..., 0]
    inner = seen[HEIGHT // 2 - 10 : HEIGHT // 2 + 10, 38:58]
    # Means of 2 x 2 pixels see the share, whatever the pattern's phase.
    means = inner.reshape(10, 2, 10, 2).mean(axis=(1, 3))
    assert least <= np.sqrt(np.mean((means - SHARE) ** 2)) <= most
