"""`paradize new --template`: each scene bakes without a warning, checks clean, and shows what it promises."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.checks import check_paths
from paradize.cli.main import main
from paradize.errors import BakeError
from paradize.new.template import new_from_template
from paradize.new.templates import TEMPLATES
from paradize.new.templates.island import LANTERNS, PALMS, ground_m
from paradize.scene.flight import plan_flight
from paradize.scene.settings import load_scene
from tests.pictures import load

NAMES = {
    "empty": {"sky"},
    "island": {"sky", "terrain_mesh", "sand_color", "sand_normal", "water_normal", "water_dudv", "palm_mesh"},
}
NAMES["night"] = NAMES["island"] | {"lantern_mesh"}


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The folders of the bakes, by template; the scenes lie beside them."""
    top = tmp_path_factory.mktemp("templates")
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))  # night reuses what the island has
        for name in TEMPLATES:
            scene = new_from_template(top / f"my_{name}", name).scene
            report = bake(scene, top / name, BuildOptions(jobs=1))
            assert not report.errors and not report.warnings
            found[name] = top / name
    return found


@pytest.mark.parametrize("name", TEMPLATES)
def test_a_template_bakes_what_it_shows_and_checks_clean(baked: dict[str, Path], name: str) -> None:
    scene = load_scene(baked[name].with_name(f"my_{name}") / "scene.toml")
    assert scene.head.name == f"my_{name}"
    assert check_paths([baked[name]]) == []
    assert {path.name.rpartition("-")[0] for path in baked[name].iterdir()} - {""} == NAMES[name]


@pytest.fixture
def drawn(baked: dict[str, Path], tmp_path: Path, player: Any) -> Callable[[str], Any]:
    """Draws a template."""

    def draw(name: str) -> Any:
        file = tmp_path / f"{name}.png"
        words = ("--mute", "--time", 4, "--size", "240x135", "--screenshot", file)
        result = player(baked[name], *words)
        assert result.returncode == 0 and not result.stderr, result.stderr
        return load(file)

    return draw


@pytest.mark.deep
def test_the_island_is_drawn_with_green_turquoise_and_sand(drawn: Callable[[str], Any]) -> None:
    island = drawn("island")
    red, green, blue = (island[:, :, k] for k in range(3))
    assert 0.003 < ((green > 1.05 * red) & (blue < 0.6 * green)).mean() < 0.2  # leaves
    assert ((green > 1.1 * red) & (blue > 1.1 * red) & (green > 0.9 * blue)).mean() > 0.1  # shallow water
    assert ((red > 1.2 * blue) & (red > 0.5)).mean() > 0.1  # sand


@pytest.mark.deep  # it differs from the island by its lanterns, whose mesh is baked above, and by its light
def test_the_night_is_dark_and_its_lanterns_are_the_warmest(drawn: Callable[[str], Any]) -> None:
    night, island = drawn("night"), drawn("island")
    assert night.mean() < 0.35 * island.mean()
    warm = (night[:, :, 0] > 1.5 * night[:, :, 2]) & (night[:, :, 0] > 0.35)
    assert 0.0003 < warm.mean() < 0.1
    stars = night[:55].max(axis=2) > 0.2
    assert 0.003 < stars.mean() < 0.06


def test_palms_and_lanterns_stand_on_the_ground_above_the_water(tmp_path: Path) -> None:
    scene = load_scene(new_from_template(tmp_path / "n", "night").scene)
    palms, lanterns = scene.objects
    assert len(palms.instances) == len(PALMS) and len(lanterns.instances) == len(LANTERNS)
    for one in (*palms.instances, *lanterns.instances):
        x, y, z = one.position
        assert y == pytest.approx(float(ground_m(np.array(x), np.array(z))), abs=1e-3) and y > 0.5
    flight = plan_flight(scene.flight)
    assert min(flight.pose(float(second))[0][1] for second in np.linspace(0.0, 40.0, 200)) > 1.0


def test_every_template_is_offered_and_goes_with_no_model(tmp_path: Path, capsys: Any) -> None:
    assert main(["new", str(tmp_path / "a"), "--template", "empty"]) == 0
    assert "scene.toml" in capsys.readouterr().out
    for wrong in (["--template", "moon"], ["--template", "island", "--from", "a.obj"]):
        assert main(["new", str(tmp_path / "b"), *wrong]) == 2
    with pytest.raises(BakeError, match="not empty"):
        new_from_template(tmp_path / "a", "island")
