"""Light shafts in the air of the baked island: where they show, and where they must not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from tests.pictures import load
from tests.player.posed import differs

Render = Callable[..., NDArray[Any]]
CASTERS = {"palm", "jetty"}
FRONDS_S = 82.0  # of the flight: below the palm's crown, the sun out of the picture on the left
SUNSET_S = 164.0  # the sun a hand above the sea
DUSK_S = 180.0  # neither sun nor moon lights
POSTER_S = 113.0  # the sun behind the camera


@pytest.fixture(scope="module")
def render(island: Path, player: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> Render:
    folder = tmp_path_factory.mktemp("shafts")
    scene = json.loads((island / "scene.json").read_text())
    scene["objects"] = [item for item in scene["objects"] if item["name"] in CASTERS]
    (folder / "scene.json").write_text(json.dumps(scene))
    for artifact in scene["artifacts"].values():
        (folder / artifact["file"]).symlink_to(island / artifact["file"])
    kept: dict[str, NDArray[Any]] = {}

    def picture(*options: object, size: str = "160x90") -> NDArray[Any]:
        out = folder / f"{len(kept)}.png"
        key = repr((options, size))
        if key not in kept:
            given = ["--size", size, "--check-finite", "--debug", "--screenshot", out]
            result = player(folder, *given, "--time", *options)
            assert result.returncode == 0, result.stderr
            kept[key] = load(out)[..., :3].astype(np.float32)
        return kept[key]

    return picture


@pytest.mark.deep
def test_fronds_cast_shadows_into_air_that_is_bright_towards_the_sun(render: Render) -> None:
    lit, plain = render(FRONDS_S), render(FRONDS_S, "--disable", "shafts")
    assert differs(lit, plain).mean() > 0.3
    change = (lit - plain).mean(axis=2)
    left, right = change[:, :40], change[:, -60:]  # towards the sun; beyond the crown
    assert left.mean() > 10 / 255
    assert (right < -4 / 255).mean() > 0.1
    # No dither is left: what the air adds to open sky differs little from pixel to pixel.
    assert np.percentile(np.abs(np.diff(change[:20, :40], 2, axis=1)), 90) < 4 / 255


@pytest.mark.deep
def test_edges_of_leaves_before_bright_air_have_no_dark_line(render: Render) -> None:
    """Half of a pixel on an edge is sky, which gets its share of the light."""
    plain = render(FRONDS_S, "--disable", "shafts", size="320x180")[:90, :160]
    change = (render(FRONDS_S, size="320x180")[:90, :160] - plain).mean(axis=2)
    sky = plain[..., 2] > 1.02 * plain[..., 1]
    around = maximum_filter(change, 3)
    dark = sky & (around > 15 / 255) & (change < 0.2 * around)
    assert dark.sum() < 0.004 * sky.sum()


@pytest.mark.deep
def test_the_air_glows_towards_a_low_sun_and_nowhere_else(render: Render) -> None:
    sunset, plain = render(SUNSET_S), render(SUNSET_S, "--disable", "shafts")
    assert differs(sunset, plain).mean() > 0.2
    change = (sunset - plain).mean(axis=2)
    assert change[:40, -40:].mean() > 4 * max(change[:, :40].mean(), 1 / 255)
    away = differs(render(POSTER_S), render(POSTER_S, "--disable", "shafts"), 12 / 255)
    assert away.mean() < 0.02


@pytest.mark.deep
@pytest.mark.parametrize(
    ("second", "quality"),
    [(DUSK_S, "balanced"), (FRONDS_S, "fast")],
)
def test_without_light_or_in_fast_quality_there_are_none(render: Render, second: float, quality: str) -> None:
    options = (second, "--quality", quality)
    assert np.array_equal(render(*options), render(*options, "--disable", "shafts"))
