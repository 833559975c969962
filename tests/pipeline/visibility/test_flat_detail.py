"""Triangles that show a line or a point of a texture hold no finer mips than their colours need."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.bakers.color import color_values
from paradize.build.bake import bake
from paradize.build.materials.flat_colors import OFF
from paradize.build.options import BuildOptions
from paradize.data import Mesh
from paradize.explain.facts import explain
from paradize.explain.words import render
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from paradize.visibility import finest_mip
from paradize.visibility.finest_mip import surface_of
from tests.pipeline.scenes import write_image
from tests.places import ROOT

SIDE = 256
SCENE = """
[scene]
name = "far"
viewport = [96, 54]
[[object]]
name = "post"
mesh = "post.obj"
color = "post.png"
lods = 1
bleed = 0.9
strength = 0.0
[[object.instance]]
position = [0.0, 0.0, 0.0]
[flight]
duration_s = 8.0
eye = [
    { position = [40, 2, 0] }, { position = [0, 2, 40] },
    { position = [-40, 2, 0] }, { position = [0, 2, -40] },
]
target = [
    { position = [0, 1, 0] }, { position = [0, 1, 0] }, { position = [0, 1, 0] }, { position = [0, 1, 0] },
]
"""


def quad(corner: tuple[float, float, float], size: float, uvs: list[tuple[float, float]], first: int) -> str:
    """Two triangles that stand upright, with the texture coordinates of their four corners."""
    x, y, z = corner
    places = [(x, y, z), (x + size, y, z), (x + size, y + size, z), (x, y + size, z)]
    lines = [f"v {a:.6f} {b:.6f} {c:.6f}" for a, b, c in places]
    lines += [f"vt {u:.8f} {v:.8f}" for u, v in uvs]
    k = first
    return "\n".join([*lines, f"f {k}/{k} {k + 1}/{k + 1} {k + 2}/{k + 2}"]) + (
        f"\nf {k}/{k} {k + 2}/{k + 2} {k + 3}/{k + 3}\n"
    )


def baked(
    folder: Path, quads: list[tuple[float, list[tuple[float, float]]]], picture: npt.NDArray[np.uint8]
) -> tuple[dict[str, Any], Path]:
    """The colour map's row of scene.json, and the bake; quads: their sizes and texture coordinates."""
    folder.mkdir()
    text, first = "usemtl wood\n", 1
    for size, uvs in quads:
        text += quad((0.05 * first - 1.0, 0.2 * (first % 7), 0.02 * first), size, uvs, first)
        first += 4
    (folder / "post.obj").write_text(text)
    write_image(folder / "post.png", picture)
    (folder / "far.toml").write_text(SCENE)
    report = bake(folder / "far.toml", folder / "out", BuildOptions(jobs=1))
    assert not report.errors, report.errors
    manifest = json.loads((folder / "out" / "scene.json").read_text())
    row: dict[str, Any] = manifest["artifacts"]["post_color"]
    return row, folder / "out"


@pytest.fixture(autouse=True)
def _store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))


WHOLE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def noise() -> npt.NDArray[np.uint8]:
    return np.random.default_rng(5).integers(20, 235, (SIDE, SIDE, 3), np.uint8)


def palette() -> npt.NDArray[np.uint8]:
    """Swatches of 32 x 32 texels."""
    swatches = np.random.default_rng(6).integers(20, 235, (8, 8, 3), np.uint8)
    return np.asarray(swatches.repeat(32, axis=0).repeat(32, axis=1), np.uint8)


def swatch(column: int, row: int) -> tuple[float, float]:
    return (32 * column + 16) / SIDE, (32 * row + 16) / SIDE


def test_mips_are_trimmed_as_without_the_few_triangles_that_show_a_point_or_a_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    flat: list[tuple[float, list[tuple[float, float]]]] = []
    for k in range(40):  # 80 triangles, a thousandth of the surface
        u, v, across = rng.uniform(0.1, 0.8, 3)
        end = (u + 0.1 * across * (k % 2), v + 0.1 * (k % 2))
        flat.append((0.01, [(u, v), end, end, (u, v)]))
    without, _ = baked(tmp_path / "without", [(2.0, WHOLE)], noise())
    found, _ = baked(tmp_path / "with", [(2.0, WHOLE), *flat], noise())
    assert without["required_detail"]["left_out"] >= 2
    assert found["required_detail"] == without["required_detail"] | {
        "second_s": found["required_detail"]["second_s"]
    }
    assert found["levels"][0].keys() == without["levels"][0].keys()


def test_a_palette_of_points_begins_where_its_colours_are_still_themselves(tmp_path: Path) -> None:
    points = [(0.4, [swatch(k % 8, k // 8)] * 4) for k in range(24)]
    row, out = baked(tmp_path / "palette", points, palette())
    assert 2 <= row["required_detail"]["left_out"] <= 5 and row["required_detail"]["view"] == "camera"
    begins = decode_texels(decode_ktx2((out / row["file"]).read_bytes()))
    side = begins.shape[0]
    assert side == SIDE >> row["required_detail"]["left_out"]
    for k in range(24):
        u, v = swatch(k % 8, k // 8)
        shown = begins[int((1.0 - v) * side), int(u * side), :3]
        meant = palette()[int((1.0 - v) * SIDE), int(u * SIDE)] / 255.0
        assert np.abs(shown - meant).max() <= OFF + 4.0 / 255.0, k  # and what BC1 costs


@pytest.mark.parametrize("end", [(0.0, 0.0), (0.05, 0.0), (0.0, 0.06), (0.04, 0.05)])
def test_gutters_leave_the_texels_that_a_point_or_a_line_shows(
    tmp_path: Path, end: tuple[float, float]
) -> None:
    """Beside islands with area, which gutters are filled from."""
    rng = np.random.default_rng(3)
    write_image(tmp_path / "post.png", noise())
    text, first, places = "", 1, []
    for k in range(12):
        u, v = 0.5 + 0.4 * rng.uniform(), 0.9 * rng.uniform()
        near, far = (u, v), (u + end[0], v + end[1])
        uvs = [(0.0, 0.0), (0.4, 0.0), (0.4, 1.0), (0.0, 1.0)] if k == 0 else [near, far, far, near]
        text += quad((0.1 * k, 0.0, 0.0), 0.1, uvs, first)
        first += 4
        places += [(u + t * end[0], v + t * end[1]) for t in np.linspace(0.0, 1.0, 60)] if k else []
    places += [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0)]
    for k, (u, v) in enumerate(places[-3:]):  # corners of the picture
        text += quad((0.1 * k, 1.0, 0.0), 0.1, [(u, v)] * 4, first)
        first += 4
    (tmp_path / "post.obj").write_text(text)
    source = noise()
    filled, _, _ = color_values(tmp_path / "post.png", None, (False, False), tmp_path / "post.obj")
    assert (filled != source).any()
    for u, v in places:
        x, y = u * SIDE - 0.5, (1.0 - v) * SIDE - 0.5
        for j in {int(np.floor(y)), int(np.ceil(y))}:
            for i in {int(np.floor(x)), int(np.ceil(x))}:
                at = min(max(j, 0), SIDE - 1), min(max(i, 0), SIDE - 1)
                weight = (1.0 - abs(x - i)) * (1.0 - abs(y - j))
                assert weight < 0.02 or (filled[at] == source[at]).all(), (u, v, at)


def test_points_of_a_picture_that_cover_much_keep_it_as_it_is_and_explain_says_why(tmp_path: Path) -> None:
    """Without parallax none is named."""
    points = [(1.0, [(u, u)] * 4) for u in (0.21, 0.43, 0.77)]
    row, out = baked(tmp_path / "points", [(2.0, WHOLE), *points], noise())
    assert row["required_detail"]["left_out"] == 0 and row["required_detail"]["texels"] == 0.0
    words = render(explain(tmp_path / "points" / "far.toml", "post_color", out))
    assert "parallax" not in words
    assert "triangles that show a single point of it would change their colour in a coarser one" in words


def test_a_line_is_read_as_finely_as_the_longest_footprint_that_the_player_filters() -> None:
    """EXT_texture_filter_anisotropic: the longer axis over the samples, at most 16 of them."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    uvs = np.array([[0.1, 0.5], [0.9, 0.5], [0.1, 0.5]], np.float32)
    mesh = Mesh(positions=positions, uvs=uvs, triangles=np.array([[0, 1, 2]], np.uint32))
    (density,) = surface_of(mesh, uvs, 1024, 1024).density
    formula = 0.8 * 1024 / finest_mip.MAX_SAMPLES
    assert formula / finest_mip.SLACK == pytest.approx(density, rel=1e-5)
    assert (
        f"max_anisotropy = {finest_mip.MAX_SAMPLES:.1f}F" in (ROOT / "player/scene/quality.cpp").read_text()
    )
    assert len(surface_of(mesh, uvs, 1024, 1024, flat=False).corners) == 0
