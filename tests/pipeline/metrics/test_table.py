"""The table of metrics names each error that a bake or a command writes, and no other."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import bake_color
from paradize.bakers.cubemap import bake_cubemap
from paradize.build.single_file import bake_single
from paradize.scene.budget import METRICS
from tests.pipeline.bakes import bake_apart
from tests.pipeline.build.test_budget_measured import MAPS, MESH, TERRAIN
from tests.pipeline.scenes import make_cove, write_image
from tests.pipeline.shapes import CORNER_OBJ
from tests.places import ROOT

ALPHA = {"occlusion": "a", "roughness": "a"}
# Of a level or a report: what is not an error.
FACTS = {"triangles", "vertices", "draw", "tier", "bytes", "bound_m", "quantised", "warnings"}


def rows() -> list[list[str]]:
    text = (ROOT / "pipeline/paradize/metrics/ERRORS.md").read_text()
    found = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| `")]
    assert found
    return found


def table() -> set[str]:
    return {name for row in rows() for name in re.findall(r"`([a-z0-9_]+)`", row[0])}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory, cove_store: Callable[[Path], Path]) -> set[str]:
    """All names of errors that a scene's bake and the commands of one file write."""
    top = tmp_path_factory.mktemp("written")
    cove_store(top / "store")
    scene = make_cove(top / "scene")
    scene.write_text(scene.read_text().replace("lods = 3\n", "lods = 3\nquantise = true\nsway_m = 0.1\n"))
    bake_apart(scene, top)
    manifest: dict[str, Any] = json.loads((top / "out/scene.json").read_text())
    names = set(manifest["flight"]["errors"])
    for artifact in manifest["artifacts"].values():
        names |= set(artifact["errors"]).union(*artifact["levels"])
        names |= {name for name in artifact["gutter"] or {} if name.startswith("bleed_")}
    leaf = np.full((16, 16, 4), 200, np.uint8)
    leaf[::2, :, 3] = 90
    write_image(top / "leaf.png", leaf)
    write_image(top / "sky.png", leaf[:8, :, :3])
    (top / "corner.obj").write_text(CORNER_OBJ)
    drawn = bake_authored({"occlusion": top / "leaf.png", "roughness": top / "leaf.png"}, channels=ALPHA)
    for made in (
        bake_color(top / "leaf.png"),
        bake_color(scene.parent / "wood.png", product="emission"),
        *drawn.values(),
        bake_cubemap([top / "sky.png"]),
        *bake_authored({}, uv=top / "corner.obj", occlusion_cast=True, occlusion_px=32).values(),
    ):
        names |= set(made.errors).union(*made.levels)
    for fmt in ("ktx2", "png"):
        result = bake_single(
            "maps", scene.parent / "wood.png", replace(MAPS, fmt=fmt), tier="fast", budget={}
        ).report
        for one in result["maps"].values():
            names |= set(one["errors"]).union(*one["levels"])
    mesh = bake_single("mesh", scene.parent / "post.obj", replace(MESH, quantise={}), tier="fast", budget={})
    names |= set().union(*mesh.report["lods"], *mesh.errors.values())
    field = scene.parent / "height.png"
    terrain = bake_single("terrain", field, replace(TERRAIN, quantise=True), tier="fast", budget={})
    names |= set(terrain.report).union(*terrain.errors.values())
    return names - FACTS


def test_every_error_that_is_written_stands_in_the_table(written: set[str]) -> None:
    assert written - table() == set()


def test_every_metric_of_a_budget_stands_in_the_table() -> None:
    assert METRICS.keys() - table() == set()


def test_the_table_names_nothing_that_is_not_written(written: set[str]) -> None:
    assert table() - written - METRICS.keys() == set()


def test_each_row_has_a_unit_a_reference_what_it_shares_and_how_sure_it_is() -> None:
    for row in rows():
        assert len(row) == 5 and all(row), row
        assert row[4].startswith(("exact", "sampled", "bound")), row


def test_no_budget_names_an_error_whose_reference_a_tier_chooses() -> None:
    chosen = [row for row in rows() if "chosen" in row[3]]
    names = {name for row in chosen for name in re.findall(r"`([a-z0-9_]+)`", row[0])}
    assert "normal_encoding_p99_deg" in names and not names & METRICS.keys()
