"""Meshes of codes before readers of others: the Khronos validator, and three.js in a headless Chromium."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.bakers.terrain.mesh import bake_terrain
from paradize.formats.glb.reader import decode_glb
from paradize.scene.baker_settings import TerrainSettings
from tests.e2e.test_three_lods import Page, require_drawn, window
from tests.e2e.three import three_page


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with three_page("show_glb.html", Page, tmp_path_factory) as page:
        yield page


@cache
def baked(root: Path, quantise_deg: float | None, lods: int) -> bytes:
    quantise = None if quantise_deg is None else {"quantise_normal_max_deg": quantise_deg}
    return bake_mesh(root / "raw_assets/palm/palm.obj", lods=lods, quantise=quantise).glb


def terrain(root: Path, *, max_error_m: float) -> bytes:
    settings = TerrainSettings(size_m=(200.0, 200.0), height_m=24.0, max_error_m=max_error_m, quantise=True)
    return bake_terrain(root / "raw_assets/terrain/height.png", settings).glb


def test_khronos_validator_finds_nothing_in_meshes_of_codes(
    root: Path, tmp_path: Path, node: Callable[..., Any]
) -> None:
    files = {
        "wide.glb": baked(root, 0.1, 1),
        "narrow.glb": baked(root, 1.0, 1),
        "coarse_terrain.glb": terrain(root, max_error_m=0.2),
        "fine_terrain.glb": terrain(root, max_error_m=0.01),
    }
    kinds = {name: decode_glb(data)[0].quantised for name, data in files.items()}
    assert [codes.normals.dtype for codes in kinds.values() if codes and codes.normals is not None] == [
        np.int16,
        np.int8,
        np.int16,
        np.float32,
    ]
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    results = node("validate_gltf.mjs", [tmp_path / name for name in files])
    assert {file: r for file, r in results.items() if r["errors"] or r["warnings"]} == {}
    assert len(results) == len(files)


@pytest.mark.deep
@pytest.mark.parametrize("quantise_deg", [0.1, 1.0])
def test_three_shows_codes_as_it_shows_floats(page: Page, root: Path, quantise_deg: float) -> None:
    floats, codes = baked(root, None, 2), baked(root, quantise_deg, 2)
    levels = [lod.mesh for lod in decode_glb(floats)]
    box = window(levels[0])
    page.show("floats", floats, box, None, {})
    report = page.show("codes", codes, box, None, {})
    assert [level["triangles"] for level in report] == [len(level.triangles) for level in levels]
    for number, level in enumerate(levels):
        require_drawn(page, "codes", number, level, box)
        ours = page.drawn["codes", number, "light"].astype(int)
        theirs = page.drawn["floats", number, "light"].astype(int)
        off = np.abs(ours - theirs).max(axis=2)
        shown = theirs[:, :, 3] > 0
        assert shown.any()
        # Edges may fall to the other side of a pixel's centre; inside, light differs by a code or two.
        assert (off > 3).sum() <= 0.005 * shown.sum()
        assert off[shown].mean() < 0.5
