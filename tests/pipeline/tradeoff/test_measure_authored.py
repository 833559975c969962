"""`paradize measure` of a scene's drawn maps: the formats and errors that the bake takes."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import bake_color
from paradize.map_table import MAPS
from paradize.scene.baker_settings import AuthoredSettings, BakerSettings, ColorSettings
from paradize.scene.jobs import BakeJob, Output
from paradize.tradeoff.plan import file_rows
from paradize.tradeoff.texture import authored_groups, color_groups
from paradize.tradeoff.tiers import run_groups
from tests.pipeline.bakers.authored.test_authored import codes, noise, write
from tests.pipeline.shapes import CORNER_OBJ
from tests.pipeline.stages.test_authored import hills
from tests.sweeps import sweep


def job(baker: str, sources: dict[str, Path], settings: BakerSettings, products: list[str]) -> BakeJob:
    outputs = tuple(Output(f"palm_{name}", "texture", name, "") for name in products)
    return BakeJob("palm maps", baker, sources, asdict(settings), outputs)


@pytest.mark.parametrize("tier", sweep(["fast", "exact"], test=["exact"]))
def test_measure_shows_of_drawn_maps_what_the_bake_takes(tmp_path: Path, tier: str) -> None:
    flat = write(tmp_path / "h.png", np.full((64, 64), 9, np.uint8))
    sources = {
        "normal": write(tmp_path / "n.png", codes(hills(64, 64))),
        "occlusion": write(tmp_path / "o.png", noise(64, 64)),
        "height": flat,
    }
    groups = authored_groups(job("authored", sources, AuthoredSettings(), ["normal", "height", "occlusion"]))
    assert [one.artifact for one in groups] == ["palm_normal", "palm_occlusion"]
    result, _ = run_groups(groups, file_rows(groups, tier), {}, 1, None)
    baked = bake_authored(sources, tier=tier)
    for group in result:
        name = group["name"].removeprefix("palm ")
        points: dict[str, Any] = {point["tier"]: point for point in group["points"]}
        assert points[tier]["error"]["value"] == baked[name].errors[MAPS[name].metrics[0]]
        assert points[tier]["bytes"] == len(baked[name].data)
        assert {"R16" if name == "occlusion" else "RG16"} <= points.keys()


def test_measure_of_emission_tells_its_own_errors_and_nothing_of_a_constant(tmp_path: Path) -> None:
    glow = write(tmp_path / "e.png", np.dstack([noise(36, 36, k) for k in range(4)]))
    settings = ColorSettings(product="emission")
    groups = color_groups(job("color", {"image": glow}, settings, ["emission"]))
    (result,), _ = run_groups(groups, file_rows(groups, "fast"), {}, 1, None)
    points: dict[str, Any] = {point["tier"]: point for point in result["points"]}
    baked = bake_color(glow, settings, tier="fast")
    assert points["fast"]["error"]["value"] == baked.errors["emission_psnr_db"]
    black = write(tmp_path / "b.png", np.zeros((8, 8, 3), np.uint8))
    assert color_groups(job("color", {"image": black}, settings, ["emission"])) == []


def test_measure_of_occlusion_from_the_mesh_tells_the_error_of_the_rays(tmp_path: Path) -> None:
    """The model's material file lies beside the layout, and is not a picture."""
    model = tmp_path / "corner.obj"
    model.write_text("mtllib corner.mtl\n" + CORNER_OBJ)
    (tmp_path / "corner.mtl").write_text("newmtl stone\n")
    settings = AuthoredSettings(only=["occlusion"], occlusion_cast=True, occlusion_px=32)
    sources = {"layout": model, "layout, file 2": tmp_path / "corner.mtl"}
    (group,) = authored_groups(job("authored", sources, settings, ["occlusion"]))
    (result,), _ = run_groups([group], file_rows([group], "balanced"), {}, 1, None)
    points: dict[str, Any] = {point["tier"]: point for point in result["points"]}
    baked = bake_authored({}, settings, uv=model)["occlusion"]
    assert points["balanced"]["error"]["value"] == baked.errors["occlusion_cast_p99"]
    errors = [points[tier]["error"]["value"] for tier in ("fast", "balanced", "exact")]
    assert errors == sorted(errors, reverse=True)
